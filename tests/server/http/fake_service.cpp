#include "tests/server/http/fake_service.h"

#include <unistd.h>

#include <stdexcept>

#include "server/blobs/file_blobs.h"

namespace kiln {
namespace {

std::unique_ptr<BlobStore> open_store(const std::filesystem::path& folder) {
  auto store = open_file_blobs(folder);
  if (!store) throw std::runtime_error("the test's blob store does not open");
  return std::move(*store);
}

class FakeUpload : public AssetUpload {
 public:
  explicit FakeUpload(BlobWriter writer) : writer_(std::move(writer)) {}
  Result<void> write(std::span<const std::uint8_t> bytes) override { return writer_.write(bytes); }
  std::uint64_t bytes() const override { return writer_.bytes(); }
  Result<StoredBlob> finish() override { return writer_.finish(); }

 private:
  BlobWriter writer_;
};

tl::unexpected<Fault> unknown_job() { return fault("not_found", "there is no such job"); }

}  // namespace

class FakeStream : public EventStream {
 public:
  FakeStream(FakeService& service, std::string job, std::uint64_t after)
      : service_(service), job_(std::move(job)), after_(after) {}

  std::optional<JobEvent> next(Millis timeout) override {
    std::unique_lock lock(service_.mutex_);
    const auto found = [this]() -> const JobEvent* {
      for (const JobEvent& event : service_.events_)
        if (event.id > after_ && (job_.empty() || event.job_id == job_)) return &event;
      return nullptr;
    };
    service_.changed_.wait_for(lock, timeout, [&] { return found() != nullptr || service_.closed_; });
    const JobEvent* event = found();
    if (event == nullptr) return std::nullopt;
    after_ = event->id;
    return *event;
  }
  bool closed() const override {
    const std::lock_guard lock(service_.mutex_);
    return service_.closed_;
  }

