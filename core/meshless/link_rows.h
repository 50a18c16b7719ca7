#pragma once
// Which nodes of the sender tree a row links to: from the rays of a gather to few links.
// A link to node n is split into links to its children while
//   sum over its children of | w_child - share w_n |  -  noise  >  split,   or   w_n > largest                      (1)
// with w the share of the row's light (all senders equally bright) that comes from a node. The first measures how the
// kernel varies over the children; noise is what that sum would be on average for as many rays drawn by the shares.
// Paper   Lehtinen et al. 2007, section 6.5 (its sender oracle: magnitude and variation of the kernel).
// Shares  of a node's children begin as their areas and become what the senders' rows that use the node receive from
//         each: so the light that each sender sends to all of them is kept to the rounding. (With areas a closed box
//         lost 4 % at each bounce: the middle of a wall is seen by more than its corners are.)
// Error   what varies of the light within a node, times what varies of the kernel from row to row

#include <vector>

#include "core/meshless/gather_rows.h"
#include "core/meshless/sender_tree.h"

namespace kiln {

struct LinkOracle {
  float split = 0.003F;   // of a row's light
  float largest = 0.04F;  // of it
};

/// A link before it is rounded.
struct FullLink {
  std::uint32_t node = 0;
  Vec3f value, aside;
};

/// Makes the links of one row after the other. One for each thread.
class LinkMaker {
 public:
  /// Keeps a reference to the tree.
  LinkMaker(const SenderTree&, const LinkOracle&);

  /// In order of nodes along the tree. `use`: adds to each node below a link the light that comes from it
  /// times the area of the row, in 2^-24.
  struct Use {
    std::vector<std::uint64_t>& nodes;
    float area = 1;
  };
  std::vector<FullLink> links_of(const std::vector<GatherRows::Ray>&, const Use* use = nullptr);

 private:
  struct Sum {
    Vec3f value, aside;  // aside times weight
    float weight = 0;
    int rays = 0;
  };
  void add(std::uint32_t node, const GatherRows::Ray&, float weight);
  bool splits(std::uint32_t node) const;
  void count_below(std::uint32_t node, const Use&) const;

  const SenderTree& tree_;
  LinkOracle oracle_;
  std::vector<Sum> sums_;               // of each node
  std::vector<std::uint32_t> touched_;  // nodes with a sum
  float total_ = 0;
  int rays_ = 0;
};

/// Shares from what rows use; a node that none does keeps its own.
void set_shares(SenderTree&, const std::vector<std::uint64_t>& use);

/// Appends the row to `out`, rounded as light_links.h says.
void append_row(const std::vector<FullLink>&, LightLinks& out);

}  // namespace kiln
