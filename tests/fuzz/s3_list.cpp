// The XML of an S3 store: a store that lies must not do more than be refused.

#include "server/blobs/s3_list.h"

#include "tests/fuzz/target.h"

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto page = kiln::read_s3_list(kiln::fuzz::text_of(data, size));
  if (!page) {
    kiln::fuzz::promise(page.error().code == "blobs_refused");
    return 0;
  }
  for (const kiln::S3Object& object : page->objects) kiln::fuzz::promise(object.key.size() <= size);
  return 0;
}
