#pragma once
// What stands between a JSON text and tinygltf: a strict check of the tree, and what tinygltf is not given.

#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <span>
#include <string>
#include <vector>

#include "core/artifact/findings.h"
#include "core/artifact/gltf_document.h"

namespace kiln::gltf {

/// Walks the table of gltf_schema.h. Members that it does not list are taken out; whole numbers written as 3.0 become
/// integers. Fails with json_type, property_missing, unknown_enum, index_out_of_range, number_out_of_range, and with
/// too_many_objects where tinygltf's form of the tree would take more than 256 MiB.
void check_tree(nlohmann::json& root, Findings&);

/// A member that tinygltf has no form for stands in an extension of this name, which no file can bring along.
inline constexpr const char* kSetAside = "KILN_set_aside";

struct PreparedTree {
  std::string text;  // for tinygltf: no file, no bytes, nothing that it refuses or loses
  std::vector<Buffer> buffers;
  std::vector<ImageSource> images;
  RadianceDeclaration radiance;
};

/// Reads text that has passed scan_json. Fails as check_tree and with unsupported_version, asset_version_missing,
/// unsupported_extension and image_source. Warns of extensions that have no effect.
PreparedTree prepare_tree(std::span<const std::uint8_t> json, Findings&);

/// Sorts extensions into known, ignored (warning) and impossible (fault).
void check_extensions(const std::vector<std::string>& used, const std::vector<std::string>& required, Findings&);

}  // namespace kiln::gltf
