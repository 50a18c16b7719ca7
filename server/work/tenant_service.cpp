#include "server/work/tenant_service.h"

#include <chrono>
#include <map>

namespace kiln {
namespace {

constexpr std::size_t kMostRemembered = 10'000;  // jobs whose owner a stream knows

/// The events of one tenant's jobs.
class TenantStream final : public EventStream {
 public:
  TenantStream(std::unique_ptr<EventStream> all, Service& service, std::string tenant)
      : all_(std::move(all)), service_(service), tenant_(std::move(tenant)) {}

  std::optional<JobEvent> next(Millis timeout) override {
    const auto deadline = std::chrono::steady_clock::now() + timeout;
    while (true) {
      const auto left = std::chrono::duration_cast<Millis>(deadline - std::chrono::steady_clock::now());
      auto event = all_->next(std::max(left, Millis(0)));
      if (!event || is_ours(event->job_id)) return event;
    }
  }
  bool closed() const override { return all_->closed(); }

 private:
  bool is_ours(const std::string& id) {
    if (const auto known = ours_.find(id); known != ours_.end()) return known->second;
    if (ours_.size() >= kMostRemembered) ours_.clear();
    const auto job = service_.get(id);
    return ours_[id] = job && job->tenant == tenant_;
  }
  std::unique_ptr<EventStream> all_;
  Service& service_;
  const std::string tenant_;
  std::map<std::string, bool> ours_;
};

}  // namespace

Submission TenantService::of_this_tenant(Submission submission) const {
  submission.tenant = tenant_;
  submission.max_open = max_jobs_;
  return submission;
}

Result<Created> TenantService::submit(const Submission& submission) { return all_.submit(of_this_tenant(submission)); }
Result<std::string> TenantService::plan(const Submission& submission) { return all_.plan(of_this_tenant(submission)); }

Result<Job> TenantService::get(const std::string& id) {
  auto job = all_.get(id);
  if (job && job->tenant != tenant_) return fault("not_found", "there is no such job");
  return job;
}

Result<JobPage> TenantService::list(const JobQuery& query) {
  JobQuery own = query;
  own.tenant = tenant_;
  return all_.list(own);
}

Result<Job> TenantService::cancel(const std::string& id) {
  KILN_TRY(job, get(id));
  return all_.cancel(job.id);
}

Result<void> TenantService::remove(const std::string& id) {
  KILN_TRY(job, get(id));
  return all_.remove(job.id);
}

Result<Job> TenantService::wait_change(const std::string& id, std::uint64_t version, Millis timeout) {
  KILN_TRY(job, get(id));
  return all_.wait_change(job.id, version, timeout);
}

Result<Job> TenantService::wait_done(const std::string& id, Millis timeout) {
  KILN_TRY(job, get(id));
  return all_.wait_done(job.id, timeout);
}

Result<std::unique_ptr<EventStream>> TenantService::subscribe(const std::string& job_id,
                                                              std::optional<std::uint64_t> after) {
  if (!job_id.empty()) {
    KILN_TRY(job, get(job_id));
    return all_.subscribe(job.id, after);
  }
  KILN_TRY(all, all_.subscribe(job_id, after));
  return std::make_unique<TenantStream>(std::move(all), all_, tenant_);
}

Result<std::vector<JobEvent>> TenantService::history(const std::string& id) {
  KILN_TRY(job, get(id));
  return all_.history(job.id);
}

Result<Job> TenantService::pin(const std::string& id, bool pinned) {
  KILN_TRY(job, get(id));
  return all_.pin(job.id, pinned);
}

Result<OpenArtifact> TenantService::open_artifact(const std::string& id, const std::string& name) {
  KILN_TRY(job, get(id));
  return all_.open_artifact(job.id, name);
}

Result<std::unique_ptr<AssetUpload>> TenantService::put_asset(const AssetRequest& request) {
  AssetRequest own = request;
  own.tenant = tenant_;
  return all_.put_asset(own);
}

Result<PartialUpload> TenantService::begin_upload(const PartialUpload& wanted) {
  PartialUpload own = wanted;
  own.tenant = tenant_;
  return all_.begin_upload(own);
}

Result<std::unique_ptr<UploadPiece>> TenantService::append_upload(const PartialUpload& upload, std::uint64_t offset) {
  PartialUpload own = upload;
  own.tenant = tenant_;
  return all_.append_upload(own, offset);
}

bool TenantService::has_asset(const std::string& sha256, const std::optional<std::string>&) {
  return all_.has_asset(sha256, tenant_);
}

Result<BlobReader> TenantService::open_asset(const std::string& sha256) {
  if (!has_asset(sha256, tenant_)) return fault("not_found", "there is no such asset");
  return all_.open_asset(sha256);
}

}  // namespace kiln
