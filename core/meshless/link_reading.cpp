#include "core/meshless/link_reading.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/meshless/sender_paths.h"
#include "core/prt/ray_origin.h"

namespace kiln {
namespace {

MeshlessBasis basis_of(const std::vector<LinkReading::Receiver>& receivers, int neighbours, Threads& threads) {
  std::vector<SurfaceSite> sites;
  for (const LinkReading::Receiver& r : receivers) sites.push_back(r.site);
  const std::array<std::uint32_t, 1> end = {static_cast<std::uint32_t>(sites.size())};
  return {sites, end, threads, neighbours};
}

}  // namespace

LinkReading::LinkReading(const Tracer& tracer, std::vector<Receiver> receivers, int neighbours, Threads& threads)
    : tracer_(tracer), receivers_(std::move(receivers)), basis_(basis_of(receivers_, neighbours, threads)) {}

LinkReading::Seen LinkReading::seen(const TransferPoint& p, std::uint32_t group) const {
  Seen out;
  std::vector<BasisTerm> near;
  if (basis_.terms({p.position, p.normal, group}, 1, near) != Cover::functions) return out;
  const SurfaceSite raised{ray_origin(p), p.normal, group};
  for (const BasisTerm& t : near) {
    if (!in_sight(tracer_, raised, receivers_[t.function].site)) continue;
    out.terms.push_back(t);
    out.sum += t.value;
  }
  return out;
}

std::vector<RowTerm> LinkReading::rows(const TransferPoint& p, std::uint32_t group) const {
  constexpr float kFewest = 0.05F;  // of the weight: what is left is no interpolation
  Seen near = seen(p, group);
  std::vector<RowTerm> out;
  if (!(near.sum > kFewest)) return out;
  std::sort(near.terms.begin(), near.terms.end(), [](const BasisTerm& a, const BasisTerm& b) {
    return a.value != b.value ? a.value > b.value : a.function < b.function;
  });
  float left = 0;
  int given = 0;
  for (const BasisTerm& t : near.terms) {
    const float exact = 255 * t.value / near.sum + left;
    const int whole = std::clamp(static_cast<int>(std::lrint(exact)), 0, 255 - given);
    left = exact - static_cast<float>(whole);
    given += whole;
    if (whole > 0) out.push_back({receivers_[t.function].row, static_cast<std::uint8_t>(whole)});
  }
  if (!out.empty()) out.front().weight = static_cast<std::uint8_t>(out.front().weight + 255 - given);
  return out;
}

}  // namespace kiln
