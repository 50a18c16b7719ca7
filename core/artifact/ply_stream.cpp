// PLY as a stream: vertices are read where they lie, faces in order.
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>

#include "core/artifact/ply_columns.h"
#include "core/artifact/triangle_stream.h"

namespace kiln {
namespace {

using Span = std::span<const std::uint8_t>;

constexpr std::uint64_t kMostCorners = 65535;  // of a face; more is a count that lies

template <class T>
double as_number(const std::uint8_t* at, bool big) {
  std::array<std::uint8_t, sizeof(T)> bytes;
  std::memcpy(bytes.data(), at, sizeof(T));
  if (big) std::reverse(bytes.begin(), bytes.end());
  return static_cast<double>(std::bit_cast<T>(bytes));
}

double number_at(const std::uint8_t* at, PlyType type, bool big) {
  switch (type) {
    case PlyType::i8:
      return as_number<std::int8_t>(at, big);
    case PlyType::u8:
      return *at;
    case PlyType::i16:
      return as_number<std::int16_t>(at, big);
    case PlyType::u16:
      return as_number<std::uint16_t>(at, big);
    case PlyType::i32:
      return as_number<std::int32_t>(at, big);
    case PlyType::u32:
      return as_number<std::uint32_t>(at, big);
    case PlyType::f32:
      return as_number<float>(at, big);
    case PlyType::f64:
      return as_number<double>(at, big);
  }
  return 0;
}

/// Vertices as rows of one size, in the file or in a spill file.
struct VertexRows {
  FileBytes bytes;
  std::uint64_t start = 0, stride = 0, count = 0;
  bool big = false, in_file = true;
  PlyColumns columns{};
  std::vector<PlyType> types;
  std::vector<std::uint64_t> offsets;

  double number(const std::uint8_t* row, int column) const {
    const auto c = static_cast<std::size_t>(column);
    return number_at(row + offsets[c], types[c], big);
  }
  const std::uint8_t* row(std::uint32_t vertex) const { return Span(bytes).data() + start + vertex * stride; }
  Vec3d triple(std::uint32_t vertex, const int (&c)[3]) const {
    const std::uint8_t* at = row(vertex);
    return {number(at, c[0]), number(at, c[1]), number(at, c[2])};
  }
};

bool has_list(const PlyElement& e) {
  return std::any_of(e.properties.begin(), e.properties.end(), [](const PlyProperty& p) { return p.list.has_value(); });
}

std::uint64_t row_bytes(const PlyElement& e) {
  std::uint64_t sum = 0;
  for (const PlyProperty& p : e.properties) sum += ply_bytes(p.type);
  return sum;
}

std::string place_of(const PlyElement& e, std::uint64_t i, std::uint64_t byte) {
  const std::string name = e.name == "vertex" || e.name == "face" ? e.name : "other";
  return "element " + name + " " + std::to_string(i) + " at byte " + std::to_string(byte);
}

Fault truncated(const PlyElement& e, std::uint64_t i, std::uint64_t byte) {
  return {"ply_truncated", "The file ends, or no number stands where one must.", place_of(e, i, byte)};
}

/// A place in the body from which numbers are read in order.
class Cursor {
 public:
  Cursor(Span file, std::uint64_t at, PlyForm form) : size_(file.size()), numbers_(file.subspan(at), form) {}
  std::uint64_t at() const { return size_ - numbers_.left(); }
  std::optional<double> next(PlyType type) { return numbers_.next(type); }

  /// One property's values; false at the end, or where a count is none.
  bool read(const PlyProperty& p, std::vector<double>& values) {
    values.clear();
    const auto count = p.list ? numbers_.next_count(*p.list) : std::optional<std::uint64_t>(1);
    if (!count) return false;
    for (std::uint64_t i = 0; i < *count; ++i) {
      if (i > kMostCorners && p.list) values.resize(kMostCorners + 1);  // too many already: only their number matters
      const auto value = next(p.type);
      if (!value) return false;
      values.push_back(*value);
    }
    return true;
  }

 private:
  std::uint64_t size_;
  PlyNumbers numbers_;
};

/// What a source keeps of its file.
struct PlyFile {
  FileBytes bytes;
  PlyForm form = PlyForm::little;
  PlyElement face;
  std::uint64_t face_start = 0;
  std::size_t corner_list = 0;
  VertexRows vertices;
};

/// The corners of all faces as fans, in batches.
class FaceReader {
 public:
  FaceReader(const PlyFile& ply, CornerBatch& batch)
      : ply_(ply), batch_(batch), cursor_(ply.bytes, ply.face_start, ply.form), at_(ply.face_start) {
    const PlyProperty& p = ply.face.properties[ply.corner_list];
    plain_ = ply.form == PlyForm::little && ply.face.properties.size() == 1 && ply_bytes(*p.list) == 1 &&
             (p.type == PlyType::i32 || p.type == PlyType::u32);
  }

