#pragma once
// Light from the side of a surface that no vertex stands for: the back of a double-sided face, by paths.
//
// Paths wait until sixteen can be traced together. Each step reflects diffusely; a ray that escapes adds Y(w) times
// what its surfaces let through, a ray that lands goes on while reflections are left. Unbiased.

#include <array>
#include <vector>

#include "core/base/random.h"
#include "core/prt/bright_spots.h"
#include "core/prt/hit_albedo.h"
#include "core/prt/lamps.h"
#include "core/trace/tracer.h"

namespace kiln {

/// A hit, and how many reflections may follow the one there.
struct FlippedHit {
  std::uint32_t triangle = 0;
  float u = 0, v = 0;
  Vec3f direction;  // of the ray that hit
  Vec3f throughput{1, 1, 1};
  int reflections = 0;
  BrightSpots::Gathering by;  // of the gathering ray; rays 0: looks know nothing of this hit
};

class FlippedPaths {
 public:
  /// Order of SH; `lit`: lamp light is wanted too, but for what looks at `spots` (may be null) find.
  FlippedPaths(const Tracer&, const Lamps&, const HitAlbedo&, int order, bool lit, const BrightSpots* spots);

  void clear();
  void add(const FlippedHit&, Random&);
  /// Traces what waits, to the end of every path.
  void finish(Random&);

  const std::vector<float>& rows() const { return rows_; }  // 3 x order^2, channel by channel
  const Vec3f& fixed() const { return fixed_; }
  std::uint64_t rays() const { return rays_; }

 private:
  struct Step {
    Vec3f origin, normal, throughput;
    int reflections = 0;
    BrightSpots::Gathering by;
  };
  Vec3f lamp_light(const Step&) const;
  void trace_waiting(Random&);
  void add_sky(const Vec3f& direction, const Vec3f& throughput);

  const Tracer& tracer_;
  const Lamps& lamps_;
  const HitAlbedo& albedo_;
  int order_;
  bool lit_;
  const BrightSpots* spots_;
  std::array<Step, kPacket> waiting_;
  int count_ = 0;
  std::vector<float> rows_;
  Vec3f fixed_;
  std::uint64_t rays_ = 0;
};

}  // namespace kiln
