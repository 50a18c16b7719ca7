#include <cmath>

#include "core/base/random.h"
#include "core/meshless/link_work.h"

namespace kiln {
namespace {

double squared(const Vec3f& x) { return double{dot(x, x)}; }

}  // namespace

LinkErrors LinkBuilder::Work::errors_at(std::span<const TransferPoint> places, Threads& threads) const {
  LinkErrors out;
  if (probes() == 0 || !reading) return out;
  std::vector<std::uint32_t> rows, points;
  std::vector<double> spread;  // the variance of what a place reads, of that of one row
  for (const TransferPoint& place : places) {
    const Reading::Seen near = reading->seen(place);
    const BasisTerm* most = nullptr;
    double squares = 0;
    for (const BasisTerm& t : near.terms) {
      squares += double{t.value} * t.value;
      if (most == nullptr || t.value > most->value) most = &t;
    }
    if (most == nullptr || !(near.sum > 0)) continue;
    rows.push_back(read_row[most->function]);
    points.push_back(receiver[rows.back()]);
    spread.push_back(squares / (double{near.sum} * near.sum));
  }
  GatherRows again(*paths, params.rays, mix64(params.seed ^ 0x616761696eULL));
  again.add(places_of(points), threads, out.rays);
  for (std::size_t k = 0; k < probes(); ++k) {
    const std::vector<VectorValue> linked = gather_links(links, lamp[k], threads);
    double light = 0, noise = 0, off = 0;
    for (std::size_t i = 0; i < rows.size(); ++i) {
      const Vec3f& full = gathered[rows[i] * probes() + k];
      light += squared(full);
      noise += spread[i] * squared(again.apply(i, lamp[k]) - full) / 2;
      off += squared(linked[link_row[rows[i]]].value - full);
    }
    if (!(light > 0)) continue;
    out.noise += noise / light / static_cast<double>(probes());
    out.links += off / light / static_cast<double>(probes());
  }
  out.noise = std::sqrt(out.noise), out.links = std::sqrt(out.links);
  return out;
}

LinkErrors LinkBuilder::errors_at(std::span<const TransferPoint> places, Threads& threads) const {
  return work_->errors_at(places, threads);
}

std::vector<std::vector<RowTerm>> LinkBuilder::readings_at(std::span<const TransferPoint> places,
                                                           Threads& threads) const {
  std::vector<std::vector<RowTerm>> out(places.size());
  if (!work_->reading) return out;
  threads.for_blocks(places.size(), Work::kBlock, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) out[i] = work_->reading->rows(places[i]);
  });
  return out;
}

}  // namespace kiln
