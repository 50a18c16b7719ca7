#pragma once
// A cap on how many requests of one kind run at once, so that they cannot take every thread.

#include <atomic>
#include <memory>

namespace kiln {

/// Leaves the gate when the last copy goes.
using Pass = std::shared_ptr<void>;

class Gate {
 public:
  explicit Gate(int limit) : limit_(limit) {}

  /// Null when the gate is full. The gate must outlive the pass.
  Pass enter() {
    if (inside_.fetch_add(1) >= limit_) {
      inside_.fetch_sub(1);
      return nullptr;
    }
    return Pass(this, [](void* gate) { static_cast<Gate*>(gate)->inside_.fetch_sub(1); });
  }
  int inside() const { return inside_.load(); }
  int limit() const { return limit_; }

 private:
  std::atomic<int> inside_{0};
  int limit_;
};

}  // namespace kiln
