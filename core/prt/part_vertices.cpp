#include "core/prt/part_vertices.h"

#include <algorithm>
#include <array>
#include <optional>
#include <span>
#include <utility>

#include "core/mesh/midpoint.h"
#include "core/mesh/topology.h"

namespace kiln {
namespace {

constexpr float kFlat = 0.9999F;  // cosine between faces: over a crease the way between them leads through the surface
constexpr float kAcross = 1.0F / 16;  // of the way from an edge to the middle of its triangle: nearer lines are on it

/// How far into each of two triangles one must go from their common edge to be past what stands between them: shares of
/// the way to their middles. Nothing where nothing does.
std::optional<std::array<float, 2>> between_triangles(const Mesh& mesh, const std::array<Triangle, 2>& side,
                                                      std::uint32_t a, std::uint32_t b, const PierceTest& test) {
  const Vec3f edge = (mesh.position[a] + mesh.position[b]) * 0.5F, normal = middle_normal(mesh, a, b);
  std::array<TransferPoint, 2> point;
  std::array<float, 2> share{};
  for (std::size_t k = 0; k < 2; ++k) {
    const Vec3f inward = centroid(mesh, side[k]), face = normalized(area_vector(mesh, side[k]), normal);
    const float way = length(inward - edge);
    if (!(way > 4 * kClear)) return std::nullopt;
    share[k] = std::max(kAcross, kClear / way);
    point[k] = {edge + (inward - edge) * share[k], normal, inward, face};
  }
  if (dot(point[0].face_normal, point[1].face_normal) < kFlat) return std::nullopt;
  const auto found = test(point[0], point[1]);
  if (!found) return std::nullopt;
  const float whole = share[0] + share[1];
  return std::array{std::max(0.0F, share[0] - found->from_a * whole), std::max(0.0F, found->from_b * whole - share[0])};
}

/// The triangles around each vertex.
class Fans {
 public:
  explicit Fans(const Mesh& mesh) : first_(mesh.position.size() + 1, 0), triangle_(3 * mesh.triangles.size()) {
    for (const Triangle& t : mesh.triangles)
      for (const std::uint32_t v : t) ++first_[v + 1];
    for (std::size_t v = 1; v < first_.size(); ++v) first_[v] += first_[v - 1];
    std::vector<std::uint32_t> next(first_.begin(), first_.end() - 1);
    for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t)
      for (const std::uint32_t v : mesh.triangles[t]) triangle_[next[v]++] = t;
  }
  std::span<const std::uint32_t> around(std::uint32_t v) const {
    return std::span(triangle_).subspan(first_[v], first_[v + 1] - first_[v]);
  }

 private:
  std::vector<std::uint32_t> first_, triangle_;
};

bool has(const Triangle& t, std::uint32_t v) { return t[0] == v || t[1] == v || t[2] == v; }

/// An edge between two triangles that something stands on.
struct Contact {
  std::uint32_t a, b;                     // vertices, a < b
  std::array<std::uint32_t, 2> triangle;  // first < second
  std::array<float, 2> past;              // how far to go into each to be past it
};

std::vector<Contact> find_contacts(const Mesh& mesh, const Fans& fans, const PierceTest& test, Threads& threads) {
  constexpr std::size_t kBlock = 1024;
  std::vector<std::vector<Contact>> of_block(mesh.triangles.size() / kBlock + 1);
  threads.for_blocks(mesh.triangles.size(), kBlock, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const auto t = static_cast<std::uint32_t>(i);
      for (std::size_t k = 0; k < 3; ++k) {
        const auto [a, b] = std::minmax({mesh.triangles[t][k], mesh.triangles[t][(k + 1) % 3]});
        for (const std::uint32_t other : fans.around(a)) {
          if (other <= t || !has(mesh.triangles[other], b)) continue;
          if (const auto past = between_triangles(mesh, {mesh.triangles[t], mesh.triangles[other]}, a, b, test))
            of_block[begin / kBlock].push_back({a, b, {t, other}, *past});
        }
      }
    }
  });
  std::vector<Contact> out;
  for (const auto& block : of_block) out.insert(out.end(), block.begin(), block.end());
  std::ranges::stable_sort(out, {}, [](const Contact& c) { return std::pair(c.a, c.b); });
  return out;
}

class Parter {
 public:
  Parter(Mesh& mesh, const Fans& fans, const std::vector<Contact>& contacts)
      : mesh_(mesh), fans_(fans), contacts_(contacts) {}

