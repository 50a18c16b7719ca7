#pragma once
// The lightmap of the step `radiosity`: light at the texels of a square picture over TEXCOORD_1, as at vertices.
//
// Place    each texel stands at the surface that it shows (core/mesh/texel_map.h), with that place's normal, and is lit
//          as a vertex is: direct light in full, reflected light read from the points that it sees.
// Edges    Where direct light jumps from one texel to the next, each of the two takes the mean over its own area: a
//          shadow has a soft step instead of teeth, as bilinear filtering wants it.
// Small    Texels of charts that have few, and those whose centre lies inside a solid, show the mean over the parts of
//          them that can be seen: where a texel is as large as a button, its centre may lie in the cloth below.
// Filled   Texels inside solids take their light from the chart around them, those of no chart from their neighbours.
//          Texels beside a small chart that goes into a solid are filled likewise. A place among the backs of faces, of
//          double-sided ones too, is inside of one where it has hardly any light: of those only texels beside lit ones
//          are filled, which filtering reads with them; the rest stays dark, as a room of such faces would be.
// Seams    The two sides of a seam agree (core/mesh/texel_seams.h).
// Layout   The author's where it is one for the whole scene, else packed anew (core/mesh/uv_charts.h). Instances are
//          written out and never share texels.
// Repeat   same bits for any thread count

#include <cstdint>
#include <optional>
#include <vector>

#include "core/artifact/baked_scene.h"
#include "core/artifact/look.h"
#include "core/bake/bake_log.h"
#include "core/bake/lightmap_certificate.h"
#include "core/bake/plan.h"
#include "core/bake/radiosity_step.h"
#include "core/bake/recipe.h"
#include "core/mesh/texel_seams.h"

namespace kiln {

/// Adds the lightmap to the plan of `radiosity`: layout, size, decisions, warnings and prediction.
/// Fails with no_lightmap_coordinates, lightmap_too_small, and memory_limit where the picture alone would pass it
Result<void> plan_lightmap(const Scene&, const Recipe&, Plan&);

struct LightmapOutcome {
  Lightmap lightmap;  // as the EXR holds it
  Bytes exr;          // lightmap.exr
  std::uint64_t image_bytes = 0;
  std::size_t texels = 0, hidden = 0, seam_places = 0;
  double texels_per_metre = 0;  // in the mean over the surface
  std::optional<LightmapCertificate> certificate;
};

class LightmapStep {
 public:
  /// `scene` is the input, with the coordinates of the plan.
  LightmapStep(const Scene& scene, const Plan&, Threads&);

  /// Where light is asked for.
  const std::vector<TransferPoint>& places() const { return places_; }
  void light(const LitPlaces&, Threads&);
  /// As automatic_exposure (core/artifact/look.h), over what is lit.
  float exposure() const;

  /// Adds the lightmap to the file, which `decoded` is, reads everything back and certifies it against `truth`.
  struct Job {
    const BakedScene& decoded;
    const Tracer& truth;
    const Environment* sky = nullptr;
    int bounces = -1;
    const Recipe& recipe;
    std::string provenance;
  };
  Result<LightmapOutcome> finish(Bytes& glb, const Job&, BakeLog&, Threads&) const;

 private:
  void choose_places(const Tracer&, Threads&);
  std::vector<char> in_small_charts() const;
  std::vector<char> inside_solids(const LitPlaces&) const;
  std::vector<Vec3f> means(std::span<const Vec3f> of_places, std::span<const char> inside) const;
  std::vector<std::uint32_t> out_of_reach(std::span<const std::uint32_t> solid, std::span<const char> known) const;
  void soften(const LitPlaces&, std::vector<Vec3f>& direct, Threads&) const;
  template <class Differs>
  std::vector<std::uint32_t> edges(const Differs&) const;

  Mesh surface_;  // of the input
  UvCharts charts_;
  TexelMap map_;
  std::vector<SeamPlace> seams_;
  std::vector<char> written_;         // parts that have a triangle
  std::vector<std::uint32_t> shown_;  // of map_.places, ascending: those that have light of their own
  std::vector<std::uint32_t> end_;    // of each: its places end there, and begin where those before it end
  std::vector<TransferPoint> places_;
  std::vector<char> backs_;     // of each place: it sees nothing but backs
  std::vector<PartLook> look_;  // of each part of the scene
  std::size_t hidden_ = 0;      // of map_.places, that were filled
  double area_ = 0;             // of what is shown, square metres
  Lightmap lightmap_;
};

}  // namespace kiln
