#include "core/artifact/grid_exr.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <optional>

#include "core/artifact/exr_parts.h"

namespace kiln {
namespace {

constexpr const char* kVersion = "3";
constexpr const char* kBeforeBricks = "2";  // read too: all that it holds means the same
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
  if (i >= kCells && i < kRooms) return CornerSet::kUnseen + 1;
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
  for (const Grid& finer : grid.finer) most = std::max(most, largest_value(finer));
  return most;
}

/// Rows and columns of a part: of a whole lattice z slices of y rows, of bricks a row each.
struct PartSize {
  int width = 0, height = 0;
};
PartSize vertex_rows(const Lattice& lattice) {
  if (lattice.in_bricks()) return {Bricks::kVertices, static_cast<int>(lattice.bricks.block.size())};
  return {lattice.size[0], lattice.size[1] * lattice.size[2]};
}
PartSize cell_rows(const Lattice& lattice) {
  if (lattice.in_bricks()) return {Bricks::kCells, static_cast<int>(lattice.bricks.block.size())};
  const auto [x, y, z] = lattice.cells();
  return {x, y * z};
}
PartSize block_rows(const Lattice& lattice) {
  const auto [x, y, z] = blocks_along(lattice);
  return {x, y * z};
}

/// Which vertex the pixels of vertex_rows hold, in their order.
std::size_t vertex_of_pixel(const Lattice& lattice, std::size_t pixel) {
  return lattice.in_bricks() ? lattice.bricks.vertex[pixel] : pixel;
}

/// Before the names of the parts of lattice k beyond the base.
std::string prefix_of(std::size_t k) { return "finer." + std::to_string(k + 1) + "."; }
constexpr int kNumberBase = 1024;  // of a brick's number: halves hold whole numbers up to 2048

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
  const PartSize size = vertex_rows(grid.lattice);
  const std::size_t pixels = static_cast<std::size_t>(size.width) * static_cast<std::size_t>(size.height);
  ExrPart part{.name = grid_part_names(grid.blend)[k], .width = size.width, .height = size.height};
  part.pixels.reserve(3 * pixels);
  for (std::size_t i = 0; i < pixels; ++i) {
    const Vec3f& v = grid.parts[k][vertex_of_pixel(grid.lattice, i)];
    const float by = is_scaled(grid.blend, k) ? scale : 1;
    for (std::size_t c = 0; c < 3; ++c) part.pixels.push_back(stored(v[c], by));
  }
  return part;
}

/// The brick of each block: its number's last and first digits to the base of kNumberBase, and whether there is one.
ExrPart numbers_of_bricks(const Lattice& lattice) {
  const PartSize size = block_rows(lattice);
  ExrPart part{.name = "bricks", .width = size.width, .height = size.height};
  for (const std::int32_t n : lattice.bricks.number) {
    const int number = std::max(n, 0);
    for (const int x : {number % kNumberBase, number / kNumberBase, n < 0 ? 0 : 1})
      part.pixels.push_back(static_cast<float>(x));
  }
  return part;
}

