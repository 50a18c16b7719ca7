#include "core/artifact/grid_exr.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <optional>

#include "core/artifact/exr_parts.h"

namespace kiln {
namespace {

constexpr const char* kVersion = "2";
constexpr float kLeastHalf = 0x1p-24F;

/// The parts of the corners that count, four bytes of a cell in each.
constexpr std::array<const char*, 11> kCornerParts{
    "corners.px",      "corners.nx",      "corners.py",      "corners.ny",     "corners.pz",    "corners.nz",
    "corners.cells.x", "corners.cells.y", "corners.cells.z", "corners.room.0", "corners.room.1"};
constexpr std::size_t kCornerChannels = 4, kCells = 4 * kDirections, kRooms = 6 * kDirections;

/// Byte i of a cell, in the order of the parts and their channels.
std::uint8_t& corner_byte(CellCorners& cell, std::size_t i) {
  if (i >= kRooms) return cell.room[i - kRooms];
  CornerCut& side = cell.surface[i >= kCells ? (i - kCells) / 2 : i / 4];
  if (i >= kCells) return i % 2 == 0 ? side.below.cell : side.above.cell;
  return i % 4 == 0 ? side.direction : i % 4 == 1 ? side.offset : i % 4 == 2 ? side.below.bits : side.above.bits;
}
/// What it stays below.
int corner_limit(std::size_t i) {
  if (i >= kCells && i < kRooms) return CornerSet::kCells;
  return i < kCells && i % 4 == 0 ? CornerCut::kDirectionsOfPlanes : 256;
}

/// Directions are stored as they are, all else divided by the grid's scale.
bool is_scaled(GridBlend blend, std::size_t part) { return blend == GridBlend::exact || part % 2 == 0; }

float largest_value(const Grid& grid) {
  float most = 0;
  for (std::size_t k = 0; k < grid.parts.size(); ++k) {
    if (!is_scaled(grid.blend, k)) continue;
    for (const Vec3f& x : grid.parts[k]) most = std::max({most, std::abs(x.x), std::abs(x.y), std::abs(x.z)});
  }
  return most;
}

/// A power of two, so that scaling loses nothing: the largest value comes to lie between 16384 and 32768.
float scale_of(const Grid& grid) {
  const float most = largest_value(grid);
  if (!(most > 0)) return 1;
  return std::ldexp(1.0F, std::clamp(std::ilogb(most) - 14, -100, 113));
}

float stored(float x, float scale) {
  const float y = x / scale;
  return x != 0 && std::abs(y) < kLeastHalf ? std::copysign(kLeastHalf, x) : y;
}

std::string text_of(const Vec3d& v) {
  char out[96];
  std::snprintf(out, sizeof out, "%.17g %.17g %.17g", v.x, v.y, v.z);
  return out;
}

std::string text_of(float x) {
  char out[32];
  std::snprintf(out, sizeof out, "%.9g", double{x});
  return out;
}

/// The whole of `text` as numbers, or nothing.
template <std::size_t N>
std::optional<std::array<double, N>> numbers_of(const ExrPart& part, const char* name) {
  const auto found = part.text.find(name);
  if (found == part.text.end()) return std::nullopt;
  std::array<double, N> out{};
  const char* at = found->second.c_str();
  for (double& x : out) {
    char* end = nullptr;
    x = std::strtod(at, &end);
    if (end == at || !std::isfinite(x)) return std::nullopt;
    at = end;
  }
  return *at == '\0' ? std::optional(out) : std::nullopt;
}

std::string word_of(const ExrPart& part, const char* name) {
  const auto found = part.text.find(name);
  return found == part.text.end() ? std::string{} : found->second;
}

ExrPart part_of(const Grid& grid, std::size_t k, float scale) {
  const auto& [x, y, z] = grid.lattice.size;
  ExrPart part{.name = grid_part_names(grid.blend)[k], .width = x, .height = y * z};
  part.pixels.reserve(3 * grid.parts[k].size());
  for (const Vec3f& v : grid.parts[k]) {
    const float by = is_scaled(grid.blend, k) ? scale : 1;
    for (std::size_t c = 0; c < 3; ++c) part.pixels.push_back(stored(v[c], by));
  }
  return part;
}

ExrPart corners_of(const Grid& grid, std::size_t which) {
  const auto [x, y, z] = grid.lattice.cells();
  ExrPart part{.name = kCornerParts[which], .width = x, .height = y * z, .channels = int{kCornerChannels}};
  for (CellCorners cell : grid.cells) {
    for (std::size_t c = 0; c < kCornerChannels; ++c)
      part.pixels.push_back(corner_byte(cell, kCornerChannels * which + c));
  }
  return part;
}

Result<Lattice> lattice_of(const ExrPart& first, const std::string& name) {
  const auto size = numbers_of<3>(first, "kiln.size"), origin = numbers_of<3>(first, "kiln.origin"),
             spacing = numbers_of<3>(first, "kiln.spacing");
  if (!size || !origin || !spacing)
    return fault("grid_invalid", "kiln.size, kiln.origin and kiln.spacing must be three numbers each.", name);
  Lattice lattice{.origin = {(*origin)[0], (*origin)[1], (*origin)[2]},
                  .spacing = {(*spacing)[0], (*spacing)[1], (*spacing)[2]}};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double n = (*size)[axis];
    if (!(n >= 1 && n <= 4096 && n == std::floor(n)) || !((*spacing)[axis] > 0))
      return fault("grid_invalid", "kiln.size must be whole numbers from 1 to 4096 and kiln.spacing positive.", name);
    lattice.size[axis] = static_cast<int>(n);
  }
  return lattice;
}

const ExrPart* find_part(const std::vector<ExrPart>& parts, const std::string& part_name, int width, int height,
                         int channels) {
  const auto found = std::find_if(parts.begin(), parts.end(), [&](const ExrPart& p) { return p.name == part_name; });
  const bool fits =
      found != parts.end() && found->width == width && found->height == height && found->channels >= channels;
  return fits ? &*found : nullptr;
}

/// The corners that count, or none where the file has no such parts.
Result<std::vector<CellCorners>> read_corners(const std::vector<ExrPart>& parts, const Lattice& lattice,
                                              const std::string& name) {
  const auto [x, y, z] = lattice.cells();
  const bool any = std::any_of(parts.begin(), parts.end(), [](auto& p) { return p.name.rfind("corners.", 0) == 0; });
  if (!any) return std::vector<CellCorners>{};
  std::vector<CellCorners> cells(lattice.cell_count());
  for (std::size_t which = 0; which < kCornerParts.size(); ++which) {
    const std::string what = std::string("Part ") + kCornerParts[which];
    const ExrPart* part = find_part(parts, kCornerParts[which], x, y * z, int{kCornerChannels});
    if (!part) return fault("grid_invalid", what + " is missing or has another size.", name);
    for (std::size_t i = 0; i < cells.size(); ++i) {
      for (std::size_t c = 0; c < kCornerChannels; ++c) {
        const float value = part->pixels[i * static_cast<std::size_t>(part->channels) + c];
        const int limit = corner_limit(kCornerChannels * which + c);
        if (!(value >= 0 && value < static_cast<float>(limit)) || value != std::floor(value))
          return fault("grid_invalid", what + " must hold whole numbers below " + std::to_string(limit) + ".", name);
        corner_byte(cells[i], kCornerChannels * which + c) = static_cast<std::uint8_t>(value);
      }
    }
  }
  return cells;
}

}  // namespace

