#pragma once
// What a place reads of receivers: the Shepard weights of those around it that it can see (in_sight), so that nothing
// is read through a wall. Repeat  a pure function of its arguments

#include <cstdint>
#include <vector>

#include "core/base/threads.h"
#include "core/meshless/basis.h"
#include "core/meshless/light_links.h"
#include "core/prt/transfer_point.h"
#include "core/trace/tracer.h"

namespace kiln {

class LinkReading {
 public:
  /// A site with a row of links.
  struct Receiver {
    SurfaceSite site;
    std::uint32_t row;
  };

  /// Keeps a reference to the tracer. `neighbours` around each receiver set how far it is read (basis.h).
  LinkReading(const Tracer&, std::vector<Receiver>, int neighbours, Threads&);

  /// Receivers that a place sees, by their index, and the sum of their weights; none where none is near.
  struct Seen {
    std::vector<BasisTerm> terms;
    float sum = 0;
  };
  Seen seen(const TransferPoint&, std::uint32_t group) const;

  /// The same as rows and weights in 255ths that sum to 255, of which the smallest are left out. Empty where too
  /// little is seen for an interpolation.
  std::vector<RowTerm> rows(const TransferPoint&, std::uint32_t group) const;

 private:
  const Tracer& tracer_;
  std::vector<Receiver> receivers_;
  MeshlessBasis basis_;
};

}  // namespace kiln
