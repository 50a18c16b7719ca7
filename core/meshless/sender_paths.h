#pragma once
// From where a ray lands to the point whose light it carries.
//   L = throughput x value of the sender + picked_up
// A hit has the sender nearest to it. What has none (backs of double-sided faces, places inside solids) is followed by
// a diffuse path until it meets one; direct light on the way is picked up. Backs of single-sided faces are black.
// Emission that a ray meets is not counted: it is direct light of where the ray came from.
// Strict  a sender answers only for places it can see: straight, or over what lies between when both rise along their
//         normals by a quarter of their distance (surfaces that bulge hide neighbours a hair above them). Where the
//         nearest does not, the next that does answers, so that a thin wall parts what lies on its two sides. A path
//         ends after four places without a sender: pockets smaller than the distance of points keep their light.
// Error   the light of a sender's disk is taken as one.   Repeat  a pure function of its arguments

#include <cstdint>

#include "core/base/random.h"
#include "core/meshless/direct_light.h"
#include "core/meshless/senders.h"
#include "core/prt/gather_faces.h"
#include "core/prt/hit_albedo.h"

namespace kiln {

/// Whether two places of a surface see each other, as `strict` above says.
bool in_sight(const Tracer&, const SurfaceSite&, const SurfaceSite&);

class SenderPaths {
 public:
  /// What rays meet. All references must outlive the paths.
  struct World {
    const Tracer& tracer;
    const GatherFaces& faces;
    const HitAlbedo& albedo;
    const Senders& senders;
    const DirectLight* light;  // on paths: a few rays are enough; null: nothing is picked up
    bool strict = false;
  };
  struct End {
    std::uint32_t sender = Senders::kNone;  // kNone: the path ended without one
    Vec3f throughput{1, 1, 1};
    Vec3f picked_up;
  };

  explicit SenderPaths(const World& world) : world_(world) {}
  const World& world() const { return world_; }

  /// `hit` of a ray along `direction`. `enclosed`: the ray came from inside a solid, where the nearest sender may stand
  /// beyond a wall; then a sender answers only for places it can see. Adds the rays sent to `rays`.
  End follow(Hit hit, Vec3f direction, bool enclosed, Random&, std::uint64_t& rays) const;

  /// The nearest sender that sees a place as `strict` says, `first` before all others; or kNone.
  std::uint32_t seen_sender(const SurfaceSite& place, std::uint32_t first) const;

 private:
  bool sees(std::uint32_t sender, const Vec3f& origin) const;

  World world_;
};

}  // namespace kiln
