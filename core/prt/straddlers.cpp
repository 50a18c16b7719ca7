#include "core/prt/straddlers.h"

#include <algorithm>
#include <array>
#include <map>
#include <optional>

namespace kiln {
namespace {

/// Of each copy: whether what it shows is hidden.
std::vector<char> verdicts(const std::vector<StandIn>& copies, const HiddenTest& hidden, Threads& threads) {
  std::vector<char> out(copies.size());
  threads.for_blocks(copies.size(), 64, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) out[i] = hidden(copies[i].point) ? 1 : 0;
  });
  return out;
}

/// The copies that are hidden, each with the first one at its place that is not.
std::map<std::uint32_t, std::uint32_t> lit_twins(const Mesh& mesh, const std::vector<StandIn>& copies,
                                                 const std::vector<char>& hidden) {
  using Place = std::array<float, 6>;
  const auto place_of = [&](std::uint32_t v) {
    const Vec3f &p = mesh.position[v], &n = mesh.normal[v];
    return Place{p.x, p.y, p.z, n.x, n.y, n.z};
  };
  std::map<Place, std::uint32_t> lit;
  for (std::size_t i = 0; i < copies.size(); ++i)
    if (hidden[i] == 0) lit.emplace(place_of(copies[i].vertex), copies[i].vertex);
  std::map<std::uint32_t, std::uint32_t> out;
  for (std::size_t i = 0; i < copies.size(); ++i) {
    if (hidden[i] == 0) continue;
    if (const auto twin = lit.find(place_of(copies[i].vertex)); twin != lit.end())
      out.emplace(copies[i].vertex, twin->second);
  }
  return out;
}

}  // namespace

void light_straddlers(Mesh& mesh, const std::vector<StandIn>& copies, const HiddenTest& hidden, Threads& threads) {
  const std::map<std::uint32_t, std::uint32_t> twins = lit_twins(mesh, copies, verdicts(copies, hidden, threads));
  const std::vector<std::uint32_t> face = widest_faces(mesh);
  const auto on_line = [&](std::uint32_t v) { return std::ranges::binary_search(copies, v, {}, &StandIn::vertex); };
  for (Triangle& t : mesh.triangles) {
    if (std::ranges::none_of(t, [&](std::uint32_t v) { return twins.count(v) > 0; })) continue;
    const bool straddles =
        std::ranges::any_of(t, [&](std::uint32_t v) { return !on_line(v) && !hidden(vertex_point(mesh, v, face[v])); });
    if (!straddles) continue;
    for (std::uint32_t& v : t) {
      if (const auto twin = twins.find(v); twin != twins.end()) v = twin->second;
    }
  }
}

}  // namespace kiln
