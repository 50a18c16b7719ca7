#include "core/prt/cut_lines.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <map>
#include <numeric>
#include <tuple>
#include <utility>
#include <vector>

#include "core/mesh/midpoint.h"
#include "core/mesh/part_vertices.h"
#include "core/mesh/topology.h"
#include "core/prt/contact_lines.h"
#include "core/prt/shadow_lines.h"

namespace kiln {
namespace {

constexpr std::uint32_t kNone = 0xffffffffU;

/// A triangle that is cut.
struct CutFace {
  std::uint32_t triangle;
  TrianglePlane plane;
  PlaneCut cut;

  CutFace(const Mesh& mesh, std::uint32_t index)
      : triangle(index),
        plane(mesh, mesh.triangles[index]),
        cut(flat_corners(mesh, mesh.triangles[index], plane), kSamePlace) {}
};

/// An edge of a triangle, from the lower to the higher welded place.
struct Side {
  std::uint32_t p, q;  // places
  std::uint32_t triangle;
  int edge;  // of the triangle
  bool turned;
};

/// A point on an edge, as one triangle has it.
struct EdgePoint {
  std::uint32_t p, q;
  double share;        // of the way from p to q
  std::uint32_t face;  // of faces_
  std::size_t border;  // of its cut's border points
};

class Cutter {
 public:
  Cutter(const Mesh& mesh, std::span<const CutLine> lines, Threads& threads)
      : mesh_(mesh), place_(weld_by_position(mesh.position)), face_of_(mesh.triangles.size(), kNone) {
    for (const CutLine& c : lines) face_at(c.triangle);
    std::vector<std::vector<Segment>> of_face(faces_.size());
    for (const CutLine& c : lines) of_face[face_of_[c.triangle]].push_back(c.line);
    threads.for_blocks(faces_.size(), 16, [&](std::size_t begin, std::size_t end) {
      for (std::size_t f = begin; f < end; ++f) {
        for (const Segment& s : of_face[f]) faces_[f].cut.cut(s);
      }
    });
    share_edges();
  }

  Mesh run() {
    Mesh out = mesh_;
    out.triangles.clear();
    out.part.clear();
    std::vector<MeshEdge> contacts;
    for (std::uint32_t t = 0; t < mesh_.triangles.size(); ++t) {
      if (face_of_[t] == kNone) {
        out.triangles.push_back(mesh_.triangles[t]);
        out.part.push_back(mesh_.part[t]);
      } else {
        emit(faces_[face_of_[t]], out, contacts);
      }
    }
    std::ranges::sort(contacts);
    contacts.erase(std::unique(contacts.begin(), contacts.end()), contacts.end());
    part_vertices(out, contacts);
    return out;
  }

 private:
  std::uint32_t face_at(std::uint32_t triangle) {
    std::uint32_t& face = face_of_[triangle];
    if (face == kNone) {
      face = static_cast<std::uint32_t>(faces_.size());
      faces_.emplace_back(mesh_, triangle);
    }
    return face;
  }

  Side side_of(std::uint32_t triangle, int edge) const {
    const Triangle& t = mesh_.triangles[triangle];
    const std::uint32_t p = place_[t[static_cast<std::size_t>(edge)]],
                        q = place_[t[static_cast<std::size_t>((edge + 1) % 3)]];
    return {std::min(p, q), std::max(p, q), triangle, edge, p > q};
  }

  /// Points that are the same place become the first of them; then all triangles on an edge get all of its points.
  void share_edges() {
    std::vector<EdgePoint> points;
    for (std::uint32_t f = 0; f < faces_.size(); ++f) {
      const auto& border = faces_[f].cut.border();
      for (std::size_t i = 0; i < border.size(); ++i) {
        const Side s = side_of(faces_[f].triangle, border[i].edge);
        points.push_back({s.p, s.q, s.turned ? 1 - border[i].share : border[i].share, f, i});
      }
    }
    std::ranges::sort(points, {}, [](const EdgePoint& e) { return std::tuple(e.p, e.q, e.share, e.face, e.border); });
    merge(points);

    std::vector<Side> sides;
    for (std::uint32_t t = 0; t < mesh_.triangles.size(); ++t) {
      for (int edge = 0; edge < 3; ++edge) {
        const Side s = side_of(t, edge);
        if (has_points(s)) sides.push_back(s);
      }
    }
    for (const Side& s : sides) {
      CutFace& face = faces_[face_at(s.triangle)];
      for (const EdgePoint& e : points_on(s)) face.cut.add_border_point(s.edge, s.turned ? 1 - e.share : e.share);
    }
  }

