#pragma once
// The surface of a scene with the light that leaves it, for rays that look at it.
//   L(x -> w) = rho(x) x light of the nearest sender, or by a path where none stands for x (sender_paths.h)         (1)
// Units   W m^-2 sr^-1; `light` of a sender is irradiance / pi.   Repeat  a pure function of its arguments

#include <cstdint>
#include <span>
#include <vector>

#include "core/base/threads.h"
#include "core/meshless/points.h"
#include "core/meshless/sender_paths.h"
#include "core/scene/environment.h"

namespace kiln {

class LitSurface {
 public:
  struct Points {
    PointPlacement placement;
    std::span<const TransferPoint> readers;  // places that ask for points (demand.h)
  };
  /// Keeps references to the tracer and to `sky`, which may be null. Places the senders; they are dark.
  LitSurface(const Tracer&, const Environment* sky, const Points&, Threads&);
  LitSurface(const LitSurface&) = delete;
  LitSurface& operator=(const LitSurface&) = delete;

  const Tracer& tracer() const { return tracer_; }
  const GatherFaces& faces() const { return faces_; }
  const PointHierarchy& points() const { return points_; }
  const SenderPaths& paths() const { return paths_; }

  /// Of each point, in order.
  void set_light(std::vector<Vec3f> light);
  /// Equation 1: what is reflected (not emitted) against a ray that lands at `hit`. Adds the rays of paths to `rays`.
  struct Reflected {
    Vec3f light;
    bool known = false;  // some sender stands for the place, or for one that the path came to, and is in no pocket
  };
  Reflected reflected(const Hit& hit, const Vec3f& direction, Random&, std::uint64_t& rays) const;
  /// Asks for what reflected() will read of this triangle.
  void prefetch(std::uint32_t triangle) const {
    faces_.prefetch(triangle);
    senders_.prefetch(triangle);
    __builtin_prefetch(&part_[triangle]);
  }

 private:
  const Tracer& tracer_;
  const std::uint32_t* part_;  // of each triangle
  GatherFaces faces_;
  HitAlbedo albedo_;
  DirectLight path_light_;  // on the way of a ray
  PointHierarchy points_;
  Senders senders_;
  SenderPaths paths_;
  std::vector<Vec3f> light_;
};

}  // namespace kiln
