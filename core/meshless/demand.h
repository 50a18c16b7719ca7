#pragma once
// Points where light is asked for and none stands: in folds, between layers, in pockets and on backs, where the
// proposals of points.h met nothing, or met what looked like the inside of a solid.
// Asked    1. by readers (vertices) that see no point within reach; 2. by kDemandRays cosine rays from every point,
// where
//          one lands on a face that lets light go and no sender stands for the place. New points ask in their turn, for
//          kDemandRounds rounds. In the order of asking each place gets a point unless it sees one that was just added.
// Adds     one more level to the points (`demanded`), of the finest radius, up to `most` points in all. What is asked
//          for beyond that is left to paths (sender_paths.h).
// Pockets  are points whose normal's ray first meets a back: no lamp or probe outside is seen from there.
// Paper    not in Lehtinen et al. 2007.   Cost  kDemandRays rays a point, and a look-up in senders.h for each
// Repeat   same points for any thread count

#include <span>

#include "core/base/threads.h"
#include "core/meshless/points.h"
#include "core/meshless/reading.h"
#include "core/meshless/senders.h"

namespace kiln {

/// Where a reader looks from: a little inside its face (cover.h), clear of edges that hide what is beside them.
SurfaceSite reader_site(const Tracer&, const TransferPoint&, float cover);

inline constexpr int kDemandRays = kPacket, kDemandRounds = 3;

struct Demand {
  const Tracer& tracer;
  const GatherFaces& faces;
  std::uint64_t seed = 0;
  std::span<const TransferPoint> readers;
  std::size_t most = 0;  // points in all; 0: twice as many as were placed
};

/// `senders` are those of `points`, and know the new ones afterwards.
void add_demanded(const Demand&, PointHierarchy& points, Senders& senders, Threads&);

}  // namespace kiln
