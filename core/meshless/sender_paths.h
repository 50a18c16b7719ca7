#pragma once
// From where a ray lands to the point whose light it carries.
//   L = throughput x value of the sender + picked_up
// A hit has the sender that senders.h gives it. What has none (pockets smaller than the distance of points) is followed
// by a diffuse path until it meets one; direct light on the way is picked up. A path ends after kMostSteps such places.
// Backs of single-sided faces are black. Emission that a ray meets is not counted: it is direct light of where the ray
// came from.
// Error   the light of a sender's disk is taken as one.   Repeat  a pure function of its arguments

#include <cstdint>

#include "core/base/random.h"
#include "core/meshless/direct_light.h"
#include "core/meshless/senders.h"
#include "core/prt/gather_faces.h"
#include "core/prt/hit_albedo.h"

namespace kiln {

class SenderPaths {
 public:
  /// What rays meet. All references must outlive the paths.
  struct World {
    const Tracer& tracer;
    const GatherFaces& faces;
    const HitAlbedo& albedo;
    const Senders& senders;
    const DirectLight* light;  // on paths: a few rays are enough; null: nothing is picked up
  };
  struct End {
    std::uint32_t sender = Senders::kNone;  // kNone: the path ended without one
    Vec3f throughput{1, 1, 1};
    Vec3f picked_up;
  };

  explicit SenderPaths(const World& world) : world_(world) {}
  const World& world() const { return world_; }

  static constexpr int kMostSteps = 4;

  /// `hit` of a ray along `direction`. Adds the rays sent to `rays`. `alone`: it is known that none stands for the hit.
  End follow(Hit hit, Vec3f direction, Random&, std::uint64_t& rays, bool alone = false) const;

 private:
  World world_;
};

}  // namespace kiln
