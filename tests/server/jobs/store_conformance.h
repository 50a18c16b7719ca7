#pragma once
// What every engine of JobStore must do. An engine joins by two lines of INSTANTIATE_TEST_SUITE_P in a file of its own;
// broken_stores_test.cpp shows that the suite finds engines that do not.

#include <gtest/gtest.h>

#include <atomic>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>

#include "server/jobs/job_store.h"

namespace kiln::testing {

/// A clock that moves when the test says so; engines that cannot take one are tested elsewhere.
struct TestClock {
  std::int64_t now_ms = 1'800'000'000'000;
};

struct Engine {
  std::string name;
  std::function<std::unique_ptr<JobStore>(const std::filesystem::path& folder, TestClock&)> open;
  std::function<void()> empty = [] {};  // before a test: for an engine that keeps nothing in `folder`
};

inline std::string engine_name(const ::testing::TestParamInfo<Engine>& info) { return info.param.name; }

/// SQLite in `folder`, on the test's clock.
std::unique_ptr<JobStore> open_sqlite_on(const std::filesystem::path& folder, TestClock&);

inline constexpr Millis kTestLease{60'000};

class StoreConformance : public ::testing::TestWithParam<Engine> {
 protected:
  StoreConformance();
  ~StoreConformance() override;

  NewJob job(const std::string& label = "", const std::string& content_key = "");
  Job create(const std::string& label = "") { return store().create(job(label)).value().job; }
  Claim claim() { return store().claim(kTestLease, {}).value().value(); }
  Artifact artifact(const std::string& name = "scene.glb") const { return {name, "model/gltf-binary", sha('e'), 12}; }
  static std::string sha(char digit) { return std::string(64, digit); }
  JobState state_of(const std::string& id) { return store().get(id).value().state; }
  JobStore& store() { return *store_; }
  void reopen();

  TestClock clock_;

 private:
  std::filesystem::path folder_;
  std::unique_ptr<JobStore> store_;
  std::atomic<int> keys_{0};
};

/// Claims, leases, fences: what keeps results exactly-once.
class StoreClaims : public StoreConformance {};

/// Messages that wait for their receivers.
class StoreDeliveries : public StoreConformance {};

}  // namespace kiln::testing
