#pragma once
// Edges that a simplification may collapse, by cost, the least first, ties by points: the same order always.

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace kiln {

struct Candidate {
  float cost = 0;
  std::uint32_t a = 0, b = 0;  // points, a < b
  std::uint32_t age = 0;       // of both together when the cost was found; ages only grow
  friend bool operator<(const Candidate& x, const Candidate& y) {
    if (x.cost != y.cost) return x.cost < y.cost;
    if (x.a != y.a) return x.a < y.a;
    return x.b != y.b ? x.b < y.b : x.age < y.age;
  }
};

/// A heap. Four children share a cache line, which is where a large queue spends its time.
class CollapseQueue {
 public:
  bool empty() const { return items_.empty(); }
  std::size_t size() const { return items_.size(); }
  void fill(std::vector<Candidate> items) {
    items_ = std::move(items);
    for (std::size_t at = items_.size() / 4 + 1; at-- > 0;)
      if (at < items_.size()) sink(at, items_[at]);
  }
  template <class Wanted>
  void keep(const Wanted& wanted) {
    std::erase_if(items_, [&](const Candidate& c) { return !wanted(c); });
    fill(std::move(items_));
  }
  void push(const Candidate& c) {
    std::size_t at = items_.size();
    items_.push_back(c);
    for (; at > 0 && c < items_[(at - 1) / 4]; at = (at - 1) / 4) items_[at] = items_[(at - 1) / 4];
    items_[at] = c;
  }
  Candidate pop() {
    const Candidate least = items_.front(), last = items_.back();
    items_.pop_back();
    if (!items_.empty()) sink(0, last);
    return least;
  }

 private:
  /// Puts `c` where it belongs, at `at` or below.
  void sink(std::size_t at, const Candidate c) {
    for (std::size_t child = 4 * at + 1; child < items_.size(); child = 4 * at + 1) {
      const std::size_t end = std::min(child + 4, items_.size());
      for (std::size_t other = child + 1; other < end; ++other)
        if (items_[other] < items_[child]) child = other;
      if (!(items_[child] < c)) break;
      items_[at] = items_[child];
      at = child;
    }
    items_[at] = c;
  }

  std::vector<Candidate> items_;
};

}  // namespace kiln
