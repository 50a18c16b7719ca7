#include <Imath/ImathBox.h>
#include <Imath/half.h>
#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfIO.h>
#include <OpenEXR/ImfMultiPartOutputFile.h>
#include <OpenEXR/ImfOutputPart.h>
#include <OpenEXR/ImfPartType.h>
#include <OpenEXR/ImfStringAttribute.h>

#include <algorithm>

#include "core/artifact/exr_parts.h"
#include "core/base/expects.h"

namespace kiln {
namespace {

constexpr const char* kChannels[] = {"R", "G", "B", "A"};

/// Takes OpenEXR's bytes.
class MemoryOutput : public Imf::OStream {
 public:
  MemoryOutput() : Imf::OStream("memory") {}
  void write(const char c[], int n) override {
    const auto count = static_cast<std::size_t>(n);
    if (bytes.size() < at_ + count) bytes.resize(at_ + count);
    std::copy(c, c + n, bytes.begin() + static_cast<std::ptrdiff_t>(at_));
    at_ += count;
  }
  std::uint64_t tellp() override { return at_; }
  void seekp(std::uint64_t to) override { at_ = to; }

  Bytes bytes;

 private:
  std::size_t at_ = 0;
};

Imf::Header header_of(const ExrPart& part, const Imath::Box2i& display) {
  const Imath::Box2i window(Imath::V2i(0, 0), Imath::V2i(part.width - 1, part.height - 1));
  Imf::Header header(display, window, 1, Imath::V2f(0, 0), 1, Imf::INCREASING_Y, Imf::ZIP_COMPRESSION);
  header.setName(part.name);
  header.setType(Imf::SCANLINEIMAGE);
  const Imf::Channel channel(part.half ? Imf::HALF : Imf::FLOAT);
  for (int c = 0; c < part.channels; ++c) header.channels().insert(kChannels[c], channel);
  for (const auto& [name, value] : part.text) header.insert(name, Imf::StringAttribute(value));
  return header;
}

/// Numbers of either kind, pixel by pixel.
template <class T>
void write_pixels(const ExrPart& part, Imf::PixelType type, const std::vector<T>& pixels, Imf::OutputPart& to) {
  const auto channels = static_cast<std::size_t>(part.channels), width = static_cast<std::size_t>(part.width);
  EXPECTS(pixels.size() == width * static_cast<std::size_t>(part.height) * channels);
  Imf::FrameBuffer frame;
  for (std::size_t c = 0; c < channels; ++c) {
    char* first = const_cast<char*>(reinterpret_cast<const char*>(pixels.data() + c));  // OpenEXR only reads it
    frame.insert(kChannels[c], Imf::Slice(type, first, channels * sizeof(T), width * channels * sizeof(T)));
  }
  to.setFrameBuffer(frame);
  to.writePixels(part.height);
}

}  // namespace

Bytes write_exr_parts(const std::vector<ExrPart>& parts) {
  EXPECTS(!parts.empty());
  // The display window is one for all parts: that of the first.
  const Imath::Box2i display(Imath::V2i(0, 0), Imath::V2i(parts[0].width - 1, parts[0].height - 1));
  std::vector<Imf::Header> headers;
  for (const ExrPart& part : parts) headers.push_back(header_of(part, display));
  MemoryOutput out;
  {
    Imf::MultiPartOutputFile file(out, headers.data(), static_cast<int>(headers.size()), false, 0);
    for (std::size_t i = 0; i < parts.size(); ++i) {
      const ExrPart& part = parts[i];
      Imf::OutputPart to(file, static_cast<int>(i));
      if (part.half) {
        write_pixels(part, Imf::HALF, std::vector<half>(part.pixels.begin(), part.pixels.end()), to);
      } else {
        write_pixels(part, Imf::FLOAT, part.pixels, to);
      }
    }
  }
  return std::move(out.bytes);
}

}  // namespace kiln
