// A disk that fills up under the real server: uploads are refused, the queue waits, and both mend without a restart.

#include <gtest/gtest.h>
#include <sys/mount.h>
#include <sys/statvfs.h>

#include <cerrno>
#include <cstring>
#include <fstream>
#include <memory>
#include <nlohmann/json.hpp>

#include "core/base/sha256.h"
#include "tests/faults/daemon.h"

namespace kiln::testing {
namespace {

using nlohmann::json;

class DiskFullTest : public ::testing::Test {
 protected:
  void SetUp() override {
    std::string name = (std::filesystem::temp_directory_path() / "kiln_disk.XXXXXX").string();
    folder_ = ::mkdtemp(name.data());
    mounted_ = ::mount("kiln", folder_.c_str(), "tmpfs", 0, "size=32m") == 0;
    if (!mounted_) GTEST_SKIP() << "a small disk needs the right to mount one: " << std::strerror(errno);
    daemon_ = std::make_unique<Daemon>(KILN_DAEMON, folder_ / "data", std::vector<std::string>{});
    const std::string glb = cube_glb();
    scene_ = sha256_hex({reinterpret_cast<const std::uint8_t*>(glb.data()), glb.size()});
    ASSERT_EQ(http_put(daemon_->port(), "/v1/assets/" + scene_, glb).status, 201);
  }
  void TearDown() override {
    daemon_.reset();
    if (mounted_) ::umount2(folder_.c_str(), MNT_DETACH);
    std::filesystem::remove(folder_);
  }

  /// Fills the disk up to the given free share.
  void fill(double free_share) {
    struct statvfs disk {};
    ::statvfs(folder_.c_str(), &disk);
    const auto wanted = static_cast<std::uint64_t>(free_share * static_cast<double>(disk.f_blocks));
    std::ofstream file(folder_ / "filler", std::ios::binary);
    const std::string block(disk.f_frsize, 'x');
    for (std::uint64_t free = disk.f_bavail; free > wanted; --free) file << block;
  }
  void make_room() { std::filesystem::remove(folder_ / "filler"); }

  Answer submit(int seed) { return http_post(daemon_->port(), "/v1/jobs", cube_job(scene_, seed)); }
  std::string status_of(const std::string& id, const std::string& wait) {
    return json::parse(http_get(daemon_->port(), "/v1/jobs/" + id + "?wait=" + wait).body).at("status");
  }
  static std::string code_of(const Answer& answer) {
    const std::string type = json::parse(answer.body).at("type");
    return type.substr(type.rfind('/') + 1);
  }

  std::filesystem::path folder_;
  std::unique_ptr<Daemon> daemon_;
  std::string scene_;
  bool mounted_ = false;
};

TEST_F(DiskFullTest, BelowTheSoftMarkUploadsAreRefusedAndJobsStillRun) {
  fill(0.08);
  const Answer upload = http_post(daemon_->port(), "/v1/assets", "some bytes");
  EXPECT_EQ(upload.status, 507);
  EXPECT_EQ(code_of(upload), "disk_full");
  const Answer job = submit(1);
  ASSERT_EQ(job.status, 202) << job.body;
  EXPECT_EQ(status_of(json::parse(job.body)["id"], "30"), "succeeded");
}

TEST_F(DiskFullTest, BelowTheHardMarkTheQueueWaitsAndGoesOnByItself) {
  fill(0.03);
  const Answer job = submit(1);
  ASSERT_EQ(job.status, 202) << job.body;
  const std::string id = json::parse(job.body)["id"];
  EXPECT_EQ(status_of(id, "1"), "queued");
  EXPECT_EQ(http_get(daemon_->port(), "/readyz").status, 503);
  make_room();
  EXPECT_EQ(status_of(id, "30"), "succeeded");
  EXPECT_EQ(http_get(daemon_->port(), "/readyz").status, 200);
}

TEST_F(DiskFullTest, AJobThatCannotBeStoredIsRefusedWith507AndTheServerLives) {
  fill(0);
  const Answer job = submit(1);
  EXPECT_EQ(job.status, 507) << job.body;
  EXPECT_EQ(code_of(job), "disk_full");
  EXPECT_EQ(http_get(daemon_->port(), "/healthz").status, 200);
  make_room();
  const Answer again = submit(1);
  ASSERT_EQ(again.status, 202) << again.body;
  EXPECT_EQ(status_of(json::parse(again.body)["id"], "30"), "succeeded");
}

}  // namespace
}  // namespace kiln::testing
