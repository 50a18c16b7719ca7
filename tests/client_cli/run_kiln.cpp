#include "tests/client_cli/run_kiln.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <stdexcept>
#include <thread>

namespace kiln {
namespace {

namespace fs = std::filesystem;

std::string read_all(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

void write_all(const std::string& path, const std::string& text) { std::ofstream(path, std::ios::binary) << text; }

void redirect(const std::string& path, int flags, int descriptor) {
  const int file = open(path.c_str(), flags, 0600);
  dup2(file, descriptor);
  close(file);
}

[[noreturn]] void become(const std::vector<std::string>& words, const std::map<std::string, std::string>& environment,
                         const std::string& folder) {
  redirect(folder + "/in", O_RDONLY, STDIN_FILENO);
  redirect(folder + "/out", O_WRONLY | O_CREAT | O_TRUNC, STDOUT_FILENO);
  redirect(folder + "/err", O_WRONLY | O_CREAT | O_TRUNC, STDERR_FILENO);
  for (const char* name : {"KILN_SERVER", "KILN_TOKEN"}) unsetenv(name);
  for (const auto& [name, value] : environment) {
    if (value.empty()) {
      unsetenv(name.c_str());
    } else {
      setenv(name.c_str(), value.c_str(), 1);
    }
  }
  std::vector<char*> arguments{const_cast<char*>(KILN_PROGRAM)};
  for (const std::string& word : words) arguments.push_back(const_cast<char*>(word.c_str()));
  arguments.push_back(nullptr);
  execv(KILN_PROGRAM, arguments.data());
  _exit(127);
}

pid_t start(const std::vector<std::string>& words, const std::map<std::string, std::string>& environment,
            const std::string& folder) {
  const pid_t child = fork();
  if (child == 0) become(words, environment, folder);
  if (child < 0) throw std::runtime_error("fork failed");
  return child;
}

Ran finish(pid_t child, const std::string& folder) {
  int status = 0;
  waitpid(child, &status, 0);
  return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, read_all(folder + "/out"), read_all(folder + "/err")};
}

std::string base64(const std::string& bytes) {
  static constexpr char kDigits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string out;
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    unsigned group = 0;
    for (std::size_t k = 0; k < 3; ++k)
      group = group << 8 | (i + k < bytes.size() ? static_cast<unsigned char>(bytes[i + k]) : 0U);
    for (std::size_t k = 0; k < 4; ++k)
      out += i + k <= bytes.size() || k < 2 ? kDigits[group >> (18 - 6 * k) & 63] : '=';
  }
  return out;
}

template <class T>
void append(std::string& bytes, T value) {
  char raw[sizeof(T)];
  std::memcpy(raw, &value, sizeof(T));
  bytes.append(raw, sizeof(T));
}

}  // namespace

Folder::Folder() {
  std::string name = (fs::temp_directory_path() / "kiln-cli-XXXXXX").string();
  if (!mkdtemp(name.data())) throw std::runtime_error("mkdtemp failed");
  path_ = name;
}
Folder::~Folder() {
  std::error_code error;
  fs::remove_all(path_, error);
}
std::string Folder::path(const std::string& name) const { return path_ + "/" + name; }
std::string Folder::read(const std::string& name) const { return read_all(path(name)); }
std::string Folder::write(const std::string& name, const std::string& text) const {
  write_all(path(name), text);
  return path(name);
}

Ran run_kiln(const std::vector<std::string>& words, const std::map<std::string, std::string>& environment,
             const std::string& input) {
  const Folder folder;
  folder.write("in", input);
  return finish(start(words, environment, folder.path("")), folder.path(""));
}

Ran run_until(const std::vector<std::string>& words, const std::string& until) {
  const Folder folder;
  folder.write("in", "");
  const pid_t child = start(words, {}, folder.path(""));
  for (int i = 0; i < 3000 && folder.read("err").find(until) == std::string::npos; ++i) {
    if (waitpid(child, nullptr, WNOHANG) == child) return {-1, folder.read("out"), folder.read("err")};
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  kill(child, SIGINT);
  return finish(child, folder.path(""));
}

std::string plane_gltf(float half, int n, float y) {
  std::string positions, normals, indices;
  const int row = n + 1;
  for (int j = 0; j < row; ++j) {
    for (int i = 0; i < row; ++i) {
      const float x = half * (2 * static_cast<float>(i) / static_cast<float>(n) - 1);
      const float z = half * (2 * static_cast<float>(j) / static_cast<float>(n) - 1);
      for (const float c : {x, y, z}) append(positions, c);
      for (const float c : {0.0F, 1.0F, 0.0F}) append(normals, c);
    }
  }
  for (int j = 0; j < n; ++j) {
    for (int i = 0; i < n; ++i) {
      const int a = j * row + i;
      for (const int v : {a, a + row, a + 1, a + 1, a + row, a + row + 1})
        append(indices, static_cast<std::uint16_t>(v));
    }
  }
  const std::string bytes = positions + normals + indices;
  const auto text = [](auto value) { return std::to_string(value); };
  const std::string count = text(row * row), plane = text(positions.size()), h = text(half), h_y = text(y);
  return R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],)"
         R"("meshes":[{"primitives":[{"attributes":{"POSITION":0,"NORMAL":1},"indices":2}]}],)"
         R"("accessors":[{"bufferView":0,"componentType":5126,"count":)" +
         count + R"(,"type":"VEC3","min":[-)" + h + "," + h_y + ",-" + h + R"(],"max":[)" + h + "," + h_y + "," + h +
         R"(]},{"bufferView":1,"componentType":5126,"count":)" + count +
         R"(,"type":"VEC3"},{"bufferView":2,"componentType":5123,"count":)" + text(6 * n * n) +
         R"(,"type":"SCALAR"}],"bufferViews":[{"buffer":0,"byteOffset":0,"byteLength":)" + plane +
         R"(},{"buffer":0,"byteOffset":)" + plane + R"(,"byteLength":)" + plane + R"(},{"buffer":0,"byteOffset":)" +
         text(2 * positions.size()) + R"(,"byteLength":)" + text(indices.size()) + R"(}],"buffers":[{"byteLength":)" +
         text(bytes.size()) + R"(,"uri":"data:application/octet-stream;base64,)" + base64(bytes) + R"("}]})";
}

}  // namespace kiln
