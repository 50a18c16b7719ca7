// A program of its own: what it allows itself holds for all of it.
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "core/artifact/triangle_stream.h"
#include "core/reduce/reduce.h"
#include "tests/core/reduce/models.h"

namespace kiln {
namespace {

constexpr std::uint64_t kLimit = 160ULL << 20;
constexpr std::uint64_t kStacks = 48ULL << 20;  // of threads: they count in full, touched or not

/// A rippled sheet of 2 n^2 triangles, written a row at a time. Returns its path.
std::string write_sheet(std::uint32_t n) {
  const auto name = "kiln_memory_test_" + std::to_string(n) + ".ply";
  const std::string path = (std::filesystem::temp_directory_path() / name).string();
  std::ofstream file(path, std::ios::binary);
  file << "ply\nformat binary_little_endian 1.0\nelement vertex " << std::uint64_t{n + 1} * (n + 1)
       << "\nproperty float x\nproperty float y\nproperty float z\nelement face " << 2ULL * n * n
       << "\nproperty list uchar int vertex_indices\nend_header\n";
  std::string row;
  for (std::uint32_t i = 0; i <= n; ++i, file << row, row.clear()) {
    for (std::uint32_t k = 0; k <= n; ++k) {
      const float x = static_cast<float>(i) / static_cast<float>(n), y = static_cast<float>(k) / static_cast<float>(n);
      testing::put(row, Vec3f{x, y, 0.05F * std::sin(20 * x) * std::sin(17 * y)});
    }
  }
  for (std::uint32_t i = 0; i < n; ++i, file << row, row.clear()) {
    for (std::uint32_t k = 0; k < n; ++k) {
      const std::uint32_t a = i * (n + 1) + k, b = a + n + 1;
      for (const Triangle& t : {Triangle{a, b, b + 1}, Triangle{a, b + 1, a + 1}}) {
        row += '\3';
        testing::put(row, t);
      }
    }
  }
  return path;
}

void expect_reduced(const std::string& path, ReduceMethod method, bool in_core) {
  Findings findings(path);
  const SceneFiles files{.name = path, .main = *FileBytes::map(path, path), .resources = {}};
  const TriangleSource source = open_triangles(files, {.spill_folder = "/tmp", .max_memory_bytes = kLimit}, findings);
  ASSERT_FALSE(findings.failed());
  const Reduce params{.triangles = 20'000, .method = method, .memory_bytes = kLimit};
  const auto plan = plan_reduction(source, params);
  ASSERT_TRUE(plan);
  EXPECT_EQ(plan->in_core, in_core);
  EXPECT_LE(plan->memory_bytes, kLimit);
  Threads threads(2);
  const auto out = reduce(source, *plan, params, threads);
  ASSERT_TRUE(out);
  EXPECT_LE(out->mesh.triangles.size(), 20'000U);
  EXPECT_LE(out->own_memory_bytes, plan->memory_bytes);
  EXPECT_LT(out->error.rms, 1e-3);
  EXPECT_LT(out->normal_degrees, 5);
}

TEST(Memory, OfAReductionStaysBelowItsLimitWhateverTheModel) {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  GTEST_SKIP() << "sanitizers take memory of their own";
#endif
  const std::string large = write_sheet(1300);  // 3,380,000 triangles: in core they would take 700 MB
  const std::string small = write_sheet(410);   // 336,200: they fit
  const rlimit hard{kLimit + kStacks, kLimit + kStacks};
  ASSERT_EQ(::setrlimit(RLIMIT_DATA, &hard), 0);
  expect_reduced(large, ReduceMethod::cluster, false);
  expect_reduced(large, ReduceMethod::adaptive, false);
  expect_reduced(small, ReduceMethod::adaptive, true);
  for (const std::string& path : {large, small}) std::filesystem::remove(path);
}

}  // namespace
}  // namespace kiln
