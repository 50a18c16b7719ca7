#include "core/artifact/exr_reader.h"

#include <Imath/ImathBox.h>
#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfIO.h>
#include <OpenEXR/ImfInputFile.h>
#include <OpenEXR/ImfInputPart.h>
#include <OpenEXR/ImfMultiPartInputFile.h>
#include <OpenEXR/ImfStandardAttributes.h>
#include <OpenEXR/ImfStringAttribute.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <optional>
#include <stdexcept>
#include <string_view>

#include "core/artifact/exr_parts.h"
#include "core/artifact/hdr_reader.h"

namespace kiln {
namespace {

using Span = std::span<const std::uint8_t>;

/// Feeds OpenEXR from memory.
class MemoryStream : public Imf::IStream {
 public:
  explicit MemoryStream(Span file) : Imf::IStream("environment"), file_(file) {}
  bool read(char out[], int n) override {
    if (n < 0 || static_cast<std::uint64_t>(n) > file_.size() - at_) throw std::runtime_error("end of file");
    std::memcpy(out, file_.data() + at_, static_cast<std::size_t>(n));
    at_ += static_cast<std::uint64_t>(n);
    return at_ < file_.size();
  }
  std::uint64_t tellg() override { return at_; }
  void seekg(std::uint64_t to) override { at_ = std::min<std::uint64_t>(to, file_.size()); }

