#include "server/work/work_folder.h"

#include <cerrno>
#include <fstream>
#include <system_error>
#include <utility>

namespace kiln {
namespace {

namespace fs = std::filesystem;

tl::unexpected<Fault> folder_fault(const std::error_code& error) {
  if (error == std::errc::no_space_on_device) return fault("disk_full", "the disk of the server is full");
  return fault("io_failed", "the server could not make a folder for a worker");
}

Result<void> place_input(const BlobStore& blobs, const NamedBlob& file, const fs::path& target) {
  auto placed = blobs.place(file.sha256, target);
  if (!placed && placed.error().code == "not_found") {
    return fault("asset_lost", "the store lost the bytes of this asset: upload it again", file.sha256);
  }
  return placed;
}

}  // namespace

Result<WorkFolder> WorkFolder::make(const fs::path& path, const BlobStore& blobs, const WorkerOrder& order) {
  std::error_code error;
  fs::create_directories(path / "inputs", error);
  if (!error) fs::create_directory(path / "ranges", error);
  WorkFolder folder(path);
  if (!error) fs::create_directory(path / "out", error);
  if (error) return folder_fault(error);
  std::vector<NamedBlob> files{order.inputs.scene};
  files.insert(files.end(), order.inputs.resources.begin(), order.inputs.resources.end());
  if (order.inputs.environment) files.push_back(*order.inputs.environment);
  for (std::size_t place = 0; place < files.size(); ++place) {
    auto placed = place_input(blobs, files[place], path / input_path(place));
    if (!placed) return tl::make_unexpected(placed.error());
  }
  if (!order.journal.empty()) {
    auto placed = place_input(blobs, {"journal", order.journal}, path / "inputs" / "journal");
    if (!placed) return tl::make_unexpected(placed.error());
  }
  std::ofstream out(path / "job.json", std::ios::binary);
  out << order_json(order);
  out.close();
  if (!out) return fault("disk_full", "the server could not write a worker's order");
  return folder;
}

WorkFolder::WorkFolder(WorkFolder&& other) noexcept : path_(std::exchange(other.path_, {})) {}

WorkFolder::~WorkFolder() {
  std::error_code none;
  if (!path_.empty()) fs::remove_all(path_, none);
}

void remove_work_folders(const fs::path& work) {
  std::error_code none;
  for (const auto& entry : fs::directory_iterator(work, none)) fs::remove_all(entry.path(), none);
}

}  // namespace kiln
