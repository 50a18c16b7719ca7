#pragma once
// What every place of blobs must do. A place joins by two lines of INSTANTIATE_TEST_SUITE_P.

#include "tests/server/blobs/blob_fixture.h"

namespace kiln::testing {

struct BlobPlace {
  std::string name;
  /// Opens the place; twice opens the same one for another program.
  std::function<std::unique_ptr<BlobStore>(const std::filesystem::path& folder)> open;
  std::function<void()> empty = [] {};  // before a test: for a place that lies elsewhere
};

inline std::string place_name(const ::testing::TestParamInfo<BlobPlace>& info) { return info.param.name; }

class BlobConformance : public BlobTest, public ::testing::WithParamInterface<BlobPlace> {
 protected:
  BlobConformance() {
    GetParam().empty();
    store_ = open();
  }
  std::unique_ptr<BlobStore> open() const { return GetParam().open(folder_ / "place"); }
  BlobStore& store() { return *store_; }
  static StoredBlob put(BlobStore& store, const std::string& text) {
    auto writer = store.write().value();
    EXPECT_TRUE(writer.write(bytes_of(text)));
    return writer.finish().value();
  }
  std::size_t spooled() const { return files_in(store_->folder() / "tmp"); }

 private:
  std::unique_ptr<BlobStore> store_;
};

}  // namespace kiln::testing
