#include "core/prt/hidden.h"

#include <algorithm>
#include <array>
#include <numbers>

#include "core/mesh/topology.h"
#include "core/prt/ray_origin.h"

namespace kiln {
namespace {

constexpr int kDirections = 64;
constexpr int kBisections = 12;  // the place is found to a 4096th of the edge

/// What ray `lane` says of the place that it comes from: `solid` where it ends on the back of a single-sided face.
Enclosure verdict_of(const Scene& scene, const Hits16& hits, const Rays16& rays, std::size_t lane) {
  const std::uint32_t triangle = hits.triangle[lane];
  if (triangle == kNoHit) return Enclosure::open;
  const Mesh& mesh = scene.mesh;
  const Triangle& t = mesh.triangles[triangle];
  const bool both = scene.materials[static_cast<std::size_t>(scene.parts[mesh.part[triangle]].material)].double_sided;
  const Vec3f way{rays.dx[lane], rays.dy[lane], rays.dz[lane]}, face = area_vector(mesh, t);
  const bool turned = both && dot(face, mesh.normal[t[0]] + mesh.normal[t[1]] + mesh.normal[t[2]]) < 0;
  if ((dot(face, way) > 0) == turned) return Enclosure::open;
  return both ? Enclosure::backs : Enclosure::solid;
}

/// Fibonacci points on the hemisphere over +Z, near enough to uniform.
std::array<Vec3f, kDirections> hemisphere() {
  std::array<Vec3f, kDirections> out;
  for (std::size_t i = 0; i < out.size(); ++i) {
    const double z = (static_cast<double>(i) + 0.5) / kDirections, r = std::sqrt(1 - z * z);
    const double turn = static_cast<double>(i) * std::numbers::pi * (3 - std::sqrt(5.0));
    out[i] = to_float(Vec3d{r * std::cos(turn), r * std::sin(turn), z});
  }
  return out;
}

/// The least of what all directions say; it is not looked for beyond what is at most `open_at`.
Enclosure enclosure(const Tracer& tracer, const std::array<Vec3f, kDirections>& directions, const TransferPoint& p,
                    Enclosure open_at) {
  Enclosure out = Enclosure::solid;
  const Vec3f origin = ray_origin(p);
  const Basis<float> basis = basis_around(p.normal);
  Rays16 rays;
  Hits16 hits;
  rays.ox.fill(origin.x), rays.oy.fill(origin.y), rays.oz.fill(origin.z), rays.far.fill(kFar);
  for (std::size_t packet = 0; packet < kDirections; packet += kPacket) {
    for (std::size_t lane = 0; lane < kPacket; ++lane) {
      // Neighbours in the list differ in height only: a packet takes every fourth, the whole hemisphere.
      const Vec3f w = basis.to_world(directions[(lane * kDirections / kPacket) + packet / kPacket]);
      rays.dx[lane] = w.x, rays.dy[lane] = w.y, rays.dz[lane] = w.z;
    }
    tracer.closest16(rays, hits);
    for (std::size_t lane = 0; lane < kPacket; ++lane) {
      out = std::min(out, verdict_of(tracer.scene(), hits, rays, lane));
      if (out <= open_at) return out;
    }
  }
  return out;
}

/// An edge from a seen vertex to a hidden one, on one of its faces.
struct Crossing {
  std::uint32_t seen, hidden, triangle;
};

TransferPoint point_between(const Mesh& mesh, const Crossing& edge, float share) {
  return edge_point(mesh, mesh.triangles[edge.triangle], edge.seen, edge.hidden, share);
}

struct Candidate {
  StandIn stand_in;
  float distance;  // to the vertex
};

Candidate last_seen(const Mesh& mesh, const Crossing& edge, const HiddenTest& hidden) {
  float seen = 0, dark = 1;
  for (int i = 0; i < kBisections; ++i) {
    const float half = 0.5F * (seen + dark);
    (hidden(point_between(mesh, edge, half)) ? dark : seen) = half;
  }
  const TransferPoint point = point_between(mesh, edge, seen);
  return {{edge.hidden, point}, length(mesh.position[edge.hidden] - point.position)};
}

/// Verdicts on the points point_at(0) to point_at(count - 1).
template <class PointAt>
std::vector<bool> test_all(std::size_t count, const PointAt& point_at, const HiddenTest& test, Threads& threads) {
  constexpr std::size_t kBlock = 64;
  std::vector<char> verdict(count);
  threads.for_blocks(count, kBlock, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) verdict[i] = test(point_at(i)) ? 1 : 0;
  });
  return {verdict.begin(), verdict.end()};
}

