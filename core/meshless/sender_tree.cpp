#include "core/meshless/sender_tree.h"

#include <algorithm>
#include <atomic>
#include <cmath>

#include "core/base/random.h"
#include "core/mesh/topology.h"
#include "core/meshless/in_sight.h"
#include "core/meshless/point_grid.h"
#include "core/prt/ray_origin.h"
#include "core/sphere/sampling.h"

namespace kiln {
namespace {

constexpr std::size_t kBlock = 256;
constexpr float kReach = 2;  // of the coarser level's R: how far a parent may be

/// Places even over the surface, on both sides of double-sided faces, and the sender of each.
struct Draw {
  SurfaceSite site;
  std::uint32_t sender = Senders::kNone;
};

Draw draw_place(const SenderPaths::World& world, const std::vector<double>& cumulative, Random random) {
  const Scene& scene = world.tracer.scene();
  const Mesh& mesh = scene.mesh;
  const double pick = random.uniform_double() * cumulative.back();
  const auto found = std::upper_bound(cumulative.begin(), cumulative.end(), pick);
  const auto triangle = static_cast<std::uint32_t>(
      std::min<std::ptrdiff_t>(found - cumulative.begin(), static_cast<std::ptrdiff_t>(cumulative.size()) - 1));
  const Triangle& t = mesh.triangles[triangle];
  const double a = random.uniform_double(), b = random.uniform_double();
  const auto uv = uniform_triangle({a, b});
  const auto u = static_cast<float>(uv.x), v = static_cast<float>(uv.y);
  const bool back = random.uniform() < 0.5F;
  Draw out;
  SurfaceSite& site = out.site;
  site.position = mesh.position[t[0]] * (1 - u - v) + mesh.position[t[1]] * u + mesh.position[t[2]] * v;
  Vec3f face = normalized(area_vector(mesh, t), mesh.normal[t[0]]);
  const Vec3f shading = mesh.normal[t[0]] * (1 - u - v) + mesh.normal[t[1]] * u + mesh.normal[t[2]] * v;
  const bool two_sided =
      scene.materials[static_cast<std::size_t>(scene.parts[mesh.part[triangle]].material)].double_sided;
  if (two_sided && dot(face, mesh.normal[t[0]] + mesh.normal[t[1]] + mesh.normal[t[2]]) < 0) face = -face;
  site.normal = normalized(shading, face);
  if (dot(site.normal, face) <= 0) site.normal = face;
  if (two_sided && back) site.normal = -site.normal, face = -face;
  const TransferPoint point{site.position, site.normal, site.position, face};
  const std::uint32_t nearest =
      two_sided && back ? world.senders.behind(triangle, u, v) : world.senders.at(triangle, u, v);
  if (nearest == Senders::kNone || is_enclosed(world.tracer, world.faces, point, true)) return out;
  site.group = world.senders.site(nearest).group;
  out.sender = nearest;
  return out;
}

}  // namespace

SenderSamples sample_senders(const SenderPaths& paths, const PointHierarchy& points, std::uint64_t seed,
                             Threads& threads) {
  const Mesh& mesh = paths.world().tracer.scene().mesh;
  const std::size_t senders = points.points.size();
  std::vector<double> cumulative;
  double sum = 0;
  for (const Triangle& t : mesh.triangles) cumulative.push_back(sum += triangle_area(mesh, t));
  std::vector<Draw> drawn(sum > 0 ? senders * kDrawn : 0);
  threads.for_blocks(drawn.size(), kBlock, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) drawn[i] = draw_place(paths.world(), cumulative, Random(seed, i));
  });
  SenderSamples out;
  out.area.assign(senders, 0);
  std::vector<std::vector<SenderSample>> kept(senders);
  for (const Draw& d : drawn) {
    if (d.sender == Senders::kNone) continue;
    out.area[d.sender] += 1;
    if (kept[d.sender].size() < kSamples) kept[d.sender].push_back({d.site.position, pack_normal(d.site.normal)});
  }
  out.begin.push_back(0);
  for (std::size_t s = 0; s < senders; ++s) {
    const SurfaceSite& own = points.points[s].site;
    if (kept[s].empty()) kept[s].push_back({own.position, pack_normal(own.normal)});
    out.area[s] = std::max(out.area[s], 0.5F);
    out.samples.insert(out.samples.end(), kept[s].begin(), kept[s].end());
    out.begin.push_back(static_cast<std::uint32_t>(out.samples.size()));
  }
  return out;
}

SenderTree grow_sender_tree(const Tracer& tracer, const PointHierarchy& points, const std::vector<float>& area,
                            Threads& threads) {
  const auto senders = static_cast<std::uint32_t>(points.points.size());
  SenderTree tree{.senders = senders, .parent = {}, .child_begin = {0}, .children = {}, .area = area};
  tree.parent.assign(senders, SenderTree::kNone);
  std::vector<std::uint32_t> top(senders);  // the highest node so far that holds a point
  for (std::uint32_t i = 0; i < senders; ++i) top[i] = i;
  for (std::size_t level = points.levels(); level-- > 1;) {
    const std::uint32_t first = points.begin(level), last = points.level_end[level];
    const float reach = kReach * points.radius[level - 1];
    PointGrid grid(reach);
    for (std::uint32_t q = 0; q < first; ++q) grid.add(q, points.points[q].site.position);
    std::vector<std::uint32_t> chosen(last - first, SenderTree::kNone);
    threads.for_blocks(chosen.size(), kBlock, [&](std::size_t begin, std::size_t end) {
      struct Candidate {
        float scaled;
        std::uint32_t point;
      };
      std::vector<Candidate> found;
      for (std::size_t i = begin; i < end; ++i) {
        const SurfaceSite& p = points.points[first + i].site;
        found.clear();
        grid.near(p.position, reach, [&](std::uint32_t q, float d2) {
          const float cosine = dot(points.points[q].site.normal, p.normal);
          if (points.points[q].site.group != p.group || cosine <= 0 || d2 > reach * reach * cosine * cosine) return;
          found.push_back({d2 / (cosine * cosine), q});
        });
        std::sort(found.begin(), found.end(), [](const Candidate& a, const Candidate& b) {
          return a.scaled != b.scaled ? a.scaled < b.scaled : a.point < b.point;
        });
        for (const Candidate& c : found) {
          if (!in_sight(tracer, p, points.points[c.point].site)) continue;
          chosen[i] = c.point;
          break;
        }
      }
    });
    // A coarser point with children becomes a node over itself and them.
    std::vector<std::vector<std::uint32_t>> children(first);
    for (std::uint32_t i = 0; i < chosen.size(); ++i) {
      if (chosen[i] != SenderTree::kNone) children[chosen[i]].push_back(top[first + i]);
    }
    for (std::uint32_t q = 0; q < first; ++q) {
      if (children[q].empty()) continue;
      children[q].insert(children[q].begin(), top[q]);
      float sum = 0;
      for (const std::uint32_t c : children[q]) sum += tree.area[c];
      const auto node = static_cast<std::uint32_t>(tree.parent.size());
      for (const std::uint32_t c : children[q]) {
        const float share = std::max(1.0F, std::round(65535 * tree.area[c] / sum));
        tree.children.push_back({static_cast<std::uint16_t>(c), static_cast<std::uint16_t>(share)});
        tree.parent[c] = node;
      }
      tree.parent.push_back(SenderTree::kNone);
      tree.area.push_back(sum);
      tree.child_begin.push_back(static_cast<std::uint32_t>(tree.children.size()));
      top[q] = node;
    }
  }
  return tree;
}

}  // namespace kiln
