#pragma once
// Spots that point and spot lights make on surfaces near them. They are so much brighter than the rest that what they
// reflect cannot be left to gathering rays, which hit them by chance: a vertex where one does is a firefly.
//
// Beams, rays from the lamps, are traced once. Those that end in a lamp's reach stay, and every gathering point looks
// at some of them with shadow rays. Light of a lamp that surfaces in its reach reflect is thus found in two ways,
// joined by the balance heuristic: of N gathering rays of density p and M looks of density q, both per area, a ray
// counts N p / (N p + M q) of it. Paper   Veach and Guibas 1995; ends of beams as lights: Keller 1997. Reach   as far
// as a lamp alone would light a surface kBright times the mean.   Repeat  same beams for the same seed. Without lamps
// near surfaces there are no beams, and nothing is done.

#include <cstdint>
#include <span>
#include <vector>

#include "core/base/random.h"
#include "core/prt/lamps.h"
#include "core/scene/scene.h"
#include "core/trace/tracer.h"

namespace kiln {

class BrightSpots {
 public:
  /// Looks of a point that sends so many gathering rays: an eighth, in whole packets.
  static int looks(int gathering_rays) { return (gathering_rays / 8 + kPacket - 1) / kPacket * kPacket; }

  /// `mean_light`: irradiance / pi of the lamps, over the surface; 0: all they light is bright beside it. Keeps a
  /// reference to the tracer.
  BrightSpots(const Tracer&, double mean_light, std::uint64_t seed);

  bool empty() const { return beams_.empty(); }
  struct Lamp {
    const Light* light;
    float reach;
  };
  std::span<const Lamp> lamps() const { return lamps_; }

  /// Gathering rays where one of them landed.
  struct Gathering {
    int rays = 0;
    float density = 0;  // N p, per area
  };
  /// Of a lamp's light at a place of a face, the share that looks find.
  float share_of_looks(std::size_t lamp, const Vec3f& place, const Vec3f& face, const Gathering&) const;
  /// Irradiance / pi of the punctual lights at the place of a gathering ray, without that.
  Vec3f gathered(const Lamps&, const Receiver&, const Gathering&) const;
  /// What a point that sends so many gathering rays sees of the spots: irradiance / pi.
  Vec3f look(const Receiver&, int gathering_rays, Random&) const;

 private:
  struct Beam {
    Vec3f end, face;  // lifted off the face, on the lit side
    Vec3f light;      // that leaves it
    float density;    // of a look, per area
  };
  void find_lamps(double mean_light);
  void trace_beams(std::uint64_t seed);
  float trace_beam(std::size_t lamp, const Vec3f& direction);
  void sort_beams();
  float density(std::size_t lamp, const Vec3f& place, const Vec3f& face) const;

  const Tracer& tracer_;
  std::vector<Lamp> lamps_;
  std::vector<Beam> beams_;
};

}  // namespace kiln
