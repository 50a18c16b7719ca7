#pragma once
// Senders in groups: a forest over the points that links may end at, so that one link carries the light of many.
// A point of a level is the child of the nearest compatible point of the coarser levels (equation 1 of points.h) within
// 2 R of them that it can see (in_sight): what a wall parts is never of one group. A point without such a parent is a
// root of its own.
// Share   of a child, to begin with: its samples over those of its parent. Samples are even over the surface.
// Samples up to kSamples places for each sender, of those that SenderPaths gives to it: what the light of the sender is
//         averaged over. Places inside solids do not count. A sender that got none is its own.
// Cost    kDrawn places for each point, one or two rays each.   Repeat  same bits for any thread count

#include <cstdint>
#include <vector>

#include "core/base/threads.h"
#include "core/meshless/light_links.h"
#include "core/meshless/points.h"
#include "core/meshless/sender_paths.h"

namespace kiln {

struct SenderTree {
  static constexpr std::uint32_t kNone = 0xffffffffU;
  std::uint32_t senders = 0;
  std::vector<std::uint32_t> parent;       // of each node; kNone: a root
  std::vector<std::uint32_t> child_begin;  // of nodes `senders`, `senders` + 1, ...
  std::vector<TreeChild> children;
  std::vector<float> area;  // of each node, in samples
  std::size_t nodes() const { return parent.size(); }
};

inline constexpr int kSamples = 10, kDrawn = 48;

struct SenderSamples {
  std::vector<std::uint32_t> begin;  // of each sender, and the end
  std::vector<SenderSample> samples;
  std::vector<float> area;  // how many were drawn for each
};

SenderSamples sample_senders(const SenderPaths&, const PointHierarchy&, std::uint64_t seed, Threads&);

SenderTree grow_sender_tree(const Tracer&, const PointHierarchy&, const std::vector<float>& area, Threads&);

}  // namespace kiln
