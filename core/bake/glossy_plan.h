#pragma once
// Which parts of a scene get transfer matrices: those whose reflection is seen to be specular.
//
// Metals up to roughness .7: straight on a GGX lobe of roughness .8 blurs the bands as Lambert's cosine does (.67, .26,
// .02 of bands 1 to 3 are left), at .7 it still shows .34 of band 2. (A glTF material that says nothing is a metal of
// roughness 1: it stays diffuse.) Other surfaces, which mirror 4 % straight on, up to roughness .4. A texture counts
// where at least a hundredth of the part's triangles have such a finish at their centre.
// What that skips, measured against `on` (the demo's floor, draft, overcast, all parts to random eyes): a dielectric of
// roughness 1 1.7 %, of .45 4.9 %. Metals are another matter: 41 % at roughness .75, 95 % at 1. Most of that is level:
// a lobe of single scattering loses up to .6 of what a rough metal reflects, and diffuse light of its full reflectance
// none. `on` shows them as glTF's formula does.
// Below roughness .4 a lobe keeps more than a third of band 5, the first that five bands leave out: the plan warns.

#include <optional>
#include <string>
#include <vector>

#include "core/bake/recipe.h"
#include "core/scene/scene.h"

namespace kiln {

inline constexpr float kGlossyMetal = 0.7F, kGlossyOther = 0.4F, kSharpest = 0.4F;  // roughness

/// How a part reflects, over those of its triangles that count as specular.
struct PartFinish {
  bool specular = false;
  float smoothest = 1;  // roughness
};

/// Of each part. `all`: whatever its roughness (unlit parts never).
std::vector<PartFinish> find_specular_parts(const Scene&, bool all);

struct GlossyPlan {
  int order = 0;           // of the matrices; 0: there are none
  int samples = 0;         // rays for each
  double compression = 0;  // relative error of the arriving light that storage may add
  std::vector<bool> parts;
  double vertex_share = 0;  // of the input's vertices on these parts

  explicit operator bool() const { return order > 0; }
};

/// What was decided, and why; `warning` where lobes are sharper than the order can show.
struct GlossyDecision {
  GlossyPlan plan;
  std::string value, reason;
  std::vector<Warning> warnings;
};

/// For steps that know diffuse light only: which parts look specular and are lit as matte ones.
std::optional<Warning> shown_as_matte(const Scene&);

/// `order` is that of the transfer vectors.
GlossyDecision plan_glossy(const Scene&, PrtStep::Glossy, int order);

/// The vertices of the given parts, ascending.
std::vector<std::uint32_t> vertices_of_parts(const Mesh&, const std::vector<bool>& parts);

}  // namespace kiln
