// Bytes of a progressive mesh. README.md specifies them.

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <string>

#include "core/base/expects.h"
#include "core/lightfield/progressive_mesh.h"

namespace kiln {
namespace {

static_assert(std::endian::native == std::endian::little, "the bytes are little endian");
static_assert(sizeof(Vec3f) == 12 && sizeof(Vec2f) == 8 && sizeof(Vec4f) == 16 && sizeof(Triangle) == 12);

constexpr std::uint32_t kMagic = 0x4D504B32;  // "2KPM"
constexpr std::uint32_t kHasUv0 = 1, kHasUv1 = 2, kHasColor = 4, kHasTangent = 8, kHasPart = 16, kHasSky = 32,
                        kALamp = 64, kHasDiffuse = 1024;  // kALamp times the number of lamps is between them

struct Header {
  std::uint32_t magic = kMagic, degree = 0, has = 0, base_vertices = 0, base_triangles = 0, vertices = 0, triangles = 0,
                splits = 0, turned = 0, moved = 0, rank = 0, wide = 0;

  std::size_t lamps() const { return has % kHasDiffuse / kALamp; }
  std::size_t stride() const { return 3 * static_cast<std::size_t>(sh_count(static_cast<int>(degree) + 1)); }
  std::size_t row_floats() const { return rank == 0 ? 0 : (rank + 1) * stride(); }
};

/// Of a split, as stored: counts are vertices | triangles << 3 | pairs << 5 | moved << 7.
struct StoredSplit {
  std::uint32_t counts = 0, turned = 0, parent[2] = {};
  float error = 0;
};

/// Codes of vertices: of the first `wide` weights in 16 bits, of the others in 8. Lengths fill words.
struct Codes {
  std::vector<std::uint16_t> wide;
  std::vector<std::uint8_t> narrow;
};

/// Light as weights of rows: weight k of a vertex is offset[k] + scale[k] code. Empty where the rank is 0.
struct LightCode {
  std::vector<float> scale, offset, rows;  // rows: the mean, then one for each weight
  Codes all, moved;
};

/// What the file has in another form than ProgressiveMesh.
struct Stored {
  std::vector<StoredSplit> splits;
  LightCode light;
};
constexpr std::uint32_t kMostMoved = 0x1ffffff, kMostVertices = 6;

std::uint32_t attributes_of(const Mesh& m) {
  return (m.uv0.empty() ? 0 : kHasUv0) | (m.uv1.empty() ? 0 : kHasUv1) | (m.color.empty() ? 0 : kHasColor) |
         (m.tangent.empty() ? 0 : kHasTangent) | (m.part.empty() ? 0 : kHasPart);
}

/// Calls visit(array, elements) for every array of the file in its order.
template <class Progressive, class AnyStored, class Visit>
void each_array(Progressive& p, AnyStored& stored, const Header& h, const Visit& visit) {
  const auto vertices_of = [&](auto& lit, auto& codes, std::size_t count) {
    visit(lit.mesh.position, count);
    visit(lit.mesh.normal, count);
    if (h.has & kHasUv0) visit(lit.mesh.uv0, count);
    if (h.has & kHasUv1) visit(lit.mesh.uv1, count);
    if (h.has & kHasColor) visit(lit.mesh.color, count);
    if (h.has & kHasTangent) visit(lit.mesh.tangent, count);
    if (h.has & kHasSky) visit(lit.field.visibility, count * kVisibilityCount);
    visit(lit.field.lamp_visibility, count * h.lamps());
    if (h.has & kHasDiffuse) visit(lit.field.diffuse, count * 3);
    visit(lit.field.coefficients, h.rank == 0 ? count * h.stride() : 0);
    visit(codes.wide, (count * h.wide + 1) / 2 * 2);
    visit(codes.narrow, (count * (h.rank - h.wide) + 3) / 4 * 4);
  };
  visit(stored.light.scale, h.rank);
  visit(stored.light.offset, h.rank);
  visit(stored.light.rows, h.row_floats());
  vertices_of(p.all, stored.light.all, h.vertices);
  visit(p.all.mesh.triangles, h.triangles);
  if (h.has & kHasPart) visit(p.all.mesh.part, h.triangles);
  visit(stored.splits, h.splits);
  visit(p.turned, h.turned);
  visit(p.moved_vertex, h.moved);
  vertices_of(p.moved, stored.light.moved, h.moved);
}

/// The weights of every r-RF: how far it goes along each row from the mean.
std::vector<double> weights_of(const LightField& field, std::span<const float> rows) {
  const std::size_t stride = 3 * field.count(), rank = rows.size() / stride - 1;
  std::vector<double> out;
  out.reserve(rank * field.vertices());
  std::vector<double> squares;
  for (std::size_t k = 1; k <= rank; ++k) {
    double sum = 0;
    for (const float x : rows.subspan(k * stride, stride)) sum += double{x} * x;
    squares.push_back(sum);
  }
  for (std::size_t v = 0; v < field.vertices(); ++v) {
    const std::span<const float> c = field.of(v);
    for (std::size_t k = 1; k <= rank; ++k) {
      double sum = 0;
      for (std::size_t s = 0; s < stride; ++s) sum += (double{c[s]} - rows[s]) * rows[k * stride + s];
      out.push_back(squares[k - 1] > 0 ? sum / squares[k - 1] : 0);
    }
  }
  return out;
}

/// Sets header.wide.
LightCode encode_light(const ProgressiveMesh& p, std::span<const float> rows, double step, Header& h) {
  LightCode out{.rows = {rows.begin(), rows.end()}};
  const std::vector<double> all = weights_of(p.all.field, rows), moved = weights_of(p.moved.field, rows);
  constexpr double kWide = 65535, kNarrow = 255;
  std::vector<double> range;
  for (std::size_t k = 0; k < h.rank; ++k) {
    double low = HUGE_VAL, high = -HUGE_VAL;
    for (const auto* weights : {&all, &moved}) {
      for (std::size_t i = k; i < weights->size(); i += h.rank)
        low = std::min(low, (*weights)[i]), high = std::max(high, (*weights)[i]);
    }
    out.offset.push_back(static_cast<float>(low));
    range.push_back(high - low);
    if (range[k] > kNarrow * step) h.wide = static_cast<std::uint32_t>(k) + 1;
  }
  for (std::size_t k = 0; k < h.rank; ++k)
    out.scale.push_back(static_cast<float>(range[k] / (k < h.wide ? kWide : kNarrow)));
  const auto encode = [&](const std::vector<double>& weights) {
    Codes codes;
    for (std::size_t i = 0; i < weights.size(); ++i) {
      const std::size_t k = i % h.rank;
      const double scale = out.scale[k], steps = scale > 0 ? (weights[i] - out.offset[k]) / scale : 0;
      const auto code = std::lround(std::clamp(steps, 0.0, k < h.wide ? kWide : kNarrow));
      if (k < h.wide) codes.wide.push_back(static_cast<std::uint16_t>(code));
      if (k >= h.wide) codes.narrow.push_back(static_cast<std::uint8_t>(code));
    }
    codes.wide.resize((codes.wide.size() + 1) / 2 * 2);
    codes.narrow.resize((codes.narrow.size() + 3) / 4 * 4);
    return codes;
  };
  out.all = encode(all), out.moved = encode(moved);
  return out;
}

/// Sums in this order, in double, rounded once: the viewer does the same.
void decode_light(const Header& h, const LightCode& light, const Codes& codes, LightField& field) {
  const std::size_t stride = h.stride(), narrow = h.rank - h.wide;
  const std::size_t vertices = &codes == &light.all ? h.vertices : h.moved;
  field.coefficients.resize(stride * vertices);
  std::vector<double> sum(stride);
  for (std::size_t v = 0; v < vertices; ++v) {
    std::copy_n(light.rows.begin(), stride, sum.begin());
    for (std::size_t k = 0; k < h.rank; ++k) {
      const int code = k < h.wide ? codes.wide[h.wide * v + k] : codes.narrow[narrow * v + k - h.wide];
      const double weight = double{light.offset[k]} + double{light.scale[k]} * code;
      const float* row = light.rows.data() + (k + 1) * stride;
      for (std::size_t s = 0; s < stride; ++s) sum[s] += weight * row[s];
    }
    std::ranges::transform(sum, field.of(v).begin(), [](double x) { return static_cast<float>(x); });
  }
}

tl::unexpected<Fault> bad_index(const std::string& what, const std::string& where) {
  return fault("index_out_of_range", what, where);
}

bool all_finite(const LitMesh& lit) {
  bool finite = true;
  const auto check = [&](const auto& array) {
    const auto* first = reinterpret_cast<const float*>(array.data());
    const std::size_t count = array.size() * sizeof array[0] / sizeof(float);
    finite = finite && std::all_of(first, first + count, [](float x) { return std::isfinite(x); });
  };
  each_attribute(lit.mesh, check);
  each_field_array(lit.field, [&](const auto& array, std::size_t) { check(array); });
  return finite;
}

/// Follows the splits and checks each against the mesh of its level.
Result<bool> check_splits(const ProgressiveMesh& p) {
  std::vector<Triangle> corners = p.all.mesh.triangles;
  std::uint64_t vertices = p.base_vertices, triangles = p.base_triangles, turned = 0, rows = 0;
  const auto check_triangles = [&](std::uint64_t begin, const std::string& where) -> Result<bool> {
    for (std::uint64_t t = begin; t < triangles; ++t) {
      const auto& [a, b, c] = corners[t];
      if (std::max({a, b, c}) >= vertices || a == b || b == c || c == a)
        return bad_index("A triangle has no three corners among the vertices of its level.",
                         where + " triangle " + std::to_string(t));
    }
    return true;
  };
  KILN_TRY(base, check_triangles(0, "base"));
  float error = HUGE_VALF;
  for (std::size_t s = 0; s < p.splits.size(); ++s) {
    const VertexSplit& split = p.splits[s];
    const std::string where = "split " + std::to_string(s);
    if (split.pairs < 1 || split.pairs > 2 || split.vertices < split.pairs || split.vertices > kMostVertices ||
        split.triangles < 1 || split.triangles > 2)
      return fault("slot_count_mismatch", "A split brings too few or too many vertices or triangles.", where);
    if (!(split.error >= 0 && split.error <= error))
      return fault("number_out_of_range", "An error is not a number that falls from level to level.", where);
    error = split.error;
    for (std::uint32_t i = 0; i < split.pairs; ++i)
      if (split.parent[i] >= vertices + split.vertices) return bad_index("A parent is not there yet.", where);
    if (turned + split.turned > p.turned.size() || rows + split.moved > p.moved_vertex.size() ||
        vertices + split.vertices > p.all.mesh.position.size() || triangles + split.triangles > corners.size())
      return fault("slot_count_mismatch",
                   "There are fewer vertices, triangles, corners or moved vertices than splits need.", where);
    for (std::uint32_t k = 0; k < split.moved; ++k, ++rows)
      if (p.moved_vertex[rows] >= vertices + split.vertices)
        return bad_index("A moved vertex is not there yet.", where);
    for (std::uint32_t k = 0; k < split.turned; ++k, ++turned) {
      const std::uint32_t triangle = p.turned[turned] / 2, i = p.turned[turned] % 2;
      if (i >= split.pairs || triangle >= triangles) return bad_index("A turned corner is not there.", where);
      const auto corner = std::ranges::find(corners[triangle], split.parent[i]);
      if (corner == corners[triangle].end()) return bad_index("A turned triangle has no corner at the parent.", where);
      *corner = static_cast<std::uint32_t>(vertices) + i;
    }

    const std::uint64_t begin = triangles;
    vertices += split.vertices, triangles += split.triangles;
    KILN_TRY(fine, check_triangles(begin, where));
    (void)fine;
  }
  (void)base;
  if (vertices != p.all.mesh.position.size() || triangles != corners.size() || turned != p.turned.size() ||
      rows != p.moved.mesh.position.size())
    return fault("slot_count_mismatch", "There are more vertices, triangles, turned corners or moved rows than used.",
                 "header");
  return true;
}

}  // namespace

std::vector<std::uint8_t> encode_progressive(const ProgressiveMesh& p, std::span<const float> rows, double step) {
  const auto size = [](const auto& array) { return static_cast<std::uint32_t>(array.size()); };
  Header h{.degree = static_cast<std::uint32_t>(p.all.field.degree),
           .has = attributes_of(p.all.mesh) | (p.all.field.has_sky() ? kHasSky : 0) | kALamp * size(p.all.field.lamps) |
                  (p.all.field.has_diffuse() ? kHasDiffuse : 0),
           .base_vertices = p.base_vertices,
           .base_triangles = p.base_triangles,
           .vertices = size(p.all.mesh.position),
           .triangles = size(p.all.mesh.triangles),
           .splits = size(p.splits),
           .turned = size(p.turned),
           .moved = size(p.moved.mesh.position)};
  Stored stored;
  if (!rows.empty()) {
    EXPECTS(rows.size() % h.stride() == 0);
    h.rank = static_cast<std::uint32_t>(rows.size() / h.stride() - 1);
  }
  if (h.rank > 0) stored.light = encode_light(p, rows, step, h);
  stored.splits.reserve(p.splits.size());
  for (const VertexSplit& s : p.splits) {
    EXPECTS(s.moved <= kMostMoved);
    stored.splits.push_back(
        {s.vertices | s.triangles << 3 | s.pairs << 5 | s.moved << 7, s.turned, {s.parent[0], s.parent[1]}, s.error});
  }
  std::vector<std::uint8_t> out;
  const auto put = [&](const void* data, std::size_t bytes) {
    const auto* first = static_cast<const std::uint8_t*>(data);
    out.insert(out.end(), first, first + bytes);
  };
  put(&h, sizeof h);
  each_array(p, stored, h, [&](const auto& array, std::size_t count) {
    EXPECTS(array.size() >= count);  // more: light that is stored as codes
    put(array.data(), count * sizeof array[0]);
  });
  return out;
}

Result<ProgressiveMesh> decode_progressive(std::span<const std::uint8_t> bytes) {
  Header h;
  if (bytes.size() < sizeof h) return fault("truncated", "The header is not whole.", "header");
  std::memcpy(&h, bytes.data(), sizeof h);
  if (h.magic != kMagic || h.degree > static_cast<std::uint32_t>(kMaxLightFieldDegree) || h.lamps() > kMostFieldLamps ||
      h.has >= 2 * kHasDiffuse || h.rank > h.stride() || h.wide > h.rank)
    return fault("unsupported_version", "This is not a progressive mesh of a version that is known.", "header");
  if (h.base_vertices > h.vertices || h.base_triangles > h.triangles)
    return fault("slot_count_mismatch", "The base is larger than the whole.", "header");
  ProgressiveMesh p;
  p.base_vertices = h.base_vertices, p.base_triangles = h.base_triangles;
  p.all.field.degree = p.moved.field.degree = static_cast<int>(h.degree);
  p.all.field.lamps.resize(h.lamps()), p.moved.field.lamps.resize(h.lamps());
  Stored stored;
  std::uint64_t size = sizeof h;  // counts are 32 bits, elements below a kilobyte: no overflow
  each_array(p, stored, h, [&](const auto& array, std::size_t count) { size += count * sizeof array[0]; });
  if (size != bytes.size())
    return fault("truncated",
                 "There are " + std::to_string(bytes.size()) + " bytes and not " + std::to_string(size) + ".",
                 "header");
  std::size_t at = sizeof h;
  each_array(p, stored, h, [&](auto& array, std::size_t count) {
    array.resize(count);
    if (count > 0) std::memcpy(array.data(), bytes.data() + at, count * sizeof array[0]);
    at += count * sizeof array[0];
  });
  for (const StoredSplit& s : stored.splits)
    p.splits.push_back({.vertices = s.counts & 7,
                        .triangles = s.counts >> 3 & 3,
                        .pairs = s.counts >> 5 & 3,
                        .parent = {s.parent[0], s.parent[1]},
                        .moved = s.counts >> 7,
                        .turned = s.turned,
                        .error = s.error});
  if (h.rank > 0) {
    decode_light(h, stored.light, stored.light.all, p.all.field);
    decode_light(h, stored.light, stored.light.moved, p.moved.field);
  }
  if (!all_finite(p.all)) return fault("number_out_of_range", "A vertex has a number that is not finite.", "vertices");
  if (!all_finite(p.moved)) return fault("number_out_of_range", "A row has a number that is not finite.", "moved rows");
  KILN_TRY(fine, check_splits(p));
  (void)fine;
  return p;
}

}  // namespace kiln