  std::vector<StandIn> run() {
    std::vector<std::uint32_t> vertices;
    for (const Contact& c : contacts_) vertices.insert(vertices.end(), {c.a, c.b});
    std::ranges::sort(vertices);
    vertices.erase(std::unique(vertices.begin(), vertices.end()), vertices.end());
    std::vector<StandIn> out;
    for (const std::uint32_t v : vertices) part(v, shares_of(v), out);
    for (const auto& [corner, vertex] : renamed_) mesh_.triangles[corner / 3][corner % 3] = vertex;
    std::ranges::sort(out, {}, &StandIn::vertex);
    return out;
  }

 private:
  std::span<const Contact> contacts_on(std::uint32_t v, std::uint32_t w) const {
    const auto edge_of = [](const Contact& c) { return std::pair(c.a, c.b); };
    const std::pair<std::uint32_t, std::uint32_t> edge = std::minmax({v, w});
    const auto first = std::ranges::lower_bound(contacts_, edge, {}, edge_of);
    return {first, std::ranges::upper_bound(contacts_, edge, {}, edge_of)};
  }

  bool apart(std::uint32_t v, std::uint32_t w, std::uint32_t t, std::uint32_t u) const {
    const auto [low, high] = std::minmax({t, u});
    return std::ranges::any_of(contacts_on(v, w), [low = low, high = high](const Contact& c) {
      return c.triangle[0] == low && c.triangle[1] == high;
    });
  }

  /// The triangles around a vertex, those together that no contact keeps apart.
  std::vector<std::vector<std::uint32_t>> shares_of(std::uint32_t v) const {
    std::vector<std::uint32_t> rest(fans_.around(v).begin(), fans_.around(v).end());
    std::vector<std::vector<std::uint32_t>> shares;
    while (!rest.empty()) {
      std::vector<std::uint32_t> share{rest.front()};
      rest.erase(rest.begin());
      for (std::size_t i = 0; i < share.size(); ++i) {
        std::erase_if(rest, [&](std::uint32_t t) {
          const bool mine = joined(v, share[i], t);
          if (mine) share.push_back(t);
          return mine;
        });
      }
      shares.push_back(std::move(share));
    }
    return shares;
  }

  bool joined(std::uint32_t v, std::uint32_t t, std::uint32_t u) const {
    return std::ranges::any_of(mesh_.triangles[t], [&](std::uint32_t w) {
      return w != v && has(mesh_.triangles[u], w) && !apart(v, w, t, u);
    });
  }

  /// The first share keeps the vertex, the others get copies.
  void part(std::uint32_t vertex, const std::vector<std::vector<std::uint32_t>>& shares, std::vector<StandIn>& out) {
    if (shares.size() < 2) return;
    for (const std::vector<std::uint32_t>& share : shares) {
      const std::uint32_t mine = &share == &shares[0] ? vertex : append_between(mesh_, vertex, vertex, 0);
      const auto area = [&](std::uint32_t t) { return triangle_area(mesh_, mesh_.triangles[t]); };
      out.push_back({mine, light_in(vertex, *std::ranges::max_element(share, {}, area))});
      for (const std::uint32_t t : share) {
        const Triangle& c = mesh_.triangles[t];
        renamed_.emplace_back(3 * std::size_t{t} + (c[0] == vertex ? 0 : c[1] == vertex ? 1 : 2), mine);
      }
    }
  }

  TransferPoint light_in(std::uint32_t vertex, std::uint32_t triangle) const {
    float past = 0;
    const Triangle& t = mesh_.triangles[triangle];
    for (std::size_t k = 0; k < 3; ++k) {
      for (const Contact& c : contacts_on(t[k], t[(k + 1) % 3])) {
        for (std::size_t side = 0; side < 2; ++side)
          if (c.triangle[side] == triangle) past = std::max(past, c.past[side]);
      }
    }
    const Vec3f inward = centroid(mesh_, mesh_.triangles[triangle]), at = mesh_.position[vertex];
    const float way = length(inward - at), share = std::min(0.5F, past + kClear / std::max(way, kClear));
    return {.position = at + (inward - at) * share,
            .normal = mesh_.normal[vertex],
            .inward = inward,
            .face_normal = normalized(area_vector(mesh_, mesh_.triangles[triangle]), mesh_.normal[vertex])};
  }

  Mesh& mesh_;
  const Fans& fans_;
  const std::vector<Contact>& contacts_;
  std::vector<std::pair<std::size_t, std::uint32_t>> renamed_;  // corners; together at the end: fans know the old names
};

}  // namespace

std::vector<StandIn> part_vertices(Mesh& mesh, const PierceTest& test, Threads& threads) {
  const Fans fans(mesh);
  const std::vector<Contact> contacts = find_contacts(mesh, fans, test, threads);
  return Parter(mesh, fans, contacts).run();
}

}  // namespace kiln
