#pragma once
// One bucket of an S3-compatible store: signed requests (SigV4 by libcurl), timeouts, a few tries. The endpoint comes
// from the configuration alone, redirects are refused. Internal to server/blobs.

#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/base/result.h"
#include "server/blobs/s3_blobs.h"

namespace kiln {

/// Faults: not_found; blobs_unavailable after all tries; blobs_refused, which no second try would mend; disk_full.
class S3Client {
 public:
  explicit S3Client(S3Options);
  ~S3Client();
  S3Client(const S3Client&) = delete;
  S3Client& operator=(const S3Client&) = delete;

  /// The store verifies the hash, which is part of the signature. `fd` is read by pread.
  Result<void> put(const std::string& key, const std::string& sha256, int fd, std::uint64_t bytes);
  Result<std::uint64_t> size_of(const std::string& key);

  using Take = std::function<bool(std::span<const std::uint8_t>)>;  // false ends the transfer
  /// The whole object. `begin` is called before each try.
  Result<void> get(const std::string& key, const std::function<void()>& begin, const Take& take);
  /// `out` from `offset` on, which must lie within the object.
  Result<void> get_range(const std::string& key, std::uint64_t offset, std::span<std::uint8_t> out);
  Result<void> remove(const std::string& key);
  /// One page of the list as XML. `token`: of the page before, or empty.
  Result<std::string> list(const std::string& token);
  /// The bucket is there and may be read.
  Result<void> check();

 private:
  struct Request;
  struct Reply {
    long status = 0;  // 0: none came
    std::uint64_t length = 0;
  };
  Result<Reply> perform(const Request&);
  Reply once(const Request&, void* handle);
  void* take_handle();
  void keep_handle(void* handle);

  const S3Options options_;
  std::mutex mutex_;
  std::vector<void*> idle_;  // curl easy handles, which keep their connections
};

}  // namespace kiln
