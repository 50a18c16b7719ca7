#pragma once
// A picture of the result, by our own tracer: what the delivered file shows, seen from outside with faces culled that
// point away, so that a closed room opens towards the camera.

#include <cstdint>
#include <functional>

#include "core/artifact/baked_scene.h"
#include "core/base/result.h"
#include "core/base/threads.h"
#include "core/scene/environment.h"
#include "core/trace/tracer.h"

namespace kiln {

struct Preview {
  int width = 384, height = 256;
  int grid = 2;  // grid x grid rays a pixel
};

/// The first face that looks at the eye, passing through those that look away.
Hit first_facing(const Tracer&, Vec3f eye, const Vec3f& direction);

/// PNG. `tracer` traces decoded.scene, whose images carry pixels where textures shall show.
Result<Bytes> render_preview(const BakedScene& decoded, const Tracer& tracer, const Preview&, Threads&);

struct PlainPreview {
  Preview picture;
  int samples = 64;  // paths a ray
  int bounces = 1;
  std::function<void(std::uint64_t done, std::uint64_t total)> advance;
};

/// PNG of a scene without a bake, by the path tracer: its own materials seen as diffuse, normal maps (on parts with
/// tangents) bent in, lit by `sky` and its own lights. Exposed so that the 90th percentile of what is seen displays as
/// 0.8. Normal maps show where their images carry pixels.
/// Repeat  same bits for any thread count.   Fails  never
Bytes render_plain_preview(const Tracer&, const Environment& sky, const PlainPreview&, Threads&);

}  // namespace kiln