ExrPart corners_of(const Grid& grid, std::size_t which) {
  const PartSize size = cell_rows(grid.lattice);
  ExrPart part{
      .name = kCornerParts[which], .width = size.width, .height = size.height, .channels = int{kCornerChannels}};
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

/// What the parts of a file have in common.
struct GridFile {
  const std::vector<ExrPart>& parts;
  const std::string& name;
  float scale;
};

/// The corners that count, or none where the file has no such parts.
Result<std::vector<CellCorners>> read_corners(const GridFile& file, const std::string& prefix, const Lattice& lattice) {
  const auto& [parts, name, scale] = file;
  const PartSize size = cell_rows(lattice);
  const bool any = std::any_of(parts.begin(), parts.end(), [](auto& p) { return p.name.rfind("corners.", 0) == 0; });
  if (!any) return std::vector<CellCorners>{};
  std::vector<CellCorners> cells(lattice.cell_count());
  for (std::size_t which = 0; which < kCornerParts.size(); ++which) {
    const std::string what = "Part " + prefix + kCornerParts[which];
    const ExrPart* part = find_part(parts, prefix + kCornerParts[which], size.width, size.height, int{kCornerChannels});
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

/// Values and corners of a lattice, which is filled in.
Result<Grid> read_lattice(const GridFile& file, const std::string& prefix, Grid grid) {
  const PartSize size = vertex_rows(grid.lattice);
  const std::size_t pixels = static_cast<std::size_t>(size.width) * static_cast<std::size_t>(size.height);
  const std::vector<std::string> names = grid_part_names(grid.blend);
  for (std::size_t k = 0; k < names.size(); ++k) {
    const std::string what = "Part " + prefix + names[k];
    const ExrPart* part = find_part(file.parts, prefix + names[k], size.width, size.height, 3);
    if (!part) return fault("grid_invalid", what + " is missing or has another size.", file.name);
    const float by = is_scaled(grid.blend, k) ? file.scale : 1;
    std::vector<Vec3f>& values = grid.parts.emplace_back(grid.lattice.vertices());
    for (std::size_t i = 0; i < pixels; ++i) {
      const float* pixel = part->pixels.data() + i * static_cast<std::size_t>(part->channels);
      const Vec3f value = Vec3f{pixel[0], pixel[1], pixel[2]} * by;
      if (!is_finite(value)) return fault("grid_invalid", what + " holds no finite numbers.", file.name);
      values[vertex_of_pixel(grid.lattice, i)] = value;
    }
  }
  KILN_TRY(cells, read_corners(file, prefix, grid.lattice));
  grid.cells = std::move(cells);
  return grid;
}

/// The blocks that are stored. Their numbers must count up in the order of the blocks.
Result<Lattice> read_bricks(const GridFile& file, const std::string& prefix, const Lattice& whole) {
  const PartSize size = block_rows(whole);
  const std::string what = "Part " + prefix + "bricks";
  const ExrPart* part = find_part(file.parts, prefix + "bricks", size.width, size.height, 3);
  if (!part) return fault("grid_invalid", what + " is missing or has another size.", file.name);
  const std::size_t pixels = static_cast<std::size_t>(size.width) * static_cast<std::size_t>(size.height);
  std::vector<std::uint32_t> blocks;
  for (std::size_t i = 0; i < pixels; ++i) {
    const float* pixel = part->pixels.data() + i * static_cast<std::size_t>(part->channels);
    if (pixel[2] == 0) continue;
    const auto number = static_cast<int>(blocks.size());
    const int low = number % kNumberBase, high = number / kNumberBase;
    if (pixel[2] != 1 || pixel[0] != static_cast<float>(low) || pixel[1] != static_cast<float>(high))
      return fault("grid_invalid", what + " must number its bricks in their order.", file.name);
    blocks.push_back(static_cast<std::uint32_t>(i));
  }
  if (blocks.empty()) return fault("grid_invalid", what + " has no bricks.", file.name);
  return in_bricks(whole, std::move(blocks));
}

Result<std::size_t> finer_count(const ExrPart& first, const std::string& name) {
  if (word_of(first, "kiln.finer").empty()) return std::size_t{0};
  const auto count = numbers_of<1>(first, "kiln.finer");
  if (!count || !((*count)[0] >= 1 && (*count)[0] <= 8) || (*count)[0] != std::floor((*count)[0]))
    return fault("grid_invalid", "kiln.finer must be a whole number from 1 to 8.", name);
  return static_cast<std::size_t>((*count)[0]);
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
  for (std::size_t k = 0; k < grid.finer.size(); ++k) {
    const Grid& finer = grid.finer[k];
    const std::size_t begin = parts.size();
    parts.push_back(numbers_of_bricks(finer.lattice));
    for (std::size_t i = 0; i < finer.parts.size(); ++i) parts.push_back(part_of(finer, i, scale));
    for (std::size_t i = 0; i < kCornerParts.size() && !finer.cells.empty(); ++i) parts.push_back(corners_of(finer, i));
    for (std::size_t i = begin; i < parts.size(); ++i) parts[i].name = prefix_of(k) + parts[i].name;
  }
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
  if (!grid.finer.empty()) parts[0].text["kiln.finer"] = std::to_string(grid.finer.size());
  return write_exr_parts(parts);
}

Result<Grid> read_grid_exr(std::span<const std::uint8_t> file, const std::string& name) {
  KILN_TRY(parts, read_exr_parts(file, name));
  const ExrPart& first = parts.front();
  const std::string blend = word_of(first, "kiln.blend"), content = word_of(first, "kiln.content");
  const std::string version = word_of(first, "kiln.grid");
  if ((version != kVersion && version != kBeforeBricks) || (blend != "exact" && blend != "paper") ||
      (content != "indirect" && content != "all"))
    return fault("grid_invalid", "The first part must have kiln.grid 2 or 3, kiln.blend and kiln.content.", name);
  const auto scale = numbers_of<1>(first, "kiln.scale");
  if (!scale || !((*scale)[0] > 0)) return fault("grid_invalid", "kiln.scale must be a positive number.", name);
  KILN_TRY(lattice, lattice_of(first, name));
  Grid grid{.lattice = lattice,
            .blend = blend == "exact" ? GridBlend::exact : GridBlend::paper,
            .content = content == "all" ? GridContent::all : GridContent::indirect};
  const GridFile read{parts, name, static_cast<float>((*scale)[0])};
  KILN_TRY(count, finer_count(first, name));
  const Grid empty = grid;
  KILN_TRY(base, read_lattice(read, "", std::move(grid)));
  for (std::size_t k = 0; k < count; ++k) {
    Grid finer = empty;
    finer.lattice = finer_lattice(lattice, k);
    if (*std::max_element(finer.lattice.size.begin(), finer.lattice.size.end()) > 4096)
      return fault("grid_invalid", "kiln.size doubled kiln.finer times is beyond 4096.", name);
    KILN_TRY(stored, read_bricks(read, prefix_of(k), finer.lattice));
    finer.lattice = std::move(stored);
    KILN_TRY(whole, read_lattice(read, prefix_of(k), std::move(finer)));
    base.finer.push_back(std::move(whole));
  }
  return base;
}

}  // namespace kiln
