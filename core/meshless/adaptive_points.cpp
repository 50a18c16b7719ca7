#include "core/meshless/adaptive_points.h"

#include <algorithm>
#include <optional>

#include "core/base/expects.h"
#include "core/meshless/cover.h"
#include "core/meshless/point_grid.h"
#include "core/meshless/reading.h"

namespace kiln {
namespace {

constexpr std::size_t kBlock = 64;
constexpr float kChildReach = 2;  // of the parent level's R: points that a mispredicted point sends for

std::vector<std::uint32_t> marked(const std::vector<char>& marks, std::uint32_t first) {
  std::vector<std::uint32_t> out;
  for (std::uint32_t i = 0; i < marks.size(); ++i) {
    if (marks[i] != 0) out.push_back(first + i);
  }
  return out;
}

class Refinement {
 public:
  Refinement(const AdaptivePoints& params, Threads& threads)
      : params_(params), points_(params.points), threads_(threads) {}

  std::vector<std::uint32_t> run() {
    const auto uniform = static_cast<std::size_t>(params_.uniform_levels);
    std::size_t before = 0;             // computed points of the levels above the last one
    std::optional<Readings> predicted;  // at the last level's points, from those
    for (std::size_t level = 0; level < points_.levels(); ++level) {
      const std::uint32_t begin = points_.begin(level), end = points_.level_end[level];
      const bool everywhere = level < uniform || level >= points_.placed_levels();
      std::vector<char> chosen(end - begin, everywhere ? 1 : 0);
      for (std::size_t i = 0; i < chosen.size() && begin + i < params_.first; ++i) chosen[i] = 1;
      std::optional<Readings> seen;
      if (level > 0 && level + 1 >= uniform && level < points_.placed_levels()) seen = predict(begin, end);
      if (!everywhere) choose(before, level, *predicted, *seen, chosen);
      before = out_.size();
      predicted = std::move(seen);
      compute(marked(chosen, begin));
    }
    return std::move(out_);
  }

 private:
  /// What the points computed so far say of others.
  Readings predict(std::uint32_t begin, std::uint32_t end) const {
    std::vector<SurfaceSite> sites;
    for (const std::uint32_t p : out_) sites.push_back(points_.points[p].site);
    std::vector<TransferPoint> places;
    for (std::uint32_t p = begin; p < end; ++p) places.push_back(transfer_point(points_.points[p]));
    return {{params_.tracer, {sites, points_.cover, params_.neighbours}, threads_}, places, threads_};
  }

  void choose(std::size_t before, std::size_t level, const std::optional<Readings>& predicted, const Readings& seen,
              std::vector<char>& chosen) const {
    const std::uint32_t begin = points_.begin(level);
    for (const std::uint32_t p : children_of(mispredicted(before, level - 1, predicted), level)) chosen[p - begin] = 1;
    for (std::size_t i = 0; i < chosen.size(); ++i) {
      if (!seen.any(i) || points_.points[begin + i].site.group == kCoveredGroup) chosen[i] = 1;
    }
  }

  /// Points computed last, of `level`, that those before them do not predict. All of the coarsest: nothing is before.
  std::vector<std::uint32_t> mispredicted(std::size_t before, std::size_t level,
                                          const std::optional<Readings>& predicted) const {
    std::vector<char> wrong(out_.size() - before);
    threads_.for_blocks(wrong.size(), kBlock, [&](std::size_t begin, std::size_t end) {
      for (std::size_t k = begin; k < end; ++k) {
        const std::size_t n = before + k, i = out_[n] - points_.begin(level);
        // What sees nothing lies in a pocket: finer points there that see nothing are computed anyway.
        wrong[k] = !predicted || (predicted->any(i) && params_.wrong(n, predicted->terms(i))) ? 1 : 0;
      }
    });
    std::vector<std::uint32_t> out;
    for (std::size_t k = 0; k < wrong.size(); ++k) {
      if (wrong[k] != 0) out.push_back(out_[before + k]);
    }
    return out;
  }

  /// The points of a level around points of the level above.
  std::vector<std::uint32_t> children_of(const std::vector<std::uint32_t>& parents, std::size_t level) const {
    const float reach = kChildReach * points_.radius[level - 1];
    PointGrid grid(2 * reach);
    for (const std::uint32_t p : parents) grid.add(p, points_.points[p].site.position);
    std::vector<std::uint32_t> out;
    for (std::uint32_t p = points_.begin(level); p < points_.level_end[level]; ++p) {
      const SurfaceSite& site = points_.points[p].site;
      bool near = false;
      grid.near(site.position, reach, [&](std::uint32_t q, float d2) {
        const SurfaceSite& parent = points_.points[q].site;
        const float cosine = dot(site.normal, parent.normal);
        near = near || (site.group == parent.group && cosine > 0 && d2 <= reach * reach * cosine * cosine);
      });
      if (near) out.push_back(p);
    }
    return out;
  }

  void compute(const std::vector<std::uint32_t>& points) {
    const std::size_t first = out_.size();
    for (const std::uint32_t p : along_curve(points_, points)) out_.push_back(p);
    params_.compute(std::span(out_).subspan(first));
  }

  const AdaptivePoints& params_;
  const PointHierarchy& points_;
  Threads& threads_;
  std::vector<std::uint32_t> out_;
};

}  // namespace

std::vector<std::uint32_t> compute_adaptively(const AdaptivePoints& params, Threads& threads) {
  EXPECTS(params.uniform_levels >= 1 && params.neighbours >= 1 && params.compute && params.wrong);
  return Refinement(params, threads).run();
}

}  // namespace kiln
