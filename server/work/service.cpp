#include "server/work/service.h"

#include <algorithm>
#include <atomic>
#include <thread>

#include "core/base/sha256.h"
#include "server/work/checkpoint_file.h"
#include "server/work/content_key.h"
#include "server/work/data_folder.h"
#include "server/work/event_stream.h"
#include "server/work/housekeeping.h"
#include "server/work/machine_memory.h"
#include "server/work/neighbours.h"
#include "server/work/sandbox.h"
#include "server/work/supervisor.h"
#include "server/work/work_folder.h"

namespace kiln {
namespace {

using Clock = std::chrono::steady_clock;

constexpr int kPlansAtOnce = 2;
constexpr Millis kRemoveWait{5000};  // for a running job to end; TERM and KILL take half a second

tl::unexpected<Fault> draining() { return fault("draining", "the server stops; try again in a moment"); }

/// All files of a submission, in their places.
Result<JobInputs> inputs_of(const Submission& submission) {
  JobInputs inputs;
  inputs.scene = {submission.scene_name,
                  submission.scene_sha256.empty() ? submission.recipe.scene_asset : submission.scene_sha256};
  inputs.resources = submission.resources;
  const EnvironmentChoice& sky = submission.recipe.environment;
  if (sky.kind == EnvironmentChoice::Kind::asset) {
    inputs.environment = {submission.environment_name.empty() ? sky.name : submission.environment_name, sky.name};
  }
  if (sky.kind == EnvironmentChoice::Kind::file) {
    return fault("environment_file", "a server reads no files of its own: upload the environment as an asset",
                 "/environment/file");
  }
  if (inputs.scene.sha256.empty()) return fault("asset_not_found", "the job names no scene", "/scene/asset");
  return inputs;
}

std::vector<NamedBlob> all_files(const JobInputs& inputs) {
  std::vector<NamedBlob> files = inputs.resources;
  files.push_back(inputs.scene);
  if (inputs.environment) files.push_back(*inputs.environment);
  return files;
}

std::string hash_of(const std::string& text) {
  return sha256_hex({reinterpret_cast<const std::uint8_t*>(text.data()), text.size()});
}

/// Everything a request says, so that an idempotency key means one request.
std::string request_hash(const NewJob& job) {
  return hash_of(job.content_key + "\n" + job.recipe + "\n" + job.inputs.scene.name + (job.force ? "\nforce" : ""));
}

}  // namespace

/// The parts, in the order of their lives: each may use those above it.
class LocalService final : public Service {
 public:
  LocalService(ServiceOptions options, DataLock lock, std::unique_ptr<TimedFiles> files,
               std::unique_ptr<JobStore> store, std::unique_ptr<BlobStore> blobs)
      : options_(std::move(options)),
        lock_(std::move(lock)),
        files_(std::move(files)),
        store_(std::move(store)),
        blobs_(std::move(blobs)) {}
  ~LocalService() override { drain(); }

  void start() override {
    supervisor_.start();
    housekeeping_.start();
    neighbours_.start();
    webhooks_.start();
  }
  void drain() override;

  Result<Created> submit(const Submission&) override;
  Result<std::string> plan(const Submission&) override;

  Result<Job> get(const std::string& id) override;
  Result<JobPage> list(const JobQuery&) override;
  Result<Job> cancel(const std::string& id) override;
  Result<void> remove(const std::string& id) override;
  Result<Job> wait_change(const std::string& id, std::uint64_t version, Millis timeout) override {
    return wait_until(id, timeout, [&](const Job& job) { return job.version != version; });
  }
  Result<Job> wait_done(const std::string& id, Millis timeout) override {
    return wait_until(id, timeout, [](const Job& job) { return is_terminal(job.state); });
  }

  Result<std::unique_ptr<EventStream>> subscribe(const std::string& job_id,
                                                 std::optional<std::uint64_t> after) override;

