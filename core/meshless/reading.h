#pragma once
// What a place reads of points: the Shepard weights (one level of basis.h) of those around it that it sees
// (in_sight.h), so that nothing is read through a wall. Repeat  a pure function of its arguments

#include <cstdint>
#include <span>
#include <vector>

#include "core/base/threads.h"
#include "core/meshless/basis.h"
#include "core/prt/transfer_point.h"
#include "core/trace/tracer.h"

namespace kiln {

class Reading {
 public:
  static constexpr float kFewest = 0.05F;  // of the weight of all points: what is less is no interpolation

  struct Points {
    std::span<const SurfaceSite> sites;
    float cover = 0;      // of the hierarchy that they are from: covered places read covered points (cover.h)
    int neighbours = 10;  // around each point set how far it is read
  };
  /// Keeps a reference to the tracer.
  Reading(const Tracer&, const Points&, Threads&);

  /// Points that a place sees, by their index, and the sum of their weights; nothing where that is below kFewest.
  struct Seen {
    std::vector<BasisTerm> terms;
    float sum = 0;
  };
  Seen at(const TransferPoint&) const;

 private:
  const Tracer& tracer_;
  std::vector<SurfaceSite> sites_;
  float cover_;
  MeshlessBasis basis_;
};

inline Vec3f sum_of(std::span<const BasisTerm> terms, std::span<const Vec3f> values) {
  Vec3f sum;
  for (const BasisTerm& t : terms) sum += values[t.function] * t.value;
  return sum;
}

/// What many places read, as rows of a sparse matrix whose weights add up to 1.
class Readings {
 public:
  Readings(const Reading&, std::span<const TransferPoint> places, Threads&);

  /// Whether the place sees any point.
  bool any(std::size_t place) const { return begin_[place + 1] > begin_[place]; }
  std::span<const BasisTerm> terms(std::size_t place) const {
    return std::span(terms_).subspan(begin_[place], begin_[place + 1] - begin_[place]);
  }

 private:
  std::vector<std::size_t> begin_;
  std::vector<BasisTerm> terms_;
};

}  // namespace kiln
