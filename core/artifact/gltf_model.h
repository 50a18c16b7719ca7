#pragma once
// tinygltf's model becomes a gltf::Document. For gltf_load.cpp and gltf_model*.cpp alone, which include tinygltf.

#include <map>
#include <string>

#include "core/artifact/findings.h"
#include "core/artifact/gltf_document.h"

namespace tinygltf {
class Model;
class Value;
}  // namespace tinygltf

namespace kiln::gltf {

/// Views, accessors, meshes, nodes and the roots of the default scene; the document has its buffers already.
/// check_tree has seen every member, so what is left to refuse are values that make no sense together.
void convert_geometry(const tinygltf::Model&, Document&, Findings&);

/// Textures, materials and lights.
void convert_materials(const tinygltf::Model&, Document&, Findings&);

// Members of extensions, which tinygltf holds as a tree of values. Absent ones give the default.

using Extensions = std::map<std::string, tinygltf::Value>;

/// Nothing if there is no such extension.
const tinygltf::Value* find_extension(const Extensions&, const char* name);
const tinygltf::Value* find_member(const tinygltf::Value& object, const char* name);
double number_of(const tinygltf::Value& object, const char* name, double absent);
int index_of(const tinygltf::Value& object, const char* name);  // -1 if absent
std::string text_of(const tinygltf::Value& object, const char* name);
std::map<std::string, int> index_map_of(const tinygltf::Value& object, const char* name);

}  // namespace kiln::gltf
