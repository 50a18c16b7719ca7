#pragma once
// Light that arrives at a place, direction by direction, for whoever sums it up.
//   integral of L(w) g(w) dw = sum over rays of along(w) g(w) / (count density) + sum over visited of light g(w) (1)
// The caller's rays have one density over all directions that matter to it; what they would find badly (punctual lights
// exactly, the sky's bright parts, emitters) is visited beside them, joined by the balance heuristic (Veach and
// Guibas 1995). Surfaces reflect as in lit_surface.h.
// Units   W m^-2 sr^-1 along a ray; visited light is W m^-2, of a plane that faces it.
// Repeat  a pure function of its arguments

#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "core/base/random.h"
#include "core/meshless/lit_surface.h"
#include "core/scene/environment.h"
#include "core/trace/environment_sampler.h"
#include "core/trace/lights.h"

namespace kiln {

class IncidentLight {
 public:
  /// What rays meet. `surface` may be null: it reflects nothing. `sky` may be null: darkness beyond the scene.
  struct World {
    const Tracer& tracer;
    const GatherFaces& faces;
    const LitSurface* surface = nullptr;
    const Environment* sky = nullptr;
  };
  struct Rays {
    int count = 0;
    double density = 0;  // per solid angle
    bool direct = true;  // emitters, sky and punctual lights too; else only what surfaces reflect
    /// Rays see the sky averaged over their share of directions (Krivanek and Colbert 2008): for sums that do not
    /// resolve single rays, to whom finer detail is noise.
    bool blurred = false;
  };
  /// References of the world must outlive it.
  IncidentLight(const World&, const Rays&, std::uint64_t seed);

  const World& world() const { return world_; }

  enum class Met { sky, lit, unknown, back };  // unknown: a surface that no light is known of
  struct Seen {
    Vec3f light;
    Met met = Met::sky;
  };
  /// Looks where a ray landed, and asks for what along() will read there: best for many rays before it.
  struct Landing {
    HitSide side = HitSide::dark;  // of a hit
    Senders::Slot slot;
  };
  Landing look(const Vec3f& w, const Hit& hit) const {
    if (!hit) return {};
    Landing at{.side = world_.faces.side(hit.triangle, w), .slot = {}};
    if (at.side != HitSide::dark && world_.surface != nullptr)
      at.slot = world_.surface->look(hit, at.side == HitSide::flipped);
    return at;
  }
  /// What one of the caller's rays brings. Adds the rays of paths to `rays`.
  Seen along(const Vec3f& w, const Hit& hit, const Landing& at, Random& random, std::uint64_t& rays) const {
    if (!hit) return {own_.direct ? sky_along(w) : Vec3f{}, Met::sky};
    if (at.side == HitSide::dark) return {{}, Met::back};
    LitSurface::Reflected from{.light = {}, .known = true};
    if (world_.surface != nullptr) from = world_.surface->reflected(at.slot, hit, w, random, rays);
    return {own_.direct ? from.light + seen_emitter(hit, w) : from.light, from.known ? Met::lit : Met::unknown};
  }
  Seen along(const Vec3f& w, const Hit& hit, Random& random, std::uint64_t& rays) const {
    return along(w, hit, look(w, hit), random, rays);
  }

  /// The sky as rays see it where nothing is in their way.
  Vec3f sky_along(const Vec3f& w) const;

  /// `place`: how far in its set the sample is, from 0 to 1, of which each half is a set as well; -1 of exact light.
  using Visit = std::function<void(const Vec3f& w, const Vec3f& light, float place)>;
  /// Visits the lamps' and the bright sky's light at a place, `item` of which names its random numbers. Nothing
  /// without `direct`. Adds to `rays`.
  void visit_lights(const Vec3f& place, std::uint64_t item, std::uint64_t& rays, const Visit&) const;
  /// The same in three parts, where punctual lights have their number in the scene, and the sky is visited whether it
  /// is seen or not.
  using LampVisit = std::function<void(std::size_t lamp, const Vec3f& w, const Vec3f& light)>;
  void visit_punctual(const Vec3f& place, std::uint64_t& rays, const LampVisit&) const;
  void visit_emitters(const Vec3f& place, std::uint64_t item, std::uint64_t& rays, const Visit&) const;
  using SkyVisit = std::function<void(const Vec3f& w, const Vec3f& light, float place, bool seen)>;
  void visit_bright_sky(const Vec3f& place, std::uint64_t item, std::uint64_t& rays, const SkyVisit&) const;

 private:
  /// A sample of the sky's bright part, and what it brings where nothing is in its way.
  struct BrightRay {
    Vec3f w, light;
    float place = 0;  // of Visit
  };
  Vec3f balanced_sky(const Vec3f& w) const;
  Environment blurred_sky() const;
  void draw_bright_rays();
  Vec3f seen_emitter(const Hit&, const Vec3f& w) const;

  float place_of(int sample) const { return static_cast<float>(sample) / static_cast<float>(own_.count); }

  World world_;
  Rays own_;
  std::uint64_t seed_;
  const EmitterSampler& emitters_;
  std::optional<EnvironmentSampler> bright_;  // of a map that has brighter and darker parts
  std::vector<BrightRay> bright_rays_;        // kBrightSets sets of own_.count rays; a place takes one by hash
  std::optional<Environment> blurred_;        // what rays see of the sky, averaged
};

}  // namespace kiln
