// Streams of files that others wrote, sound and broken ones, and of files that were damaged at random.
#include "tests/conformance/shared_models.h"

#include <gtest/gtest.h>

#include <fstream>

#include "core/base/random.h"
#include "tests/core/reduce/models.h"

namespace kiln {
namespace {

namespace fs = std::filesystem;

std::vector<fs::path> models_below(const fs::path& folder) {
  std::vector<fs::path> out;
  std::error_code error;
  for (fs::recursive_directory_iterator at(folder, error), end; !error && at != end; at.increment(error)) {
    const std::string type = at->path().extension().string();
    if (type == ".glb" || type == ".gltf" || type == ".ply") out.push_back(at->path());
  }
  std::sort(out.begin(), out.end());
  return out;
}

struct Seen {
  bool good = false;
  double area = 0;
  std::uint64_t triangles = 0;
};

Seen stream(const SceneFiles& files) {
  Findings findings(files.name);
  const TriangleSource source = open_triangles(files, {.spill_folder = "/tmp"}, findings);
  if (findings.failed()) {
    EXPECT_FALSE(findings.fault().code.empty());
    return {};
  }
  Threads threads(2);
  Seen seen;
  const auto done = source.stream(
      Detail::all,
      [&](const TriangleBatch& b) {
        for (std::size_t t = 0; t < b.triangles(); ++t) {
          const Vec3d* p = &b.position[3 * t];
          seen.area += 0.5 * length(cross(p[1] - p[0], p[2] - p[0]));
        }
        seen.triangles += b.triangles();
        EXPECT_TRUE(b.normal.empty() || b.normal.size() == b.position.size());
        EXPECT_TRUE(b.color.empty() || b.color.size() == b.position.size());
      },
      threads);
  seen.good = done.has_value();
  return seen;
}

double area_of(const Scene& scene) {
  double area = 0;
  for (const auto& [a, b, c] : scene.mesh.triangles) {
    const auto& p = scene.mesh.position;
    area += 0.5 * length(cross(to_double(p[b] - p[a]), to_double(p[c] - p[a])));
  }
  return area * scene.frame.scale * scene.frame.scale;
}

TEST(SharedModels, StreamTheSurfaceThatTheImporterSees) {
  int compared = 0;
  for (const char* folder : {"scenes", "conformance"}) {
    for (const fs::path& path : models_below(test::shared_models() / folder)) {
      const auto files = read_scene_files(path.string());
      if (!files) continue;
      const auto scene = import_scene(*files);
      const Seen seen = stream(*files);
      if (!scene) continue;  // refused by one, perhaps for what the other does not look at
      EXPECT_TRUE(seen.good) << path;
      EXPECT_GE(seen.triangles, scene->mesh.triangles.size())
          << path;  // the importer drops degenerate and repeated ones
      // Positions of the unit cube are floats: 6e-8 of the size each, more of small triangles.
      EXPECT_GE(seen.area * 1.0001, area_of(*scene)) << path;
      if (seen.triangles == scene->mesh.triangles.size()) {
        EXPECT_LE(seen.area, area_of(*scene) * 1.0001) << path;
      }
      ++compared;
    }
  }
  if (compared == 0) GTEST_SKIP() << "no shared models";
  EXPECT_GT(compared, 20);
}

TEST(SharedModels, ThatAreBrokenEndInAFaultOrNot) {
  int count = 0;
  for (const fs::path& path : models_below(test::shared_models() / "hostile")) {
    const auto files = read_scene_files(path.string());
    if (!files) continue;
    stream(*files);
    ++count;
  }
  if (count == 0) GTEST_SKIP() << "no shared models";
}

/// Flips bytes anywhere, or cuts the end off; the same damage for the same number.
Bytes damaged(Bytes file, std::uint64_t number) {
  Random random(9, number);
  const std::size_t size = file.size();
  for (std::uint64_t i = 0; i < 1 + random.next() % 4; ++i)
    file[random.next() % size] = static_cast<std::uint8_t>(random.next());
  if (random.next() % 4 == 0) file.resize(random.next() % size);
  return file;
}

TEST(Damage, NeverDoesMoreThanAFault) {
  testing::Model model = testing::sphere(3);
  for (const Vec3d& p : model.position) model.color.push_back(to_float(p));
  const Bytes binary = testing::binary_ply(model), ascii = testing::ascii_ply(testing::cube(1));
  int refused = 0;
  for (std::uint64_t i = 0; i < 3000; ++i) {
    refused += stream({.name = "a.ply", .main = damaged(binary, i), .resources = {}}).good ? 0 : 1;
    refused += stream({.name = "b.ply", .main = damaged(ascii, i), .resources = {}}).good ? 0 : 1;
  }
  EXPECT_GT(refused, 1000);  // about a third of the bytes are counts and indices, and a quarter of the files are cut
}

}  // namespace
}  // namespace kiln
