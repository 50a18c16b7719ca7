#include "client_cli/models.h"

#include <cstring>

#include "client_cli/files.h"
#include "core/artifact/grid_exr.h"

namespace kiln {
namespace {

constexpr std::size_t kGlbHeader = 20;  // magic, version, length; chunk length, chunk type

std::uint32_t little_endian(std::span<const std::uint8_t> bytes, std::size_t at) {
  return std::uint32_t{bytes[at]} | std::uint32_t{bytes[at + 1]} << 8 | std::uint32_t{bytes[at + 2]} << 16 |
         std::uint32_t{bytes[at + 3]} << 24;
}

bool starts_with(std::span<const std::uint8_t> bytes, std::string_view start) {
  return bytes.size() >= start.size() && std::memcmp(bytes.data(), start.data(), start.size()) == 0;
}

std::string_view text_of(std::span<const std::uint8_t> bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

}  // namespace

std::string_view gltf_json(std::span<const std::uint8_t> bytes) {
  if (!starts_with(bytes, "glTF")) {
    const auto first = text_of(bytes).find_first_not_of(" \t\r\n\xef\xbb\xbf");
    return first != std::string_view::npos && bytes[first] == '{' ? text_of(bytes) : std::string_view{};
  }
  if (bytes.size() < kGlbHeader) return {};
  const std::size_t length = little_endian(bytes, 12);
  return length <= bytes.size() - kGlbHeader ? text_of(bytes.subspan(kGlbHeader, length)) : std::string_view{};
}

FileKind kind_of(std::span<const std::uint8_t> bytes) {
  if (gltf_json(bytes).find("\"KILN_radiance_transfer\"") != std::string_view::npos) return FileKind::artefact;
  if (looks_like_grid(bytes)) return FileKind::grid;
  const bool scene = starts_with(bytes, "glTF") || starts_with(bytes, "ply") || !gltf_json(bytes).empty();
  return scene ? FileKind::scene : FileKind::text;
}

Outcome<SceneFiles> load_files(const std::string& path) {
  if (!file_exists(path)) return fail(ExitCode::not_found, "not_found", "there is no such file", path);
  return or_failure(read_scene_files(path));
}

Outcome<Scene> load_scene(const std::string& path) {
  KILN_TRY(files, load_files(path));
  return or_failure(import_scene(files));
}

Outcome<LitScene> load_lit_scene(const std::string& path) {
  KILN_TRY(files, load_files(path));
  return or_failure(import_lit_scene(files));
}

Outcome<BakedScene> load_artefact(const std::string& path) {
  KILN_TRY(bytes, read_file(path));
  if (kind_of(bytes) != FileKind::artefact) {
    return fail(ExitCode::rejected, "not_an_artefact",
                "carries no KILN_radiance_transfer: it is not the result of a bake", path);
  }
  Result<BakedScene> baked = read_baked_glb(bytes);
  if (!baked && baked.error().where.empty()) baked.error().where = base_name(path);
  if (baked) decode_pixels(baked->scene);
  return or_failure(std::move(baked));
}

Outcome<Grid> load_grid(const std::string& path) {
  KILN_TRY(bytes, read_file(path));
  return or_failure(read_grid_exr(bytes, base_name(path)));
}

}  // namespace kiln
