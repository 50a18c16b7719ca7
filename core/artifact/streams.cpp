#include "core/artifact/streams.h"

#include <algorithm>
#include <array>
#include <map>

#include "core/artifact/baked_geometry.h"
#include "core/artifact/glb.h"
#include "core/artifact/png.h"
#include "core/base/expects.h"

namespace kiln {
namespace {

constexpr std::array kNames{"connectivity and positions", "normals", "texture coordinates", "tangents", "colours"};

/// The report's row of a stream.
std::size_t row_of(const std::string& attribute) {
  if (attribute == "POSITION") return 0;
  if (attribute == "NORMAL") return 1;
  if (attribute.starts_with("TEXCOORD")) return 2;
  return attribute == "TANGENT" ? 3 : 4;
}

/// Encodes the part's streams up to each row in turn and adds what each row costs.
Result<void> add_part(const PartPrimitive& part, int speed, std::vector<StreamBytes>& rows) {
  DracoMesh mesh{part.mesh.triangles, {}};
  std::uint64_t before = 0;
  for (std::size_t row = 0; row < rows.size(); ++row) {
    const std::size_t had = mesh.streams.size();
    for (std::size_t i = 0; i < part.names.size(); ++i) {
      if (row_of(part.names[i].name) == row) mesh.streams.push_back(part.mesh.streams[i]);
    }
    if (mesh.streams.size() == had) continue;
    KILN_TRY(bytes, encode_draco(mesh, speed));
    rows[row].bytes += std::max<std::uint64_t>(bytes.size(), before) - before;
    before = std::max<std::uint64_t>(bytes.size(), before);
  }
  return {};
}

}  // namespace

Result<std::vector<StreamBytes>> stream_bytes(const BakedScene& baked, const Encoding& encoding,
                                              std::span<const std::uint8_t> file) {
  std::vector<StreamBytes> rows;
  for (const char* name : kNames) rows.push_back({name, 0});
  const auto done = visit_part_primitives(
      baked, {encoding, nullptr}, [&](const PartPrimitive& part) { return add_part(part, encoding.speed, rows); });
  if (!done) return tl::make_unexpected(done.error());
  KILN_TRY(chunks, split_glb(file));
  std::uint64_t images = 0;
  for (const Image& image : baked.scene.images) {
    images += image.encoded.empty() ? white_pixel_png().size() : image.encoded.size();
  }
  std::uint64_t known = images + (file.size() - chunks.binary.size());
  for (const StreamBytes& row : rows) known += row.bytes;
  EXPECTS(known <= file.size());
  std::uint64_t matrices = 0;
  if (baked.glossy) {
    Encoding without = encoding;
    without.glossy = false;
    KILN_TRY(plain, write_baked_glb(baked, without));
    matrices = file.size() - std::min(file.size(), plain.size());
  }
  rows.push_back({"coefficients", file.size() - known - matrices});
  if (matrices > 0) rows.push_back({"matrices", matrices});
  rows.push_back({"images", images});
  rows.push_back({"JSON and headers", file.size() - chunks.binary.size()});
  return rows;
}

}  // namespace kiln
