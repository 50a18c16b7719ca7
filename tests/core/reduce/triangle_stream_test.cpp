#include "core/artifact/triangle_stream.h"

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <filesystem>

#include "tests/core/artifact/gltf_samples.h"
#include "tests/core/reduce/models.h"

namespace kiln {
namespace {

using testing::Model;

struct Streamed {
  std::vector<Vec3d> position;
  std::vector<Vec3f> normal, color;
  std::size_t batches = 0;
};

Streamed all_of(const TriangleSource& source, Detail detail = Detail::all) {
  Streamed out;
  Threads threads(3);
  const auto done = source.stream(
      detail,
      [&](const TriangleBatch& b) {
        EXPECT_EQ(b.first, out.position.size() / 3);
        EXPECT_TRUE(b.triangles() == kBatchTriangles || b.triangles() < kBatchTriangles);
        out.position.insert(out.position.end(), b.position.begin(), b.position.end());
        out.normal.insert(out.normal.end(), b.normal.begin(), b.normal.end());
        out.color.insert(out.color.end(), b.color.begin(), b.color.end());
        ++out.batches;
      },
      threads);
  EXPECT_TRUE(done) << done.error().message;
  return out;
}

std::vector<Vec3d> corners_of(const Model& m) {
  std::vector<Vec3d> out;
  for (const Triangle& t : m.triangles) {
    for (const std::uint32_t v : t) out.push_back(m.position[v]);
  }
  return out;
}

TriangleSource open_glb(const Bytes& file) {
  Findings findings("scene.glb");
  TriangleSource source =
      open_triangles({.name = "scene.glb", .main = file, .resources = {}}, {.spill_folder = "/tmp"}, findings);
  EXPECT_FALSE(findings.failed()) << findings.fault().message;
  return source;
}

Fault glb_fault(const Bytes& file) {
  Findings findings("scene.glb");
  const TriangleSource source =
      open_triangles({.name = "scene.glb", .main = file, .resources = {}}, {.spill_folder = "/tmp"}, findings);
  if (findings.failed()) return findings.fault();
  Threads threads(2);
  const auto done = source.stream(
      Detail::all, [](const TriangleBatch&) {}, threads);
  return done ? Fault{} : done.error();
}

TEST(PlyStream, GivesTheTrianglesOfTheFileInEveryPass) {
  const Model model = testing::sphere(120);  // 172,800 triangles: three batches
  const TriangleSource source = testing::source_of(model);
  EXPECT_EQ(source.triangles, model.triangles.size());
  EXPECT_EQ(source.vertices, model.position.size());
  for (int pass = 0; pass < 2; ++pass) {
    const Streamed got = all_of(source);
    EXPECT_EQ(got.position, corners_of(model));
    EXPECT_EQ(got.batches, 3U);
  }
}

TEST(PlyStream, ReadsAsciiLikeBinary) {
  const Model model = testing::sphere(10);
  EXPECT_EQ(all_of(testing::source_of(testing::ascii_ply(model))).position, corners_of(model));
}

TEST(PlyStream, ReadsBigEndianPolygonsForeignPropertiesAndElements) {
  std::string file =
      "ply\r\nformat binary_big_endian 1.0\r\ncomment odd\r\nelement camera 1\r\nproperty float f\r\n"
      "element face 1\r\nproperty uchar flag\r\nproperty list ushort uint vertex_index\r\nelement vertex 4\r\n"
      "property uchar red\r\nproperty uchar green\r\nproperty uchar blue\r\nproperty short x\r\nproperty short y\r\n"
      "property short z\r\nproperty list uchar uchar extra\r\nend_header\r\n";
  const auto bytes = [&](std::initializer_list<int> list) {
    for (const int b : list) file += static_cast<char>(b);
  };
  bytes({0, 0, 0, 0, 7, 0, 4, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 2, 0, 0, 0, 3});
  const int corners[4][2] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
  for (const auto& c : corners) bytes({255, 0, 188, 0, c[0], 0, c[1], 255, 254, 2, 9, 9});
  const Streamed got = all_of(testing::source_of(testing::to_bytes(file)));
  EXPECT_EQ(got.position, (std::vector<Vec3d>{{0, 0, -2}, {1, 0, -2}, {1, 1, -2}, {0, 0, -2}, {1, 1, -2}, {0, 1, -2}}));
  ASSERT_EQ(got.color.size(), 6U);
  EXPECT_EQ(got.color[0].x, 1);
  EXPECT_NEAR(got.color[0].z, 0.5, 0.003);  // sRGB 188
}

TEST(PlyStream, LeavesNoFileBehind) {
  const auto folder = std::filesystem::temp_directory_path() / "kiln_spill_test";
  std::filesystem::create_directory(folder);
  {
    Findings findings("scan.ply");
    const TriangleSource source =
        open_triangles({.name = "scan.ply", .main = testing::ascii_ply(testing::cube(2)), .resources = {}},
                       {.spill_folder = folder.string()}, findings);
    EXPECT_TRUE(std::filesystem::is_empty(folder));  // nor while it is in use
    EXPECT_EQ(all_of(source).position.size(), 144U);
  }
  std::filesystem::remove(folder);
}

TEST(PlyStream, SaysThatTheDiskIsFull) {
  const Bytes file = testing::ascii_ply(testing::sphere(30));
  const pid_t child = ::fork();
  if (child == 0) {
    ::signal(SIGXFSZ, SIG_IGN);
    const rlimit small{4096, 4096};
    ::setrlimit(RLIMIT_FSIZE, &small);
    Findings findings("scan.ply");
    open_triangles({.name = "scan.ply", .main = file, .resources = {}}, {.spill_folder = "/tmp"}, findings);
    ::_exit(findings.failed() && findings.fault().code == "disk_full" ? 0 : 1);
  }
  int status = 0;
  ::waitpid(child, &status, 0);
  EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0);
}

TEST(PlyStream, RefusesAFolderItCannotWriteTo) {
  Findings findings("scan.ply");
  open_triangles({.name = "scan.ply", .main = testing::ascii_ply(testing::cube(1)), .resources = {}},
                 {.spill_folder = "/proc/nowhere"}, findings);
  ASSERT_TRUE(findings.failed());
  EXPECT_EQ(findings.fault().code, "spill_failed");
}

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  text.replace(text.find(from), from.size(), to);
  return text;
}

