#include "tests/bench/trade/scenes.h"

#include <algorithm>
#include <filesystem>

#include "core/bake/demo_scene.h"

namespace kiln::trade {

namespace fs = std::filesystem;

std::vector<std::string> bundled_scenes() {
  std::vector<std::string> out = demo_scene_names();
  const fs::path models = fs::path(KILN_SHARED) / "models";
  std::vector<std::string> more;
  std::error_code nothing_there;
  for (const auto& entry : fs::directory_iterator(models / "references", nothing_there)) {
    if (entry.path().extension() == ".glb") more.push_back(entry.path().string());
  }
  std::ranges::sort(more);
  const fs::path interior = models / "scenes/dungeon-interior/level-dungeon.gltf";
  if (fs::exists(interior)) more.push_back(interior.string());
  out.insert(out.end(), more.begin(), more.end());
  return out;
}

Result<TradeScene> load_trade_scene(const std::string& name_or_path) {
  TradeScene out{fs::path(name_or_path).stem().string(), {}};
  if (auto bytes = demo_scene(name_or_path)) {
    out.files.name = name_or_path + ".glb";
    out.files.main = std::move(*bytes);
    return out;
  }
  KILN_TRY(files, read_scene_files(name_or_path));
  out.files = std::move(files);
  return out;
}

}  // namespace kiln::trade
