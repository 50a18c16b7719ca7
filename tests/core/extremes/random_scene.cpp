#include "tests/core/extremes/random_scene.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <numbers>

#include "core/base/random.h"
#include "tests/core/artifact/gltf_samples.h"

namespace kiln::test {
namespace {

std::string number(double x) {
  std::array<char, 40> out{};
  std::snprintf(out.data(), out.size(), "%.17g", x);
  return out.data();
}

std::string list(std::initializer_list<double> values) {
  std::string out;
  for (const double x : values) out += (out.empty() ? "[" : ",") + number(x);
  return out + "]";
}

std::string quaternion(const Vec4<double>& q) { return list({q.x, q.y, q.z, q.w}); }

/// The dice of one seed.
class Dice {
 public:
  explicit Dice(std::uint64_t seed) : random_(seed, 0x7363656eU) {}
  double unit() { return random_.uniform_double(); }
  double between(double low, double high) { return low + (high - low) * unit(); }
  double magnitude(double low, double high) { return std::pow(10.0, between(low, high)); }  // decades
  int below(int n) { return static_cast<int>(random_.next() % static_cast<std::uint64_t>(n)); }
  bool chance(double p) { return unit() < p; }
  Vec3d in_cube() { return {between(-1, 1), between(-1, 1), between(-1, 1)}; }
  std::uint64_t bits() { return random_.next(); }

