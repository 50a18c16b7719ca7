#include <algorithm>
#include <cmath>

#include "core/base/random.h"
#include "core/meshless/free_places.h"
#include "core/meshless/link_sweeps.h"
#include "core/meshless/link_work.h"
#include "core/meshless/point_grid.h"

namespace kiln {
namespace {

constexpr float kChildReach = 2;  // of the parent level's R

float largest(const Vec3f& x) { return std::max({std::abs(x.x), std::abs(x.y), std::abs(x.z)}); }

}  // namespace

void LinkBuilder::Work::light_probes(Threads& threads) {
  const std::vector<Vec3f> places = free_places(tracer, kProbes, mix64(params.seed ^ 0x70726f6265ULL));
  std::vector<std::vector<Vec3f>> direct;
  for (const Vec3f& place : places) {
    const Light light{.intensity = {1, 1, 1}, .position = place};
    direct.push_back(light_senders(links, light, tracer, threads));
  }
  // Even light has a say too: what no probe reaches is part of the scene.
  std::vector<std::vector<Vec3f>> counted = direct;
  counted.emplace_back(links.senders, Vec3f{1, 1, 1});
  const auto area = std::span<const float>(tree.area).first(links.senders);
  stats.left = count_sweeps(links, area, counted, params.bounces);
  double whole = 0;
  for (const float a : area) whole += a;
  for (const auto& e : direct) {
    std::vector<Vec3f> x = solve_nodes(links, e);
    limit.push_back(static_cast<float>(params.eps * light_over_area(x, area) / std::max(1.0, whole)));
    lamp.push_back(std::move(x));
  }
}

void LinkBuilder::Work::measure(const GatherRows& rows, std::size_t row) {
  for (std::size_t k = 0; k < probes(); ++k) gathered.push_back(rows.apply(row, lamp[k]));
}

std::vector<std::uint32_t> LinkBuilder::Work::readable(std::size_t levels) const {
  std::vector<std::uint32_t> out;
  for (std::uint32_t r = 0; r < receiver.size(); ++r) {
    if (!all.points[receiver[r]].behind && receiver[r] < all.level_end[levels - 1]) out.push_back(r);
  }
  return out;
}

MeshlessBasis LinkBuilder::Work::basis_of(const std::vector<std::uint32_t>& some, Threads& threads) const {
  std::vector<SurfaceSite> sites;
  for (const std::uint32_t r : some) sites.push_back(all.points[receiver[r]].site);
  const std::uint32_t end[] = {static_cast<std::uint32_t>(sites.size())};
  return {sites, end, threads, params.neighbours};
}

void LinkBuilder::Work::refine(Threads& threads) {
  if (probes() == 0) return;
  for (std::size_t level = coarse.levels(); level < all.levels(); ++level) {
    // Parents of the first finer points are those of the last level of senders, asked for or not.
    const std::size_t first = level == coarse.levels() ? coarse.placed_levels() - 1 : level - 1;
    const std::vector<std::uint32_t> chosen = children_of(mispredicted(first, level, threads), level);
    if (chosen.empty()) return;
    gather(chosen, threads);
  }
}

std::vector<std::uint32_t> LinkBuilder::Work::mispredicted(std::size_t level, std::size_t end, Threads& threads) const {
  std::vector<std::uint32_t> asked;
  for (std::uint32_t r = 0; r < receiver.size(); ++r) {
    const std::uint32_t p = receiver[r];
    if (p >= all.begin(level) && p < all.level_end[end - 1] && !all.points[p].behind) asked.push_back(r);
  }
  if (level == 0) {
    std::vector<std::uint32_t> out;
    for (const std::uint32_t r : asked) out.push_back(receiver[r]);
    return out;
  }
  const std::vector<std::uint32_t> known = readable(level);
  const MeshlessBasis basis = basis_of(known, threads);
  std::vector<char> wrong(asked.size());
  threads.for_blocks(asked.size(), kBlock, [&](std::size_t begin, std::size_t end) {
    std::vector<BasisTerm> terms;
    for (std::size_t i = begin; i < end; ++i) {
      terms.clear();
      wrong[i] = basis.terms(all.points[receiver[asked[i]]].site, 1, terms) != Cover::functions ? 1 : 0;
      for (std::size_t k = 0; k < probes() && wrong[i] == 0; ++k) {
        Vec3f predicted;
        for (const BasisTerm& t : terms) predicted += gathered[known[t.function] * probes() + k] * t.value;
        wrong[i] = largest(gathered[asked[i] * probes() + k] - predicted) > limit[k] ? 1 : 0;
      }
    }
  });
  std::vector<std::uint32_t> out;
  for (std::size_t i = 0; i < asked.size(); ++i) {
    if (wrong[i] != 0) out.push_back(receiver[asked[i]]);
  }
  return out;
}

std::vector<std::uint32_t> LinkBuilder::Work::children_of(const std::vector<std::uint32_t>& parents,
                                                          std::size_t level) const {
  const float reach = kChildReach * all.radius[level - 1];
  PointGrid grid(2 * reach);
  for (const std::uint32_t p : parents) grid.add(p, all.points[p].site.position);
  std::vector<std::uint32_t> out;
  for (std::uint32_t p = all.begin(level); p < all.level_end[level]; ++p) {
    const SurfaceSite& site = all.points[p].site;
    bool near = false;
    grid.near(site.position, reach, [&](std::uint32_t q, float d2) {
      const float cosine = dot(site.normal, all.points[q].site.normal);
      near = near || (site.group == all.points[q].site.group && cosine > 0 && d2 <= reach * reach * cosine * cosine);
    });
    if (near && !all.points[p].behind) out.push_back(p);
  }
  return out;
}

std::vector<float> LinkBuilder::Work::probe_light(std::span<const TransferPoint> places, Threads& threads) const {
  std::vector<float> out(places.size() * probes(), 0.0F);
  if (probes() == 0) return out;
  threads.for_blocks(places.size(), kBlock, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const Reading::Seen near = reading->seen(places[i]);
      std::vector<float> light(probes());
      for (const BasisTerm& t : near.terms) {
        const std::size_t first = read_row[t.function] * probes();
        for (std::size_t k = 0; k < probes(); ++k)
          light[k] += t.value * static_cast<float>(mean_of(gathered[first + k]));
      }
      for (std::size_t k = 0; k < probes() && near.sum > 0; ++k)
        out[i * probes() + k] = limit[k] > 0 ? params.eps * light[k] / (near.sum * limit[k]) : 0;
    }
  });
  return out;
}

}  // namespace kiln