std::string text_of(const Bytes& bytes) { return {bytes.begin(), bytes.end()}; }

TEST(PlyStream, RefusesCountsThatLie) {
  const std::string good = text_of(testing::binary_ply(testing::cube(2)));
  const Fault vertices = testing::fault_of(testing::to_bytes(replaced(good, "vertex 54", "vertex 99999999999")));
  EXPECT_EQ(vertices.code, "ply_truncated");
  const Fault faces = testing::fault_of(testing::to_bytes(replaced(good, "face 48", "face 49")));
  EXPECT_EQ(faces.code, "ply_truncated");
  EXPECT_EQ(faces.where, "scan.ply: element face 48 at byte " + std::to_string(good.size() + 0));
  const Fault fewer = testing::fault_of(testing::to_bytes(replaced(good, "vertex 54", "vertex 53")));
  EXPECT_FALSE(fewer.code.empty());
}

TEST(PlyStream, RefusesAFileThatEndsEarlyAtAnyByte) {
  for (const std::string& good :
       {text_of(testing::binary_ply(testing::cube(1))), text_of(testing::ascii_ply(testing::cube(1)))}) {
    const std::size_t body = good.find("end_header\n") + 11;
    for (std::size_t size = body; size + 2 < good.size(); size += 7) {
      const Fault fault = testing::fault_of(testing::to_bytes(good.substr(0, size)));
      EXPECT_EQ(fault.code, "ply_truncated") << size;
      EXPECT_FALSE(fault.where.empty());
    }
  }
}

