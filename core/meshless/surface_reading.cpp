#include "core/meshless/surface_reading.h"

#include "core/meshless/demand.h"

namespace kiln {
namespace {

constexpr std::size_t kBlock = 128;

Reading read_computed(const SurfaceReading::Surface& surface, std::span<const std::uint32_t> computed, int neighbours,
                      Threads& threads) {
  std::vector<SurfaceSite> sites;
  for (const std::uint32_t p : computed) sites.push_back(surface.points.points[p].site);
  return {surface.tracer, {sites, surface.points.cover, neighbours}, threads};
}

std::vector<TransferPoint> places_of(const PointHierarchy& points) {
  std::vector<TransferPoint> places;
  for (const MeshlessPoint& p : points.points) places.push_back(transfer_point(p));
  return places;
}

}  // namespace

SurfaceReading::SurfaceReading(const Surface& surface, std::span<const std::uint32_t> computed, int neighbours,
                               Threads& threads)
    : surface_(surface),
      reading_(read_computed(surface, computed, neighbours, threads)),
      at_points_(reading_, places_of(surface.points), threads),
      at_vertices_(reading_, surface.vertices, threads),
      self_(surface.points.points.size()),
      nearest_(surface.vertices.size(), Senders::kNone) {
  threads.for_blocks(nearest_.size(), kBlock, [&](std::size_t begin, std::size_t end) {
    for (std::size_t v = begin; v < end; ++v) {
      if (at_vertices_.any(v)) continue;
      nearest_[v] = surface.senders.nearest(reader_site(surface.tracer, surface.vertices[v], surface.points.cover));
    }
  });
  let_read_themselves(computed);
}

void SurfaceReading::let_read_themselves(std::span<const std::uint32_t> computed) {
  for (std::uint32_t n = 0; n < computed.size(); ++n) self_[computed[n]] = {n, 1};
  alone_.clear();
  for (std::uint32_t v = 0; v < nearest_.size(); ++v) {
    if (of_vertex(v).empty()) alone_.push_back(v);
  }
}

SurfaceReading SurfaceReading::of_all(const Surface& surface, const std::vector<std::uint32_t>& computed,
                                      int neighbours, const Compute& compute, Threads& threads) {
  SurfaceReading first(surface, computed, neighbours, threads);
  const std::vector<std::uint32_t> unseen = first.unseen();
  if (unseen.empty()) return first;
  compute(along_curve(surface.points, unseen));
  SurfaceReading second(surface, computed, neighbours, threads);
  // Where points are denser they are read less far: a few more may see nothing now.
  if (const std::vector<std::uint32_t> left = second.unseen(); !left.empty()) {
    compute(along_curve(surface.points, left));
    second.let_read_themselves(computed);
  }
  return second;
}

std::span<const BasisTerm> SurfaceReading::of_point(std::size_t point) const {
  return self_[point].value > 0 ? std::span(&self_[point], 1) : at_points_.terms(point);
}

std::span<const BasisTerm> SurfaceReading::of_vertex(std::size_t vertex) const {
  if (nearest_[vertex] == Senders::kNone) return at_vertices_.terms(vertex);
  return of_point(nearest_[vertex]);
}

void SurfaceReading::of_place(const TransferPoint& place, std::vector<BasisTerm>& terms) const {
  const Reading::Seen seen = reading_.at(place);
  for (const BasisTerm& t : seen.terms) terms.push_back({t.function, t.value / seen.sum});
  if (!seen.terms.empty()) return;
  const std::uint32_t nearest = surface_.senders.nearest(reader_site(surface_.tracer, place, surface_.points.cover));
  if (nearest == Senders::kNone) return;
  const std::span<const BasisTerm> there = of_point(nearest);
  terms.insert(terms.end(), there.begin(), there.end());
}

std::vector<std::uint32_t> SurfaceReading::unseen() const {
  std::vector<std::uint32_t> out;
  for (std::uint32_t p = 0; p < self_.size(); ++p) {
    if (of_point(p).empty()) out.push_back(p);
  }
  return out;
}

}  // namespace kiln