  Result<std::vector<JobEvent>> history(const std::string& id) override;
  Result<Job> pin(const std::string& id, bool pinned) override {
    auto job = store_->pin(id, pinned);
    bus_.announce();
    return job;
  }
  Result<void> pin_asset(const std::string& sha256, const std::string& tenant, bool pinned) override {
    return store_->pin_blob(sha256, tenant, pinned);
  }
  Result<std::int64_t> charge_upload(const std::string& tenant, std::uint64_t bytes, std::uint64_t limit) override {
    return store_->charge_upload(tenant, bytes, limit);
  }
  Result<void> refund_upload(const std::string& tenant, std::uint64_t bytes, std::int64_t day) override {
    return store_->refund_upload(tenant, bytes, day);
  }

  Result<OpenArtifact> open_artifact(const std::string& id, const std::string& name) override;
  Result<std::unique_ptr<AssetUpload>> put_asset(const AssetRequest&) override;
  bool has_asset(const std::string& sha256, const std::optional<std::string>& tenant) override;
  std::uint64_t asset_offset(const std::string& sha256, const std::string& tenant) override {
    return blobs_->partial_bytes(sha256, tenant);
  }
  Result<BlobReader> open_asset(const std::string& sha256) override { return blobs_->open_blob(sha256); }

  Result<PartialUpload> begin_upload(const PartialUpload& wanted) override;
  Result<PartialUpload> find_upload(const std::string& id, const std::string& tenant) override {
    return desk_.find(id, tenant);
  }
  Result<std::unique_ptr<UploadPiece>> append_upload(const PartialUpload& upload, std::uint64_t offset) override;
  Result<void> remove_upload(const std::string& id, const std::string& tenant) override {
    return desk_.remove(id, tenant);
  }

  ServiceStats stats() override;
  std::vector<Check> checks() override;

 private:
  friend class LocalUpload;
  template <class Condition>
  Result<Job> wait_until(const std::string& id, Millis timeout, Condition&& reached);
  void overlay_progress(Job&) const;
  Result<void> check_room(std::uint64_t bytes) const;
  void share_with_nobody(const JobInputs&);
  Result<StoredBlob> register_blob(const std::string& tenant, const std::function<Result<StoredBlob>()>& store);
  bool may_claim() const { return disk().free_fraction >= options_.hard_free_fraction; }
  DiskSpace disk() const;
  WorkPlace place() { return {*store_, *blobs_, bus_, counters_, work_options_}; }
  WorkOptions work_options() const;

  const ServiceOptions options_;
  DataLock lock_;
  std::unique_ptr<TimedFiles> files_;
  std::unique_ptr<JobStore> store_;
  std::unique_ptr<BlobStore> blobs_;
  EventBus bus_;
  WorkCounters counters_;
  const WorkOptions work_options_ = work_options();
  StopSignal plans_stop_;
  std::atomic<int> plans_{0};
  Supervisor supervisor_{place(),
                         {options_.workers, options_.memory_mb > 0 ? options_.memory_mb : machine_memory_mb()},
                         [this] { return may_claim(); }};
  Housekeeping housekeeping_{place(), {options_.blob_grace, options_.retention}};
  Neighbours neighbours_{place(), supervisor_};
  UploadDesk desk_{*blobs_, [this](const auto& tenant, const auto& store) { return register_blob(tenant, store); }};
  Webhooks webhooks_{*store_, options_.webhooks};
};

class LocalUpload final : public AssetUpload {
 public:
  LocalUpload(LocalService& service, BlobWriter writer, std::string tenant)
      : service_(&service), writer_(std::move(writer)), tenant_(std::move(tenant)) {}

  Result<void> write(std::span<const std::uint8_t> bytes) override { return writer_.write(bytes); }
  std::uint64_t bytes() const override { return writer_.bytes(); }
  Result<StoredBlob> finish() override {
    return service_->register_blob(tenant_, [this] { return writer_.finish(); });
  }

