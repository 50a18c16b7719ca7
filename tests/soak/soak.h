#pragma once
// What the runs of the soak program share. Each prints one line of JSON with its figures, and a line for each promise
// that did not hold.

#include <chrono>
#include <cstdio>
#include <filesystem>
#include <map>
#include <memory>
#include <mutex>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tests/faults/daemon.h"
#include "tests/fixtures/postgres_server.h"

namespace kiln::testing {

using Clock = std::chrono::steady_clock;
double seconds_since(Clock::time_point start);
std::string sha256_of(const std::string& text);

/// Promises that did not hold. Safe from any thread.
class Breaches {
 public:
  void expect(bool held, const std::string& sentence);
  int count() const { return count_; }

 private:
  std::mutex mutex_;
  int count_ = 0;
};

/// Real servers on one store, in a folder of their own under `work`.
class Fleet {
 public:
  /// `nodes` servers on PostgreSQL and a shared directory, or one on SQLite; a lease of kLeaseS.
  Fleet(bool postgres, int nodes, std::vector<std::string> more = {});
  ~Fleet();
  Fleet(const Fleet&) = delete;
  Fleet& operator=(const Fleet&) = delete;

  static constexpr int kLeaseS = 2;
  std::size_t size() const { return nodes_.size(); }
  Daemon& node(std::size_t i) { return *nodes_[i]; }
  /// Starts (again) whatever does not run.
  void start();
  std::filesystem::path data(std::size_t i) const { return folder_ / ("node" + std::to_string(i)); }
  std::filesystem::path blobs() const;

 private:
  const bool postgres_;
  std::unique_ptr<PostgresServer> database_;
  std::filesystem::path folder_;
  std::vector<std::string> more_;
  std::vector<std::unique_ptr<Daemon>> nodes_;
};

/// The SHA-256 of the cube, which the server has afterwards; tried until it answers.
std::string upload_cube(int port);
nlohmann::json ask_job(int port, const std::string& id);
/// A job that succeeded has its artefacts, each with the hash that it is named by, and its story ends once.
void expect_sound(int port, const nlohmann::json& job, Breaches&);

struct Kills {
  bool postgres = false;
  int cycles = 30;
};
/// Kills server, worker, or both while jobs come in; looks afterwards that none is lost, doubled, wrong or stuck.
void run_kills(const Kills&, Breaches&);

struct Stale {
  int rounds = 3;
};
/// Stops a server beyond its lease and lets it go on: nothing of what it then writes may count.
void run_stale(const Stale&, Breaches&);

struct Crowd {
  bool postgres = false;
  int clients = 200, slow = 500, uploads = 16;
};
/// So many clients at once, in rounds, spread over the servers of the fleet, beside connections that never end their
/// head and uploads that take their time.
void run_crowd(const Crowd&, Breaches&);

struct Steady {
  int seconds = 20;
};
/// Jobs without a pause; memory and descriptors of the server meanwhile.
void run_steady(const Steady&, Breaches&);

struct Split {
  std::string model;    // a GLB file; "pit": that of the tests
  int samples = 65536;  // of a point
  double share_s = 10;  // --share-s of the servers; 10 is theirs
};
/// One bake of the model by a worker with four threads, and by four workers with one: the same bytes, and processor
/// time of all processes.
void run_split(const Split&, Breaches&);

}  // namespace kiln::testing
