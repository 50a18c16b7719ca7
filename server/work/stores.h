#pragma once
// Which engine the addresses of the options mean.

#include <filesystem>
#include <memory>

#include "server/blobs/blob_store.h"
#include "server/jobs/job_store.h"

namespace kiln {

/// Where jobs and blobs live. A fleet is any number of servers with the same two addresses.
struct StoreOptions {
  std::string jobs;   // "postgresql://..."; empty: SQLite in the data folder
  std::string blobs;  // "dir:/shared" or "s3://bucket"; empty: files in the data folder
  std::string s3_endpoint, s3_region = "us-east-1", s3_key, s3_secret;
};

/// "bad_store" when the addresses mean nothing, or when other servers would not find the blobs that jobs refer to.
Result<void> check_addresses(const StoreOptions&);
/// True when the address of the jobs holds a password.
bool holds_password(const StoreOptions&);
Result<std::unique_ptr<JobStore>> open_job_store(const StoreOptions&, const std::filesystem::path& data);
Result<std::unique_ptr<BlobStore>> open_blob_store(const StoreOptions&, const std::filesystem::path& data,
                                                   FileLayer& files = real_files());
/// "blobs_of_another" when a place that may be shared belongs to another job store, which would lose its blobs here.
Result<void> check_owner(const StoreOptions&, JobStore&, BlobStore&);

}  // namespace kiln
