#include "core/artifact/gltf_images.h"

#include "core/artifact/image_decode.h"

namespace kiln::gltf {
namespace {

/// Which images a bake looks at: those behind base colours, emissions, metalness and roughness.
std::vector<bool> needed_images(const Document& d) {
  std::vector<bool> needed(d.images.size());
  const auto mark = [&](const TextureRef& ref) {
    const int image = ref.texture < 0 ? -1 : d.textures[static_cast<std::size_t>(ref.texture)].image;
    if (image >= 0) needed[static_cast<std::size_t>(image)] = true;
  };
  for (const Material& m : d.materials) {
    mark(m.base_color_texture);
    mark(m.emission_texture);
    mark(m.metallic_roughness_texture);
  }
  return needed;
}

std::optional<Span> encoded_bytes(const ImageSource& source, const BufferBytes& bytes, const SceneFiles& files,
                                  std::vector<Bytes>& owned, const std::string& place, Findings& findings) {
  if (source.view >= 0) return bytes.views[static_cast<std::size_t>(source.view)];
  return resolve_uri(source.uri, files, owned, place + "/uri", findings);
}

std::optional<ImageHeader> checked_header(Span encoded, std::uint64_t& pixels, const ImportLimits& limits,
                                          const std::string& place, Findings& findings) {
  auto header = read_image_header(encoded);
  if (!header) {
    findings.fail("image_type", "The image is neither PNG nor JPEG, or its header is broken.", place);
    return std::nullopt;
  }
  const bool decodable = header->width > 0 || header->height > 0;
  if (!decodable && header->mime != "image/ktx2" && header->mime != "image/webp") {
    findings.fail("image_invalid", "The image has no pixels.", place);
    return std::nullopt;
  }
  const std::uint64_t area = header->width > kMaxImageSide || header->height > kMaxImageSide
                                 ? limits.max_image_pixels + 1
                                 : header->width * header->height;
  pixels += area;
  if (area > limits.max_image_pixels || pixels > limits.max_total_pixels) {
    findings.fail("image_too_large",
                  std::to_string(header->width) + " x " + std::to_string(header->height) +
                      " pixels; an image may have " + std::to_string(limits.max_image_pixels) + ", all together " +
                      std::to_string(limits.max_total_pixels) + ".",
                  place);
    return std::nullopt;
  }
  return header;
}

void decode_into(Image& image, const ImageHeader& header, const std::string& place, Findings& findings) {
  if (header.width == 0 || header.height == 0) {
    findings.warn("texture_not_decoded", "An image of type " + header.mime + " is baked as white.", place);
    return;
  }
  auto rgba = decode_image(image.encoded, header);
  if (!rgba) return findings.fail("image_invalid", "The image data is corrupt.", place);
  image.rgba = std::move(*rgba);
}

}  // namespace

std::vector<Image> load_images(const Document& d, const BufferBytes& bytes, const SceneFiles& files,
                               const ImportLimits& limits, Findings& findings) {
  const std::vector<bool> needed = needed_images(d);
  std::vector<Image> out;
  std::uint64_t pixels = 0;
  for (std::size_t i = 0; i < d.images.size() && !findings.failed(); ++i) {
    const std::string place = "/images/" + std::to_string(i);
    std::vector<Bytes> owned;
    const auto encoded = encoded_bytes(d.images[i], bytes, files, owned, place, findings);
    if (!encoded) break;
    const auto header = checked_header(*encoded, pixels, limits, place, findings);
    if (!header) break;
    Image image{.name = d.images[i].name,
                .mime = header->mime,
                .encoded = Bytes(encoded->begin(), encoded->end()),
                .width = static_cast<int>(header->width),
                .height = static_cast<int>(header->height),
                .rgba = {}};
    if (needed[i]) decode_into(image, *header, place, findings);
    out.push_back(std::move(image));
  }
  return out;
}

}  // namespace kiln::gltf