std::vector<std::string> grid_part_names(GridBlend blend) {
  if (blend == GridBlend::exact) return {"phi.x", "phi.y", "phi.z", "a.x", "a.y", "a.z", "b.xy", "b.xz", "b.yz"};
  std::vector<std::string> out;
  for (const char* direction : {"px", "nx", "py", "ny", "pz", "nz"}) {
    for (const char* what : {".color", ".direction"}) out.push_back(std::string(direction) + what);
  }
  return out;
}

bool looks_like_grid(std::span<const std::uint8_t> file) { return looks_like_exr_parts(file); }

Bytes write_grid_exr(const Grid& grid, const Frame& frame, const std::string& provenance) {
  const float scale = scale_of(grid);
  std::vector<ExrPart> parts;
  for (std::size_t k = 0; k < grid.parts.size(); ++k) parts.push_back(part_of(grid, k, scale));
  for (std::size_t k = 0; k < kCornerParts.size() && !grid.cells.empty(); ++k) parts.push_back(corners_of(grid, k));
  const auto& [x, y, z] = grid.lattice.size;
  parts[0].text = {
      {"kiln.grid", kVersion},
      {"kiln.blend", grid.blend == GridBlend::exact ? "exact" : "paper"},
      {"kiln.content", grid.content == GridContent::indirect ? "indirect" : "all"},
      {"kiln.size", std::to_string(x) + " " + std::to_string(y) + " " + std::to_string(z)},
      {"kiln.origin", text_of(frame.to_world(grid.lattice.origin))},
      {"kiln.spacing", text_of(grid.lattice.spacing * frame.scale)},
      {"kiln.scale", text_of(scale)},
      {"kiln.axes", "glTF: right-handed, +Y up, metres"},
      {"kiln.quantity", "irradiance, W m^-2; a value is its pixel times kiln.scale"},
      {"kiln.layout", "column i of row k * size.y + j is vertex (i, j, k), at origin + (i, j, k) * spacing"},
      {"kiln.provenance", provenance}};
  return write_exr_parts(parts);
}

