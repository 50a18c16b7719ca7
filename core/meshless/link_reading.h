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

  /// Keeps a reference to the tracer. `neighbours` around each receiver set how far it is read.
  LinkReading(const Tracer&, const std::vector<Receiver>&, int neighbours, Threads&);

  Reading::Seen seen(const TransferPoint& p, std::uint32_t group) const { return reading_.at(p, group); }

  /// The same as rows and weights in 255ths that sum to 255, of which the smallest are left out.
  std::vector<RowTerm> rows(const TransferPoint&, std::uint32_t group) const;

 private:
  std::vector<std::uint32_t> row_;
  Reading reading_;
};

}  // namespace kiln