  /// Sorted points in; edge_points_ has one for each place, and the border points of the faces have its share.
  void merge(const std::vector<EdgePoint>& points) {
    for (const EdgePoint& e : points) {
      const double near = 1.5 * kSamePlace / length(mesh_.position[e.q] - mesh_.position[e.p]);
      const bool known = !edge_points_.empty() && edge_points_.back().p == e.p && edge_points_.back().q == e.q &&
                         e.share - edge_points_.back().share < near;
      if (!known) edge_points_.push_back(e);
      PlaneCut& cut = faces_[e.face].cut;
      const double share = edge_points_.back().share;
      const bool turned = side_of(faces_[e.face].triangle, cut.border()[e.border].edge).turned;
      cut.move_border_point(e.border, turned ? 1 - share : share);
    }
  }

  std::span<const EdgePoint> points_on(const Side& s) const {
    const auto edge = [](const EdgePoint& e) { return std::pair(e.p, e.q); };
    const auto first = std::ranges::lower_bound(edge_points_, std::pair(s.p, s.q), {}, edge);
    return {first, std::ranges::upper_bound(edge_points_, std::pair(s.p, s.q), {}, edge)};
  }
  bool has_points(const Side& s) const { return !points_on(s).empty(); }

  /// The vertex at a point of an edge: one for each pair of vertices at its ends.
  std::uint32_t vertex_on_edge(Mesh& out, const Side& s, double share) {
    const Triangle& t = mesh_.triangles[s.triangle];
    std::uint32_t a = t[static_cast<std::size_t>(s.edge)], b = t[static_cast<std::size_t>((s.edge + 1) % 3)];
    if (s.turned) std::swap(a, b), share = 1 - share;
    const std::span<const EdgePoint> points = points_on(s);
    const auto nearest =
        std::ranges::min_element(points, {}, [&](const EdgePoint& e) { return std::abs(e.share - share); });
    const auto key = std::tuple(a, b, static_cast<std::size_t>(nearest - points.begin()));
    const auto [known, fresh] = on_edge_.try_emplace(key, kNone);
    if (fresh) known->second = append_between(out, a, b, static_cast<float>(nearest->share));
    return known->second;
  }

  std::uint32_t vertex_inside(Mesh& out, const CutFace& face, const Vec2d& at) const {
    const auto& p = face.cut.points();
    const auto area = [](const Vec2d& a, const Vec2d& b, const Vec2d& c) { return cross(b - a, c - a); };
    const double whole = area(p[0], p[1], p[2]);
    return append_inside(out, mesh_.triangles[face.triangle], static_cast<float>(area(p[0], at, p[2]) / whole),
                         static_cast<float>(area(p[0], p[1], at) / whole));
  }

  void emit(CutFace& face, Mesh& out, std::vector<MeshEdge>& contacts) {
    const std::vector<Triangle> pieces = face.cut.triangles();
    const Triangle& t = mesh_.triangles[face.triangle];
    std::vector<std::uint32_t> vertex(face.cut.points().size(), kNone);
    std::copy(t.begin(), t.end(), vertex.begin());
    for (const PlaneCut::BorderPoint& b : face.cut.border())
      vertex[b.id] = vertex_on_edge(out, side_of(face.triangle, b.edge), b.share);
    for (const Triangle& piece : pieces) {
      Triangle named{};
      for (std::size_t k = 0; k < 3; ++k) {
        std::uint32_t& v = vertex[piece[k]];
        if (v == kNone) v = vertex_inside(out, face, face.cut.points()[piece[k]]);
        named[k] = v;
      }
      if (named[0] == named[1] || named[1] == named[2] || named[2] == named[0]) continue;
      out.triangles.push_back(named);
      out.part.push_back(mesh_.part[face.triangle]);
      for (std::size_t k = 0; k < 3; ++k) {
        if (face.cut.along_segment(piece[k], piece[(k + 1) % 3]))
          contacts.emplace_back(std::minmax(named[k], named[(k + 1) % 3]));
      }
    }
  }

