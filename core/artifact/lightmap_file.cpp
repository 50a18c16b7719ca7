#include "core/artifact/lightmap_file.h"

#include <numbers>

#include "core/artifact/exr_reader.h"
#include "core/artifact/glb_extension.h"
#include "core/artifact/image_decode.h"
#include "core/mesh/texel_map.h"

namespace kiln {
namespace {

constexpr const char* kName = "KILN_lightmap";
constexpr int kVersion = 1;
constexpr std::uint64_t kMostSide = 8192;
constexpr double kMostIntensity = 1e30;

Lightmap decoded(const Fields& extension, const gltf::BufferBytes& bytes, Findings& findings) {
  Lightmap out;
  if (extension.count("version", 0) != kVersion)
    findings.fail("unsupported_version", "Only version 1 of KILN_lightmap is read.", extension.pointer("version"));
  const int view = extension.index("bufferView", bytes.views.size());
  const std::uint64_t side = extension.count("size", 0);
  const double intensity = extension.number("intensity", 0);
  const std::uint64_t primitives = extension.count("of", 0);
  if (side < 1 || side > kMostSide || !(intensity > 0 && intensity <= kMostIntensity) ||
      primitives > bytes.views.size())
    findings.fail("number_out_of_range", "Size, intensity or number of primitives are out of range.",
                  extension.pointer());
  if (view < 0) findings.fail("index_out_of_range", "There is no image.", extension.pointer("bufferView"));
  if (findings.failed()) return {};
  out.parts.assign(primitives, 0);
  for (const int i : extension.indices("primitives", primitives)) out.parts[static_cast<std::size_t>(i)] = 1;
  const auto encoded = bytes.views[static_cast<std::size_t>(view)];
  const auto header = read_image_header(encoded);
  const bool sized = header && header->mime == "image/png" && header->width == side && header->height == side;
  const auto pixels = sized ? decode_image(encoded, *header) : std::nullopt;
  if (!pixels) {
    findings.fail("image_invalid", "The lightmap is no PNG of its size.", extension.pointer("bufferView"));
    return {};
  }
  out.side = static_cast<int>(side);
  const double scale = intensity / std::numbers::pi / 255;
  for (std::size_t i = 0; i + 3 < pixels->size(); i += 4) {
    out.texels.push_back(
        to_float(Vec3d{double((*pixels)[i]), double((*pixels)[i + 1]), double((*pixels)[i + 2])} * scale));
  }
  return out;
}

}  // namespace

Vec3f Lightmap::at(const Vec2f& uv) const {
  const Bilinear b = bilinear_at(uv, side);
  Vec3f sum;
  for (std::size_t k = 0; k < 4; ++k) sum += texels[b.texel[k]] * b.weight[k];
  return sum;
}

Result<Lightmap> read_lightmap(std::span<const std::uint8_t> glb) {
  Findings findings("scene.glb");
  Lightmap out;
  read_root_extension(glb, kName, findings, [&](const Fields& extension, const gltf::BufferBytes& bytes) {
    out = decoded(extension, bytes, findings);
  });
  if (findings.failed()) return tl::make_unexpected(findings.fault());
  return out;
}

Result<Lightmap> read_lightmap_exr(std::span<const std::uint8_t> file, const std::string& name) {
  KILN_TRY(picture, read_exr(file, name));
  if (picture.width != picture.height) return fault("lightmap_invalid", "A lightmap is square.", name);
  Lightmap out{.side = picture.width, .texels = std::move(picture.radiance), .parts = {}};
  for (Vec3f& x : out.texels) x = x / std::numbers::pi_v<float>;
  return out;
}

}  // namespace kiln
