#pragma once
// The one XML document that we read: an answer to ListObjectsV2. Internal to server/blobs.

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/result.h"

namespace kiln {

struct S3Object {
  std::string key;
  std::uint64_t bytes = 0;
  std::int64_t modified_s = 0;  // seconds since 1970
};

struct S3Page {
  std::vector<S3Object> objects;
  std::string next_token;  // empty on the last page
};

/// Reads the elements it knows and passes over all others. Fails with "blobs_refused" for what is no such document.
Result<S3Page> read_s3_list(std::string_view xml);

}  // namespace kiln
