#include "core/bake/demo_scene.h"

#include <cmath>
#include <cstring>
#include <nlohmann/json.hpp>
#include <numbers>

namespace kiln {
namespace {

using nlohmann::ordered_json;

/// One glTF primitive in the making.
struct Piece {
  std::string name;
  Vec3f color;
  float emission = 0;
  std::vector<Vec3f> position, normal;
  std::vector<std::uint32_t> indices;
};

/// Adds a parallelogram origin + s * u + t * v of nu x nv squares, facing along u x v.
void add_quads(Piece& piece, const Vec3f& origin, const Vec3f& u, const Vec3f& v, std::array<int, 2> squares) {
  const auto [nu, nv] = squares;
  const auto first = static_cast<std::uint32_t>(piece.position.size());
  const auto row = static_cast<std::uint32_t>(nu + 1);
  const Vec3f normal = normalized(cross(u, v));
  for (int j = 0; j <= nv; ++j) {
    for (int i = 0; i <= nu; ++i) {
      const float s = static_cast<float>(i) / static_cast<float>(nu),
                  t = static_cast<float>(j) / static_cast<float>(nv);
      piece.position.push_back(origin + u * s + v * t);
      piece.normal.push_back(normal);
    }
  }
  for (std::uint32_t j = 0; j < static_cast<std::uint32_t>(nv); ++j) {
    for (std::uint32_t i = 0; i < static_cast<std::uint32_t>(nu); ++i) {
      const std::uint32_t a = first + j * row + i;
      for (const std::uint32_t corner : {a, a + 1, a + row + 1, a, a + row + 1, a + row})
        piece.indices.push_back(corner);
    }
  }
}

/// Adds the faces of a box that stands on its floor: four sides of 1 x `rows` squares and the top.
void add_standing_box(Piece& piece, const Vec3f& low, const Vec3f& high, int rows) {
  const float dx = high.x - low.x, dy = high.y - low.y, dz = high.z - low.z;
  add_quads(piece, {low.x, low.y, high.z}, {dx, 0, 0}, {0, dy, 0}, {1, rows});
  add_quads(piece, {high.x, low.y, low.z}, {-dx, 0, 0}, {0, dy, 0}, {1, rows});
  add_quads(piece, {high.x, low.y, high.z}, {0, 0, -dz}, {0, dy, 0}, {1, rows});
  add_quads(piece, {low.x, low.y, low.z}, {0, 0, dz}, {0, dy, 0}, {1, rows});
  add_quads(piece, {low.x, high.y, high.z}, {dx, 0, 0}, {0, 0, -dz}, {1, 1});
}

/// The (2, 3) torus knot at parameter t.
Vec3f knot_center(float t) {
  const float radius = 0.62F + 0.26F * std::cos(3 * t);
  return {radius * std::cos(2 * t), 0.30F * std::sin(3 * t), radius * std::sin(2 * t)};
}

void add_knot(Piece& piece, const Vec3f& center, std::array<int, 2> segments) {
  const int along = segments[0], around = segments[1];
  constexpr float kTurn = 2 * std::numbers::pi_v<float>;
  for (int i = 0; i < along; ++i) {
    const float t = kTurn * static_cast<float>(i) / static_cast<float>(along);
    const Vec3f here = knot_center(t);
    const Vec3f tangent = normalized(knot_center(t + 1e-3F) - knot_center(t - 1e-3F));
    const Vec3f side = normalized(cross(tangent, here)), up = cross(side, tangent);
    for (int j = 0; j < around; ++j) {
      const float a = kTurn * static_cast<float>(j) / static_cast<float>(around);
      const Vec3f normal = side * std::cos(a) + up * std::sin(a);
      piece.position.push_back(center + here + normal * 0.14F);
      piece.normal.push_back(normal);
    }
  }
  const auto vertex = [&](int i, int j) { return static_cast<std::uint32_t>((i % along) * around + j % around); };
  for (int i = 0; i < along; ++i) {
    for (int j = 0; j < around; ++j) {
      const std::uint32_t a = vertex(i, j), b = vertex(i, j + 1), c = vertex(i + 1, j + 1), d = vertex(i + 1, j);
      for (const std::uint32_t corner : {a, c, b, a, d, c}) piece.indices.push_back(corner);
    }
  }
}

std::vector<Piece> column_scene() {
  Piece floor{.name = "floor", .color = {0.62F, 0.60F, 0.56F}};
  add_quads(floor, {-5, 0, 5}, {10, 0, 0}, {0, 0, -10}, {10, 10});
  Piece column{.name = "column", .color = {0.75F, 0.72F, 0.66F}};
  add_standing_box(column, {-0.5F, 0, -0.5F}, {0.5F, 4, 0.5F}, 5);
  Piece box{.name = "box", .color = {0.70F, 0.25F, 0.18F}};
  add_standing_box(box, {2, 0, 0.5F}, {3.4F, 1.1F, 1.9F}, 1);
  Piece knot{.name = "knot", .color = {0.25F, 0.42F, 0.66F}};
  add_knot(knot, {-2.2F, 0.46F, 1.9F}, {96, 12});
  return {floor, column, box, knot};
}

std::vector<Piece> room_scene() {
  Piece white{.name = "white", .color = {0.73F, 0.73F, 0.73F}};
  add_quads(white, {-2, 0, 2}, {4, 0, 0}, {0, 0, -4}, {4, 4});  // floor
  // The ceiling leaves a square open in which the lamp lies flush: no gap, no light behind it.
  add_quads(white, {-2, 3, -2}, {4, 0, 0}, {0, 0, 1.4F}, {4, 2});
  add_quads(white, {-2, 3, 0.6F}, {4, 0, 0}, {0, 0, 1.4F}, {4, 2});
  add_quads(white, {-2, 3, -0.6F}, {1.4F, 0, 0}, {0, 0, 1.2F}, {2, 1});
  add_quads(white, {0.6F, 3, -0.6F}, {1.4F, 0, 0}, {0, 0, 1.2F}, {2, 1});
  add_quads(white, {-2, 0, -2}, {4, 0, 0}, {0, 3, 0}, {4, 3});  // far wall
  add_quads(white, {2, 0, 2}, {-4, 0, 0}, {0, 3, 0}, {4, 3});   // near wall, seen through from outside
  add_standing_box(white, {-0.4F, 0, -1.2F}, {0.9F, 1.5F, 0.0F}, 2);
  Piece red{.name = "red", .color = {0.63F, 0.065F, 0.05F}};
  add_quads(red, {-2, 0, 2}, {0, 0, -4}, {0, 3, 0}, {4, 3});
  Piece green{.name = "green", .color = {0.14F, 0.45F, 0.091F}};
  add_quads(green, {2, 0, -2}, {0, 0, 4}, {0, 3, 0}, {4, 3});
  Piece lamp{.name = "lamp", .color = {0, 0, 0}, .emission = 12};
  add_quads(lamp, {-0.6F, 3, -0.6F}, {1.2F, 0, 0}, {0, 0, 1.2F}, {1, 1});
  return {white, red, green, lamp};
}

/// The parts of a GLB as they grow.
struct GlbBuilder {
  ordered_json json = {{"asset", {{"version", "2.0"}, {"generator", "kiln demo-scene"}}}};
  Bytes binary;

