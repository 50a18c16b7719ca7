#pragma once
// What kiln-trade tries: the list of settings of the prt step's knobs. The only place to edit for a new knob.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace kiln::trade {

/// One setting of the knobs, for any scene.
struct Setting {
  std::string name;     // "standard, samples 256": what it is called in rows, plots and presets.json
  std::string quality;  // of the recipe: "draft", "standard" or "final"
  std::string step;     // JSON members of the prt step that differ from the quality's: {"samples": 256}
  std::optional<std::uint64_t> more_triangles;  // subdivide.triangles = the scene's own and these
};

/// Names of the settings that are the presets in force, in the order draft, standard, final.
struct PresetNames {
  std::string draft, standard, final;
};

struct Sweep {
  std::vector<Setting> settings;  // run in this order: a sweep that is cut short keeps its beginning
  PresetNames presets;
};

/// The presets, each knob of `standard` alone, and small factorials around the presets.
Sweep full_sweep();

/// Four settings of a few rays each: does everything, proves nothing.
Sweep smoke_sweep();

/// The recipe (JSON) of a setting for a scene of that many triangles, under the built-in clear sky.
std::string recipe_of(const Setting&, std::uint64_t scene_triangles);

}  // namespace kiln::trade