TEST(PlyStream, RefusesAbsurdFaces) {
  std::string file =
      "ply\nformat binary_little_endian 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
      "element face 1\nproperty list uint int vertex_indices\nend_header\n";
  for (const float x : {0.F, 0.F, 0.F, 1.F, 0.F, 0.F, 0.F, 1.F, 0.F}) testing::put(file, x);
  std::string million = file, more = file;
  testing::put(million, 1'000'000U);
  million.resize(million.size() + 4'000'000);  // really there, all zero
  EXPECT_EQ(testing::fault_of(testing::to_bytes(million)).code, "ply_face_too_large");
  EXPECT_EQ(testing::fault_of(testing::to_bytes(million)).where,
            "scan.ply: element face 0 at byte " + std::to_string(file.size()));
  testing::put(more, 4'000'000'000U);
  testing::put(more, 0);
  EXPECT_EQ(testing::fault_of(testing::to_bytes(more)).code, "ply_truncated");
}

TEST(PlyStream, RefusesIndicesOutOfRangeAndNamesTheByte) {
  Model model = testing::cube(1);
  model.triangles[7][1] = 24;
  const Bytes file = testing::binary_ply(model);
  const Fault fault = testing::fault_of(file);
  EXPECT_EQ(fault.code, "index_out_of_range");
  EXPECT_EQ(fault.where, "scan.ply: element face 7 at byte " + std::to_string(file.size() - 13 * 5));
  model.triangles[7][1] = 0xffffffffU;  // -1
  EXPECT_EQ(testing::fault_of(testing::binary_ply(model)).code, "index_out_of_range");
}

TEST(PlyStream, RefusesWhatIsNotFinite) {
  for (const double bad : {std::nan(""), HUGE_VAL, -HUGE_VAL}) {
    Model model = testing::cube(1);
    model.position[5].y = bad;
    const Bytes binary = testing::binary_ply(model);
    const Fault fault = testing::fault_of(binary);
    EXPECT_EQ(fault.code, "non_finite_geometry");
    EXPECT_EQ(fault.where,
              "scan.ply: element vertex 5 at byte " + std::to_string(binary.size() - 13 * 12 - 24 * (24 - 5)));
    EXPECT_EQ(testing::fault_of(testing::ascii_ply(model)).code, "non_finite_geometry");
  }
  Model far = testing::cube(1);
  far.position[5].y = 1e19;
  EXPECT_EQ(testing::fault_of(testing::binary_ply(far)).code, "position_out_of_range");
}

TEST(PlyStream, RefusesAFileWithoutFaces) {
  const std::string points =
      "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\nend_header\n0 0 "
      "0\n";
  EXPECT_EQ(testing::fault_of(testing::to_bytes(points)).code, "empty_scene");
  EXPECT_EQ(testing::fault_of(testing::to_bytes("ply\n")).code, "ply_invalid");
  EXPECT_EQ(testing::fault_of({}).code, "empty_file");
  EXPECT_EQ(testing::fault_of(testing::to_bytes("solid")).code, "unknown_format");
}

TEST(GlbStream, FollowsNodesMirrorsAndInstancesOfAMesh) {
  test::Sample s;
  s.positions(test::kTriangle);
  const Bytes file = s.glb(
      R"("meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],"scenes":[{"nodes":[0]}],"scene":0,)"
      R"("nodes":[{"translation":[10,0,0],"children":[1,2]},{"mesh":0,"scale":[2,2,2]},{"mesh":0,"scale":[-1,1,1]}])");
  const TriangleSource source = open_glb(file);
  EXPECT_EQ(source.triangles, 2U);
  const Streamed got = all_of(source);
  EXPECT_EQ(got.position, (std::vector<Vec3d>{{10, 0, 0}, {12, 0, 0}, {10, 2, 0}, {10, 0, 0}, {10, 1, 0}, {9, 0, 0}}));
}

TEST(GlbStream, ReadsStripsFansAndSparseAccessors) {
  test::Sample s;
  const int quad = s.positions({0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0});
  EXPECT_EQ(quad, 0);
  const auto mode = [&](int m) {
    return all_of(open_glb(s.glb(test::one_node(R"("attributes":{"POSITION":0},"mode":)" + std::to_string(m)))))
        .position;
  };
  const Vec3d a{0, 0, 0}, b{1, 0, 0}, c{0, 1, 0}, d{1, 1, 0};
  EXPECT_EQ(mode(5), (std::vector<Vec3d>{a, b, c, b, d, c}));
  EXPECT_EQ(mode(6), (std::vector<Vec3d>{b, c, a, c, d, a}));
}

