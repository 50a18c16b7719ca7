#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "core/artifact/gltf_container.h"
#include "core/artifact/import.h"
#include "core/artifact/json_scan.h"
#include "core/artifact/uri.h"

namespace kiln {
namespace {

namespace fs = std::filesystem;

Result<Bytes> read_file(const fs::path& path, const std::string& name) {
  std::error_code error;
  if (!fs::is_regular_file(path, error)) return fault("file_not_found", "There is no such file.", name);
  std::ifstream in(path, std::ios::binary);
  Bytes bytes(fs::file_size(path, error));
  if (error || !in.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()))) {
    return fault("file_unreadable", "The file cannot be read.", name);
  }
  return bytes;
}

/// The JSON text of the main file, if it has one that is sound.
std::span<const std::uint8_t> json_of(const SceneFiles& files) {
  Findings findings(files.name);
  std::span<const std::uint8_t> json;
  if (looks_like_glb(files.main)) {
    json = open_glb(files.main, findings).json;
  } else if (looks_like_json(files.main)) {
    json = open_gltf(files.main, findings).json;
  }
  if (!json.empty() && !findings.failed()) scan_json(json, {}, findings);
  return findings.failed() ? std::span<const std::uint8_t>{} : json;
}

/// The decoded relative URIs of buffers and images.
std::vector<std::string> named_files(std::span<const std::uint8_t> text) {
  std::vector<std::string> out;
  const auto json = nlohmann::json::parse(text.begin(), text.end(), nullptr, false);
  for (const char* array : {"buffers", "images"}) {
    if (!json.is_object() || !json.contains(array) || !json[array].is_array()) continue;
    for (const auto& element : json[array]) {
      if (!element.is_object() || !element.contains("uri") || !element["uri"].is_string()) continue;
      const auto uri = element["uri"].get<std::string>();
      const auto path = is_data_uri(uri) ? std::nullopt : percent_decode(uri);
      if (path && is_plain_relative_path(*path)) out.push_back(*path);
    }
  }
  return out;
}

/// Whether `path`, links followed, lies below `folder`.
bool is_below(const fs::path& path, const fs::path& folder) {
  std::error_code error;
  const fs::path inner = fs::canonical(path, error), outer = error ? fs::path{} : fs::canonical(folder, error);
  if (error) return false;
  const auto [at, unused] = std::mismatch(outer.begin(), outer.end(), inner.begin(), inner.end());
  return at == outer.end();
}

}  // namespace

Result<SceneFiles> read_scene_files(const std::string& path) {
  const fs::path main(path);
  SceneFiles files;
  files.name = main.filename().string();
  KILN_TRY(bytes, FileBytes::map(path, files.name));
  files.main = std::move(bytes);
  const fs::path folder = main.has_parent_path() ? main.parent_path() : fs::path(".");
  for (const std::string& name : named_files(json_of(files))) {
    // Absent files are the importer's to name, with their place in the glTF.
    if (!is_below(folder / name, folder)) continue;
    KILN_TRY(resource, read_file(folder / name, files.name));
    files.resources[name] = std::move(resource);
  }
  return files;
}

}  // namespace kiln