  /// Fills the batch; it is empty at the end.
  Result<void> next() {
    batch_.first += batch_.corners.size() / 3;
    batch_.corners.clear();
    while (batch_.corners.size() < 3 * kBatchTriangles && face_ < ply_.face.count) {
      const std::uint64_t before = at_;
      if (auto read = plain_ ? read_plain() : read_any(); !read) return read;
      for (const double v : corners_) {
        if (v >= 0 && v < static_cast<double>(ply_.vertices.count) && v == std::floor(v)) continue;
        return fault("index_out_of_range",
                     "A vertex index is not one of the " + std::to_string(ply_.vertices.count) + " vertices.",
                     place_of(ply_.face, face_, before));
      }
      for (std::size_t k = 2; k < corners_.size(); ++k) {
        for (const std::size_t c : {std::size_t{0}, k - 1, k})
          batch_.corners.push_back(static_cast<std::uint32_t>(corners_[c]));
      }
      ++face_;
    }
    return {};
  }

 private:
  tl::unexpected<Fault> too_large(std::uint64_t byte) const {
    return fault("ply_face_too_large", "A face has more than " + std::to_string(kMostCorners) + " corners.",
                 place_of(ply_.face, face_, byte));
  }

  /// A byte that counts, then whole numbers of four bytes: what nearly all binary files have.
  Result<void> read_plain() {
    const Span file = ply_.bytes;
    const std::uint64_t left = file.size() - at_;
    const std::uint64_t count = left > 0 ? file[at_] : 1;
    if (left < 1 + 4 * count) return tl::make_unexpected(truncated(ply_.face, face_, at_));
    corners_.resize(count);
    const PlyType type = ply_.face.properties[0].type;
    for (std::size_t i = 0; i < count; ++i) corners_[i] = number_at(file.data() + at_ + 1 + 4 * i, type, false);
    at_ += 1 + 4 * count;
    return {};
  }

  Result<void> read_any() {
    for (std::size_t p = 0; p < ply_.face.properties.size(); ++p) {
      if (!cursor_.read(ply_.face.properties[p], values_))
        return tl::make_unexpected(truncated(ply_.face, face_, cursor_.at()));
      if (p == ply_.corner_list) corners_ = values_;
    }
    if (corners_.size() > kMostCorners) return too_large(at_);
    at_ = cursor_.at();
    return {};
  }

