#include "core/meshless/link_rows.h"

#include <algorithm>
#include <cmath>

namespace kiln {

LinkMaker::LinkMaker(const SenderTree& tree, const LinkOracle& oracle)
    : tree_(tree), oracle_(oracle), sums_(tree.nodes()) {}

void LinkMaker::add(std::uint32_t node, const GatherRows::Ray& ray, float weight) {
  Sum& sum = sums_[node];
  if (sum.rays == 0) touched_.push_back(node);
  sum.value += ray.value;
  sum.aside += ray.aside * weight;
  sum.weight += weight;
  ++sum.rays;
}

/// Equation 1.
bool LinkMaker::splits(std::uint32_t node) const {
  if (node < tree_.senders) return false;
  const Sum& own = sums_[node];
  if (own.weight > oracle_.largest * total_) return true;
  constexpr float kMeanOfAbsolute = 0.7979F;  // sqrt(2 / pi): of a normal deviate
  const std::uint32_t i = node - tree_.senders;
  float apart = 0, noise = 0, shares = 0;
  for (std::uint32_t k = tree_.child_begin[i]; k < tree_.child_begin[i + 1]; ++k) {
    shares += static_cast<float>(tree_.children[k].share);
  }
  for (std::uint32_t k = tree_.child_begin[i]; k < tree_.child_begin[i + 1]; ++k) {
    const float share = static_cast<float>(tree_.children[k].share) / shares;
    apart += std::abs(sums_[tree_.children[k].node].weight - share * own.weight);
    noise += kMeanOfAbsolute * std::sqrt(static_cast<float>(own.rays) * share * (1 - share));
  }
  noise *= own.weight / static_cast<float>(own.rays);
  return apart - noise > oracle_.split * total_;
}

void LinkMaker::count_below(std::uint32_t node, const Use& use) const {
  if (node < tree_.senders) return;
  const std::uint32_t i = node - tree_.senders;
  for (std::uint32_t k = tree_.child_begin[i]; k < tree_.child_begin[i + 1]; ++k) {
    const std::uint32_t child = tree_.children[k].node;
    if (sums_[child].rays == 0) continue;
    use.nodes[child] += static_cast<std::uint64_t>(double{sums_[child].weight} * double{use.area} * 0x1p24);
    count_below(child, use);
  }
}

void set_shares(SenderTree& tree, const std::vector<std::uint64_t>& use) {
  for (std::size_t i = 0; i + 1 < tree.child_begin.size(); ++i) {
    double sum = 0;
    for (std::uint32_t k = tree.child_begin[i]; k < tree.child_begin[i + 1]; ++k)
      sum += static_cast<double>(use[tree.children[k].node]);
    if (!(sum > 0)) continue;
    for (std::uint32_t k = tree.child_begin[i]; k < tree.child_begin[i + 1]; ++k) {
      const double share = static_cast<double>(use[tree.children[k].node]) / sum;
      tree.children[k].share = static_cast<std::uint16_t>(std::max(1.0, std::round(65535 * share)));
    }
  }
}

std::vector<FullLink> LinkMaker::links_of(const std::vector<GatherRows::Ray>& rays, const Use* use) {
  total_ = 0;
  for (const GatherRows::Ray& ray : rays) {
    const float weight = (ray.value.x + ray.value.y + ray.value.z) / 3;
    if (!(weight > 0)) continue;
    total_ += weight;
    for (std::uint32_t n = ray.sender; n != SenderTree::kNone; n = tree_.parent[n]) add(n, ray, weight);
  }
  std::vector<std::uint32_t> open;
  for (const std::uint32_t n : touched_) {
    if (tree_.parent[n] == SenderTree::kNone) open.push_back(n);
  }
  std::sort(open.begin(), open.end(), std::greater<>());
  std::vector<FullLink> out;
  while (!open.empty()) {
    const std::uint32_t n = open.back();
    open.pop_back();
    if (splits(n)) {
      const std::uint32_t i = n - tree_.senders;
      for (std::uint32_t k = tree_.child_begin[i + 1]; k-- > tree_.child_begin[i];) {
        if (sums_[tree_.children[k].node].rays > 0) open.push_back(tree_.children[k].node);
      }
      continue;
    }
    if (use != nullptr) count_below(n, *use);
    const Sum& sum = sums_[n];
    out.push_back({n, sum.value, sum.aside / sum.weight});
  }
  for (const std::uint32_t n : touched_) sums_[n] = {};
  touched_.clear();
  return out;
}

void append_row(const std::vector<FullLink>& links, LightLinks& out) {
  float most = 0;
  for (const FullLink& l : links) most = std::max({most, l.value.x, l.value.y, l.value.z});
  const float scale = most > 0 ? most : 0;
  Vec3f left;
  for (const FullLink& l : links) {
    LightLink link{.node = static_cast<std::uint16_t>(l.node)};
    for (std::size_t c = 0; c < 3; ++c) {
      const float exact = scale > 0 ? l.value[c] * 255 / scale + left[c] : 0.0F;
      const float whole = std::clamp(std::round(exact), 0.0F, 255.0F);
      link.value[c] = static_cast<std::uint8_t>(whole);
      left[c] = exact - whole;
      link.aside[c] = static_cast<std::int8_t>(std::clamp(std::round(l.aside[c] * 16), -127.0F, 127.0F));
    }
    if (link.value != std::array<std::uint8_t, 3>{}) out.links.push_back(link);
  }
  out.scale.push_back(scale);
  out.link_begin.push_back(static_cast<std::uint32_t>(out.links.size()));
}

}  // namespace kiln
