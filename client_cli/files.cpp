#include "client_cli/files.h"

#include <unistd.h>

#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <iterator>

namespace kiln {
namespace {

namespace fs = std::filesystem;

Outcome<void> write_to_stdout(std::span<const std::uint8_t> bytes) {
  const bool good = std::fwrite(bytes.data(), 1, bytes.size(), stdout) == bytes.size() && std::fflush(stdout) == 0;
  if (!good) return fail(ExitCode::error, "unwritable_file", "standard output takes no more");
  return {};
}

std::vector<std::uint8_t> read_all(std::istream& in) {
  return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

}  // namespace

Outcome<std::vector<std::uint8_t>> read_file(const std::string& path) {
  if (path == "-") return read_all(std::cin);
  std::error_code error;
  if (!fs::exists(path, error)) return fail(ExitCode::not_found, "not_found", "there is no such file", path);
  if (fs::is_directory(path, error)) return fail(ExitCode::error, "unreadable_file", "is a folder, not a file", path);
  std::ifstream in(path, std::ios::binary);
  if (!in) return fail(ExitCode::error, "unreadable_file", "cannot be opened for reading", path);
  if (!fs::is_regular_file(path, error)) return read_all(in);  // a pipe has no size
  const std::uintmax_t size = fs::file_size(path, error);
  if (error) return fail(ExitCode::error, "unreadable_file", "cannot be read", path);
  std::vector<std::uint8_t> bytes(static_cast<std::size_t>(size));
  in.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  if (static_cast<std::size_t>(in.gcount()) != bytes.size())
    return fail(ExitCode::error, "unreadable_file", "ended before its size", path);
  return bytes;
}

Outcome<std::string> read_text(const std::string& path) {
  KILN_TRY(bytes, read_file(path));
  return std::string(bytes.begin(), bytes.end());
}

Outcome<void> write_file(const std::string& path, std::span<const std::uint8_t> bytes) {
  if (path.empty() || path == "-") return write_to_stdout(bytes);
  std::error_code error;
  if (fs::exists(path, error) && !fs::is_regular_file(path, error)) {  // a device or pipe: no renaming over it
    std::ofstream out(path, std::ios::binary);
    out.write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
    if (!out.flush()) return fail(ExitCode::error, "unwritable_file", "cannot be written", path);
    return {};
  }
  const std::string part = path + ".part" + std::to_string(getpid());
  std::ofstream out(part, std::ios::binary);
  out.write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  out.close();
  if (out) fs::rename(part, path, error);
  if (out && !error) return {};
  fs::remove(part, error);
  return fail(ExitCode::error, "unwritable_file", "cannot be written", path);
}

Outcome<void> write_text(const std::string& path, std::string_view text) {
  return write_file(path, {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()});
}

Outcome<void> make_folder(const std::string& path) {
  std::error_code error;
  fs::create_directories(path, error);
  if (error || !fs::is_directory(path))
    return fail(ExitCode::error, "unwritable_file", "cannot be made a folder", path);
  return {};
}

Outcome<void> check_folder(const std::string& path) {
  std::error_code error;
  fs::path place = fs::absolute(path, error);
  while (!error && !fs::exists(place, error) && place.has_relative_path()) place = place.parent_path();
  if (!error && fs::is_directory(place, error) && access(place.c_str(), W_OK | X_OK) == 0) return {};
  return fail(ExitCode::error, "unwritable_file", "cannot be made a folder", path);
}

bool file_exists(const std::string& path) {
  std::error_code error;
  return fs::exists(path, error);
}

std::string base_name(const std::string& path) { return fs::path(path).filename().string(); }

}  // namespace kiln