Result<Grid> read_grid_exr(std::span<const std::uint8_t> file, const std::string& name) {
  KILN_TRY(parts, read_exr_parts(file, name));
  const ExrPart& first = parts.front();
  const std::string blend = word_of(first, "kiln.blend"), content = word_of(first, "kiln.content");
  if (word_of(first, "kiln.grid") != kVersion || (blend != "exact" && blend != "paper") ||
      (content != "indirect" && content != "all"))
    return fault("grid_invalid", "The first part must have kiln.grid 2, kiln.blend and kiln.content.", name);
  const auto scale = numbers_of<1>(first, "kiln.scale");
  if (!scale || !((*scale)[0] > 0)) return fault("grid_invalid", "kiln.scale must be a positive number.", name);
  KILN_TRY(lattice, lattice_of(first, name));
  Grid grid{.lattice = lattice,
            .blend = blend == "exact" ? GridBlend::exact : GridBlend::paper,
            .content = content == "all" ? GridContent::all : GridContent::indirect};
  const auto& [x, y, z] = lattice.size;
  const std::vector<std::string> names = grid_part_names(grid.blend);
  for (std::size_t k = 0; k < names.size(); ++k) {
    const ExrPart* part = find_part(parts, names[k], x, y * z, 3);
    if (!part) return fault("grid_invalid", "Part " + names[k] + " is missing or has another size.", name);
    const auto by = static_cast<float>(is_scaled(grid.blend, k) ? (*scale)[0] : 1);
    std::vector<Vec3f>& values = grid.parts.emplace_back(lattice.vertices());
    for (std::size_t v = 0; v < values.size(); ++v) {
      const float* pixel = part->pixels.data() + v * static_cast<std::size_t>(part->channels);
      values[v] = Vec3f{pixel[0], pixel[1], pixel[2]} * by;
      if (!is_finite(values[v])) return fault("grid_invalid", "Part " + names[k] + " holds no finite numbers.", name);
    }
  }
  KILN_TRY(cells, read_corners(parts, lattice, name));
  grid.cells = std::move(cells);
  return grid;
}

}  // namespace kiln
