#include "core/meshless/link_reading.h"

#include <algorithm>
#include <cmath>

namespace kiln {
namespace {

std::vector<SurfaceSite> sites_of(const std::vector<LinkReading::Receiver>& receivers) {
  std::vector<SurfaceSite> sites;
  for (const LinkReading::Receiver& r : receivers) sites.push_back(r.site);
  return sites;
}

}  // namespace

LinkReading::LinkReading(const Tracer& tracer, const Points& points, Threads& threads)
    : reading_(tracer, {sites_of(points.receivers), points.cover, points.neighbours}, threads) {
  for (const Receiver& r : points.receivers) row_.push_back(r.row);
}

std::vector<RowTerm> LinkReading::rows(const TransferPoint& p) const {
  Reading::Seen near = seen(p);
  std::vector<RowTerm> out;
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
    if (whole > 0) out.push_back({row_[t.function], static_cast<std::uint8_t>(whole)});
  }
  if (!out.empty()) out.front().weight = static_cast<std::uint8_t>(out.front().weight + 255 - given);
  return out;
}

}  // namespace kiln
