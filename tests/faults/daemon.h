#pragma once
// A real kilnd under test: started, killed, asked over HTTP.

#include <sys/types.h>

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace kiln::testing {

/// Kills and reaps in the destructor.
class Daemon {
 public:
  /// Starts `kilnd --data DATA --port 0 ...` and waits for its "listening" line (or, of a `worker`, its first). Throws
  /// std::runtime_error when it ends instead. The program's own log goes to DATA.log.
  Daemon(const std::string& program, const std::filesystem::path& data, const std::vector<std::string>& arguments);
  ~Daemon();
  Daemon(const Daemon&) = delete;
  Daemon& operator=(const Daemon&) = delete;

  int port() const { return port_; }  // 0 of a `worker`
  pid_t pid() const { return pid_; }
  void kill_hard();                              // SIGKILL, reaped
  int terminate();                               // SIGTERM; the wait status
  std::map<pid_t, std::string> workers() const;  // by process id, the job's id
  double processor_s() const;                    // its own, and that of the workers that it has reaped

 private:
  int wait_end();
  pid_t pid_ = -1;
  int port_ = 0;
};

struct Answer {
  int status = 0;  // 0: no answer
  std::string body;
};

Answer http_get(int port, const std::string& path);
Answer http_post(int port, const std::string& path, const std::string& json,
                 const std::map<std::string, std::string>& headers = {});
Answer http_put(int port, const std::string& path, const std::string& bytes);

/// A triangle-cube GLB: 12 triangles, no normals, so that the smallest true bake has all its stages.
std::string cube_glb();

/// A cube without its top, seen from within: light comes in and goes from side to side. Each side is so many squares
/// wide and high.
std::string pit_glb(int squares);

/// A job document for the cube: as small as a bake gets. `seed` makes its result its own.
std::string cube_job(const std::string& scene_sha256, int seed);

}  // namespace kiln::testing
