#pragma once
// Runs the built program as a user would, and keeps what it said.

#include <map>
#include <string>
#include <vector>

namespace kiln {

struct Ran {
  int exit = -1;  // -1: ended by a signal
  std::string out, err;
};

/// Runs the program with these words; `environment` is added to ours, where "" takes a variable away. stdout and stderr
/// are files, so the program sees no terminal. `input` becomes its stdin.
Ran run_kiln(const std::vector<std::string>& words, const std::map<std::string, std::string>& environment = {},
             const std::string& input = {});

/// The same for any program and for a program that is sent SIGINT once its stderr holds `until`.
Ran run_until(const std::vector<std::string>& words, const std::string& until);

/// A folder of the test's own, emptied; removed with the object.
class Folder {
 public:
  Folder();
  ~Folder();
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;
  std::string path(const std::string& name) const;
  std::string write(const std::string& name, const std::string& text) const;
  std::string read(const std::string& name) const;

 private:
  std::string path_;
};

/// A square of side 2 * `half` at height y, facing up, subdivided n x n, as a glTF with its buffer inside.
std::string plane_gltf(float half = 1, int n = 4, float y = 0);

}  // namespace kiln
