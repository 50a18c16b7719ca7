// No crack and no T-junction on any bundled model, by the exact welded-edge check.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>

#include "core/mesh/topology.h"
#include "core/prt/subdivide.h"
#include "tests/core/prt/crack_check.h"
#include "tests/core/prt/reference_set.h"

namespace kiln {
namespace {

// Soft edges of spheres about the corner of the unit cube: every model has something to refine.
std::vector<float> rings(std::span<const TransferPoint> points) {
  std::vector<float> values;
  for (const TransferPoint& p : points) {
    values.push_back(std::sin(40 * length(p.position - Vec3f{-0.5F, -0.5F, -0.5F})) + 0.1F * p.normal.y);
  }
  return values;
}

constexpr std::size_t kMost = 2'000'000;  // triangles: one instancing model has 7.7 million, minutes for this check

std::vector<std::string> models(const std::string& folder) {
  std::vector<std::string> found;
  const std::filesystem::path root = std::string(KILN_SHARED) + "/models";
  if (!std::filesystem::exists(root / folder)) return found;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(root / folder)) {
    const std::string type = entry.path().extension().string();
    if (type == ".glb" || type == ".gltf") found.push_back(std::filesystem::relative(entry.path(), root).string());
  }
  std::sort(found.begin(), found.end());
  return found;
}

void check_folder(const std::string& folder) {
  const std::vector<std::string> paths = models(folder);
  if (paths.empty()) GTEST_SKIP() << "shared/models/" << folder << " is not there";
  Threads threads(2);
  int checked = 0;
  for (const std::string& path : paths) {
    const std::optional<Scene> scene = testing::load_scene(KILN_SHARED, path);
    if (!scene || scene->mesh.triangles.empty()) continue;  // refused, with a reason that the importer's tests check
    const Mesh& mesh = scene->mesh;
    if (mesh.triangles.size() > kMost) continue;
    const std::uint64_t budget = mesh.triangles.size() + std::min<std::uint64_t>(3000, 2 * mesh.triangles.size() + 8);
    for (const SplitMeasure measure : {SplitMeasure::eq3, SplitMeasure::residual}) {
      if (measure == SplitMeasure::eq3 && mesh.triangles.size() > 50'000) continue;  // once is enough for time
      const Subdivided fine = subdivide(mesh, {1, rings}, {.measure = measure, .triangles = budget}, threads);
      EXPECT_LE(fine.mesh.triangles.size(), budget) << path;
      EXPECT_EQ(testing::find_crack(mesh, fine.mesh), "") << path;
      // Midpoints round to float: 1e-7 of each new triangle's size.
      EXPECT_NEAR(surface_area(fine.mesh), surface_area(mesh), 1e-5 * surface_area(mesh)) << path;
    }
    ++checked;
  }
  std::printf("%d of %zu models of %s checked\n", checked, paths.size(), folder.c_str());
  EXPECT_GT(checked, 0);
}

TEST(SubdivideModels, NoCrackOnAnyScene) { check_folder("scenes"); }
TEST(SubdivideModels, NoCrackOnTheReferences) { check_folder("references"); }
TEST(SubdivideModels, NoCrackOnTheConformanceModels) { check_folder("conformance"); }

}  // namespace
}  // namespace kiln
