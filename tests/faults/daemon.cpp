#include "tests/faults/daemon.h"

#include <fcntl.h>
#include <httplib.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cstring>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>
#include <stdexcept>
#include <thread>

extern char** environ;

namespace kiln::testing {
namespace {

using namespace std::chrono_literals;

constexpr const char* kListening = "kilnd listening on http://127.0.0.1:";
constexpr const char* kWorking = "kilnd works for its fleet";

pid_t spawn(const std::string& program, std::vector<std::string> arguments, const std::string& log) {
  posix_spawn_file_actions_t files;
  posix_spawn_file_actions_init(&files);
  posix_spawn_file_actions_addopen(&files, 0, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_addopen(&files, 2, log.c_str(), O_WRONLY | O_CREAT | O_APPEND, 0600);
  posix_spawn_file_actions_adddup2(&files, 2, 1);
  arguments.insert(arguments.begin(), program);
  std::vector<char*> pointers;
  for (std::string& argument : arguments) pointers.push_back(argument.data());
  pointers.push_back(nullptr);
  pid_t pid = -1;
  const int failed = ::posix_spawn(&pid, program.c_str(), &files, nullptr, pointers.data(), environ);
  posix_spawn_file_actions_destroy(&files);
  if (failed != 0) throw std::runtime_error("cannot start " + program);
  return pid;
}

std::string text_of(const std::filesystem::path& file) {
  std::ifstream in(file);
  std::stringstream text;
  text << in.rdbuf();
  return text.str();
}

/// "kilnd\0bake-worker\0.../work/<job>.<token>\0" -> job
std::optional<std::string> job_of(pid_t pid) {
  const std::string line = text_of("/proc/" + std::to_string(pid) + "/cmdline");
  const auto folder = line.rfind("/work/");
  if (line.find("bake-worker") == std::string::npos || folder == std::string::npos) return std::nullopt;
  return line.substr(folder + 6, 26);
}

pid_t parent_of(pid_t pid) {
  const std::string stat = text_of("/proc/" + std::to_string(pid) + "/stat");
  const auto end = stat.rfind(')');
  return end == std::string::npos ? -1 : static_cast<pid_t>(std::atoi(stat.c_str() + end + 4));
}

httplib::Client client(int port) {
  httplib::Client http("127.0.0.1", port);
  http.set_connection_timeout(2s);
  http.set_read_timeout(10s);
  return http;
}

Answer answer_of(const httplib::Result& result) { return result ? Answer{result->status, result->body} : Answer{}; }

}  // namespace

Daemon::Daemon(const std::string& program, const std::filesystem::path& data,
               const std::vector<std::string>& arguments) {
  std::vector<std::string> all{"--data", data, "--port", "0", "--quiet"};
  all.insert(all.end(), arguments.begin(), arguments.end());
  const std::string log = data.string() + ".log";
  std::filesystem::remove(log);
  pid_ = spawn(program, all, log);
  for (int i = 0; i < 3000; ++i) {
    const std::string text = text_of(log);
    if (text.find(kWorking) != std::string::npos) return;
    if (const auto found = text.find(kListening);
        found != std::string::npos && text.find('\n', found) != std::string::npos) {
      port_ = std::atoi(text.c_str() + found + std::strlen(kListening));
      return;
    }
    if (::waitpid(pid_, nullptr, WNOHANG) == pid_) {
      pid_ = -1;
      throw std::runtime_error("kilnd ended: " + text);
    }
    std::this_thread::sleep_for(10ms);
  }
  kill_hard();
  throw std::runtime_error("kilnd does not listen");
}

Daemon::~Daemon() { kill_hard(); }

int Daemon::wait_end() {
  int status = 0;
  while (::waitpid(pid_, &status, 0) < 0 && errno == EINTR) {
  }
  pid_ = -1;
  return status;
}

void Daemon::kill_hard() {
  if (pid_ <= 0) return;
  ::kill(pid_, SIGKILL);
  wait_end();
}

int Daemon::terminate() {
  ::kill(pid_, SIGTERM);
  return wait_end();
}

std::map<pid_t, std::string> Daemon::workers() const {
  std::map<pid_t, std::string> found;
  for (const auto& entry : std::filesystem::directory_iterator("/proc")) {
    const pid_t pid = std::atoi(entry.path().filename().c_str());
    if (pid <= 0 || parent_of(pid) != pid_) continue;
    if (const auto job = job_of(pid)) found[pid] = *job;
  }
  return found;
}

double Daemon::processor_s() const {
  std::ifstream file("/proc/" + std::to_string(pid_) + "/stat");
  std::string text((std::istreambuf_iterator<char>(file)), {});
  std::istringstream fields(text.substr(text.rfind(')') + 2));
  std::string skipped;
  for (int i = 0; i < 11; ++i) fields >> skipped;  // state to cmajflt
  double sum = 0, ticks = 0;
  for (int i = 0; i < 4; ++i) sum += fields >> ticks ? ticks : 0;  // user and system time, its own and the reaped's
  return sum / static_cast<double>(::sysconf(_SC_CLK_TCK));
}

Answer http_get(int port, const std::string& path) { return answer_of(client(port).Get(path)); }

Answer http_post(int port, const std::string& path, const std::string& json,
                 const std::map<std::string, std::string>& headers) {
  return answer_of(client(port).Post(path, httplib::Headers(headers.begin(), headers.end()), json, "application/json"));
}

Answer http_put(int port, const std::string& path, const std::string& bytes) {
  return answer_of(client(port).Put(path, bytes, "application/octet-stream"));
}

namespace {

struct Triangles {
  std::vector<float> position;
  std::vector<std::uint16_t> corner;
};

std::string glb_of(const Triangles& mesh) {
  const std::size_t places = mesh.position.size() * sizeof(float), corners = mesh.corner.size() * sizeof(std::uint16_t);
  std::string bytes((places + corners + 3) / 4 * 4, '\0');
  std::memcpy(bytes.data(), mesh.position.data(), places);
  std::memcpy(bytes.data() + places, mesh.corner.data(), corners);
  const auto text_of = [](std::size_t number) { return std::to_string(number); };
  std::string json =
      R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],)"
      R"("meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":1}]}],"buffers":[{"byteLength":)" +
      text_of(bytes.size()) + R"(}],"bufferViews":[{"buffer":0,"byteLength":)" + text_of(places) +
      R"(},{"buffer":0,"byteOffset":)" + text_of(places) + R"(,"byteLength":)" + text_of(corners) +
      R"(}],"accessors":[{"bufferView":0,"componentType":5126,"type":"VEC3","min":[-1,-1,-1],)"
      R"("max":[1,1,1],"count":)" +
      text_of(mesh.position.size() / 3) + R"(},{"bufferView":1,"componentType":5123,"type":"SCALAR","count":)" +
      text_of(mesh.corner.size()) + "}]}";
  json.resize((json.size() + 3) / 4 * 4, ' ');
  std::string glb;
  const auto word = [&](std::size_t value) {
    const auto number = static_cast<std::uint32_t>(value);
    glb.append(reinterpret_cast<const char*>(&number), 4);
  };
  word(0x46546C67);
  word(2);
  word(12 + 8 + json.size() + 8 + bytes.size());
  word(json.size());
  word(0x4E4F534A);
  glb += json;
  word(bytes.size());
  word(0x004E4942);
  return glb + bytes;
}

}  // namespace

