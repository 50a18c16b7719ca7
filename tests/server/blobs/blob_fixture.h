#pragma once
#include <gtest/gtest.h>

#include <filesystem>
#include <string>
#include <vector>

#include "server/blobs/file_blobs.h"

namespace kiln::testing {

inline std::span<const std::uint8_t> bytes_of(const std::string& text) {
  return {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()};
}

class BlobTest : public ::testing::Test {
 protected:
  BlobTest() {
    // In memory where that is possible: thousands of folders come and go, and what a disk would lose is modelled.
    const bool memory = std::filesystem::is_directory("/dev/shm");
    const auto place = memory ? std::filesystem::path("/dev/shm") : std::filesystem::temp_directory_path();
    std::string name = (place / "kiln_blobs.XXXXXX").string();
    folder_ = ::mkdtemp(name.data());
  }
  ~BlobTest() override { std::filesystem::remove_all(folder_); }

  /// Removes the blobs of these texts and all that is in the spool; the folders stay, since to make them takes longer
  /// than most tests.
  void remove_files(std::initializer_list<std::string> texts) const {
    for (const std::string& text : texts) {
      const std::string name = sha256_hex(bytes_of(text));
      std::filesystem::remove(folder_ / "cas" / name.substr(0, 2) / name);
    }
    std::filesystem::remove_all(folder_ / "tmp");
    std::filesystem::create_directories(folder_ / "tmp");
  }
  static std::string read(const BlobStore& store, const std::string& sha256) {
    const auto reader = store.open_blob(sha256).value();
    std::string text(reader.size(), ' ');
    EXPECT_EQ(reader.read(0, {reinterpret_cast<std::uint8_t*>(text.data()), text.size()}).value(), text.size());
    return text;
  }
  static std::size_t files_in(const std::filesystem::path& folder) {
    std::size_t count = 0;
    for (const auto& entry : std::filesystem::directory_iterator(folder)) count += entry.is_regular_file();
    return count;
  }
  /// Every blob's bytes hash to its name.
  static void expect_sound(const BlobStore& store) {
    EXPECT_TRUE(store.for_each(
        [&](const BlobEntry& blob) { EXPECT_EQ(sha256_hex(bytes_of(read(store, blob.sha256))), blob.sha256); }));
  }

  std::filesystem::path folder_;
};

}  // namespace kiln::testing
