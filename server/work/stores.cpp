#include "server/work/stores.h"

#include "server/blobs/file_blobs.h"
#include "server/blobs/s3_blobs.h"
#include "server/jobs/postgres_store.h"
#include "server/jobs/sqlite_store.h"

namespace kiln {
namespace {

constexpr std::string_view kDirectory = "dir:", kBucket = "s3://";

std::string after(const std::string& address, std::string_view scheme) { return address.substr(scheme.size()); }

bool is_postgres(const std::string& address) {
  return address.starts_with("postgresql://") || address.starts_with("postgres://");
}

bool is_bucket_name(const std::string& name) {
  return name.size() >= 3 && name.find_first_not_of("abcdefghijklmnopqrstuvwxyz0123456789.-") == std::string::npos;
}

bool is_endpoint(const std::string& url) {
  const bool http = url.starts_with("http://") || url.starts_with("https://");
  return http && !url.ends_with('/') && url.find_first_of("@?# ") == std::string::npos;
}

}  // namespace

Result<void> check_addresses(const StoreOptions& options) {
  const std::string& blobs = options.blobs;
  if (!options.jobs.empty() && !is_postgres(options.jobs)) {
    return fault("bad_store", "--store wants postgresql://user@host/database");
  }
  if (!options.jobs.empty() && blobs.empty()) {
    return fault("bad_store",
                 "--store needs --blobs dir:/shared or s3://bucket: other servers must find the bytes too");
  }
  if (blobs.starts_with(kDirectory)) {
    if (std::filesystem::path(after(blobs, kDirectory)).is_absolute()) return {};
  } else if (blobs.starts_with(kBucket)) {
    if (!is_endpoint(options.s3_endpoint)) {
      return fault("bad_store", "s3:// needs --s3-endpoint https://host[:port], without a path");
    }
    if (options.s3_key.empty() || options.s3_secret.empty()) {
      return fault("bad_store", "s3:// needs AWS_ACCESS_KEY_ID and AWS_SECRET_ACCESS_KEY in the environment");
    }
    if (is_bucket_name(after(blobs, kBucket))) return {};
  } else if (blobs.empty()) {
    return {};
  }
  return fault("bad_store", "--blobs wants dir:/absolute/path or s3://bucket");
}

bool holds_password(const StoreOptions& options) { return !options.jobs.empty() && has_password(options.jobs); }

Result<std::unique_ptr<JobStore>> open_job_store(const StoreOptions& options, const std::filesystem::path& data) {
  if (options.jobs.empty()) return open_sqlite_store({data / "kiln.db", {}});
  return open_postgres_store({options.jobs, {}});
}

Result<std::unique_ptr<BlobStore>> open_blob_store(const StoreOptions& options, const std::filesystem::path& data,
                                                   FileLayer& files) {
  if (options.blobs.empty()) return open_file_blobs(data, files);
  if (options.blobs.starts_with(kDirectory)) return open_file_blobs(after(options.blobs, kDirectory), files);
  S3Options s3;
  s3.endpoint = options.s3_endpoint;
  s3.bucket = after(options.blobs, kBucket);
  s3.region = options.s3_region;
  s3.key = options.s3_key;
  s3.secret = options.s3_secret;
  return open_s3_blobs(s3, data, files);
}

Result<void> check_owner(const StoreOptions& options, JobStore& jobs, BlobStore& blobs) {
  if (options.blobs.empty()) return {};  // in the data folder, beside its own job store
  KILN_TRY(identity, jobs.identity());
  KILN_TRY(owner, blobs.owner(identity));
  if (owner == identity) return {};
  return fault("blobs_of_another",
               "the place of --blobs belongs to another job store, which would lose its blobs to this one (remove "
               "'owner' there to give it away)");
}

}  // namespace kiln
