#pragma once
// A service in a folder of its own, with the fake worker.

#include <gtest/gtest.h>

#include <chrono>
#include <filesystem>
#include <string>

#include "server/work/service.h"

namespace kiln::testing {

using namespace std::chrono_literals;

class ServiceTest : public ::testing::Test {
 protected:
  ServiceTest() {
    // In memory where that is possible: durability has tests of its own.
    const bool memory = std::filesystem::is_directory("/dev/shm");
    const auto place = memory ? std::filesystem::path("/dev/shm") : std::filesystem::temp_directory_path();
    std::string name = (place / "kiln_service.XXXXXX").string();
    folder_ = ::mkdtemp(name.data());
    options_.data = folder_ / "data";
    options_.worker_command = {KILN_FAKE_WORKER};
    options_.soft_free_fraction = options_.hard_free_fraction = 0;  // the test machine's disk is no part of the test
    options_.first_retry = Millis(20);
  }
  ~ServiceTest() override {
    service_.reset();
    std::filesystem::remove_all(folder_);
  }

  Service& open() {
    service_.reset();
    service_ = Service::open(options_).value();
    return *service_;
  }
  Service& start() {
    open().start();
    return *service_;
  }

  std::string put(const std::string& text) {
    auto upload = service_->put_asset({}).value();
    const auto* bytes = reinterpret_cast<const std::uint8_t*>(text.data());
    EXPECT_TRUE(upload->write({bytes, text.size()}));
    return upload->finish().value().sha256;
  }

  /// A job that the fake worker treats as its label says; each has a seed, and so a result, of its own.
  Submission submission(const std::string& label) {
    Submission job;
    job.scene_sha256 = put(label == "crash-once" ? (folder_ / "marker").string() : "scene");
    job.recipe.steps = {PrtStep{}};
    job.recipe.label = label;
    job.recipe.seed = ++seed_;
    return job;
  }
  Job submit(const std::string& label) { return service_->submit(submission(label)).value().job; }
  Job finish(const std::string& label) { return service_->wait_done(submit(label).id, 20s).value(); }

  Job wait_running(const std::string& id) {
    Job job = service_->get(id).value();
    for (int i = 0; i < 50 && job.state == JobState::queued; ++i) {
      job = service_->wait_change(id, job.version, 200ms).value();
    }
    EXPECT_EQ(job.state, JobState::running);
    return job;
  }

  /// What each check that is not ready says.
  std::vector<std::string> unready() {
    std::vector<std::string> states;
    for (const Check& check : service_->checks()) {
      if (!check.ready) states.push_back(check.state);
    }
    return states;
  }

  /// Entries below a folder of the data.
  std::size_t entries(const std::string& folder) const {
    std::size_t count = 0;
    for (const auto& entry : std::filesystem::directory_iterator(options_.data / folder)) count += entry.exists();
    return count;
  }

  std::filesystem::path folder_;
  ServiceOptions options_;
  std::unique_ptr<Service> service_;
  std::uint64_t seed_ = 0;
};

}  // namespace kiln::testing
