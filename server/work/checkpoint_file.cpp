#include "server/work/checkpoint_file.h"

#include <fstream>
#include <sstream>
#include <system_error>

namespace kiln {

namespace fs = std::filesystem;

std::string CheckpointFile::load() const {
  std::ifstream in(path_, std::ios::binary);
  std::stringstream text;
  text << in.rdbuf();
  return in ? text.str() : std::string();
}

void CheckpointFile::save(const std::string& text) const {
  fs::path beside = path_;
  beside += ".new";  // a reader finds the old one or the new one, never half of one
  std::ofstream out(beside, std::ios::binary | std::ios::trunc);
  out << text;
  out.close();
  std::error_code none;
  if (out) {
    fs::rename(beside, path_, none);
  } else {
    fs::remove(beside, none);
  }
}

void CheckpointFile::remove() const {
  std::error_code none;
  fs::remove(path_, none);
}

void remove_stale_checkpoints(const fs::path& folder, JobStore& store) {
  std::error_code none;
  for (const auto& entry : fs::directory_iterator(folder, none)) {
    const auto job = store.get(entry.path().filename().string());
    if (!job || is_terminal(job->state)) fs::remove(entry.path(), none);
  }
}

}  // namespace kiln
