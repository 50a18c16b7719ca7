#include "core/meshless/reading.h"

#include <algorithm>
#include <array>

#include "core/meshless/cover.h"
#include "core/meshless/in_sight.h"
#include "core/prt/ray_origin.h"

namespace kiln {
namespace {

constexpr std::size_t kBlock = 128;

MeshlessBasis one_level(std::span<const SurfaceSite> sites, int neighbours, Threads& threads) {
  const std::array<std::uint32_t, 1> end = {static_cast<std::uint32_t>(sites.size())};
  return {sites, end, threads, neighbours};
}

}  // namespace

Reading::Reading(const Tracer& tracer, const Points& points, Threads& threads)
    : tracer_(tracer),
      sites_(points.sites.begin(), points.sites.end()),
      cover_(points.cover),
      basis_(one_level(sites_, points.neighbours, threads)) {}

Reading::Seen Reading::at(const TransferPoint& p) const {
  const std::uint32_t group = group_of(tracer_, p, cover_);
  std::vector<BasisTerm> near;
  if (basis_.terms({p.position, p.normal, group}, 1, near) != Cover::functions) return {};
  const SurfaceSite raised{ray_origin(p), p.normal, group};
  Seen out;
  for (std::size_t first = 0; first < near.size(); first += kPacket) {
    const std::size_t count = std::min<std::size_t>(kPacket, near.size() - first);
    std::array<SurfaceSite, kPacket> sites;
    for (std::size_t i = 0; i < count; ++i) sites[i] = sites_[near[first + i].function];
    const std::uint32_t seen = in_sight(tracer_, raised, std::span(sites).first(count));
    for (std::size_t i = 0; i < count; ++i) {
      if ((seen >> i & 1) == 0) continue;
      out.terms.push_back(near[first + i]);
      out.sum += near[first + i].value;
    }
  }
  return out.sum > kFewest ? out : Seen{};
}

Readings::Readings(const Reading& reading, std::span<const TransferPoint> places, Threads& threads)
    : begin_(places.size() + 1) {
  std::vector<std::vector<BasisTerm>> found((places.size() + kBlock - 1) / kBlock);
  threads.for_blocks(places.size(), kBlock, [&](std::size_t begin, std::size_t end) {
    std::vector<BasisTerm>& own = found[begin / kBlock];
    for (std::size_t i = begin; i < end; ++i) {
      const Reading::Seen seen = reading.at(places[i]);
      for (const BasisTerm& t : seen.terms) own.push_back({t.function, t.value / seen.sum});
      begin_[i + 1] = own.size();
    }
  });
  std::size_t total = 0;
  for (std::size_t block = 0; block < found.size(); ++block) {
    const std::size_t end = std::min(places.size(), (block + 1) * kBlock);
    for (std::size_t i = block * kBlock; i < end; ++i) begin_[i + 1] += total;
    total += found[block].size();
  }
  terms_.reserve(total);
  for (const auto& own : found) terms_.insert(terms_.end(), own.begin(), own.end());
}

}  // namespace kiln
