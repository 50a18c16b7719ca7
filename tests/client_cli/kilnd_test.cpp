// The built client against the built server.
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <fstream>
#include <memory>
#include <nlohmann/json.hpp>
#include <sstream>
#include <thread>

#include "tests/client_cli/run_kiln.h"

namespace kiln {
namespace {

using nlohmann::json;

/// One server for all tests of this file, on a free port, with a data folder of its own.
class Daemon {
 public:
  Daemon() {
    const std::string data = folder_.path("data"), log = folder_.path("log");
    child_ = fork();
    if (child_ == 0) {
      if (!freopen(log.c_str(), "w", stderr)) _exit(126);
      execl(KILND_PROGRAM, KILND_PROGRAM, "--data", data.c_str(), "--port", "0", nullptr);
      _exit(127);
    }
    for (int i = 0; i < 1000 && url_.empty(); ++i) {
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
      const std::string text = folder_.read("log");
      const auto at = text.find("listening on http://");
      if (at != std::string::npos) std::istringstream(text.substr(at + 13)) >> url_;
    }
  }
  ~Daemon() {
    kill(child_, SIGTERM);
    waitpid(child_, nullptr, 0);
  }
  const std::string& url() const { return url_; }

 private:
  Folder folder_;
  pid_t child_ = -1;
  std::string url_;
};

class Service : public ::testing::Test {
 protected:
  static void SetUpTestSuite() { daemon = std::make_unique<Daemon>(); }
  static void TearDownTestSuite() { daemon.reset(); }
  void SetUp() override {
    ASSERT_NE(daemon->url(), "") << "the server did not start";
    ASSERT_EQ(run_kiln({"demo-scene", "room", "-o", scene}).exit, 0);
  }
  Ran at_server(const std::vector<std::string>& words) const {
    return run_kiln(words, {{"KILN_SERVER", daemon->url()}});
  }

  static std::unique_ptr<Daemon> daemon;
  Folder folder;
  std::string scene = folder.path("room.glb");
};
std::unique_ptr<Daemon> Service::daemon;

TEST_F(Service, ABakeThereGivesTheBytesOfABakeHere) {
  const Ran here = run_kiln({"bake", scene, "--preset", "lamps", "--quality", "draft", "-o", folder.path("here")});
  ASSERT_EQ(here.exit, 0) << here.err;
  const Ran there = at_server({"bake", scene, "--preset", "lamps", "--quality", "draft", "-o", folder.path("there")});
  ASSERT_EQ(there.exit, 0) << there.err;
  EXPECT_FALSE(folder.read("here/scene.glb").empty());
  EXPECT_TRUE(folder.read("here/scene.glb") == folder.read("there/scene.glb"));
  EXPECT_TRUE(json::parse(folder.read("there/report.json")).at("certificate").is_object());
  const Ran again = at_server({"submit", scene, "--preset", "lamps", "--quality", "draft", "--json"});
  ASSERT_EQ(again.exit, 0) << again.err;
  EXPECT_TRUE(json::parse(again.out).at("cached").get<bool>());
}

TEST_F(Service, AJobIsSubmittedWatchedFetchedAndForgotten) {
  const Ran submitted =
      at_server({"submit", scene, "--preset", "lamps", "--quality", "draft", "--label", "piecewise", "--seed", "7"});
  ASSERT_EQ(submitted.exit, 0) << submitted.err;
  const std::string id = submitted.out.substr(0, submitted.out.size() - 1);
  const Ran watched = at_server({"watch", id});
  EXPECT_EQ(watched.exit, 0) << watched.err;
  EXPECT_EQ(watched.out, id + " succeeded\n");
  EXPECT_NE(at_server({"list", "--label", "piecewise"}).out.find(id), std::string::npos);
  EXPECT_EQ(json::parse(at_server({"get", id, "--json"}).out).at("status"), "succeeded");
  EXPECT_EQ(at_server({"get", id, "-o", folder.path("got"), "--artifact", "report.json"}).exit, 0);
  EXPECT_FALSE(folder.read("got/report.json").empty());
  EXPECT_EQ(folder.read("got/scene.glb"), "");
  EXPECT_EQ(at_server({"open", id}).out, daemon->url() + "/view/" + id + "\n");
  EXPECT_EQ(at_server({"pin", id}).out, id + "\n");
  EXPECT_NE(at_server({"rm", id}).err.find("pinned"), std::string::npos);
  EXPECT_EQ(at_server({"pin", "--off", id}).exit, 0);
  EXPECT_EQ(at_server({"rm", id}).exit, 0);
  EXPECT_EQ(at_server({"pin", id}).exit, 5);
  EXPECT_EQ(at_server({"get", id}).exit, 5);
}

TEST_F(Service, ACanceledJobEndsWithFour) {
  const auto recipe = folder.write("slow.json", R"({"steps":[{"do":"prt","order":10,"samples":65536,"bounces":16}]})");
  const Ran submitted = at_server({"submit", scene, "-r", recipe});
  ASSERT_EQ(submitted.exit, 0) << submitted.err;
  const std::string id = submitted.out.substr(0, submitted.out.size() - 1);
  EXPECT_EQ(at_server({"cancel", id}).exit, 0);
  EXPECT_EQ(at_server({"watch", id}).exit, 4);
}

TEST_F(Service, WhatIsWrongWithARecipeOrASceneEndsWithSevenAndItsPlace) {
  const auto recipe = folder.write("bad.json", R"({"steps":[{"do":"prt","order":99}],"colour":1})");
  const Ran refused = at_server({"bake", scene, "-r", recipe, "-o", folder.path("no")});
  EXPECT_EQ(refused.exit, 7) << refused.err;
  EXPECT_NE(refused.err.find("/steps/0/order"), std::string::npos) << refused.err;
  EXPECT_NE(refused.err.find("/colour"), std::string::npos) << refused.err;
  const auto broken = folder.write("s.gltf", R"({"asset":{"version":"2.0"},"meshes":7})");
  EXPECT_EQ(at_server({"bake", broken, "--preset", "lamps", "-o", folder.path("no")}).exit, 7);
}

TEST_F(Service, AnUnknownJobEndsWithFive) {
  for (const char* command : {"get", "watch", "cancel", "open"})
    EXPECT_EQ(at_server({command, "01JQZZZZZZZZZZZZZZZZZZZZZZ"}).exit, 5) << command;
}

TEST_F(Service, APlanThereIsAPlanHere) {
  const Ran here = run_kiln({"plan", scene, "--preset", "lamps", "--json"});
  const Ran there = at_server({"plan", scene, "--preset", "lamps", "--json"});
  ASSERT_EQ(there.exit, 0) << there.err;
  EXPECT_EQ(json::parse(there.out).at("parameters"), json::parse(here.out).at("parameters"));
}

TEST_F(Service, AGltfAndItsFilesArriveTogether) {
  const std::string model =
      std::string(KILN_SHARED) + "/models/conformance/SimpleSparseAccessor/SimpleSparseAccessor.gltf";
  if (!std::ifstream(model)) GTEST_SKIP() << "needs the shared models";
  const Ran ran = at_server({"bake", model, "--env", "1,1,1", "--quality", "draft", "-o", folder.path("out")});
  EXPECT_EQ(ran.exit, 0) << ran.err;
  EXPECT_FALSE(folder.read("out/scene.glb").empty());
}

}  // namespace
}  // namespace kiln
