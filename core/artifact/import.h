#pragma once
// Untrusted bytes become a valid Scene once, here.

#include <cstdint>
#include <functional>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "core/base/file_bytes.h"
#include "core/base/result.h"
#include "core/lightfield/light_field.h"
#include "core/scene/environment.h"
#include "core/scene/scene.h"

namespace kiln {

using Bytes = std::vector<std::uint8_t>;

/// The files of one upload. The main file may name others by relative URI; only names in `resources` are ever read.
struct SceneFiles {
  std::string name;                        // of the main file; for error places only
  FileBytes main;                          // .glb, .gltf or .ply, told apart by content
  std::map<std::string, Bytes> resources;  // by URI as written in the glTF after percent-decoding
};

struct ImportLimits {
  std::uint64_t max_json_bytes = 16u << 20;
  int max_json_depth = 64;
  std::uint64_t max_objects = 1'000'000;  // of each glTF array
  std::uint64_t max_image_pixels = 64u << 20;
  std::uint64_t max_total_pixels = 256u << 20;
  std::uint64_t max_triangles = 200'000'000;  // after instancing
  std::uint64_t max_memory_bytes = 4096ull << 20;
};

/// Reads glTF 2.0, GLB or PLY. Every index, range and number is checked before use.
Result<Scene> import_scene(const SceneFiles&, const ImportLimits& = {});

/// A scene and the r-RFs of its mesh's vertices, where the file carries radiance functions (carried.md).
struct LitScene {
  Scene scene;
  LightField field;
};
Result<LitScene> import_lit_scene(const SceneFiles&, const ImportLimits& = {});

/// Reads Radiance .hdr or scanline .exr (RGB, not deep, not multi-part), equirectangular.
Result<Environment> import_environment(std::span<const std::uint8_t> file, const std::string& name);

/// Reads a glTF and the files it names from disk, next to it and below only.
Result<SceneFiles> read_scene_files(const std::string& path);

}  // namespace kiln