std::string cube_glb() {
  return glb_of(
      {{-1, -1, -1, 1, -1, -1, 1, 1, -1, -1, 1, -1, -1, -1, 1, 1, -1, 1, 1, 1, 1, -1, 1, 1},
       {0, 2, 1, 0, 3, 2, 4, 5, 6, 4, 6, 7, 0, 1, 5, 0, 5, 4, 3, 7, 6, 3, 6, 2, 0, 4, 7, 0, 7, 3, 1, 2, 6, 1, 6, 5}});
}

std::string pit_glb(int squares) {
  Triangles pit;
  const auto wall = [&](const std::array<float, 3>& middle, const std::array<float, 3>& right,
                        const std::array<float, 3>& up) {
    const std::size_t first = pit.position.size() / 3, row = static_cast<std::size_t>(squares) + 1;
    for (int j = 0; j <= squares; ++j) {
      for (int i = 0; i <= squares; ++i) {
        const float u = 2 * static_cast<float>(i) / static_cast<float>(squares) - 1,
                    v = 2 * static_cast<float>(j) / static_cast<float>(squares) - 1;
        for (std::size_t axis = 0; axis < 3; ++axis)
          pit.position.push_back(middle[axis] + u * right[axis] + v * up[axis]);
        const std::size_t a = first + static_cast<std::size_t>(j) * row + static_cast<std::size_t>(i);
        if (i == squares || j == squares) continue;
        for (const std::size_t k : {a, a + 1, a + row + 1, a, a + row + 1, a + row})
          pit.corner.push_back(static_cast<std::uint16_t>(k));
      }
    }
  };
  wall({0, -1, 0}, {0, 0, 1}, {1, 0, 0});
  wall({-1, 0, 0}, {0, 1, 0}, {0, 0, 1});
  wall({1, 0, 0}, {0, 0, 1}, {0, 1, 0});
  wall({0, 0, -1}, {1, 0, 0}, {0, 1, 0});
  wall({0, 0, 1}, {0, 1, 0}, {1, 0, 0});
  return glb_of(pit);
}

std::string cube_job(const std::string& scene_sha256, int seed) {
  return nlohmann::json{{"scene", {{"asset", scene_sha256}}},
                        {"environment", {{"constant", {1, 1, 1}}}},
                        {"steps", {{{"do", "prt"}, {"order", 2}, {"samples", 64}, {"bounces", 0}}}},
                        {"quality", "draft"},
                        {"certificate", false},
                        {"seed", seed},
                        {"label", "cube " + std::to_string(seed)}}
      .dump();
}

}  // namespace kiln::testing
