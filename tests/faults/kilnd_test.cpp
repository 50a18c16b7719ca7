// The program itself: what it refuses to be started with, and how it ends.

#include <gtest/gtest.h>
#include <sys/wait.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <fstream>
#include <memory>
#include <nlohmann/json.hpp>
#include <sstream>
#include <thread>

#include "core/base/sha256.h"
#include "tests/faults/daemon.h"
#include "tests/fixtures/webhook_receiver.h"

namespace kiln::testing {
namespace {

using nlohmann::json;

std::string sha256_of(const std::string& text) {
  return sha256_hex({reinterpret_cast<const std::uint8_t*>(text.data()), text.size()});
}

class KilndTest : public ::testing::Test {
 protected:
  KilndTest() {
    std::string name = (std::filesystem::temp_directory_path() / "kiln_program.XXXXXX").string();
    folder_ = ::mkdtemp(name.data());
  }
  ~KilndTest() override { std::filesystem::remove_all(folder_); }

  std::unique_ptr<Daemon> start(const std::vector<std::string>& arguments) const {
    return std::make_unique<Daemon>(KILN_DAEMON, folder_ / "data", arguments);
  }
  struct End {
    int code = 0;
    std::string text;
  };
  /// Runs a kilnd that should end by itself.
  End refuse(const std::string& arguments, const std::string& data = "data") const {
    const std::string out = folder_ / "out.txt";
    const std::string command = std::string("timeout 20 ") + KILN_DAEMON + " --data " + (folder_ / data).string() +
                                " --port 0 " + arguments + " >" + out + " 2>&1";
    const int status = std::system(command.c_str());
    std::ifstream in(out);
    std::stringstream text;
    text << in.rdbuf();
    return {WEXITSTATUS(status), text.str()};
  }

