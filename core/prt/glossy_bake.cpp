#include "core/prt/glossy_bake.h"

#include <algorithm>
#include <atomic>
#include <cmath>

#include "core/base/expects.h"
#include "core/base/random.h"
#include "core/mesh/topology.h"
#include "core/prt/morton.h"

namespace kiln {
namespace {

constexpr std::size_t kBlock = 32;   // vertices of a unit of work
constexpr std::size_t kNews = 2048;  // between two pieces of news

/// Evenly over the surface: at equal steps of the area, in Morton order. Indices into `vertices`, each at most once.
std::vector<std::size_t> choose_samples(const Mesh& mesh, std::span<const std::uint32_t> vertices,
                                        std::span<const double> share) {
  std::vector<Vec3f> position;
  for (const auto v : vertices) position.push_back(mesh.position[v]);
  std::vector<std::size_t> out;
  double sum = 0;
  std::size_t taken = 0;
  for (const auto n : morton_order(position)) {
    sum += share[n];
    if (sum * kGlossySamples < static_cast<double>(taken) + 0.5 && vertices.size() > kGlossySamples) continue;
    out.push_back(n);
    taken = std::max(taken + 1, static_cast<std::size_t>(sum * kGlossySamples));
  }
  if (out.empty()) out.push_back(0);
  return out;
}

}  // namespace

std::vector<double> vertex_shares(const Mesh& mesh, std::span<const std::uint32_t> vertices) {
  std::vector<double> area(mesh.position.size(), 0.0), out;
  for (const Triangle& t : mesh.triangles) {
    for (const auto v : t) area[v] += triangle_area(mesh, t);
  }
  double sum = 0;
  for (const auto v : vertices) sum += area[v];
  for (const auto v : vertices) out.push_back(sum > 0 ? area[v] / sum : 1 / static_cast<double>(vertices.size()));
  return out;
}

GlossyBaked bake_glossy(const Tracer& tracer, const Transfer& light, std::span<const std::uint32_t> vertices,
                        const GlossyBake& bake, Threads& threads) {
  EXPECTS(!vertices.empty() && std::ranges::is_sorted(vertices));
  const Mesh& mesh = tracer.scene().mesh;
  const std::vector<double> share = vertex_shares(mesh, vertices);
  const std::vector<TransferPoint> points = lit_places(mesh, vertices, bake.stand_ins);
  std::vector<TransferPoint> some;
  for (const std::size_t n : choose_samples(mesh, vertices, share)) some.push_back(points[n]);

  const GlossyMatrixBaker baker(tracer, light, bake.matrix), redrawn(tracer, light, another_draw(bake.matrix));
  GlossyBaked out;
  out.transfer = {
      bake.matrix.order, bake.matrix.channels, bake.matrix.fixed, {}, {vertices.begin(), vertices.end()}, {}};
  const std::vector<float> matrices = baker.bake(some, threads, out.rays);
  const GlossyComponents components(out.transfer, matrices, bake.rank);
  out.transfer.components = components.components();
  out.noise = components.noise(matrices, redrawn.bake(some, threads, out.rays));

  const std::size_t rank = components.rank();
  out.transfer.weights.resize(vertices.size() * rank);
  std::vector<double> left(vertices.size());
  std::atomic<std::uint64_t> rays = 0;
  for (std::size_t first = 0; first < points.size(); first += kNews) {
    const std::size_t count = std::min(kNews, points.size() - first);
    threads.for_blocks(count, kBlock, [&](std::size_t begin, std::size_t end) {
      std::vector<float> block((end - begin) * baker.stride());
      for (std::size_t k = begin; k < end; ++k)
        rays += baker.bake(points[first + k], &block[(k - begin) * baker.stride()]);
      components.project(block, &out.transfer.weights[(first + begin) * rank], &left[first + begin]);
    });
    if (bake.progress) bake.progress(first + count, points.size());
  }
  out.rays += rays;
  double squared = 0;
  for (std::size_t n = 0; n < left.size(); ++n) squared += share[n] * left[n];
  out.left_out = std::sqrt(squared);
  return out;
}

}  // namespace kiln