 private:
  Span file_;
  std::uint64_t at_ = 0;
};

/// Version 2 with none of: tiled 0x200, deep 0x800, multi-part 0x1000 (long names 0x400 do no harm).
bool is_simple_scanline(Span file) {
  constexpr unsigned kForbidden = 0x02 | 0x08 | 0x10;
  return file.size() >= 8 && file[4] == 2 && (file[5] & kForbidden) == 0;
}

std::int64_t width_of(const Imath::Box2i& w) { return std::int64_t{w.max.x} - w.min.x + 1; }
std::int64_t height_of(const Imath::Box2i& w) { return std::int64_t{w.max.y} - w.min.y + 1; }

bool allowed(const Imath::Box2i& w) {
  return width_of(w) >= 1 && height_of(w) >= 1 && width_of(w) <= kMaxEnvironmentWidth &&
         height_of(w) <= kMaxEnvironmentHeight;
}

bool has_full(const Imf::ChannelList& channels, const char* name) {
  const Imf::Channel* found = channels.findChannel(name);
  return found && found->xSampling == 1 && found->ySampling == 1;
}

/// Channels of red, green and blue: all of them Y in a grey picture. Nothing where there are none.
std::optional<std::array<const char*, 3>> colour_channels(const Imf::ChannelList& channels) {
  if (has_full(channels, "R") && has_full(channels, "G") && has_full(channels, "B")) return {{"R", "G", "B"}};
  const bool grey = has_full(channels, "Y") && !channels.findChannel("RY") && !channels.findChannel("BY");
  if (grey) return {{"Y", "Y", "Y"}};
  return std::nullopt;
}

/// The pixels of the data window, row by row.
std::vector<Vec3f> read_window(Imf::InputFile& input, const std::array<const char*, 3>& names) {
  const Imath::Box2i window = input.header().dataWindow();
  const std::int64_t width = width_of(window);
  std::vector<Vec3f> out(static_cast<std::size_t>(width * height_of(window)));
  char* base = reinterpret_cast<char*>(out.data()) -
               (window.min.x + window.min.y * width) * static_cast<std::int64_t>(sizeof(Vec3f));
  const bool grey = names[0] == names[1];
  Imf::FrameBuffer frame;
  for (std::size_t c = 0; c < (grey ? 1U : 3U); ++c) {
    frame.insert(names[c], Imf::Slice(Imf::FLOAT, base + c * sizeof(float), sizeof(Vec3f),
                                      static_cast<std::size_t>(width) * sizeof(Vec3f)));
  }
  input.setFrameBuffer(frame);
  input.readPixels(window.min.y, window.max.y);
  if (grey) {
    for (Vec3f& p : out) p = {p.x, p.x, p.x};
  }
  return out;
}

/// What a data window shows of the picture, which is the display window: black where it has nothing.
std::vector<Vec3f> placed(const std::vector<Vec3f>& pixels, const Imath::Box2i& data, const Imath::Box2i& display) {
  if (data == display) return pixels;
  const std::int64_t width = width_of(display);
  std::vector<Vec3f> out(static_cast<std::size_t>(width * height_of(display)));
  const std::int64_t left = std::max(data.min.x, display.min.x), right = std::min(data.max.x, display.max.x);
  for (std::int64_t y = std::max(data.min.y, display.min.y); y <= std::min(data.max.y, display.max.y); ++y) {
    if (left > right) break;
    const auto from = pixels.begin() + (y - data.min.y) * width_of(data) + (left - data.min.x);
    std::copy_n(from, right - left + 1, out.begin() + (y - display.min.y) * width + (left - display.min.x));
  }
  return out;
}

Result<Environment> read_pixels(Span file, const std::string& name) {
  MemoryStream stream(file);
  Imf::InputFile input(stream, 1);
  const Imf::Header& header = input.header();
  const Imath::Box2i data = header.dataWindow(), display = header.displayWindow();
  if (!allowed(data) || !allowed(display)) {
    return fault("image_too_large",
                 std::to_string(width_of(data)) + " x " + std::to_string(height_of(data)) + " pixels in " +
                     std::to_string(width_of(display)) + " x " + std::to_string(height_of(display)) +
                     "; an environment may have 8192 x 4096.",
                 name);
  }
  if (Imf::hasEnvmap(header) && Imf::envmap(header) == Imf::ENVMAP_CUBE)
    return fault("exr_unsupported", "The picture is a cube map; save it as latitude and longitude.", name);
  const auto names = colour_channels(header.channels());
  if (!names)
    return fault("exr_unsupported", "The picture must have full channels named R, G and B, or Y alone.", name);
  return Environment{.name = name,
                     .width = static_cast<int>(width_of(display)),
                     .height = static_cast<int>(height_of(display)),
                     .radiance = placed(read_window(input, *names), data, display)};
}

constexpr const char* kChannels[] = {"R", "G", "B", "A"};
constexpr std::uint64_t kMostInflation = 600;  // pixels from a byte: deflate makes 1032 bytes at most, a half has two

/// Version 2 with multi-part 0x1000, but neither tiled 0x200 nor deep 0x800.
bool is_scanline_parts(Span file) { return looks_like_exr_parts(file) && (file[5] & (0x02 | 0x08)) == 0; }

/// The NUL-terminated text at `at`, which is moved behind it; nothing when it does not end within 255 bytes.
std::optional<std::string_view> take_text(Span file, std::size_t& at) {
  const auto rest = file.subspan(std::min(at, file.size()));
  const auto end =
      std::find(rest.begin(), rest.begin() + static_cast<std::ptrdiff_t>(std::min<std::size_t>(256, rest.size())), 0);
  if (end == rest.end() || *end != 0) return std::nullopt;
  const auto length = static_cast<std::size_t>(end - rest.begin());
  at += length + 1;
  return std::string_view(reinterpret_cast<const char*>(rest.data()), length);
}

std::int64_t int_at(Span file, std::size_t at) {
  std::int32_t value = 0;
  std::memcpy(&value, file.data() + at, sizeof value);
  return value;
}

/// Whether no header speaks of more than a file of this size can hold: OpenEXR makes room before it reads.
bool headers_fit(Span file) {
  const auto most = static_cast<std::int64_t>(kMostInflation * file.size());
  for (std::size_t at = 8; at < file.size();) {
    if (file[at] == 0) return true;  // the empty header behind the last one
    while (at < file.size() && file[at] != 0) {
      const auto name = take_text(file, at);
      const auto type = take_text(file, at);
      if (!name || !type || file.size() - std::min(at, file.size()) < 4) return false;
      const std::int64_t size = int_at(file, at);
      at += 4;
      if (size < 0 || static_cast<std::uint64_t>(size) > file.size() - at) return false;
      if (*name == "chunkCount" && (size != 4 || int_at(file, at) < 1 || int_at(file, at) > most)) return false;
      if (*name == "dataWindow" || *name == "displayWindow") {
        if (size != 16) return false;
        const std::int64_t width = int_at(file, at + 8) - int_at(file, at) + 1,
                           height = int_at(file, at + 12) - int_at(file, at + 4) + 1;
        if (width < 1 || height < 1 || width > most || height > most / width) return false;
      }
      at += static_cast<std::size_t>(size);
    }
    ++at;
  }
  return false;
}

Result<ExrPart> describe_part(const Imf::Header& header, const std::string& name) {
  const Imath::Box2i& window = header.dataWindow();
  const std::int64_t width = std::int64_t{window.max.x} - window.min.x + 1,
                     height = std::int64_t{window.max.y} - window.min.y + 1;
  if (!header.hasName() || window.min != Imath::V2i(0, 0) || width < 1 || height < 1)
    return fault("exr_unsupported", "A part must have a name and start at 0, 0.", name);
  ExrPart part{.name = header.name(), .width = static_cast<int>(width), .height = static_cast<int>(height)};
  part.channels = 0;
  for (const char* channel : kChannels) {
    const Imf::Channel* found = header.channels().findChannel(channel);
    if (!found) break;
    if (found->xSampling != 1 || found->ySampling != 1) break;
    ++part.channels;
  }
  if (part.channels == 0) return fault("exr_unsupported", "A part must have a full channel named R.", name);
  for (auto it = header.begin(); it != header.end(); ++it) {
    if (const auto* text = dynamic_cast<const Imf::StringAttribute*>(&it.attribute()))
      part.text[it.name()] = text->value();
  }
  return part;
}

void read_part_pixels(Imf::MultiPartInputFile& input, int index, ExrPart& part) {
  const auto channels = static_cast<std::size_t>(part.channels), width = static_cast<std::size_t>(part.width);
  part.pixels.resize(width * static_cast<std::size_t>(part.height) * channels);
  Imf::FrameBuffer frame;
  for (std::size_t c = 0; c < channels; ++c) {
    frame.insert(kChannels[c], Imf::Slice(Imf::FLOAT, reinterpret_cast<char*>(part.pixels.data() + c),
                                          channels * sizeof(float), width * channels * sizeof(float)));
  }
  Imf::InputPart from(input, index);
  from.setFrameBuffer(frame);
  from.readPixels(0, part.height - 1);
}

Result<std::vector<ExrPart>> read_parts(Span file, const std::string& name, const ExrLimits& limits) {
  MemoryStream stream(file);
  Imf::MultiPartInputFile input(stream, 0);
  if (static_cast<std::size_t>(input.parts()) > limits.most_parts)
    return fault("exr_unsupported", "The file has more than " + std::to_string(limits.most_parts) + " parts.", name);
  std::vector<ExrPart> out;
  std::uint64_t pixels = 0;
  for (int i = 0; i < input.parts(); ++i) {
    KILN_TRY(part, describe_part(input.header(i), name));
    pixels += static_cast<std::uint64_t>(part.width) * static_cast<std::uint64_t>(part.height);
    if (pixels > std::min<std::uint64_t>(limits.most_pixels, kMostInflation * file.size()))
      return fault("image_too_large", "The parts have more pixels than are allowed or than such a file can hold.",
                   name);
    out.push_back(std::move(part));
  }
  for (int i = 0; i < input.parts(); ++i) read_part_pixels(input, i, out[static_cast<std::size_t>(i)]);
  return out;
}

}  // namespace

bool looks_like_exr_parts(Span file) {
  return looks_like_exr(file) && file.size() >= 8 && file[4] == 2 && (file[5] & 0x10) != 0;
}

Result<std::vector<ExrPart>> read_exr_parts(Span file, const std::string& name, const ExrLimits& limits) {
  if (!is_scanline_parts(file))
    return fault("exr_unsupported", "Only multi-part files of plain scan lines are read here.", name);
  if (!headers_fit(file))
    return fault("exr_invalid", "The headers are damaged or speak of more than the file holds.", name);
  try {
    return read_parts(file, name, limits);
  } catch (const std::exception&) {
    return fault("exr_invalid", "The file cannot be read as OpenEXR.", name);
  }
}

bool looks_like_exr(Span file) {
  return file.size() >= 4 && file[0] == 0x76 && file[1] == 0x2F && file[2] == 0x31 && file[3] == 0x01;
}

Result<Environment> read_exr(Span file, const std::string& name) {
  if (!is_simple_scanline(file)) {
    return fault("exr_unsupported", "Deep, tiled and multi-part files are not read; save it as plain scanlines.", name);
  }
  try {
    return read_pixels(file, name);
  } catch (const std::exception&) {
    return fault("exr_invalid", "The file cannot be read as OpenEXR.", name);
  }
}

}  // namespace kiln
