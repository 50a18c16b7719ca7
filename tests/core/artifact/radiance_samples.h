#pragma once
// glTF files that carry radiance functions, for the tests of their reader.

#include <functional>
#include <string>
#include <vector>

#include "core/lightfield/radiance_function.h"
#include "tests/core/artifact/gltf_samples.h"

namespace kiln::test {

/// One primitive under KILN_radiance_functions; each `function` has the basis and degree of the first.
struct RadianceSample {
  std::vector<float> position, normal, tangent;
  std::vector<std::uint32_t> indices;
  std::vector<RadianceFunction> function;  // of each vertex, as it goes into the file
  bool reflected = false;

  /// The accessors of every attribute, and the primitive's members that name them.
  std::string primitive(Sample&) const;
  std::string declaration() const;
  /// `node` is more members of its node, as in one_node().
  Bytes glb(const std::string& node = {}) const;
};

/// Three vertices in the plane z = 0 with other normals and random functions each, about those normals.
RadianceSample radiance_triangle(RadianceBasis, int degree, bool reflected);

/// n x n squares of a bumpy sheet with smooth functions: a highlight that moves, on a ground whose colour varies.
RadianceSample radiance_sheet(std::uint32_t n, int degree);

}  // namespace kiln::test
