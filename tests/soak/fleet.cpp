#include <fstream>
#include <thread>

#include "core/base/sha256.h"
#include "tests/soak/soak.h"

namespace kiln::testing {

using namespace std::chrono_literals;
using nlohmann::json;

double seconds_since(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }

std::string sha256_of(const std::string& text) {
  return sha256_hex({reinterpret_cast<const std::uint8_t*>(text.data()), text.size()});
}

void Breaches::expect(bool held, const std::string& sentence) {
  if (held) return;
  const std::lock_guard lock(mutex_);
  if (++count_ <= 20) std::printf("broken: %s\n", sentence.c_str());
}

Fleet::Fleet(bool postgres, int nodes, std::vector<std::string> more)
    : postgres_(postgres), nodes_(static_cast<std::size_t>(nodes)) {
  std::string name = (std::filesystem::temp_directory_path() / "kiln_soak.XXXXXX").string();
  folder_ = ::mkdtemp(name.data());
  more_ = {"--threads",           "1",   "--lease-s",           std::to_string(kLeaseS),
           "--first-retry-s",     "0.1", "--soft-free-percent", "0",
           "--hard-free-percent", "0"};
  more_.insert(more_.end(), more.begin(), more.end());
  if (postgres_) {
    database_ = std::make_unique<PostgresServer>();
    const std::vector<std::string> shared{"--store", database_->url(), "--blobs",
                                          "dir:" + (folder_ / "shared").string()};
    more_.insert(more_.end(), shared.begin(), shared.end());
  }
  start();
}

Fleet::~Fleet() {
  nodes_.clear();
  std::filesystem::remove_all(folder_);
}

void Fleet::start() {
  for (std::size_t i = 0; i < nodes_.size(); ++i) {
    if (nodes_[i] && nodes_[i]->pid() > 0) continue;
    nodes_[i] = std::make_unique<Daemon>(KILN_DAEMON, data(i), more_);
  }
}

std::filesystem::path Fleet::blobs() const { return postgres_ ? folder_ / "shared" : data(0); }

std::string upload_cube(int port) {
  std::string scene = sha256_of(cube_glb());
  for (int i = 0; i < 50; ++i) {
    const int status = http_put(port, "/v1/assets/" + scene, cube_glb()).status;
    if (status == 200 || status == 201) return scene;
    std::this_thread::sleep_for(100ms);
  }
  throw std::runtime_error("the server does not take the scene");
}

json ask_job(int port, const std::string& id) {
  const Answer answer = http_get(port, "/v1/jobs/" + id);
  return answer.status == 200 ? json::parse(answer.body) : json{{"status", "none: " + std::to_string(answer.status)}};
}

void expect_sound(int port, const json& job, Breaches& breaches) {
  const std::string id = job.value("id", "?");
  breaches.expect(job["status"] == "succeeded", "job " + id + " ended as " + job.dump());
  if (job["status"] != "succeeded") return;
  breaches.expect(!job["artifacts"].empty(), "job " + id + " succeeded without artefacts");
  for (const json& artifact : job["artifacts"]) {
    const Answer file = http_get(port, artifact["url"]);
    breaches.expect(sha256_of(file.body) == artifact["sha256"], "wrong bytes: " + artifact.dump());
  }
  const std::string story = http_get(port, "/v1/jobs/" + id + "/events").body;
  const auto first = story.find("event: done");
  breaches.expect(first != std::string::npos && story.find("event: done", first + 1) == std::string::npos,
                  "job " + id + " did not end once");
}

}  // namespace kiln::testing
