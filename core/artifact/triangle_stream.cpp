#include "core/artifact/triangle_stream.h"

#include <algorithm>

#include "core/artifact/gltf_container.h"
#include "core/artifact/ply_scene.h"

namespace kiln {

TriangleSource open_triangles(const SceneFiles& files, const StreamOptions& options, Findings& findings) {
  const std::span<const std::uint8_t> main = files.main;
  TriangleSource source;
  if (main.empty()) {
    findings.fail("empty_file", "The file has no bytes.");
  } else if (looks_like_ply(main)) {
    source = open_ply(files, options, findings);
  } else if (looks_like_glb(main) || looks_like_json(main)) {
    source = open_gltf_triangles(files, options, findings);
  } else {
    findings.fail("unknown_format", "The file is not glTF 2.0, GLB or PLY.");
  }
  source.name = files.name;
  source.bytes = main.size();
  return source;
}

std::optional<std::size_t> fetch_corners(const CornerBatch& batch, Threads& threads,
                                         const std::function<bool(std::uint32_t vertex, std::size_t i)>& fetch) {
  constexpr std::size_t kBlock = 3 * 4096;
  std::vector<std::size_t> bad(batch.corners.size() / kBlock + 1, batch.corners.size());
  threads.for_blocks(batch.corners.size(), kBlock, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      if (fetch(batch.corners[i], i)) continue;
      bad[begin / kBlock] = i;
      return;
    }
  });
  const std::size_t first = *std::min_element(bad.begin(), bad.end());
  return first < batch.corners.size() ? std::optional(first) : std::nullopt;
}

}  // namespace kiln