TEST(GlbStream, MultipliesColoursOfMaterialAndVertices) {
  test::Sample s;
  s.positions(test::kTriangle);
  s.accessor(std::vector<float>{1, 1, 1, 0.5F, 1, 1, 0, 1, 1}, 5126, "VEC3", 3);
  const Bytes file = s.glb(test::one_node(R"("attributes":{"POSITION":0,"COLOR_0":1},"material":0)") +
                           R"(,"materials":[{"pbrMetallicRoughness":{"baseColorFactor":[0.5,0.25,1,1]}}])");
  const Streamed got = all_of(open_glb(file));
  EXPECT_EQ(got.color, (std::vector<Vec3f>{{0.5F, 0.25F, 1}, {0.25F, 0.25F, 1}, {0, 0.25F, 1}}));
}

TEST(GlbStream, SamplesTexturesBetweenTheCorners) {
  test::Sample s;
  s.positions(test::kTriangle);
  s.accessor(std::vector<float>{0.25F, 0.25F, 0.75F, 0.25F, 0.25F, 0.75F}, 5126, "VEC2", 3);
  const Bytes file =
      s.glb(test::one_node(R"("attributes":{"POSITION":0,"TEXCOORD_0":1},"material":0)") +
            R"(,"materials":[{"pbrMetallicRoughness":{"baseColorTexture":{"index":0}}}],"textures":[{"source":0}],)"
            R"("images":[{"uri":"data:image/png;base64,)" +
            test::base64(test::tiny_png()) + R"("}])");
  const TriangleSource source = open_glb(file);
  EXPECT_EQ(source.texels, 4U);
  Threads threads(1);
  const auto done = source.stream(
      Detail::all,
      [](const TriangleBatch& b) {
        EXPECT_EQ(b.color, (std::vector<Vec3f>{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}));  // texel centres
        ASSERT_TRUE(b.texture);
        const Vec3f middle = b.texture(0, 0.5, 0);
        EXPECT_NEAR(middle.x, 0.5, 1e-6);
        EXPECT_NEAR(middle.y, 0.5, 1e-6);
        EXPECT_EQ(b.texture(0, 0, 1), (Vec3f{0, 0, 1}));
      },
      threads);
  EXPECT_TRUE(done);
}

TEST(GlbStream, RefusesAccessorsThatOverflowAndIndicesThatPointOutside) {
  test::Sample s;
  s.positions(test::kTriangle);
  s.add_accessor(R"("bufferView":0,"componentType":5126,"count":4,"type":"VEC3")");
  EXPECT_EQ(glb_fault(s.glb(test::one_node(R"("attributes":{"POSITION":1})"))).code, "accessor_out_of_bounds");
  test::Sample t;
  t.positions(test::kTriangle);
  t.indices({0, 1, 3});
  const Fault fault = glb_fault(t.glb(test::one_node(R"("attributes":{"POSITION":0},"indices":1)")));
  EXPECT_EQ(fault.code, "index_out_of_range");
  EXPECT_NE(fault.where.find("/meshes/0/primitives/0/indices element 2 at byte "), std::string::npos) << fault.where;
  test::Sample n;
  n.positions({0, 0, 0, 1, 0, 0, 0, std::nanf(""), 0});
  const Fault nan = glb_fault(n.glb(test::one_node(R"("attributes":{"POSITION":0})")));
  EXPECT_EQ(nan.code, "non_finite_geometry");
  EXPECT_NE(nan.where.find("element 2 at byte "), std::string::npos) << nan.where;
}

TEST(GlbStream, WarnsOfWhatIsLeftOut) {
  test::Sample s;
  s.positions(test::kTriangle);
  Findings findings("scene.glb");
  const Bytes file = s.glb(test::one_node(R"("attributes":{"POSITION":0},"material":0)") +
                           R"(,"materials":[{"emissiveFactor":[1,1,1],"alphaMode":"BLEND"}])");
  open_triangles({.name = "scene.glb", .main = file, .resources = {}}, {.spill_folder = "/tmp"}, findings);
  ASSERT_FALSE(findings.failed());
  const auto warnings = findings.warnings();
  const auto has = [&](const char* code) {
    return std::any_of(warnings.begin(), warnings.end(), [&](const Warning& w) { return w.code == code; });
  };
  EXPECT_TRUE(has("emission_dropped"));
  EXPECT_TRUE(has("alpha_dropped"));
}

}  // namespace
}  // namespace kiln