 private:
  Random random_;
};

std::uint32_t add(RandomPart& part, const Vec3d& p) {
  const Vec3f f = to_float(p);
  part.position.insert(part.position.end(), {f.x, f.y, f.z});
  return static_cast<std::uint32_t>(part.position.size() / 3 - 1);
}

void add_triangle(RandomPart& part, std::uint32_t a, std::uint32_t b, std::uint32_t c) {
  part.index.insert(part.index.end(), {a, b, c});
}

void add_quad(RandomPart& part, const Vec3d& corner, const Vec3d& a, const Vec3d& b) {
  const std::uint32_t p = add(part, corner), q = add(part, corner + a), r = add(part, corner + a + b),
                      s = add(part, corner + b);
  add_triangle(part, p, q, r);
  add_triangle(part, p, r, s);
}

void box(RandomPart& part, Dice& dice) {
  part.position = cube_positions();
  part.index = cube_indices();
  if (dice.chance(0.3)) {  // inside out: a room
    for (std::size_t i = 0; i < part.index.size(); i += 3) std::swap(part.index[i], part.index[i + 1]);
  }
  if (dice.chance(0.3)) part.index.resize(part.index.size() - 6);  // without a lid
}

void sheet(RandomPart& part, Dice& dice) {
  const int n = 1 + dice.below(4);
  for (int i = 0; i < n * n; ++i) {
    const int column = i % n, row = i / n;
    add_quad(part, {2.0 * column / n - 1, 0, 1 - 2.0 * row / n}, {2.0 / n, 0, 0}, {0, 0, -2.0 / n});
  }
}

void needles(RandomPart& part, Dice& dice) {
  for (int i = 0; i < 1 + dice.below(6); ++i) {
    const Vec3d from = dice.in_cube(), along = dice.in_cube(), aside = dice.in_cube() * dice.magnitude(-7, -3);
    const std::uint32_t a = add(part, from), b = add(part, from + along), c = add(part, from + along * 0.5 + aside);
    add_triangle(part, a, b, c);
  }
}

/// Two sheets in one plane, half upon each other, perhaps back to back.
void overlap(RandomPart& part, Dice& dice) {
  const bool back_to_back = dice.chance(0.5);
  add_quad(part, {-1, 0, 1}, {1.5, 0, 0}, {0, 0, -2});
  if (back_to_back) {
    add_quad(part, {-0.5, 0, 1}, {0, 0, -2}, {1.5, 0, 0});
  } else {
    add_quad(part, {-0.5, 0, 1}, {1.5, 0, 0}, {0, 0, -2});
  }
}

void soup(RandomPart& part, Dice& dice) {
  const int points = 3 + dice.below(20);
  for (int i = 0; i < points; ++i) add(part, dice.in_cube());
  for (int i = 0; i < 1 + dice.below(40); ++i) {
    const auto v = [&] { return static_cast<std::uint32_t>(dice.below(points)); };
    add_triangle(part, v(), v(), v());
  }
}

void sphere(RandomPart& part, Dice& dice) {
  const int rings = 3 + dice.below(3), around = 2 * rings;
  for (int i = 0; i <= rings; ++i) {
    for (int k = 0; k < around; ++k) {
      const double theta = std::numbers::pi * i / rings, phi = 2 * std::numbers::pi * k / around;
      const Vec3d n{std::sin(theta) * std::cos(phi), std::cos(theta), std::sin(theta) * std::sin(phi)};
      add(part, n);
      const Vec3f f = to_float(n);
      part.normal.insert(part.normal.end(), {f.x, f.y, f.z});
    }
  }
  const auto id = [&](int i, int k) { return static_cast<std::uint32_t>(i * around + k % around); };
  for (int i = 0; i < rings; ++i) {
    for (int k = 0; k < around; ++k) {
      add_triangle(part, id(i, k), id(i, k + 1), id(i + 1, k + 1));
      add_triangle(part, id(i, k), id(i + 1, k + 1), id(i + 1, k));
    }
  }
}

void t_junction(RandomPart& part, Dice& dice) {
  add_quad(part, {-1, 0, 0}, {2, 0, 0}, {0, 1, 0});
  const double cut = dice.between(-0.9, 0.9);
  add_quad(part, {-1, -1, 0}, {cut + 1, 0, 0}, {0, 1, 0});
  add_quad(part, {cut, -1, 0}, {1 - cut, 0, 0}, {0, 1, 0});
}

void fan_on_one_edge(RandomPart& part, Dice& dice) {
  const std::uint32_t a = add(part, {0, -1, 0}), b = add(part, {0, 1, 0});
  const int leaves = 3 + dice.below(4);
  for (int i = 0; i < leaves; ++i) {
    const double phi = 2 * std::numbers::pi * i / leaves;
    add_triangle(part, a, b, add(part, {std::cos(phi), 0, std::sin(phi)}));
  }
}

struct Kind {
  const char* name;
  void (*make)(RandomPart&, Dice&);
};
constexpr std::array<Kind, 9> kKinds{{{"box", box},
                                      {"box", box},
                                      {"sheet", sheet},
                                      {"needles", needles},
                                      {"overlap", overlap},
                                      {"soup", soup},
                                      {"sphere", sphere},
                                      {"t-junction", t_junction},
                                      {"fan", fan_on_one_edge}}};

void spoil_shape(RandomPart& part, Dice& dice) {
  if (dice.chance(0.2)) add(part, dice.in_cube() * 3.0);  // a vertex that nobody uses
  if (dice.chance(0.2)) part.index.insert(part.index.end(), part.index.begin(), part.index.begin() + 3);
  if (dice.chance(0.2)) part.index.insert(part.index.end(), {part.index[0], part.index[1], part.index[0]});
  if (dice.chance(0.1)) std::swap(part.index[0], part.index[1]);
}

/// Normals of a length and direction that nobody should trust.
void spoil_normals(RandomPart& part, Dice& dice) {
  if (dice.chance(0.5)) {
    part.normal.resize(part.normal.size() == part.position.size() ? part.normal.size() : 0);
    return;
  }
  part.normal.clear();
  const double norm = dice.chance(0.5) ? 1 : dice.magnitude(-20, 15);
  const bool zeros = dice.chance(0.3);
  for (std::size_t v = 0; v < part.position.size() / 3; ++v) {
    const Vec3f n = to_float(normalized(dice.in_cube()) * (zeros && dice.chance(0.3) ? 0.0 : norm));
    part.normal.insert(part.normal.end(), {n.x, n.y, n.z});
  }
}

void paint(RandomPart& part, Dice& dice, const RandomChoices& choices) {
  const auto channel = [&] { return dice.chance(0.3) ? dice.below(2) : dice.unit(); };
  const double grey = channel();
  const bool colored = dice.chance(0.5);
  const double alpha = dice.chance(0.5) ? 1 : dice.unit();
  std::string& m = part.material;
  m = "{\"pbrMetallicRoughness\":{\"baseColorFactor\":";
  m += colored ? list({channel(), channel(), channel(), alpha}) : list({grey, grey, grey, alpha});
  m += "},\"doubleSided\":" + std::string(dice.chance(0.3) ? "true" : "false");
  if (dice.chance(0.2)) m += ",\"alphaMode\":\"" + std::string(dice.chance(0.5) ? "MASK" : "BLEND") + "\"";
  if (choices.lamps && dice.chance(0.2)) {
    m += ",\"emissiveFactor\":" + list({dice.unit(), dice.unit(), dice.unit()}) +
         ",\"extensions\":{\"KHR_materials_emissive_strength\":{\"emissiveStrength\":" + number(dice.magnitude(-8, 8)) +
         "}}";
  }
  m += "}";
  if (!dice.chance(0.2)) return;
  const double high = choices.strange_color && dice.chance(0.5) ? dice.magnitude(0, 38) : 1;
  for (std::size_t v = 0; v < part.position.size() / 3 * 4; ++v) {
    part.color.push_back(static_cast<float>(high * (high > 1 ? dice.between(-1, 1) : dice.unit())));
  }
}

void place(RandomPart& part, Dice& dice) {
  const Vec3d at = dice.in_cube();
  std::string node = "\"translation\":" + list({at.x, at.y, at.z});
  if (dice.chance(0.5)) node += ",\"rotation\":" + quaternion(random_turn(dice.bits()));
  const double size = dice.magnitude(-1.5, 0.5);
  Vec3d scale{size, size, size};
  if (dice.chance(0.3)) scale = {dice.magnitude(-3, 0), dice.magnitude(-3, 0), dice.magnitude(-3, 0)};
  if (dice.chance(0.1)) scale[static_cast<std::size_t>(dice.below(3))] = 0;
  for (std::size_t k = 0; k < 3; ++k) scale[k] *= dice.chance(0.2) ? -1 : 1;
  node += ",\"scale\":" + list({scale.x, scale.y, scale.z});
  if (dice.chance(0.2)) {  // a detour by large and small numbers
    const double detour = dice.magnitude(-9, 9);
    part.nodes.push_back("\"scale\":" + list({detour, detour, detour}));
    part.nodes.push_back("\"scale\":" + list({1 / detour, 1 / detour, 1 / detour}));
  }
  part.nodes.push_back(node);
}

RandomLight light(Dice& dice) {
  RandomLight out;
  const int type = dice.below(3);
  out.type = type == 0 ? "directional" : type == 1 ? "point" : "spot";
  out.intensity = dice.magnitude(-8, 8);
  if (dice.chance(0.3)) out.range = dice.magnitude(-2, 1);
  out.rest = ",\"color\":" + list({dice.unit(), dice.unit(), dice.unit()});
  if (type == 2) {
    const double outer = dice.between(0.01, 1.57);
    out.rest += ",\"spot\":{\"outerConeAngle\":" + number(outer) +
                ",\"innerConeAngle\":" + number(outer * (dice.chance(0.3) ? 0.999999 : dice.unit())) + "}";
  }
  const Vec3d at = dice.in_cube();
  out.node = "\"translation\":" + list({at.x, at.y, at.z}) + ",\"rotation\":" + quaternion(random_turn(dice.bits()));
  return out;
}

/// Appends a chain of nodes that ends in one with `leaf` and returns the index of its first.
int add_chain(std::string& nodes, int& count, const std::vector<std::string>& members, const std::string& leaf) {
  const int first = count;
  for (std::size_t i = 0; i < members.size(); ++i) {
    const bool last = i + 1 == members.size();
    nodes += ",{" + members[i] + "," + (last ? leaf : "\"children\":[" + std::to_string(count + 1) + "]") + "}";
    ++count;
  }
  return first;
}

}  // namespace

Vec4<double> random_turn(std::uint64_t seed) {
  Random random(seed, 0x7475726eU);
  const double a = 2 * std::numbers::pi * random.uniform_double(), b = 2 * std::numbers::pi * random.uniform_double();
  const double u = random.uniform_double(), r = std::sqrt(1 - u), s = std::sqrt(u);
  return {r * std::sin(a), r * std::cos(a), s * std::sin(b), s * std::cos(b)};  // Shoemake 1992
}

Vec3d turned(const Vec4<double>& q, const Vec3d& v) {
  const Vec3d axis{q.x, q.y, q.z};
  return v + cross(axis, cross(axis, v) + v * q.w) * 2.0;
}

RandomScene random_scene(std::uint64_t seed, const RandomChoices& choices) {
  Dice dice(seed);
  RandomScene scene;
  const int parts = 1 + dice.below(6);
  std::size_t triangles = 0;
  for (int i = 0; i < parts; ++i) {
    RandomPart part;
    const Kind& kind = kKinds[static_cast<std::size_t>(dice.below(static_cast<int>(kKinds.size())))];
    part.kind = kind.name;
    kind.make(part, dice);
    spoil_shape(part, dice);
    spoil_normals(part, dice);
    paint(part, dice, choices);
    place(part, dice);
    triangles += part.index.size() / 3;
    if (triangles > 200) break;
    scene.parts.push_back(std::move(part));
  }
  if (choices.lamps && dice.chance(0.4)) scene.lights.push_back(light(dice));
  if (choices.lamps && dice.chance(0.2)) scene.lights.push_back(light(dice));
  if (dice.chance(0.4)) scene.placement.scale = dice.magnitude(-6, 9);
  if (dice.chance(0.3)) scene.placement.translation = dice.in_cube() * (1e7 * scene.placement.scale);
  return scene;
}

Bytes to_glb(const RandomScene& scene, const Placement& placement) {
  Sample sample;
  std::string meshes, materials, nodes, children, lights;
  int count = 1;
  const auto child = [&](int node) { children += (children.empty() ? "" : ",") + std::to_string(node); };
  for (std::size_t i = 0; i < scene.parts.size(); ++i) {
    const RandomPart& part = scene.parts[i];
    std::string attributes = "\"POSITION\":" + std::to_string(sample.positions(part.position));
    if (!part.normal.empty()) attributes += ",\"NORMAL\":" + std::to_string(sample.normals(part.normal));
    if (!part.color.empty()) {
      attributes += ",\"COLOR_0\":" + std::to_string(sample.accessor(part.color, 5126, "VEC4", part.color.size() / 4));
    }
    const std::string comma = i == 0 ? "" : ",", at = std::to_string(i);
    meshes += comma + "{\"primitives\":[{\"attributes\":{" + attributes +
              "},\"indices\":" + std::to_string(sample.indices(part.index)) + ",\"material\":" + at + "}]}";
    materials += comma + part.material;
    child(add_chain(nodes, count, part.nodes, "\"mesh\":" + at));
  }
  for (std::size_t i = 0; i < scene.lights.size(); ++i) {
    const RandomLight& l = scene.lights[i];
    const double grown = l.type == "directional" ? 1 : placement.scale * placement.scale;
    lights += (i == 0 ? "" : ",") + ("{\"type\":\"" + l.type) + "\",\"intensity\":" + number(l.intensity * grown) +
              (l.range > 0 ? ",\"range\":" + number(l.range * placement.scale) : "") + l.rest + "}";
    child(add_chain(nodes, count, {l.node},
                    "\"extensions\":{\"KHR_lights_punctual\":{\"light\":" + std::to_string(i) + "}}"));
  }
  const double s = placement.scale;
  const Vec3d& t = placement.translation;
  const std::string root = "{\"translation\":" + list({t.x, t.y, t.z}) +
                           ",\"rotation\":" + quaternion(placement.rotation) + ",\"scale\":" + list({s, s, s}) +
                           ",\"children\":[" + children + "]}";
  std::string rest = "\"meshes\":[" + meshes + "],\"materials\":[" + materials + "],\"nodes\":[" + root + nodes +
                     "],\"scenes\":[{\"nodes\":[0]}],\"scene\":0";
  if (!lights.empty()) rest += ",\"extensions\":{\"KHR_lights_punctual\":{\"lights\":[" + lights + "]}}";
  return sample.glb(rest);
}

std::optional<Scene> imported(const RandomScene& scene, const Placement& placement) {
  Result<Scene> out = import_bytes(to_glb(scene, placement));
  if (out) return std::move(*out);
  EXPECT_EQ(out.error().code, "empty_scene") << out.error().message << ' ' << out.error().where;
  return std::nullopt;
}

}  // namespace kiln::test