  std::filesystem::path folder_;
};

TEST_F(KilndTest, OpenToOthersWithoutTokensIsRefusedInOneLine) {
  const End end = refuse("--bind 0.0.0.0");
  EXPECT_EQ(end.code, 78);
  EXPECT_EQ(std::ranges::count(end.text, '\n'), 1) << end.text;
  EXPECT_NE(end.text.find("--token-file"), std::string::npos);
}

TEST_F(KilndTest, ATokenFileThatHoldsNoTokenIsRefused) {
  std::ofstream(folder_ / "tokens") << "short\n";
  EXPECT_EQ(refuse("--token-file " + (folder_ / "tokens").string()).code, 78);
  EXPECT_EQ(refuse("--token-file " + (folder_ / "missing").string()).code, 78);
}

TEST_F(KilndTest, WithATokenFileNobodyElseIsServed) {
  std::ofstream(folder_ / "tokens") << std::string(43, 'a') << "\n";
  const auto daemon = start({"--token-file", folder_ / "tokens"});
  EXPECT_EQ(http_get(daemon->port(), "/v1/jobs").status, 401);
  EXPECT_EQ(http_get(daemon->port(), "/healthz").status, 200);
}

TEST_F(KilndTest, AReceiverHearsOfAJobThoughTheServerWasKilledBeforeItListened) {
  WebhookReceiver receiver;
  receiver.fail(503, 1000);
  std::ofstream(folder_ / "hooks") << receiver.url() << " whsec_MfKQ9r8GKYqrTwjUPD8ILPZIo2LaLaSw\n";
  const std::vector<std::string> arguments{
      "--webhook-file", folder_ / "hooks", "--webhook-private", "--soft-free-percent", "0", "--hard-free-percent", "0"};
  std::string id;
  {
    const auto daemon = start(arguments);
    const std::string scene = sha256_of(cube_glb());
    EXPECT_EQ(http_put(daemon->port(), "/v1/assets/" + scene, cube_glb()).status, 201);
    id = json::parse(http_post(daemon->port(), "/v1/jobs", cube_job(scene, 1)).body).at("id");
    ASSERT_TRUE(receiver.wait_for(1));
    std::this_thread::sleep_for(std::chrono::milliseconds(300));
    daemon->kill_hard();
  }
  receiver.fail(0, 0);
  const auto daemon = start(arguments);
  ASSERT_TRUE(receiver.wait_for(2)) << "due 5 s after the first try, or 25 s if it died before it could note that";
  const auto messages = receiver.messages();
  EXPECT_EQ(messages[1].id, messages[0].id);
  EXPECT_EQ(json::parse(messages[1].body)["type"], "job.succeeded");
  EXPECT_EQ(json::parse(messages[1].body)["data"]["id"], id);
}

TEST_F(KilndTest, AFileOfWebhooksThatNamesNobodyIsRefusedInOneLine) {
  std::ofstream(folder_ / "hooks") << "http://127.0.0.1/ whsec_MfKQ9r8GKYqrTwjUPD8ILPZIo2LaLaSw\n";
  for (const char* file : {"hooks", "missing"}) {
    const End end = refuse("--webhook-file " + (folder_ / file).string());
    EXPECT_EQ(end.code, 78);
    EXPECT_EQ(std::ranges::count(end.text, '\n'), 1) << end.text;
  }
}

TEST_F(KilndTest, ASecondServerOnTheSameDataIsRefused) {
  const auto daemon = start({});
  const End end = refuse("");
  EXPECT_EQ(end.code, 78);
  EXPECT_NE(end.text.find("another server"), std::string::npos) << end.text;
}

TEST_F(KilndTest, AddressesOfAFleetThatMeanNothingAreRefusedInOneLine) {
  for (const char* arguments :
       {"--store mysql://db/kiln --blobs dir:/tmp", "--store postgresql://kiln@db/kiln", "--blobs dir:relative",
        "--blobs s3://bucket", "--blobs ftp://host", "worker",
        "--blobs s3://bucket --s3-endpoint http://user:secret@host", "--s3-endpoint http://host --blobs s3://a/b"}) {
    const End end = refuse(arguments);
    EXPECT_EQ(end.code, 78) << arguments << end.text;
    EXPECT_EQ(std::ranges::count(end.text, '\n'), 1) << end.text;
  }
}

TEST_F(KilndTest, APasswordOnTheCommandLineIsRefusedAndNotRepeated) {
  const End end = refuse("--blobs dir:/tmp --store postgresql://kiln:hunter2@127.0.0.1:1/kiln");
  EXPECT_EQ(end.code, 78);
  EXPECT_EQ(end.text.find("hunter2"), std::string::npos) << end.text;
  ::setenv("KILN_STORE", "postgresql://kiln:hunter2@127.0.0.1:1/kiln", 1);
  const End from_environment = refuse("--blobs dir:/tmp");
  ::unsetenv("KILN_STORE");
  EXPECT_EQ(from_environment.code, 1) << "the address is taken, and nobody answers there: " << from_environment.text;
  EXPECT_EQ(from_environment.text.find("hunter2"), std::string::npos);
}

TEST_F(KilndTest, ABackupOfARunningServerServesTheSameJobsAndBytes) {
  std::string id, artifact;
  {
    const auto daemon = start({"--soft-free-percent", "0", "--hard-free-percent", "0"});
    const std::string scene = sha256_of(cube_glb());
    EXPECT_EQ(http_put(daemon->port(), "/v1/assets/" + scene, cube_glb()).status, 201);
    id = json::parse(http_post(daemon->port(), "/v1/jobs", cube_job(scene, 1)).body).at("id");
    const json done = json::parse(http_get(daemon->port(), "/v1/jobs/" + id + "?wait=60").body);
    ASSERT_EQ(done["status"], "succeeded") << done.dump();
    artifact = done["artifacts"][0]["sha256"];
    const End backup = refuse("admin backup " + (folder_ / "copy").string());
    EXPECT_EQ(backup.code, 0) << backup.text;
    EXPECT_GE(json::parse(backup.text)["blobs"], 3);
    EXPECT_EQ(refuse("admin backup " + (folder_ / "copy").string()).code, 1) << "a backup never writes over another";
    EXPECT_EQ(refuse("admin stats").code, 78) << "the server has the folder";
  }
  const Daemon copy(KILN_DAEMON, folder_ / "copy", {});
  const json job = json::parse(http_get(copy.port(), "/v1/jobs/" + id).body);
  EXPECT_EQ(job["status"], "succeeded");
  for (const json& file : job["artifacts"]) {
    EXPECT_EQ(sha256_of(http_get(copy.port(), file["url"]).body), file["sha256"]);
  }
  const End stats = refuse("admin stats");
  EXPECT_EQ(json::parse(stats.text)["jobs"]["succeeded"], 1) << stats.text;
}

TEST_F(KilndTest, BlobsOfAnotherStoreAreRefusedBeforeTheyAreLost) {
  const std::string shared = "dir:" + (folder_ / "shared").string();
  { const auto first = start({"--blobs", shared}); }
  { const auto again = start({"--blobs", shared}); }
  const End end = refuse("--blobs " + shared, "other");
  EXPECT_EQ(end.code, 78) << end.text;
  EXPECT_NE(end.text.find("belongs to another"), std::string::npos) << end.text;
}

TEST_F(KilndTest, ScrubFindsAFlippedBitAndGcTakesWhatNobodyNeeds) {
  const std::string scene = sha256_of(cube_glb());
  EXPECT_EQ(http_put(start({})->port(), "/v1/assets/" + scene, cube_glb()).status, 201);
  const End sound = refuse("admin scrub");
  EXPECT_EQ(sound.code, 0) << sound.text;
  EXPECT_EQ(json::parse(sound.text)["blobs"], 1);
  {
    std::fstream blob(folder_ / "data" / "cas" / scene.substr(0, 2) / scene, std::ios::in | std::ios::out);
    blob.seekp(100);
    blob.put('\x7f');
  }
  const End flipped = refuse("admin scrub");
  EXPECT_EQ(flipped.code, 1);
  EXPECT_EQ(json::parse(flipped.text)["wrong"], json::array({scene}));
  EXPECT_EQ(json::parse(refuse("admin gc").text)["removed"], 0) << "its grace is not over";
  EXPECT_EQ(json::parse(refuse("admin gc --blob-grace-s 0").text)["removed"], 1);
  EXPECT_EQ(json::parse(refuse("admin stats").text)["blobs"], 0);
}

TEST_F(KilndTest, AJobGoesWhenItsTimeIsOverAndAPinnedOneStays) {
  const std::string cube = cube_glb();
  std::string pinned, other;
  {
    const auto daemon = start({"--workers", "0", "--keep-days", "0.00001", "--blob-grace-s", "1"});
    const int port = daemon->port();
    ASSERT_EQ(http_put(port, "/v1/assets/" + sha256_of(cube), cube).status, 201);
    const auto canceled = [&](int seed, bool pin) {
      std::string id = json::parse(http_post(port, "/v1/jobs", cube_job(sha256_of(cube), seed)).body)["id"];
      EXPECT_TRUE(!pin || http_put(port, "/v1/jobs/" + id + "/pin", "").status == 200);
      EXPECT_EQ(http_post(port, "/v1/jobs/" + id + "/cancel", "").status, 200);
      return id;
    };
    pinned = canceled(1, true);
    other = canceled(2, false);
    for (int i = 0; i < 200 && http_get(port, "/v1/jobs/" + other).status == 200; ++i)
      std::this_thread::sleep_for(std::chrono::milliseconds(50));
    EXPECT_EQ(http_get(port, "/v1/jobs/" + other).status, 404);
    EXPECT_EQ(http_get(port, "/v1/jobs/" + pinned).status, 200);
    EXPECT_EQ(http_get(port, "/v1/assets/" + sha256_of(cube)).status, 200) << "its scene stays with it";
  }
  const std::string rules = " --keep-days 0.00001 --blob-grace-s 0";
  EXPECT_EQ(json::parse(refuse("admin gc" + rules).text)["forgotten"], 0);
  EXPECT_EQ(refuse("admin unpin " + pinned).code, 0);
  EXPECT_EQ(json::parse(refuse("admin gc --dry-run" + rules).text)["forgotten"], 1);
  EXPECT_EQ(json::parse(refuse("admin stats").text)["jobs"]["canceled"], 1) << "it was only counted";
  EXPECT_EQ(refuse("admin pin " + sha256_of(cube)).code, 0);
  const json gone = json::parse(refuse("admin gc" + rules).text);
  EXPECT_EQ(gone["forgotten"], 1);
  EXPECT_EQ(gone["removed"], 0) << "the scene is pinned by itself";
  EXPECT_EQ(refuse("admin unpin " + sha256_of(cube)).code, 0);
  std::this_thread::sleep_for(std::chrono::milliseconds(10));
  EXPECT_EQ(json::parse(refuse("admin gc" + rules).text)["removed"], 1);
  EXPECT_EQ(refuse("admin pin " + pinned).code, 1);
  EXPECT_EQ(refuse("admin pin").code, 2);
}

TEST_F(KilndTest, OriginsAndProxiesThatMeanNothingAreRefused) {
  for (const char* flag : {"--cors-origin '*'", "--cors-origin https://a.example/", "--trusted-proxy proxy.example",
                           "--trusted-proxy 10.0.0.0/40"}) {
    const End end = refuse(flag);
    EXPECT_EQ(end.code, 78) << flag;
    EXPECT_EQ(std::ranges::count(end.text, '\n'), 1) << end.text;
  }
}

TEST_F(KilndTest, AnUnknownFlagIsAUsageError) {
  EXPECT_EQ(refuse("--no-such-flag").code, 2);
  EXPECT_EQ(refuse("admin dance").code, 2);
  EXPECT_EQ(refuse("admin backup").code, 2);
  EXPECT_EQ(refuse("admin stats somewhere").code, 2);
}

TEST_F(KilndTest, TermEndsAnIdleServerWithZero) {
  const auto daemon = start({});
  EXPECT_EQ(http_get(daemon->port(), "/readyz").status, 200);
  const int status = daemon->terminate();
  EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0) << status;
}

}  // namespace
}  // namespace kiln::testing
