#pragma once
// --light x,y,z[,r,g,b]: a point lamp, in metres of the scene's world and W/sr, in place of all other light.

#include <optional>
#include <span>
#include <string>

#include "client_cli/failure.h"
#include "client_cli/light_lookup.h"
#include "core/artifact/links_glb.h"

namespace kiln {

struct Lamp {
  Vec3d place, intensity{1, 1, 1};
};

/// Fails  usage where the text is not three or six finite numbers, or an intensity is negative.
Outcome<Lamp> parse_lamp(const std::string& text);

/// Leaves the lamp as the only light of a scene.
void light_only(Scene&, const Lamp&);

/// What an artefact with links shows under the lamp: reflected light from the links, as a viewer interpolates it, and
/// direct light by a ray from each point, unless `indirect`.
struct LampLookup {
  Lamp lamp;
  bool indirect = false;
  LookupOptions look = {};
};
std::vector<LightValue> lamp_values(BakedScene, const LightLinks&, const Places&, const LampLookup&, Threads&);

}  // namespace kiln
