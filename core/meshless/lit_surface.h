#pragma once
// The surface of a scene with the light that leaves it, for rays that look at it.
//   L(x -> w) = rho(x) x light of the nearest sender, or by a path where none stands for x (sender_paths.h)         (1)
// Table    as fine as that of senders.h, with the mean of rho over each entry: a hit costs one read, and sees a texture
//          no sharper than the light on it. Where hits look for themselves (senders.h) an entry has what its middle
//          finds. Where there is no entry, and on paths, rho is that of the hit.
// Memory   16 bytes a cell, 256 more for one in parts
// Units   W m^-2 sr^-1; `light` of a sender is irradiance / pi.   Repeat  a pure function of its arguments

#include <cstdint>
#include <functional>
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
  void set_light(std::vector<Vec3f> light, Threads&);
  /// Equation 1: what is reflected (not emitted) against a ray that lands at `hit`. Adds the rays of paths to `rays`.
  struct Reflected {
    Vec3f light;
    bool known = false;  // some sender stands for the place, or for one that the path came to, and is in no pocket
  };
  Reflected reflected(const Hit& hit, const Vec3f& direction, Random&, std::uint64_t& rays) const;
  /// Where the table has the light of a hit on the lit side of a face, or on the back of a double-sided one. Asks for
  /// it, so that the memory answers to many hits at once.
  Senders::Slot look(const Hit& hit, bool back) const {
    const Senders::Slot slot = senders_.slot(hit.triangle, hit.u, hit.v, back);
    if (slot.cell != Senders::kNone) __builtin_prefetch(&exits_[slot.cell]);
    return slot;
  }
  Reflected reflected(Senders::Slot slot, const Hit& hit, const Vec3f& direction, Random& random,
                      std::uint64_t& rays) const {
    if (slot.cell == Senders::kNone) return follow(hit, direction, random, rays, false);
    const Exit* exit = &exits_[slot.cell];
    if (exit->kind >= Exit::kParts) exit = &exits_[exit->kind - Exit::kParts + slot.part];
    if (exit->kind == Exit::kFollow) return follow(hit, direction, random, rays, true);
    return {exit->light, exit->kind == Exit::kLit};
  }
  /// Asks for what look() will read of this triangle.
  void prefetch(std::uint32_t triangle) const {
    faces_.prefetch(triangle);
    senders_.prefetch(triangle);
  }

 private:
  const Tracer& tracer_;
  GatherFaces faces_;
  HitAlbedo albedo_;
  DirectLight path_light_;  // on the way of a ray
  PointHierarchy points_;
  Senders senders_;
  SenderPaths paths_;
  std::vector<Vec3f> light_;
  /// What an entry of the senders' table reflects.
  struct Exit {
    enum : std::uint32_t { kLit, kPocket, kFollow, kParts };  // kFollow: no sender stands for it
    Vec3f light;
    std::uint32_t kind = kFollow;  // from kParts on: kParts + the first slot of its parts
  };
  Reflected follow(const Hit&, const Vec3f& direction, Random&, std::uint64_t& rays, bool alone) const;
  Vec3f mean_albedo(std::uint32_t triangle, const std::function<Vec2f(float, float)>& uv) const;
  std::vector<Exit> exits_;
};

}  // namespace kiln
