#pragma once
// The pieces of parse_document, one for each kind of glTF object.

#include "core/artifact/gltf_document.h"
#include "core/artifact/json_fields.h"

namespace kiln::gltf {

/// How many of each kind the root declares: what indices are checked against.
struct Sizes {
  std::size_t buffers = 0, views = 0, accessors = 0, meshes = 0, nodes = 0, images = 0, samplers = 0, textures = 0,
              materials = 0, lights = 0, skins = 0;
};

/// Sorts the extensions of the root into known, ignored (warning) and impossible (fault).
void check_extensions(const Fields& root, Document&);

Buffer parse_buffer(const Fields&);
BufferView parse_view(const Fields&, const Sizes&);
Accessor parse_accessor(const Fields&, const Sizes&);
Mesh parse_mesh(const Fields&, const Sizes&);
Node parse_node(const Fields&, const Sizes&);
ImageSource parse_image(const Fields&, const Sizes&);
Light parse_light(const Fields&);
std::vector<Texture> parse_textures(const Fields& root, const Sizes&);
Material parse_material(const Fields&, const Sizes&);

/// A number that a float holds. Fails with number_out_of_range.
float real(const Fields&, const char* key, double absent);

}  // namespace kiln::gltf
