#include "core/artifact/gltf_bytes.h"

#include "core/artifact/uri.h"

namespace kiln::gltf {
namespace {

std::string place_of(const char* array, std::size_t i) { return std::string("/") + array + "/" + std::to_string(i); }

bool inside(std::uint64_t offset, std::uint64_t bytes, std::uint64_t size) {
  return offset <= size && bytes <= size - offset;
}

std::string range_text(std::uint64_t offset, std::uint64_t bytes, std::uint64_t size) {
  return "Bytes " + std::to_string(offset) + " + " + std::to_string(bytes) + " pass the end at " +
         std::to_string(size) + ".";
}

/// What the buffer may use: the BIN chunk for the first without a URI, else what the URI names.
std::optional<Span> source_of(const Buffer& buffer, std::size_t i, const GltfContainer& container,
                              const SceneFiles& files, BufferBytes& out, Findings& findings) {
  if (buffer.has_uri) return resolve_uri(buffer.uri, files, out.owned, place_of("buffers", i) + "/uri", findings);
  if (i == 0 && container.has_binary) return container.binary;
  if (buffer.fallback) return Span{};
  findings.fail("buffer_missing", "The buffer has neither a uri nor a binary chunk.", place_of("buffers", i));
  return std::nullopt;
}

void load_buffer(const Buffer& buffer, std::size_t i, const GltfContainer& container, const SceneFiles& files,
                 BufferBytes& out, Findings& findings) {
  const auto source = source_of(buffer, i, container, files, out, findings);
  if (!source) return;
  const bool absent = buffer.fallback && source->empty();
  if (!absent && source->size() < buffer.bytes) {
    findings.fail("buffer_too_short",
                  "The buffer has " + std::to_string(source->size()) + " bytes, " + std::to_string(buffer.bytes) +
                      " are declared.",
                  place_of("buffers", i) + "/byteLength");
    return;
  }
  out.buffers.push_back(absent ? Span{} : source->first(buffer.bytes));
}

Span load_compressed(const Meshopt& m, std::uint64_t view_bytes, const std::string& place, BufferBytes& out,
                     Findings& findings) {
  const Span buffer = out.buffers[static_cast<std::size_t>(m.buffer)];
  if (!inside(m.offset, m.bytes, buffer.size())) {
    findings.fail("view_out_of_bounds", range_text(m.offset, m.bytes, buffer.size()), place);
    return {};
  }
  if (m.stride == 0 || m.count > view_bytes / m.stride || m.count * m.stride != view_bytes) {
    findings.fail("meshopt_invalid", "count * byteStride differs from the byteLength of the view.", place);
    return {};
  }
  out.owned.push_back(decode_meshopt(m, buffer.subspan(m.offset, m.bytes), place, findings));
  return out.owned.back();
}

void load_view(const BufferView& view, std::size_t i, const Document& document, BufferBytes& out, Findings& findings) {
  const std::string place = place_of("bufferViews", i);
  const std::uint64_t declared = document.buffers[static_cast<std::size_t>(view.buffer)].bytes;
  if (!inside(view.offset, view.bytes, declared)) {
    findings.fail("view_out_of_bounds", range_text(view.offset, view.bytes, declared), place);
    return;
  }
  if (view.meshopt.mode != MeshoptMode::none) {
    out.views.push_back(
        load_compressed(view.meshopt, view.bytes, place + "/extensions/EXT_meshopt_compression", out, findings));
    return;
  }
  const Span buffer = out.buffers[static_cast<std::size_t>(view.buffer)];
  if (buffer.empty() && view.bytes > 0) {
    findings.fail("buffer_missing", "The view lies in a fallback buffer without bytes.", place);
    return;
  }
  out.views.push_back(buffer.subspan(view.offset, view.bytes));
}

}  // namespace

std::optional<Span> resolve_uri(const std::string& uri, const SceneFiles& files, std::vector<Bytes>& owned,
                                const std::string& place, Findings& findings) {
  if (is_data_uri(uri)) {
    auto bytes = decode_data_uri(uri);
    if (!bytes) {
      findings.fail("data_uri_invalid", "The data URI is not valid base64.", place);
      return std::nullopt;
    }
    owned.push_back(std::move(*bytes));
    return owned.back();
  }
  const auto path = percent_decode(uri);
  if (!path || !is_plain_relative_path(*path)) {
    findings.fail("external_uri_forbidden", "Only data URIs and names of files beside the scene are read.", place);
    return std::nullopt;
  }
  const auto at = files.resources.find(*path);
  if (at == files.resources.end()) {
    findings.fail("resource_missing", "A file that the scene names is not among the uploaded ones.", place);
    return std::nullopt;
  }
  return Span(at->second);
}

BufferBytes load_bytes(const Document& document, const GltfContainer& container, const SceneFiles& files,
                       const ImportLimits& limits, Findings& findings) {
  BufferBytes out;
  for (std::size_t i = 0; i < document.buffers.size() && !findings.failed(); ++i) {
    load_buffer(document.buffers[i], i, container, files, out, findings);
  }
  std::uint64_t decoded = 0;
  for (std::size_t i = 0; i < document.views.size() && !findings.failed(); ++i) {
    if (document.views[i].meshopt.mode != MeshoptMode::none) decoded += document.views[i].bytes;
    if (decoded > limits.max_memory_bytes / 2) {
      findings.fail("scene_too_large", "Decompressed buffers would take more than half of the memory limit.",
                    place_of("bufferViews", i));
    } else {
      load_view(document.views[i], i, document, out, findings);
    }
  }
  return out;
}

}  // namespace kiln::gltf