/// Calls f(a, b, triangle) for both directions of each edge of each triangle.
template <class F>
void for_edges(const Mesh& mesh, const F& f) {
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    const Triangle& corner = mesh.triangles[t];
    for (std::size_t k = 0; k < 3; ++k) {
      f(corner[k], corner[(k + 1) % 3], t);
      f(corner[(k + 1) % 3], corner[k], t);
    }
  }
}

std::vector<Candidate> from_crossings(const Mesh& mesh, const std::vector<bool>& hidden, const HiddenTest& test,
                                      Threads& threads) {
  std::vector<Crossing> crossings;
  for_edges(mesh, [&](std::uint32_t a, std::uint32_t b, std::uint32_t t) {
    if (!hidden[a] && hidden[b]) crossings.push_back({a, b, t});
  });
  std::vector<Candidate> found(crossings.size());
  threads.for_blocks(crossings.size(), 16, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) found[i] = last_seen(mesh, crossings[i], test);
  });
  return found;
}

}  // namespace

HiddenTest hidden_test(const Tracer& tracer) {
  return [&tracer, directions = hemisphere()](const TransferPoint& p) {
    return enclosure(tracer, directions, p, Enclosure::backs) == Enclosure::solid;
  };
}

std::function<Enclosure(const TransferPoint&)> enclosure_test(const Tracer& tracer) {
  return [&tracer, directions = hemisphere()](const TransferPoint& p) {
    return enclosure(tracer, directions, p, Enclosure::open);
  };
}

std::vector<StandIn> find_stand_ins(const Mesh& mesh, const std::vector<bool>& dark, const HiddenTest& test,
                                    Threads& threads) {
  const std::vector<std::uint32_t> face = widest_faces(mesh);
  const auto point_of = [&](std::size_t i) { return vertex_point(mesh, static_cast<std::uint32_t>(i), face[i]); };
  const std::vector<bool> hidden = test_all(mesh.position.size(), point_of, test, threads);
  std::vector<Candidate> found = from_crossings(mesh, hidden, test, threads);
  if (!dark.empty()) {
    for_edges(mesh, [&](std::uint32_t a, std::uint32_t b, std::uint32_t) {
      if (dark[a] && !hidden[a] && !dark[b]) found.push_back({{a, point_of(a)}, 0});
    });
  }
  std::ranges::stable_sort(found, [](const Candidate& a, const Candidate& b) {
    return a.stand_in.vertex != b.stand_in.vertex ? a.stand_in.vertex < b.stand_in.vertex : a.distance < b.distance;
  });
  std::vector<StandIn> out;
  for (const Candidate& c : found) {
    if (out.empty() || out.back().vertex != c.stand_in.vertex) out.push_back(c.stand_in);
  }
  return out;
}

std::vector<bool> hidden_middles(const Mesh& mesh, const std::vector<MeshEdge>& edges, const HiddenTest& test,
                                 Threads& threads) {
  std::vector<std::size_t> edge_of;
  std::vector<TransferPoint> points;
  for_edges(mesh, [&](std::uint32_t a, std::uint32_t b, std::uint32_t t) {
    if (a > b) return;
    const MeshEdge edge{a, b};
    const auto at = std::ranges::lower_bound(edges, edge);
    if (at == edges.end() || *at != edge) return;
    edge_of.push_back(static_cast<std::size_t>(at - edges.begin()));
    points.push_back(point_between(mesh, {a, b, t}, 0.5F));
  });
  const auto point_at = [&](std::size_t i) { return points[i]; };
  const std::vector<bool> hidden = test_all(points.size(), point_at, test, threads);
  std::vector<bool> out(edges.size(), false);
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (hidden[i]) out[edge_of[i]] = true;
  }
  return out;
}

std::vector<TransferPoint> lit_places(const Mesh& mesh, std::span<const std::uint32_t> vertices,
                                      std::span<const StandIn> stand_ins) {
  const std::vector<std::uint32_t> face = widest_faces(mesh);
  std::vector<TransferPoint> out;
  for (const std::uint32_t v : vertices) {
    const auto found = std::ranges::lower_bound(stand_ins, v, {}, &StandIn::vertex);
    const bool stands_in = found != stand_ins.end() && found->vertex == v;
    out.push_back(stands_in ? found->point : vertex_point(mesh, v, face[v]));
  }
  return out;
}

}  // namespace kiln
