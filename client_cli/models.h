#pragma once
// Scenes and artefacts from disk.

#include <span>
#include <string>

#include "client_cli/failure.h"
#include "core/artifact/baked_scene.h"
#include "core/artifact/import.h"
#include "core/grid/grid.h"

namespace kiln {

/// What a file is, told by its content.
enum class FileKind { artefact, grid, scene, text };
FileKind kind_of(std::span<const std::uint8_t> bytes);

/// The JSON of a GLB or glTF, empty when there is none.
std::string_view gltf_json(std::span<const std::uint8_t> bytes);

/// The files of a scene for import or upload.
Outcome<SceneFiles> load_files(const std::string& path);
Outcome<Scene> load_scene(const std::string& path);
/// With the radiance functions that it carries.
Outcome<LitScene> load_lit_scene(const std::string& path);
/// Fails  not_an_artefact when the file carries no KILN_radiance_transfer
Outcome<BakedScene> load_artefact(const std::string& path);
Outcome<Grid> load_grid(const std::string& path);

}  // namespace kiln