  template <class T>
  int add_view(const std::vector<T>& values) {
    const std::size_t bytes = values.size() * sizeof(T);
    json["bufferViews"].push_back({{"buffer", 0}, {"byteOffset", binary.size()}, {"byteLength", bytes}});
    const std::size_t start = binary.size();
    binary.resize(start + bytes);
    std::memcpy(binary.data() + start, values.data(), bytes);
    return static_cast<int>(json["bufferViews"].size()) - 1;
  }

  int add_accessor(ordered_json accessor) {
    json["accessors"].push_back(std::move(accessor));
    return static_cast<int>(json["accessors"].size()) - 1;
  }
};

ordered_json bounds_accessor(int view, const std::vector<Vec3f>& position) {
  Vec3f low = position.front(), high = position.front();
  for (const Vec3f& p : position) {
    for (std::size_t k = 0; k < 3; ++k) {
      low[k] = std::min(low[k], p[k]);
      high[k] = std::max(high[k], p[k]);
    }
  }
  return {{"bufferView", view}, {"componentType", 5126},        {"count", position.size()},
          {"type", "VEC3"},     {"min", {low.x, low.y, low.z}}, {"max", {high.x, high.y, high.z}}};
}

ordered_json material_json(const Piece& piece) {
  ordered_json material = {{"name", piece.name},
                           {"pbrMetallicRoughness",
                            {{"baseColorFactor", {piece.color.x, piece.color.y, piece.color.z, 1}},
                             {"metallicFactor", 0},
                             {"roughnessFactor", 1}}}};
  if (piece.emission > 0) {
    material["emissiveFactor"] = {1, 1, 1};
    material["extensions"]["KHR_materials_emissive_strength"]["emissiveStrength"] = piece.emission;
  }
  return material;
}

void add_piece(GlbBuilder& glb, const Piece& piece) {
  const int position = glb.add_accessor(bounds_accessor(glb.add_view(piece.position), piece.position));
  const int normal = glb.add_accessor({{"bufferView", glb.add_view(piece.normal)},
                                       {"componentType", 5126},
                                       {"count", piece.normal.size()},
                                       {"type", "VEC3"}});
  const int indices = glb.add_accessor({{"bufferView", glb.add_view(piece.indices)},
                                        {"componentType", 5125},
                                        {"count", piece.indices.size()},
                                        {"type", "SCALAR"}});
  const auto index = glb.json["materials"].size();
  glb.json["materials"].push_back(material_json(piece));
  glb.json["meshes"].push_back(
      {{"name", piece.name},
       {"primitives",
        {{{"attributes", {{"POSITION", position}, {"NORMAL", normal}}}, {"indices", indices}, {"material", index}}}}});
  glb.json["nodes"].push_back({{"name", piece.name}, {"mesh", index}});
  glb.json["scenes"][0]["nodes"].push_back(index);
  if (piece.emission > 0) glb.json["extensionsUsed"] = {"KHR_materials_emissive_strength"};
}

void append_word(Bytes& out, std::size_t value) {
  for (int shift = 0; shift < 32; shift += 8) out.push_back(static_cast<std::uint8_t>(value >> shift));
}

Bytes finish(GlbBuilder glb) {
  glb.json["scene"] = 0;
  glb.json["buffers"] = {{{"byteLength", glb.binary.size()}}};
  std::string text = glb.json.dump();
  text.resize((text.size() + 3) / 4 * 4, ' ');
  glb.binary.resize((glb.binary.size() + 3) / 4 * 4);
  Bytes out;
  for (const std::size_t word : {std::size_t{0x46546c67}, std::size_t{2}, 28 + text.size() + glb.binary.size(),
                                 text.size(), std::size_t{0x4e4f534a}}) {
    append_word(out, word);
  }
  out.insert(out.end(), text.begin(), text.end());
  append_word(out, glb.binary.size());
  append_word(out, 0x004e4942);
  out.insert(out.end(), glb.binary.begin(), glb.binary.end());
  return out;
}

}  // namespace

const std::vector<std::string>& demo_scene_names() {
  static const std::vector<std::string> names = {"column", "room"};
  return names;
}

std::optional<Bytes> demo_scene(const std::string& name) {
  std::vector<Piece> pieces;
  if (name == "column") pieces = column_scene();
  if (name == "room") pieces = room_scene();
  if (pieces.empty()) return std::nullopt;
  GlbBuilder glb;
  for (const Piece& piece : pieces) add_piece(glb, piece);
  return finish(std::move(glb));
}

}  // namespace kiln
