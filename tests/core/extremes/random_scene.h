#pragma once
// Small scenes that nobody would build: what importer, tracer and transport must survive.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/artifact/import.h"
#include "core/base/vec.h"

namespace kiln::test {

/// One primitive at a node of its own.
struct RandomPart {
  std::string kind;                            // "box", "needles", ...
  std::vector<float> position, normal, color;  // normal and color may be empty
  std::vector<std::uint32_t> index;
  std::string material;            // JSON object
  std::vector<std::string> nodes;  // members of its nodes, outermost first
};

struct RandomLight {
  std::string type, rest;           // rest: further JSON members
  double intensity = 1, range = 0;  // range 0: infinite
  std::string node;
};

/// Where the whole scene stands: x -> translation + scale * rotation(x). Lights stay as bright as seen from the scene.
struct Placement {
  double scale = 1;
  Vec3d translation{};
  Vec4<double> rotation{0, 0, 0, 1};  // unit quaternion
};

struct RandomScene {
  std::vector<RandomPart> parts;  // 1 to 200 triangles all told
  std::vector<RandomLight> lights;
  Placement placement;  // of the seed's own choice: 1e-6 to 1e9 in size, up to 1e7 sizes from the origin
};

struct RandomChoices {
  bool lamps = true;          // emitters of 1e-8 to 1e8, and punctual lights
  bool strange_color = true;  // vertex colours outside [0, 1]
};

/// Boxes (open, closed, inside out), sheets, needles, coplanar overlaps, triangle soup, spheres, T-junctions, fans on
/// one edge; isolated vertices, degenerate and repeated triangles; normals missing, zero, not unit or contradicting;
/// odd node scales. A pure function of the seed.
RandomScene random_scene(std::uint64_t seed, const RandomChoices& = {});

Bytes to_glb(const RandomScene&, const Placement&);
inline Bytes to_glb(const RandomScene& scene) { return to_glb(scene, scene.placement); }

/// A uniformly random turn as a unit quaternion, and what it does to a vector.
Vec4<double> random_turn(std::uint64_t seed);
Vec3d turned(const Vec4<double>& q, const Vec3d& v);

/// The seed's scene behind the importer; nothing, without a word, when no triangle of it has an area, and with a
/// failure of the test when the importer refuses it for another reason.
std::optional<Scene> imported(const RandomScene&, const Placement&);
inline std::optional<Scene> imported(const RandomScene& scene) { return imported(scene, scene.placement); }

}  // namespace kiln::test