  const Mesh& mesh_;
  std::vector<std::uint32_t> place_;    // of each vertex
  std::vector<std::uint32_t> face_of_;  // of each triangle
  std::vector<CutFace> faces_;
  std::vector<EdgePoint> edge_points_;  // by edge and share
  std::map<std::tuple<std::uint32_t, std::uint32_t, std::size_t>, std::uint32_t> on_edge_;
};

std::vector<bool> opaque_triangles(const Scene& scene) {
  std::vector<bool> out;
  for (const std::uint32_t part : scene.mesh.part) {
    const Material& material = scene.materials[static_cast<std::size_t>(scene.parts[part].material)];
    out.push_back(material.alpha_mode == AlphaMode::opaque);
  }
  return out;
}

/// Of each line: the square of the change of light across it, times the area that an uncut triangle would spread it
/// over (the line's length times the size of the triangle). Reflected light, which is not known yet, may change as
/// well.
std::vector<double> worths(const Mesh& mesh, std::span<const CutLine> lines, const ValueSource& source) {
  constexpr std::size_t kBatch = 8192;
  constexpr double kReflected = 1e-4;  // square of what it may change by: a thirtieth of an open point's constant band
  std::vector<double> out;
  out.reserve(lines.size());
  std::vector<TransferPoint> points;
  for (std::size_t begin = 0; begin < lines.size(); begin += kBatch) {
    const auto batch = lines.subspan(begin, std::min(kBatch, lines.size() - begin));
    points.clear();
    for (const CutLine& line : batch) {
      for (const TransferPoint& p : beside_line(mesh, line)) points.push_back(p);
    }
    const std::vector<float> values = source.rough ? source.rough(points) : source.values(points);
    for (std::size_t i = 0; i < batch.size(); ++i) {
      const float* one = values.data() + 2 * i * source.width;
      double squares = kReflected;
      for (std::size_t c = 0; c < source.width; ++c) squares += std::pow(one[c] - one[c + source.width], 2);
      const double size = std::sqrt(triangle_area(mesh, mesh.triangles[batch[i].triangle]));
      out.push_back(squares * length(batch[i]) * size);
    }
  }
  return out;
}

/// The lines at which somebody can see one of the two sides.
std::vector<CutLine> seen_lines(const Mesh& mesh, std::vector<CutLine> lines, const HiddenTest& hidden,
                                Threads& threads) {
  if (!hidden) return lines;
  std::vector<char> seen(lines.size());
  threads.for_blocks(lines.size(), 64, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const auto [one, other] = beside_line(mesh, lines[i]);
      seen[i] = !hidden(one) || !hidden(other) ? 1 : 0;
    }
  });
  std::erase_if(lines, [&](const CutLine& line) { return seen[static_cast<std::size_t>(&line - lines.data())] == 0; });
  return lines;
}

}  // namespace

Mesh cut_where_light_jumps(const Tracer& tracer, const ValueSource& source, std::uint64_t budget, Threads& threads) {
  const Scene& scene = tracer.scene();
  const std::vector<bool> opaque = opaque_triangles(scene);
  std::vector<CutLine> lines = find_contact_lines(scene.mesh, opaque, threads);
  const std::vector<CutLine> shadows = find_shadow_lines(tracer, opaque, threads);
  lines.insert(lines.end(), shadows.begin(), shadows.end());
  lines = seen_lines(scene.mesh, std::move(lines), source.hidden, threads);
  const std::vector<double> worth = worths(scene.mesh, lines, source);
  std::vector<std::uint32_t> order(lines.size());
  std::iota(order.begin(), order.end(), 0U);
  std::ranges::stable_sort(order, std::greater{}, [&](std::uint32_t i) { return worth[i]; });
  std::vector<CutLine> sorted;
  for (const std::uint32_t i : order) sorted.push_back(lines[i]);
  return cut_along(scene.mesh, sorted, budget, threads);
}

Mesh cut_along(const Mesh& mesh, std::span<const CutLine> lines, std::uint64_t budget, Threads& threads) {
  while (!lines.empty()) {
    Mesh out = Cutter(mesh, lines, threads).run();
    if (out.triangles.size() <= budget) return out;
    const double share = static_cast<double>(budget - std::min<std::uint64_t>(budget, mesh.triangles.size())) /
                         static_cast<double>(out.triangles.size() - mesh.triangles.size());
    lines = lines.first(static_cast<std::size_t>(0.9 * share * static_cast<double>(lines.size())));
  }
  return mesh;
}

}  // namespace kiln
