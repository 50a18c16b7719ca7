#pragma once
// The service as one tenant sees it: its own jobs and assets, and no word that others have any. What belongs to
// somebody else is not_found. Wraps any service, so that no route has to remember whom it talks to.

#include "server/work/service.h"

namespace kiln {

class TenantService final : public Service {
 public:
  /// `max_jobs`: unfinished jobs at a time ("quota"); 0: as many as the queue takes. `all` outlives this.
  TenantService(Service& all, std::string tenant, int max_jobs)
      : all_(all), tenant_(std::move(tenant)), max_jobs_(max_jobs) {}

  void start() override {}  // not a tenant's business
  void drain() override {}
  ServiceStats stats() override { return {}; }
  std::vector<Check> checks() override { return all_.checks(); }

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
  Result<void> pin_asset(const std::string& sha256, const std::string&, bool pinned) override {
    return all_.pin_asset(sha256, tenant_, pinned);
  }
  Result<std::int64_t> charge_upload(const std::string&, std::uint64_t bytes, std::uint64_t limit) override {
    return all_.charge_upload(tenant_, bytes, limit);
  }
  Result<void> refund_upload(const std::string&, std::uint64_t bytes, std::int64_t day) override {
    return all_.refund_upload(tenant_, bytes, day);
  }
  Result<OpenArtifact> open_artifact(const std::string& id, const std::string& name) override;
  Result<std::unique_ptr<AssetUpload>> put_asset(const AssetRequest&) override;
  bool has_asset(const std::string& sha256, const std::optional<std::string>& tenant) override;
  std::uint64_t asset_offset(const std::string& sha256, const std::string&) override {
    return all_.asset_offset(sha256, tenant_);
  }
  Result<BlobReader> open_asset(const std::string& sha256) override;
  Result<PartialUpload> begin_upload(const PartialUpload& wanted) override;
  Result<PartialUpload> find_upload(const std::string& id, const std::string&) override {
    return all_.find_upload(id, tenant_);
  }
  Result<std::unique_ptr<UploadPiece>> append_upload(const PartialUpload& upload, std::uint64_t offset) override;
  Result<void> remove_upload(const std::string& id, const std::string&) override {
    return all_.remove_upload(id, tenant_);
  }

 private:
  Submission of_this_tenant(Submission) const;
  Service& all_;
  const std::string tenant_;
  const int max_jobs_;
};

}  // namespace kiln
