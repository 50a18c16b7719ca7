// Lightmap -> scene.glb and lightmap.exr. README.md specifies what is written here.

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>

#include "core/artifact/exr_parts.h"
#include "core/artifact/glb.h"
#include "core/artifact/lightmap_file.h"
#include "core/artifact/png.h"
#include "core/base/expects.h"

namespace kiln {
namespace {

using json = nlohmann::ordered_json;

constexpr const char* kName = "KILN_lightmap";
constexpr const char* kMaterial = "MOZ_lightmap";
constexpr const char* kTransfer = "KILN_radiance_transfer";
constexpr int kVersion = 1;

/// Mean squared error of 8 bits up to `most`, per number.
double rounding_error(const std::vector<Vec3f>& texels, double most) {
  const double step = most / 255;
  double sum = 0;
  for (const Vec3f& x : texels) {
    for (std::size_t c = 0; c < 3; ++c) {
      const double over = std::max(0.0, double{x[c]} - most);
      sum += over * over + (x[c] > 0 ? step * step / 12 : 0);
    }
  }
  return sum;
}

/// The largest value that is kept: see "Image".
double range_of(const std::vector<Vec3f>& texels) {
  constexpr int kTried = 24;  // down to 2^-12 of the brightest texel
  double most = 0;
  for (const Vec3f& x : texels) most = std::max({most, double{x.x}, double{x.y}, double{x.z}});
  if (!(most > 0)) return 1;
  double best = most, least = rounding_error(texels, most);
  for (int k = 1; k <= kTried; ++k) {
    const double range = most * std::exp2(-0.5 * k), error = rounding_error(texels, range);
    if (error < least) best = range, least = error;
  }
  return best;
}

Bytes image_of(const Lightmap& map, double range) {
  Bytes pixels;
  pixels.reserve(3 * map.texels.size());
  for (const Vec3f& x : map.texels) {
    for (std::size_t c = 0; c < 3; ++c)
      pixels.push_back(static_cast<std::uint8_t>(std::lround(255 * std::clamp(double{x[c]} / range, 0.0, 1.0))));
  }
  return write_png({map.side, map.side, 3}, pixels);
}

/// A finished file that grows.
struct Growing {
  json document;
  Bytes binary;

  std::size_t add_view(std::span<const std::uint8_t> bytes) {
    binary.resize((binary.size() + 3) / 4 * 4, 0);
    document["bufferViews"].push_back({{"buffer", 0}, {"byteOffset", binary.size()}, {"byteLength", bytes.size()}});
    binary.insert(binary.end(), bytes.begin(), bytes.end());
    return document["bufferViews"].size() - 1;
  }
  std::size_t add(const char* list, json element) {
    document[list].push_back(std::move(element));
    return document[list].size() - 1;
  }
};

/// Bilinear and clamped: what lies beyond the border belongs to nobody.
std::size_t add_texture(Growing& file, std::size_t view) {
  const std::size_t image = file.add("images", {{"name", "lightmap"}, {"mimeType", "image/png"}, {"bufferView", view}});
  const std::size_t sampler =
      file.add("samplers", {{"magFilter", 9729}, {"minFilter", 9729}, {"wrapS", 33071}, {"wrapT", 33071}});
  return file.add("textures", {{"name", "lightmap"}, {"sampler", sampler}, {"source", image}});
}

/// The primitive of the new scene: the original one with its material's twin, or where the part is not in the lightmap
/// the baked one, whose colours hold the light. Its Draco bytes get a view of their own.
json primitive_of(Growing& file, std::size_t i, bool shown, std::size_t first_twin) {
  json out = file.document["meshes"][shown ? 1 : 0]["primitives"][i];
  out["extensions"].erase(kTransfer);
  json& draco = out["extensions"]["KHR_draco_mesh_compression"];
  draco["bufferView"] =
      file.add("bufferViews", json(file.document["bufferViews"][draco["bufferView"].get<std::size_t>()]));
  if (shown) out["material"] = first_twin + out["material"].get<std::size_t>();
  return out;
}

void add_scene(Growing& file, json primitives) {
  json& document = file.document;
  json node = document["nodes"][0];
  node["name"] = "lightmap";
  node["mesh"] = file.add("meshes", {{"name", "lightmap"}, {"primitives", std::move(primitives)}});
  const std::size_t index = file.add("nodes", std::move(node));
  file.add("scenes", {{"name", "lightmap"}, {"nodes", json::array({index})}});
}

void name_extensions(json& document) {
  json& used = document["extensionsUsed"];
  used.push_back(kName);
  used.push_back(kMaterial);
  std::sort(used.begin(), used.end());
}

}  // namespace

Result<Bytes> add_lightmap(std::span<const std::uint8_t> glb, const Lightmap& map, std::span<const char> written) {
  EXPECTS(map.side > 0 && map.texels.size() == static_cast<std::size_t>(map.side) * static_cast<std::size_t>(map.side));
  EXPECTS(map.parts.size() == written.size());
  KILN_TRY(chunks, split_glb(glb));
  Growing file{json::parse(chunks.json), Bytes(chunks.binary.begin(), chunks.binary.end())};
  const double range = range_of(map.texels), intensity = range * std::numbers::pi;
  const std::size_t view = file.add_view(image_of(map, range)), texture = add_texture(file, view);
  const std::size_t originals = file.document["materials"].size() / 2, first_twin = 2 * originals;
  for (std::size_t m = 0; m < originals; ++m) {
    json twin = file.document["materials"][m];
    twin["name"] = twin.value("name", "") + " (lightmap)";
    twin["extensions"][kMaterial] = {{"index", texture}, {"texCoord", 1}, {"intensity", intensity}};
    file.add("materials", std::move(twin));
  }
  json primitives = json::array(), shown = json::array();
  for (std::size_t part = 0; part < written.size(); ++part) {
    if (written[part] == 0) continue;
    if (map.parts[part] != 0) shown.push_back(primitives.size());
    primitives.push_back(primitive_of(file, primitives.size(), map.parts[part] != 0, first_twin));
  }
  file.document["extensions"][kName] = {{"version", kVersion}, {"units", "W m^-2: irradiance = intensity * texel"},
                                        {"size", map.side},    {"intensity", intensity},
                                        {"texture", texture},  {"bufferView", view},
                                        {"primitives", shown}, {"of", primitives.size()}};
  add_scene(file, std::move(primitives));
  name_extensions(file.document);
  file.document["buffers"][0]["byteLength"] = (file.binary.size() + 3) / 4 * 4;
  return join_glb(file.document.dump(-1, ' ', false, json::error_handler_t::replace), std::move(file.binary));
}

Bytes write_lightmap_exr(const Lightmap& map, const std::string& provenance) {
  ExrPart part;
  part.name = "lightmap", part.width = part.height = map.side, part.half = false;
  part.pixels.reserve(3 * map.texels.size());
  constexpr auto kPi = std::numbers::pi_v<float>;
  for (const Vec3f& x : map.texels) part.pixels.insert(part.pixels.end(), {kPi * x.x, kPi * x.y, kPi * x.z});
  part.text = {{"kiln.lightmap", "1"},
               {"kiln.quantity", "irradiance, W m^-2; a Lambertian surface radiates albedo / pi times it"},
               {"kiln.layout", "TEXCOORD_1 of scene.glb, v downwards; texel centres at (i + 1/2) / size"},
               {"kiln.provenance", provenance}};
  return write_exr_parts({part});
}

}  // namespace kiln
