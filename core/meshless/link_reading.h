#pragma once
// What a place reads of receivers (reading.h), as rows of links and weights in whole numbers.
// Repeat  a pure function of its arguments

#include <cstdint>
#include <vector>

#include "core/base/threads.h"
#include "core/meshless/light_links.h"
#include "core/meshless/reading.h"

namespace kiln {

class LinkReading {
 public:
  /// A site with a row of links.
  struct Receiver {
    SurfaceSite site;
    std::uint32_t row;
  };

  struct Points {
    const std::vector<Receiver>& receivers;
    float cover = 0;
    int neighbours = 10;
  };
  /// Keeps a reference to the tracer. The rest is as in reading.h.
  LinkReading(const Tracer&, const Points&, Threads&);

  Reading::Seen seen(const TransferPoint& p) const { return reading_.at(p); }

  /// The same as rows and weights in 255ths that sum to 255, of which the smallest are left out.
  std::vector<RowTerm> rows(const TransferPoint&) const;

 private:
  std::vector<std::uint32_t> row_;
  Reading reading_;
};

}  // namespace kiln
