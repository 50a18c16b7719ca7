#pragma once
// A Service without workers or a database: jobs in memory that end when the test says so, real blobs on disk.

#include <condition_variable>
#include <filesystem>
#include <map>
#include <mutex>

#include "server/work/service.h"

namespace kiln {

class FakeService : public Service {
 public:
  FakeService();
  ~FakeService() override;

  // What a test does behind the server's back.
  void succeed(const std::string& id, const std::map<std::string, std::string>& files);
  void fail(const std::string& id, const Fault& why);
  void say(const std::string& id, EventKind kind, const std::string& message = {});
  void throw_on_list(std::string what);
  void refuse_submit(Fault why);
  void not_ready(std::string reason);
  Submission last_submission();
  std::filesystem::path folder() const { return folder_; }

  void start() override {}
  void drain() override;
  Result<Created> submit(const Submission&) override;
  Result<std::string> plan(const Submission&) override;
  Result<Job> get(const std::string& id) override;
  Result<JobPage> list(const JobQuery&) override;
  Result<Job> cancel(const std::string& id) override;
  Result<void> remove(const std::string& id) override;
  Result<Job> wait_change(const std::string& id, std::uint64_t version, Millis timeout) override;
  Result<Job> wait_done(const std::string& id, Millis timeout) override;
  Result<std::unique_ptr<EventStream>> subscribe(const std::string& job_id,
                                                 std::optional<std::uint64_t> after) override;
  Result<std::vector<JobEvent>> history(const std::string& id) override;
  Result<Job> pin(const std::string& id, bool pinned) override;
  Result<void> pin_asset(const std::string& sha256, const std::string& tenant, bool pinned) override;
  Result<std::int64_t> charge_upload(const std::string& tenant, std::uint64_t bytes, std::uint64_t limit) override;
  Result<void> refund_upload(const std::string& tenant, std::uint64_t bytes, std::int64_t day) override;
  Result<OpenArtifact> open_artifact(const std::string& id, const std::string& name) override;
  Result<std::unique_ptr<AssetUpload>> put_asset(const AssetRequest&) override;
  bool has_asset(const std::string& sha256, const std::optional<std::string>&) override {
    return blobs().exists(sha256);
  }
  std::uint64_t asset_offset(const std::string& sha256, const std::string& tenant) override {
    return blobs().partial_bytes(sha256, tenant);
  }
  Result<BlobReader> open_asset(const std::string& sha256) override { return blobs().open_blob(sha256); }
  Result<PartialUpload> begin_upload(const PartialUpload& wanted) override { return desk().begin(wanted); }
  Result<PartialUpload> find_upload(const std::string& id, const std::string& tenant) override {
    return desk().find(id, tenant);
  }
  Result<std::unique_ptr<UploadPiece>> append_upload(const PartialUpload& upload, std::uint64_t offset) override {
    return desk().append(upload, offset);
  }
  Result<void> remove_upload(const std::string& id, const std::string& tenant) override {
    return desk().remove(id, tenant);
  }
  ServiceStats stats() override { return {}; }
  std::vector<Check> checks() override;

 private:
  friend class FakeStream;
  /// Made when first asked for: a store of blobs syncs hundreds of folders.
  BlobStore& blobs();
  UploadDesk& desk();
  void record(Job& job, EventKind kind, const std::string& message = {});

  std::filesystem::path folder_;
  std::once_flag blobs_once_;
  std::unique_ptr<BlobStore> blobs_;
  std::unique_ptr<UploadDesk> desk_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::map<std::string, Job> jobs_;
  std::map<std::string, std::string> keys_;  // idempotency key -> job
  std::vector<JobEvent> events_;
  std::map<std::string, std::uint64_t> uploaded_;  // by tenant
  std::vector<Check> checks_;
  std::optional<Fault> submit_fault_;
  std::string list_exception_;
  Submission last_;
  bool closed_ = false;
  int made_ = 0;
};

}  // namespace kiln
