#pragma once
// A picture of the result, by our own tracer: what the delivered file shows, seen from outside with faces culled that
// point away, so that a closed room opens towards the camera.

#include "core/artifact/baked_scene.h"
#include "core/base/result.h"
#include "core/base/threads.h"
#include "core/trace/tracer.h"

namespace kiln {

struct Preview {
  int width = 384, height = 256;
  int grid = 2;  // grid x grid rays a pixel
};

/// PNG. `tracer` traces decoded.scene, whose images carry pixels where textures shall show.
Result<Bytes> render_preview(const BakedScene& decoded, const Tracer& tracer, const Preview&, Threads&);

}  // namespace kiln