  const PlyFile& ply_;
  CornerBatch& batch_;
  Cursor cursor_;
  std::uint64_t at_, face_ = 0;
  bool plain_ = false;
  std::vector<double> values_, corners_;
};

Result<void> stream_ply(const PlyFile& ply, Detail detail, const TriangleSource::Take& take, Threads& threads) {
  CornerBatch corners;
  TriangleBatch batch;
  FaceReader faces(ply, corners);
  const VertexRows& rows = ply.vertices;
  const bool all = detail == Detail::all;
  for (;;) {
    threads.check();
    if (auto read = faces.next(); !read) return read;
    if (corners.corners.empty()) return {};
    batch.first = corners.first;
    batch.position.resize(corners.corners.size());
    if (all && rows.columns.has_normal()) batch.normal.resize(corners.corners.size());
    if (all && rows.columns.has_color()) batch.color.resize(corners.corners.size());
    const auto bad = fetch_corners(corners, threads, [&](std::uint32_t v, std::size_t i) {
      batch.position[i] = rows.triple(v, rows.columns.position);
      if (!batch.normal.empty()) {
        batch.normal[i] = normalized(to_float(rows.triple(v, rows.columns.normal)), Vec3f{});
      }
      if (!batch.color.empty()) {
        const Vec3d c = rows.triple(v, rows.columns.color);
        const auto linear = [&](double x) { return ply_color(rows.columns, x); };
        batch.color[i] = {linear(c.x), linear(c.y), linear(c.z)};
      }
      return is_sane_position(batch.position[i]) && (batch.color.empty() || is_finite(batch.color[i]));
    });
    if (bad) {
      const std::uint32_t v = corners.corners[*bad];
      const std::string byte = rows.in_file ? " at byte " + std::to_string(rows.start + v * rows.stride) : "";
      const bool finite = is_finite(batch.position[*bad]);
      return fault(finite ? "position_out_of_range" : "non_finite_geometry",
                   finite ? "A coordinate is larger than 1e18." : "A value is not finite.",
                   "element vertex " + std::to_string(v) + byte);
    }
    take(batch);
  }
}

/// Rows of the file itself.
VertexRows rows_in_place(const FileBytes& file, const PlyHeader& header, const PlyElement& e, std::uint64_t start) {
  VertexRows rows{.bytes = file,
                  .start = start,
                  .stride = row_bytes(e),
                  .count = e.count,
                  .big = header.form == PlyForm::big,
                  .columns = ply_columns(e)};
  std::uint64_t offset = 0;
  for (const PlyProperty& p : e.properties) {
    rows.types.push_back(p.type);
    rows.offsets.push_back(offset);
    offset += ply_bytes(p.type);
  }
  return rows;
}

/// Rows of doubles in a spill file, one for each property; a list stands for its first value.
Result<VertexRows> spill_rows(Cursor& cursor, const PlyElement& e, const StreamOptions& options) {
  KILN_TRY(spill, SpillFile::create(options.spill_folder));
  std::vector<double> values, rows;
  const auto flush = [&] {
    auto put = spill.append({reinterpret_cast<const std::uint8_t*>(rows.data()), rows.size() * sizeof(double)});
    rows.clear();
    return put;
  };
  for (std::uint64_t i = 0; i < e.count; ++i) {
    for (const PlyProperty& p : e.properties) {
      const std::uint64_t at = cursor.at();
      if (!cursor.read(p, values)) return tl::make_unexpected(truncated(e, i, cursor.at()));
      rows.push_back(values.empty() ? 0 : values[0]);
      if (!std::isfinite(rows.back())) {
        return fault("non_finite_geometry", "A value is not finite.", place_of(e, i, at));
      }
    }
    if (rows.size() < (1U << 16)) continue;
    if (auto put = flush(); !put) return tl::make_unexpected(put.error());
  }
  if (auto put = flush(); !put) return tl::make_unexpected(put.error());
  KILN_TRY(bytes, spill.bytes());
  VertexRows out{.bytes = std::move(bytes),
                 .stride = e.properties.size() * sizeof(double),
                 .count = e.count,
                 .in_file = false,
                 .columns = ply_columns(e)};
  for (std::size_t i = 0; i < e.properties.size(); ++i) {
    out.types.push_back(PlyType::f64);
    out.offsets.push_back(i * sizeof(double));
  }
  return out;
}

/// Leaves the cursor behind the element.
Result<void> skip(Cursor& cursor, const PlyElement& e) {
  std::vector<double> values;
  for (std::uint64_t i = 0; i < e.count && !e.properties.empty(); ++i) {
    for (const PlyProperty& p : e.properties) {
      if (!cursor.read(p, values)) return tl::make_unexpected(truncated(e, i, cursor.at()));
    }
  }
  return {};
}

/// Finds vertices and faces in the body.
Result<PlyFile> locate(const FileBytes& file, const PlyHeader& header, const StreamOptions& options) {
  PlyFile ply{.bytes = file, .form = header.form};
  bool vertices = false, faces = false;
  std::uint64_t at = header.bytes;
  for (const PlyElement& e : header.elements) {
    if (vertices && faces) break;
    const bool fixed = header.form != PlyForm::ascii && !has_list(e);
    if (e.name == "face" && !faces) {
      const auto list = ply_corner_list(e);
      if (!list) return fault("ply_invalid", "Faces have no list of vertex_indices.", "header");
      ply.face = e, ply.face_start = at, ply.corner_list = *list, faces = true;
      if (vertices) break;
    }
    Cursor cursor(file, at, header.form);
    if (e.name == "vertex" && !vertices) {
      if (!ply_columns(e).has_position()) return fault("ply_invalid", "Vertices have no x, y and z.", "header");
      if (e.count > 0xFFFFFFFFU) return fault("ply_invalid", "There are more than 2^32 vertices.", "header");
      vertices = true;
      if (fixed) {
        ply.vertices = rows_in_place(file, header, e, at);
      } else {
        KILN_TRY(rows, spill_rows(cursor, e, options));
        ply.vertices = std::move(rows);
      }
    } else if (!fixed) {
      if (auto skipped = skip(cursor, e); !skipped) return tl::make_unexpected(skipped.error());
    }
    if (!fixed) {
      at = cursor.at();
      continue;
    }
    const std::uint64_t row = row_bytes(e), left = file.size() - at;
    if (row > 0 && e.count > left / row) return tl::make_unexpected(truncated(e, left / row, file.size()));
    at += row * e.count;
  }
  if (!vertices || !faces || ply.face.count == 0 || ply.vertices.count == 0)
    return fault("empty_scene", "The file has no faces: there is no surface.");
  return ply;
}

}  // namespace

TriangleSource open_ply(const SceneFiles& files, const StreamOptions& options, Findings& findings) {
  TriangleSource source;
  const PlyHeader header = read_ply_header(files.main, findings);
  if (findings.failed()) return source;
  auto located = locate(files.main, header, options);
  if (!located) {
    findings.fail(located.error().code, located.error().message, located.error().where);
    return source;
  }
  const auto ply = std::make_shared<const PlyFile>(std::move(*located));
  source.triangles = ply->face.count;
  source.vertices = ply->vertices.count;
  source.normals = ply->vertices.columns.has_normal();
  source.colors = ply->vertices.columns.has_color();
  source.stream = [ply, name = files.name](Detail detail, const TriangleSource::Take& take, Threads& threads) {
    auto done = stream_ply(*ply, detail, take, threads);
    if (!done) done.error().where = name + ": " + done.error().where;
    return done;
  };
  return source;
}

}  // namespace kiln