 private:
  FakeService& service_;
  std::string job_;
  std::uint64_t after_;
};

FakeService::FakeService() {
  std::string name = (std::filesystem::temp_directory_path() / "kiln-http-XXXXXX").string();
  if (mkdtemp(name.data()) == nullptr) throw std::runtime_error("no temporary folder");
  folder_ = name;
}

BlobStore& FakeService::blobs() {
  std::call_once(blobs_once_, [this] {
    blobs_ = open_store(folder_);
    desk_ = std::make_unique<UploadDesk>(*blobs_, [](const std::string&, const auto& store) { return store(); });
  });
  return *blobs_;
}

UploadDesk& FakeService::desk() {
  static_cast<void>(blobs());
  return *desk_;
}

FakeService::~FakeService() {
  blobs_.reset();
  std::filesystem::remove_all(folder_);
}

void FakeService::record(Job& job, EventKind kind, const std::string& message) {
  JobEvent event;
  event.id = events_.size() + 1;
  event.job_id = job.id;
  event.kind = kind;
  event.state = job.state;
  event.message = message;
  events_.push_back(event);
  job.version = event.id;
  changed_.notify_all();
}

void FakeService::succeed(const std::string& id, const std::map<std::string, std::string>& files) {
  const std::lock_guard lock(mutex_);
  Job& job = jobs_.at(id);
  for (const auto& [name, text] : files) {
    auto writer = blobs().write();
    if (!writer->write({reinterpret_cast<const std::uint8_t*>(text.data()), text.size()}))
      throw std::runtime_error("write");
    auto stored = writer->finish();
    job.artifacts.push_back({name, "whatever/type", stored->sha256, stored->bytes});
  }
  job.state = JobState::succeeded;
  job.finished_ms = 1'700'000'001'500;
  record(job, EventKind::done);
}

void FakeService::fail(const std::string& id, const Fault& why) {
  const std::lock_guard lock(mutex_);
  Job& job = jobs_.at(id);
  job.state = JobState::failed;
  job.error = JobError{why, 422};
  record(job, EventKind::done);
}

void FakeService::say(const std::string& id, EventKind kind, const std::string& message) {
  const std::lock_guard lock(mutex_);
  record(jobs_.at(id), kind, message);
}

void FakeService::throw_on_list(std::string what) { list_exception_ = std::move(what); }
void FakeService::refuse_submit(Fault why) { submit_fault_ = std::move(why); }
void FakeService::not_ready(std::string reason) {
  checks_.push_back({"check" + std::to_string(checks_.size()), false, std::move(reason)});
}
std::vector<Check> FakeService::checks() { return checks_; }

Submission FakeService::last_submission() {
  const std::lock_guard lock(mutex_);
  return last_;
}

void FakeService::drain() {
  const std::lock_guard lock(mutex_);
  closed_ = true;
  changed_.notify_all();
}

Result<Created> FakeService::submit(const Submission& submission) {
  const std::lock_guard lock(mutex_);
  if (submit_fault_) return tl::make_unexpected(*submit_fault_);
  last_ = submission;
  if (!submission.idempotency_key.empty() && keys_.contains(submission.idempotency_key))
    return Created{jobs_.at(keys_.at(submission.idempotency_key)), true};
  Job job;
  job.id = "01JOB" + std::to_string(++made_);
  job.label = submission.recipe.label;
  job.recipe = recipe_json(submission.recipe);
  job.inputs.scene = {submission.scene_name, submission.scene_sha256};
  job.created_ms = 1'700'000'000'000 + made_;
  jobs_[job.id] = job;
  if (!submission.idempotency_key.empty()) keys_[submission.idempotency_key] = job.id;
  record(jobs_[job.id], EventKind::state);
  return Created{jobs_[job.id], false};
}

Result<std::string> FakeService::plan(const Submission& submission) {
  const std::lock_guard lock(mutex_);
  last_ = submission;
  return std::string(R"({"plan":[]})");
}

Result<Job> FakeService::get(const std::string& id) {
  const std::lock_guard lock(mutex_);
  const auto found = jobs_.find(id);
  if (found == jobs_.end()) return unknown_job();
  return found->second;
}

Result<JobPage> FakeService::list(const JobQuery& query) {
  if (!list_exception_.empty()) throw std::runtime_error(list_exception_);
  const std::lock_guard lock(mutex_);
  JobPage page;
  for (auto entry = jobs_.rbegin(); entry != jobs_.rend(); ++entry) {
    const Job& job = entry->second;
    if ((query.state && job.state != *query.state) || (query.label && job.label != *query.label)) continue;
    if (!query.cursor.empty() && job.id >= query.cursor) continue;
    if (static_cast<int>(page.jobs.size()) == query.limit) {
      page.next_cursor = page.jobs.back().id;
      break;
    }
    page.jobs.push_back(job);
  }
  return page;
}

Result<Job> FakeService::cancel(const std::string& id) {
  const std::lock_guard lock(mutex_);
  const auto found = jobs_.find(id);
  if (found == jobs_.end()) return unknown_job();
  if (!is_terminal(found->second.state)) {
    found->second.state = JobState::canceled;
    record(found->second, EventKind::done);
  }
  return found->second;
}

Result<void> FakeService::remove(const std::string& id) {
  const std::lock_guard lock(mutex_);
  if (jobs_.erase(id) == 0) return unknown_job();
  return {};
}

Result<Job> FakeService::wait_change(const std::string& id, std::uint64_t, Millis timeout) {
  return wait_done(id, timeout);
}

Result<Job> FakeService::wait_done(const std::string& id, Millis timeout) {
  std::unique_lock lock(mutex_);
  const auto found = jobs_.find(id);
  if (found == jobs_.end()) return unknown_job();
  changed_.wait_for(lock, timeout, [&] { return is_terminal(jobs_.at(id).state); });
  return jobs_.at(id);
}

Result<std::unique_ptr<EventStream>> FakeService::subscribe(const std::string& job_id,
                                                            std::optional<std::uint64_t> after) {
  const std::lock_guard lock(mutex_);
  return std::unique_ptr<EventStream>(std::make_unique<FakeStream>(*this, job_id, after.value_or(events_.size())));
}

Result<std::vector<JobEvent>> FakeService::history(const std::string& id) {
  KILN_TRY(job, get(id));
  const std::lock_guard lock(mutex_);
  std::vector<JobEvent> own;
  for (const JobEvent& event : events_)
    if (event.job_id == job.id) own.push_back(event);
  return own;
}

Result<Job> FakeService::pin(const std::string& id, bool pinned) {
  const std::lock_guard lock(mutex_);
  const auto found = jobs_.find(id);
  if (found == jobs_.end()) return unknown_job();
  found->second.pinned = pinned;
  return found->second;
}

Result<void> FakeService::pin_asset(const std::string& sha256, const std::string&, bool) {
  if (!blobs().exists(sha256)) return fault("not_found", "there is no such asset");
  return {};
}

Result<std::int64_t> FakeService::charge_upload(const std::string& tenant, std::uint64_t bytes, std::uint64_t limit) {
  const std::lock_guard lock(mutex_);
  if (limit > 0 && uploaded_[tenant] + bytes > limit) return fault("daily_quota", "that is enough for today");
  uploaded_[tenant] += bytes;
  return 1;
}

Result<void> FakeService::refund_upload(const std::string& tenant, std::uint64_t bytes, std::int64_t) {
  const std::lock_guard lock(mutex_);
  uploaded_[tenant] -= bytes;
  return {};
}

Result<OpenArtifact> FakeService::open_artifact(const std::string& id, const std::string& name) {
  KILN_TRY(job, get(id));
  for (const Artifact& artifact : job.artifacts) {
    if (artifact.name != name) continue;
    KILN_TRY(reader, blobs().open_blob(artifact.sha256));
    return OpenArtifact{artifact, std::move(reader)};
  }
  return fault("not_found", "the job has no such file");
}

Result<std::unique_ptr<AssetUpload>> FakeService::put_asset(const AssetRequest& request) {
  auto writer =
      request.sha256.empty() ? blobs().write() : blobs().write_named(request.sha256, request.offset, request.tenant);
  if (!writer) return tl::make_unexpected(writer.error());
  return std::unique_ptr<AssetUpload>(std::make_unique<FakeUpload>(std::move(*writer)));
}

}  // namespace kiln
