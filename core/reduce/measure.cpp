#include "core/reduce/measure.h"

#include <algorithm>
#include <limits>

namespace kiln {

void drop_unused(Surface& s) {
  constexpr std::uint32_t kUnused = 0xffffffffU;
  std::vector<std::uint32_t> to(s.position.size(), kUnused);
  for (const Triangle& t : s.triangles) {
    for (const std::uint32_t v : t) to[v] = 0;
  }
  std::uint32_t next = 0;
  for (std::size_t v = 0; v < to.size(); ++v) {
    if (to[v] == kUnused) continue;
    s.position[next] = s.position[v];
    s.sample[next] = s.sample[v];
    to[v] = next++;
  }
  s.position.resize(next), s.sample.resize(next);
  for (Triangle& t : s.triangles) t = {to[t[0]], to[t[1]], to[t[2]]};
}

UnitFrame Extent::frame() const {
  const Vec3d size = high - low;
  const double longest = std::max({size.x, size.y, size.z});
  return {(low + high) * 0.5, longest > 0 ? longest : 1};
}

Result<Extent> measure(const TriangleSource& source, Threads& threads) {
  constexpr std::size_t kBlock = 8192;
  constexpr double kFar = std::numeric_limits<double>::infinity();
  Extent out{.low = {kFar, kFar, kFar}, .high = {-kFar, -kFar, -kFar}};
  std::vector<Extent> parts;
  const auto take = [&](const TriangleBatch& batch) {
    parts.assign((batch.triangles() + kBlock - 1) / kBlock, {.low = out.low, .high = out.high});
    threads.for_blocks(batch.triangles(), kBlock, [&](std::size_t begin, std::size_t end) {
      Extent& part = parts[begin / kBlock];
      for (std::size_t t = begin; t < end; ++t) {
        const Vec3d* p = &batch.position[3 * t];
        for (std::size_t c = 0; c < 3; ++c) {
          part.low = {std::min(part.low.x, p[c].x), std::min(part.low.y, p[c].y), std::min(part.low.z, p[c].z)};
          part.high = {std::max(part.high.x, p[c].x), std::max(part.high.y, p[c].y), std::max(part.high.z, p[c].z)};
        }
        part.area += 0.5 * length(cross(p[1] - p[0], p[2] - p[0]));
      }
    });
    for (const Extent& part : parts) {
      out.low = {std::min(out.low.x, part.low.x), std::min(out.low.y, part.low.y), std::min(out.low.z, part.low.z)};
      out.high = {std::max(out.high.x, part.high.x), std::max(out.high.y, part.high.y),
                  std::max(out.high.z, part.high.z)};
      out.area += part.area;
    }
    out.triangles += batch.triangles();
  };
  if (auto done = source.stream(Detail::positions, take, threads); !done) return tl::make_unexpected(done.error());
  if (out.triangles == 0) return fault("empty_scene", "The file has no triangles: there is no surface.", source.name);
  return out;
}

}  // namespace kiln
