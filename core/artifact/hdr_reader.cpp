#include "core/artifact/hdr_reader.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <optional>
#include <string_view>

namespace kiln {
namespace {

using Span = std::span<const std::uint8_t>;
using Rgbe = std::array<std::uint8_t, 4>;

constexpr std::size_t kMaxHeaderBytes = 64 * 1024;

/// Takes one line off the front; nothing if there is no end of line in reach.
std::optional<std::string> take_line(Span& file) {
  const Span reach = file.first(std::min(file.size(), kMaxHeaderBytes));
  const auto end = std::find(reach.begin(), reach.end(), '\n');
  if (end == reach.end()) return std::nullopt;
  std::string line(reach.begin(), end);
  file = file.subspan(line.size() + 1);
  return line;
}

struct Header {
  int width = 0, height = 0;
  float exposure = 1;
  bool valid = false;
};

bool read_number(std::string_view& text, int& out) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), out);
  text.remove_prefix(static_cast<std::size_t>(end - text.data()));
  return error == std::errc();
}

/// "-Y height +X width".
bool read_resolution(std::string_view line, Header& header) {
  if (line.substr(0, 3) != "-Y ") return false;
  line.remove_prefix(3);
  if (!read_number(line, header.height) || line.substr(0, 4) != " +X ") return false;
  line.remove_prefix(4);
  return read_number(line, header.width);
}

void read_exposure(std::string_view line, Header& header) {
  constexpr std::string_view kKey = "EXPOSURE=";
  if (line.substr(0, kKey.size()) != kKey) return;
  line.remove_prefix(std::min(line.size(), line.find_first_not_of(' ', kKey.size())));
  float exposure = 1;
  std::from_chars(line.data(), line.data() + line.size(), exposure);
  if (std::isfinite(exposure) && exposure > 0) header.exposure *= exposure;
}

Header read_header(Span& file) {
  Header header;
  bool rgbe = true;
  for (std::size_t lines = 0; lines < 1000; ++lines) {
    const auto line = take_line(file);
    if (!line) return header;
    if (line->empty()) break;
    if (line->rfind("FORMAT=", 0) == 0) rgbe = line->rfind("FORMAT=32-bit_rle_rgbe", 0) == 0;
    read_exposure(*line, header);
  }
  const auto resolution = take_line(file);
  header.valid = rgbe && resolution && read_resolution(*resolution, header);
  return header;
}

/// New run lengths: each of the four components of a row by itself.
bool read_component_row(Span& in, std::vector<Rgbe>& row) {
  for (std::size_t component = 0; component < 4; ++component) {
    for (std::size_t x = 0; x < row.size();) {
      if (in.size() < 2) return false;
      const bool run = in[0] > 128;
      const std::size_t count = run ? in[0] - 128U : in[0];
      if (count == 0 || count > row.size() - x || (!run && in.size() < 1 + count)) return false;
      for (std::size_t i = 0; i < count; ++i) row[x + i][component] = in[run ? 1 : 1 + i];
      in = in.subspan(run ? 2 : 1 + count);
      x += count;
    }
  }
  return true;
}

/// Flat pixels, and old run lengths: 1 1 1 n repeats the last pixel, further ones count for 256 times as much.
bool read_flat_row(Span& in, std::vector<Rgbe>& row) {
  int shift = 0;
  for (std::size_t x = 0; x < row.size();) {
    if (in.size() < 4) return false;
    const Rgbe pixel{in[0], in[1], in[2], in[3]};
    in = in.subspan(4);
    if (pixel[0] != 1 || pixel[1] != 1 || pixel[2] != 1) {
      row[x++] = pixel;
      shift = 0;
      continue;
    }
    if (x == 0 || shift > 16) return false;
    const std::size_t count = static_cast<std::size_t>(pixel[3]) << shift;
    if (count > row.size() - x) return false;
    const Rgbe last = row[x - 1];
    std::fill_n(row.begin() + static_cast<std::ptrdiff_t>(x), count, last);
    x += count;
    shift += 8;
  }
  return true;
}

bool read_row(Span& in, std::vector<Rgbe>& row) {
  const std::size_t width = row.size();
  const bool components = width >= 8 && width < 32768 && in.size() >= 4 && in[0] == 2 && in[1] == 2 && in[2] < 128;
  if (!components) return read_flat_row(in, row);
  if (static_cast<std::size_t>(in[2] * 256 + in[3]) != width) return false;
  in = in.subspan(4);
  return read_component_row(in, row);
}

Vec3f to_radiance(const Rgbe& p, float exposure) {
  if (p[3] == 0) return {0, 0, 0};
  const float scale = std::ldexp(1.0F / exposure, static_cast<int>(p[3]) - 128 - 8);
  return Vec3f{static_cast<float>(p[0]), static_cast<float>(p[1]), static_cast<float>(p[2])} * scale;
}

}  // namespace

bool looks_like_hdr(Span file) { return file.size() >= 2 && file[0] == '#' && file[1] == '?'; }

Result<Environment> read_hdr(Span file, const std::string& name) {
  const Header header = read_header(file);
  if (!header.valid || header.width < 1 || header.height < 1) {
    return fault("hdr_invalid", "The header is not that of an RGBE picture with rows from top to bottom.", name);
  }
  if (header.width > kMaxEnvironmentWidth || header.height > kMaxEnvironmentHeight) {
    return fault("image_too_large",
                 std::to_string(header.width) + " x " + std::to_string(header.height) +
                     " pixels; an environment may have 8192 x 4096.",
                 name);
  }
  Environment out{.name = name, .width = header.width, .height = header.height, .radiance = {}};
  std::vector<Rgbe> row(static_cast<std::size_t>(header.width));
  for (int y = 0; y < header.height; ++y) {
    if (!read_row(file, row))
      return fault("hdr_truncated", "The pixels end early or are not encoded as they should.",
                   name + ": row " + std::to_string(y));
    for (const Rgbe& pixel : row) out.radiance.push_back(to_radiance(pixel, header.exposure));
  }
  return out;
}

}  // namespace kiln