 private:
  LocalService* service_;
  BlobWriter writer_;
  std::string tenant_;
};

WorkOptions LocalService::work_options() const {
  const int hardware = std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
  const int threads = options_.threads > 0 ? options_.threads : std::max(1, hardware / std::max(1, options_.workers));
  const bool others = options_.workers > 1 || store_->shared();
  return {.folder = options_.data / "work",
          .checkpoints = options_.data / "checkpoints",
          .worker_command = options_.worker_command,
          .threads = threads,
          .first_retry = options_.first_retry,
          .lease = options_.lease,
          .require_sandbox = options_.require_sandbox,
          .soft_free_fraction = options_.soft_free_fraction,
          .sharing = others ? options_.sharing : Sharing{}};
}

void LocalService::drain() {
  bus_.close();
  neighbours_.stop();
  plans_stop_.ask(StopReason::drain);
  supervisor_.stop();
  housekeeping_.stop();
  webhooks_.stop();
  while (plans_ > 0) std::this_thread::sleep_for(Millis(5));
}

Result<Created> LocalService::submit(const Submission& submission) {
  if (bus_.closed()) return draining();
  KILN_TRY(inputs, inputs_of(submission));
  NewJob job;
  job.tenant = submission.tenant.value_or("");
  job.max_open = submission.max_open;
  job.label = submission.recipe.label;
  job.recipe = recipe_json(submission.recipe);
  job.content_key = content_key(job.tenant, inputs, submission.recipe);
  job.inputs = std::move(inputs);
  job.force = submission.force;
  job.idempotency_key = submission.idempotency_key;
  job.memory_mb = submission.recipe.limits.memory_mb;
  job.max_queued = options_.max_queued;
  job.request_hash = request_hash(job);
  if (!submission.tenant) share_with_nobody(job.inputs);
  KILN_TRY(created, store_->create(job));
  supervisor_.wake();
  bus_.announce();
  return created;
}

/// Who sees everything bakes the files of any tenant: from then on those without a tenant have them, too.
void LocalService::share_with_nobody(const JobInputs& inputs) {
  for (const NamedBlob& file : all_files(inputs)) {
    if (store_->knows_blob(file.sha256, "").value_or(true) || !has_asset(file.sha256, std::nullopt)) continue;
    const auto reader = blobs_->open_blob(file.sha256);
    if (reader) static_cast<void>(store_->touch_blob(file.sha256, reader->size(), ""));  // else asset_not_found follows
  }
}

Result<std::string> LocalService::plan(const Submission& submission) {
  if (bus_.closed()) return draining();
  KILN_TRY(inputs, inputs_of(submission));
  struct Place {
    std::atomic<int>& taken;
    const int others = taken++;
    ~Place() { --taken; }
  } place_among{plans_};
  if (place_among.others >= kPlansAtOnce)
    return fault("plan_busy", "other plans are being made; try again in a moment");
  for (const NamedBlob& file : all_files(inputs)) {
    if (!has_asset(file.sha256, submission.tenant))
      return fault("asset_not_found", "no asset has this SHA-256", file.sha256);
  }
  return run_plan(inputs, recipe_json(submission.recipe), plans_stop_, place());
}

void LocalService::overlay_progress(Job& job) const {
  if (job.state != JobState::running) return;
  if (auto live = bus_.progress_of(job.id)) job.progress = std::move(live);
}

Result<Job> LocalService::get(const std::string& id) {
  KILN_TRY(job, store_->get(id));
  overlay_progress(job);
  return job;
}

Result<JobPage> LocalService::list(const JobQuery& query) {
  KILN_TRY(page, store_->list(query));
  for (Job& job : page.jobs) overlay_progress(job);
  return page;
}

Result<Job> LocalService::cancel(const std::string& id) {
  KILN_TRY(job, store_->cancel(id));
  supervisor_.cancel(id);
  bus_.announce();
  return job;
}

Result<void> LocalService::remove(const std::string& id) {
  KILN_TRY(known, store_->get(id));
  if (known.pinned) return fault("pinned", "the job is pinned: unpin it first");
  KILN_TRY(job, cancel(id));
  if (!is_terminal(job.state)) {
    KILN_TRY(ended, wait_done(id, kRemoveWait));
    job = std::move(ended);
  }
  return store_->remove(id);
}

template <class Condition>
Result<Job> LocalService::wait_until(const std::string& id, Millis timeout, Condition&& reached) {
  const auto deadline = Clock::now() + timeout;
  while (true) {
    const std::uint64_t seen = bus_.ticks();
    KILN_TRY(job, get(id));
    if (reached(job) || !bus_.wait(seen, deadline)) return job;
  }
}

Result<std::unique_ptr<EventStream>> LocalService::subscribe(const std::string& job_id,
                                                             std::optional<std::uint64_t> after) {
  if (!job_id.empty()) {
    KILN_TRY(job, store_->get(job_id));
    static_cast<void>(job);
  }
  KILN_TRY(last, store_->last_event_id());
  return std::make_unique<StoredEventStream>(*store_, bus_, job_id, after.value_or(last));
}

Result<std::vector<JobEvent>> LocalService::history(const std::string& id) {
  KILN_TRY(job, store_->get(id));
  return store_->events_after(0, job.id, kMaxHistory);
}

Result<OpenArtifact> LocalService::open_artifact(const std::string& id, const std::string& name) {
  KILN_TRY(job, store_->get(id));
  const auto found = std::ranges::find(job.artifacts, name, &Artifact::name);
  if (found == job.artifacts.end()) return fault("not_found", "the job has no such artefact");
  KILN_TRY(reader, blobs_->open_blob(found->sha256));
  return OpenArtifact{*found, std::move(reader)};
}

Result<void> LocalService::check_room(std::uint64_t bytes) const {
  const DiskSpace room = disk();
  if (room.free_fraction >= options_.soft_free_fraction && room.free_bytes >= bytes) return {};
  return fault("disk_full", "the disk of the server is nearly full: uploads wait until there is room");
}

/// Under the gate from the first name of the blob to its row.
Result<StoredBlob> LocalService::register_blob(const std::string& tenant,
                                               const std::function<Result<StoredBlob>()>& store) {
  KILN_TRY(gate, store_->enter_blob_gate());
  KILN_TRY(stored, store());
  // Whether somebody else has these bytes is not this tenant's to know.
  stored.existed = stored.existed && store_->knows_blob(stored.sha256, tenant).value_or(false);
  if (auto noted = store_->touch_blob(stored.sha256, stored.bytes, tenant); !noted) {
    return tl::make_unexpected(noted.error());
  }
  counters_.bytes_uploaded += stored.bytes;
  return stored;
}

Result<PartialUpload> LocalService::begin_upload(const PartialUpload& wanted) {
  if (bus_.closed()) return draining();
  if (auto room = check_room(wanted.length); !room) return tl::make_unexpected(room.error());
  KILN_TRY(upload, desk_.begin(wanted));
  if (!upload.done || has_asset(upload.sha256, upload.tenant)) return upload;
  // It was complete, and its blob was collected meanwhile.
  if (auto gone = desk_.remove(upload.id, upload.tenant); !gone) return tl::make_unexpected(gone.error());
  return desk_.begin(wanted);
}

Result<std::unique_ptr<UploadPiece>> LocalService::append_upload(const PartialUpload& upload, std::uint64_t offset) {
  if (bus_.closed()) return draining();
  if (auto room = check_room(0); !room) return tl::make_unexpected(room.error());
  return desk_.append(upload, offset);
}

Result<std::unique_ptr<AssetUpload>> LocalService::put_asset(const AssetRequest& request) {
  if (bus_.closed()) return draining();
  if (auto room = check_room(request.expected); !room) return tl::make_unexpected(room.error());
  KILN_TRY(writer, request.sha256.empty() ? blobs_->write()
                                          : blobs_->write_named(request.sha256, request.offset, request.tenant));
  return std::make_unique<LocalUpload>(*this, std::move(writer), request.tenant);
}

bool LocalService::has_asset(const std::string& sha256, const std::optional<std::string>& tenant) {
  // The row decides: a file without one may be on its way out. Asking keeps the blob for another grace.
  const auto gate = store_->enter_blob_gate();
  if (!gate) return false;
  if (!store_->knows_blob(sha256, tenant).value_or(false)) return false;
  const auto reader = blobs_->open_blob(sha256);
  return reader && store_->touch_blob(sha256, reader->size(), tenant).has_value();
}

ServiceStats LocalService::stats() {
  ServiceStats stats;
  stats.jobs = store_->counts().value_or(StoreCounts{});
  stats.claimed = counters_.claimed;
  stats.succeeded = counters_.succeeded;
  stats.failed = counters_.failed;
  stats.canceled = counters_.canceled;
  stats.cached = counters_.cached;
  stats.parts = counters_.parts;
  stats.retried = counters_.retried;
  stats.reaped = counters_.reaped;
  stats.forgotten = counters_.forgotten;
  stats.lost_leases = counters_.lost_leases;
  stats.stale_commits = counters_.stale_commits;
  stats.deaths_signal = counters_.deaths_signal;
  stats.deaths_memory = counters_.deaths_memory;
  stats.deaths_timeout = counters_.deaths_timeout;
  stats.bytes_uploaded = counters_.bytes_uploaded;
  stats.webhooks = webhooks_.counts();
  stats.claim_latency = counters_.claim_latency.snapshot();
  stats.syncs = files_->syncs().snapshot();
  stats.sandbox = sandbox_support();
  const DiskSpace room = disk();
  stats.free_fraction = room.free_fraction;
  stats.free_bytes = room.free_bytes;
  return stats;
}

/// The fuller of the two disks: that of the workers, and that of the blobs where it is another.
DiskSpace LocalService::disk() const {
  const DiskSpace work = disk_space(options_.data), blobs = disk_space(blobs_->folder());
  return work.free_fraction < blobs.free_fraction ? work : blobs;
}

std::vector<Check> LocalService::checks() {
  const auto check = [](const char* name, const Result<void>& works) {
    return Check{name, works.has_value(), works ? "ok" : works.error().message};
  };
  std::vector<Check> all{check("store", store_->check_writable()), check("blobs", blobs_->check())};
  const double free = disk().free_fraction;
  if (free < options_.hard_free_fraction) {
    all.push_back({"disk", false, "the disk is nearly full: jobs wait"});
  } else if (free < options_.soft_free_fraction) {
    all.push_back({"disk", false, "the disk is nearly full: uploads are refused"});
  } else {
    all.push_back({"disk", true, "ok"});
  }
  const Sandbox sandbox = sandbox_support();
  const char* locks = sandbox.whole() ? "files and calls"
                      : sandbox.files ? "files only"
                      : sandbox.calls ? "calls only"
                                      : "none";
  all.push_back({"sandbox", sandbox.whole() || !options_.require_sandbox, locks});
  if (bus_.closed()) all.push_back({"drain", false, "the server stops"});
  return all;
}

Result<std::unique_ptr<Service>> Service::open(const ServiceOptions& given) {
  ServiceOptions options = given;
  options.data = std::filesystem::absolute(given.data);
  if (auto sound = check_addresses(options.stores); !sound) return tl::make_unexpected(sound.error());
  KILN_TRY(lock, DataLock::take(options.data));
  KILN_TRY(store, open_job_store(options.stores, options.data));
  auto files = std::make_unique<TimedFiles>();
  KILN_TRY(blobs, open_blob_store(options.stores, options.data, *files));
  if (auto ours = check_owner(options.stores, *store, *blobs); !ours) return tl::make_unexpected(ours.error());
  std::error_code error;
  std::filesystem::create_directories(options.data / "work", error);
  if (!error) std::filesystem::create_directories(options.data / "checkpoints", error);
  if (error) return fault("io_failed", "the work folder cannot be made");
  // What an earlier server left behind: its workers died with it.
  remove_work_folders(options.data / "work");
  blobs->remove_dead_writers();
  if (!store->shared()) {
    KILN_TRY(requeued, store->reap(true));
    static_cast<void>(requeued);
  }
  remove_stale_checkpoints(options.data / "checkpoints", *store);
  return std::make_unique<LocalService>(std::move(options), std::move(lock), std::move(files), std::move(store),
                                        std::move(blobs));
}

}  // namespace kiln
