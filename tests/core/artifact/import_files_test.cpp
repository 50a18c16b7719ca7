// PLY, environments and files on disk.
#include <Imath/half.h>
#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfOutputFile.h>
#include <OpenEXR/ImfStandardAttributes.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>
#include <numeric>

#include "tests/core/artifact/gltf_samples.h"

namespace kiln::test {
namespace {

namespace fs = std::filesystem;

Bytes to_bytes(const std::string& text) { return {text.begin(), text.end()}; }

Result<Scene> import_ply_text(const std::string& text) {
  return import_scene({.name = "scan.ply", .main = to_bytes(text), .resources = {}});
}

const std::string kVertexHeader = "element vertex 4\nproperty float x\nproperty float y\nproperty float z\n";
const std::string kFaceHeader = "element face 1\nproperty list uchar int vertex_indices\nend_header\n";

TEST(ImportPly, AQuadBecomesAFan) {
  const auto scene = import_ply_text("ply\nformat ascii 1.0\ncomment by hand\n" + kVertexHeader + kFaceHeader +
                                     "0 0 0\n1 0 0\n1 1 0\n0 1 0\n4 0 1 2 3\n");
  ASSERT_TRUE(scene) << scene.error().message << scene.error().where;
  EXPECT_EQ(scene->mesh.triangles, (std::vector<Triangle>{{0, 1, 2}, {0, 2, 3}}));
  EXPECT_EQ(scene->mesh.position.size(), 4U) << "a scan is one smooth surface";
  EXPECT_EQ(scene->mesh.normal[0], (Vec3f{0, 0, 1}));
}

TEST(ImportPly, BothByteOrdersGiveTheSameMesh) {
  const auto file = [](bool big) {
    Bytes out =
        to_bytes("ply\nformat binary_" + std::string(big ? "big" : "little") +
                 "_endian 1.0\nelement vertex 3\nproperty double x\n"
                 "property float y\nproperty short z\nproperty uchar red\nproperty uchar green\nproperty uchar blue\n"
                 "element face 1\nproperty uchar flags\nproperty list uchar uint vertex_index\nelement camera "
                 "1\nproperty float a\nend_header\n");
    const auto put = [&](auto value) {
      auto bytes = std::bit_cast<std::array<std::uint8_t, sizeof value>>(value);
      if (big) std::reverse(bytes.begin(), bytes.end());
      out.insert(out.end(), bytes.begin(), bytes.end());
    };
    for (int v = 0; v < 3; ++v) {
      put(v == 1 ? 4.0 : 0.0);
      put(v == 2 ? 3.0F : 0.0F);
      put(std::int16_t{7});
      for (int c = 0; c < 3; ++c) put(static_cast<std::uint8_t>(c == v ? 255 : 0));
    }
    put(std::uint8_t{1});
    put(std::uint8_t{3});
    for (std::uint32_t v = 0; v < 3; ++v) put(v);
    put(1.5F);
    return out;
  };
  const auto little = import_scene({.name = "a.ply", .main = file(false), .resources = {}});
  const auto big = import_scene({.name = "a.ply", .main = file(true), .resources = {}});
  ASSERT_TRUE(little) << little.error().message;
  ASSERT_TRUE(big) << big.error().message;
  EXPECT_EQ(little->mesh.position, big->mesh.position);
  EXPECT_EQ(little->mesh.color, big->mesh.color);
  EXPECT_EQ(little->mesh.color[0], (Vec4f{1, 0, 0, 1}));
  EXPECT_NEAR(little->frame.center.z, 7, 1e-12);
}

TEST(ImportPly, BrokenFilesNameTheirPlace) {
  const std::string head = "ply\nformat ascii 1.0\n" + kVertexHeader + kFaceHeader;
  struct Case {
    std::string text, code, where;
  };
  const Case cases[] = {
      {"ply\nformat ascii 2.0\nend_header\n", "ply_invalid", "line 2"},
      {"ply\nformat ascii 1.0\nelement vertex many\nend_header\n", "ply_invalid", "line 3"},
      {"ply\nformat ascii 1.0\nproperty float x\nend_header\n", "ply_invalid", "line 3"},
      {"ply\nformat ascii 1.0\nelement vertex 1\nproperty quad x\nend_header\n", "ply_invalid", "line 4"},
      {"ply\nformat ascii 1.0\n" + kVertexHeader + kVertexHeader, "ply_invalid", "line 7"},
      {"ply\nformat ascii 1.0\n", "ply_invalid", "header"},
      {"ply\nend_header\n", "ply_invalid", "header"},
      {"ply\nformat ascii 1.0\nelement vertex 4000000000\nproperty float x\nend_header\n1\n", "ply_truncated",
       "header"},
      {head + "0 0 0 1 0 0 1 1 0 0 1", "ply_truncated", "element vertex 3"},
      {head + "0 0 0 1 0 0 1 1 0 0 1 nan 3 0 1 2", "non_finite_geometry", "element vertex 3"},
      {head + "0 0 0 1 0 0 1 1 0 0 1 1e300 3 0 1 2", "non_finite_geometry", "element vertex 3"},
      {head + "0 0 0 1 0 0 1 1 0 0 1 x 3 0 1 2", "ply_truncated", "element vertex 3"},
      {head + "0 0 0 1 0 0 1 1 0 0 1 0 3 0 1 4", "index_out_of_range", "element face 0"},
      {head + "0 0 0 1 0 0 1 1 0 0 1 0 3 0 1 -1", "index_out_of_range", "element face 0"},
      {head + "0 0 0 1 0 0 1 1 0 0 1 0 2.5 0 1 2", "ply_truncated", "element face 0"},
      {head + "0 0 0 1 0 0 1 1 0 0 1 0 nan 0 1 2", "ply_truncated", "element face 0"},
      {head + "0 0 0 1 0 0 1 1 0 0 1 0 200 0 1 2", "ply_truncated", "element face 0"},
  };
  for (const Case& c : cases) {
    const auto scene = import_ply_text(c.text);
    ASSERT_FALSE(scene) << c.text;
    EXPECT_EQ(scene.error().code, c.code) << c.text;
    EXPECT_EQ(scene.error().where, "scan.ply: " + c.where) << c.text;
  }
}

std::string hdr_header(int width, int height) {
  return "#?RADIANCE\n# made by a test\nFORMAT=32-bit_rle_rgbe\n\n-Y " + std::to_string(height) + " +X " +
         std::to_string(width) + "\n";
}

TEST(ImportEnvironment, RgbeIsMantissaOver256WithoutAHalf) {
  Bytes file = to_bytes(hdr_header(2, 1));
  append_bytes(file, {128, 64, 255, 129, 9, 9, 9, 0});
  const auto e = import_environment(file, "a.hdr");
  ASSERT_TRUE(e) << e.error().message;
  EXPECT_EQ(e->radiance[0], (Vec3f{1, 0.5F, 255 / 128.0F}));
  EXPECT_EQ(e->radiance[1], (Vec3f{0, 0, 0}));
}

TEST(ImportEnvironment, OldAndNewRunLengthsAndFlatPixelsAgree) {
  const int width = 300;
  Bytes flat = to_bytes(hdr_header(width, 1)), old = flat, fresh = flat;
  for (int x = 0; x < width; ++x) {
    append_bytes(flat, {128, 64, 32, 130});
  }
  // One pixel, then 43 + 1 * 256 repetitions.
  append_bytes(old, {128, 64, 32, 130, 1, 1, 1, 43, 1, 1, 1, 1});
  append_bytes(fresh, {2, 2, width >> 8, width & 255});
  for (const int c : {128, 64, 32, 130}) {
    append_bytes(fresh, {128 + 127, c, 128 + 127, c, 128 + 45, c});
    append_bytes(fresh, {1, c});  // a literal run of one
  }
  const auto a = import_environment(flat, "a.hdr"), b = import_environment(old, "b.hdr"),
             c = import_environment(fresh, "c.hdr");
  ASSERT_TRUE(a) << a.error().message;
  ASSERT_TRUE(b) << b.error().message;
  ASSERT_TRUE(c) << c.error().message;
  EXPECT_EQ(a->radiance, b->radiance);
  EXPECT_EQ(a->radiance, c->radiance);
}

TEST(ImportEnvironment, BrokenHdrFilesAreRefused) {
  Bytes bad_run = to_bytes(hdr_header(8, 1));
  append_bytes(bad_run, {2, 2, 0, 8, 128 + 9, 1});
  Bytes orphan = to_bytes(hdr_header(2, 1));
  append_bytes(orphan, {1, 1, 1, 2});
  const std::pair<Bytes, const char*> cases[] = {
      {to_bytes("#?RADIANCE\n"), "hdr_invalid"},
      {to_bytes("#?RADIANCE\nFORMAT=32-bit_rle_xyze\n\n-Y 1 +X 1\n...."), "hdr_invalid"},
      {to_bytes("#?RADIANCE\n\n+Y 1 +X 1\n...."), "hdr_invalid"},
      {to_bytes("#?RADIANCE\n\n-Y 0 +X 1\n...."), "hdr_invalid"},
      {to_bytes(hdr_header(100000, 100000)), "image_too_large"},
      {to_bytes(hdr_header(2, 2) + "12345678"), "hdr_truncated"},
      {bad_run, "hdr_truncated"},
      {orphan, "hdr_truncated"},
      {to_bytes("BM"), "unknown_format"},
      {Bytes{}, "unknown_format"},
  };
  for (const auto& [file, code] : cases) {
    const auto e = import_environment(file, "a.hdr");
    ASSERT_FALSE(e) << code;
    EXPECT_EQ(e.error().code, code);
  }
}

struct ExrForm {
  std::vector<std::string> channels{"R", "G", "B"};
  Imath::Box2i data, display;
  bool half_pixels = false;
  bool cube = false;
};

/// An EXR of these values, channel after channel of a pixel.
Bytes make_exr(const std::vector<float>& values, const ExrForm& form) {
  const fs::path path = fs::temp_directory_path() / ("kiln-test-" + std::to_string(::getpid()) + ".exr");
  Imf::Header header(form.display, form.data);
  if (form.cube) Imf::addEnvmap(header, Imf::ENVMAP_CUBE);
  std::vector<Imath::half> halves(values.begin(), values.end());
  Imf::FrameBuffer frame;
  const int width = form.data.max.x - form.data.min.x + 1, height = form.data.max.y - form.data.min.y + 1;
  const std::size_t size = form.half_pixels ? 2 : 4, step = form.channels.size() * size;
  char* base = form.half_pixels ? reinterpret_cast<char*>(halves.data())
                                : reinterpret_cast<char*>(const_cast<float*>(values.data()));
  base -= (form.data.min.x + form.data.min.y * width) * static_cast<std::ptrdiff_t>(step);
  const Imf::PixelType type = form.half_pixels ? Imf::HALF : Imf::FLOAT;
  for (std::size_t c = 0; c < form.channels.size(); ++c) {
    header.channels().insert(form.channels[c], Imf::Channel(type));
    frame.insert(form.channels[c], Imf::Slice(type, base + c * size, step, step * static_cast<std::size_t>(width)));
  }
  {
    Imf::OutputFile out(path.c_str(), header);
    out.setFrameBuffer(frame);
    out.writePixels(height);
  }
  std::ifstream in(path, std::ios::binary);
  Bytes bytes((std::istreambuf_iterator<char>(in)), {});
  fs::remove(path);
  return bytes;
}

/// Both windows off the origin, and the same.
Bytes make_exr(const std::vector<float>& rgb, int width, int height, bool half_pixels) {
  const Imath::Box2i window({5, -3}, {5 + width - 1, -3 + height - 1});
  return make_exr(rgb, {.data = window, .display = window, .half_pixels = half_pixels});
}

TEST(ImportEnvironment, ExrOfHalvesAndFloatsComesBackExactly) {
  const std::vector<float> rgb{1, 2, 3, 0.5F, 0.25F, 8, 100, 0, 1024, 6, 7, 8, 0, 0, 0, 1, 1, 1};
  for (const bool halves : {false, true}) {
    const auto e = import_environment(make_exr(rgb, 3, 2, halves), "a.exr");
    ASSERT_TRUE(e) << e.error().message;
    EXPECT_EQ(e->width, 3);
    EXPECT_EQ(e->height, 2);
    for (std::size_t i = 0; i < 6; ++i) EXPECT_EQ(e->radiance[i], (Vec3f{rgb[3 * i], rgb[3 * i + 1], rgb[3 * i + 2]}));
  }
}

/// OpenEXR, "Technical Introduction": the display window is the picture, the data window what of it is in the file.
TEST(ImportEnvironment, TheDataWindowOfAnExrLiesWhereItSaysInTheDisplayWindow) {
  const auto grey = [](const ExrForm& form, const std::vector<float>& values) {
    const auto e = import_environment(make_exr(values, form), "a.exr");
    std::vector<float> red;
    if (e) {
      for (const Vec3f& p : e->radiance) red.push_back(p.x);
    }
    return std::pair(e ? e->width : 0, red);
  };
  const Imath::Box2i part({1, 1}, {2, 1}), whole({0, 0}, {3, 2}), apart({7, 7}, {8, 7});
  EXPECT_EQ(grey({.channels = {"Y"}, .data = part, .display = whole}, {5, 6}),
            std::pair(4, std::vector<float>{0, 0, 0, 0, 0, 5, 6, 0, 0, 0, 0, 0}));
  std::vector<float> count(12);
  std::iota(count.begin(), count.end(), 1.0F);
  EXPECT_EQ(grey({.channels = {"Y"}, .data = whole, .display = part}, count), std::pair(2, std::vector<float>{6, 7}));
  EXPECT_EQ(grey({.channels = {"Y"}, .data = apart, .display = part}, {5, 6}), std::pair(2, std::vector<float>{0, 0}));
}

TEST(ImportEnvironment, ExrMayBeGreyOrHaveAlphaAndIsNoCube) {
  const Imath::Box2i window({0, 0}, {1, 0});
  const auto grey = import_environment(
      make_exr({3, .5F, 4, .5F}, {.channels = {"Y", "A"}, .data = window, .display = window}), "a.exr");
  ASSERT_TRUE(grey) << grey.error().message;
  EXPECT_EQ(grey->radiance, (std::vector<Vec3f>{{3, 3, 3}, {4, 4, 4}}));
  const auto alpha = import_environment(
      make_exr({1, 2, 3, .5F, 4, 5, 6, 0}, {.channels = {"R", "G", "B", "A"}, .data = window, .display = window}),
      "a.exr");
  ASSERT_TRUE(alpha) << alpha.error().message;
  EXPECT_EQ(alpha->radiance, (std::vector<Vec3f>{{1, 2, 3}, {4, 5, 6}}));
  const auto without =
      import_environment(make_exr({1, 2, 3, 4}, {.channels = {"R", "G"}, .data = window, .display = window}), "a.exr");
  ASSERT_FALSE(without);
  EXPECT_EQ(without.error().code, "exr_unsupported");
  const auto cube = import_environment(
      make_exr({1, 2}, {.channels = {"Y"}, .data = window, .display = window, .cube = true}), "a.exr");
  ASSERT_FALSE(cube);
  EXPECT_EQ(cube.error().code, "exr_unsupported");
}

TEST(ImportEnvironment, LightThatIsNotFiniteNamesItsPixelAndNegativeLightIsNone) {
  const float inf = std::numeric_limits<float>::infinity();
  const auto bad = import_environment(make_exr({1, 1, 1, 1, inf, 1}, 2, 1, false), "a.exr");
  ASSERT_FALSE(bad);
  EXPECT_EQ(bad.error().code, "non_finite_radiance");
  EXPECT_EQ(bad.error().where, "a.exr: pixel 1, 0");
  const auto negative = import_environment(make_exr({-1, 1, 1, 1, 1, 1}, 2, 1, false), "a.exr");
  ASSERT_TRUE(negative);
  EXPECT_EQ(negative->radiance[0].x, 0);
}

TEST(ImportEnvironment, G18DeepTiledAndMultiPartExrNeverReachTheLibrary) {
  const Bytes good = make_exr({1, 1, 1, 1, 1, 1}, 2, 1, true);
  for (const int flag : {0x02, 0x08, 0x10}) {
    Bytes file = good;
    file[5] = static_cast<std::uint8_t>(file[5] | flag);
    const auto e = import_environment(file, "a.exr");
    ASSERT_FALSE(e);
    EXPECT_EQ(e.error().code, "exr_unsupported");
  }
  for (std::size_t size = 8; size < good.size(); size += 5) {
    EXPECT_FALSE(import_environment(std::span(good).first(size), "a.exr")) << size;
  }
}

/// A folder that goes with the test.
struct Folder {
  fs::path path = fs::temp_directory_path() / ("kiln-test-" + std::to_string(::getpid()));
  Folder() { fs::create_directories(path / "inner"); }
  ~Folder() { fs::remove_all(path); }
  void write(const std::string& name, const std::string& text) const {
    std::ofstream(path / name, std::ios::binary) << text;
  }
};

TEST(ReadSceneFiles, TakesTheNamedFilesBelowTheFolderAndNoOthers) {
  const Folder folder;
  folder.write("secret", "x");
  folder.write("inner/a \xE2\x9D\xA4.bin", "0123");
  folder.write("inner/scene.gltf",
               "{\"asset\":{\"version\":\"2.0\"},\"buffers\":[{\"uri\":\"a%20%E2%9D%A4.bin\",\"byteLength\":4},{"
               "\"uri\":\"../secret\","
               "\"byteLength\":1},{\"uri\":\"link\",\"byteLength\":1},{\"uri\":\"absent.bin\",\"byteLength\":1}]}");
  fs::create_symlink(folder.path / "secret", folder.path / "inner" / "link");
  const auto files = read_scene_files((folder.path / "inner" / "scene.gltf").string());
  ASSERT_TRUE(files) << files.error().message;
  EXPECT_EQ(files->name, "scene.gltf");
  ASSERT_EQ(files->resources.size(), 1U);
  EXPECT_EQ(files->resources.begin()->first, "a \xE2\x9D\xA4.bin");
  EXPECT_EQ(files->resources.begin()->second, to_bytes("0123"));
}

TEST(ReadSceneFiles, AnAbsentFileOrAFolderIsAFaultWithoutThePath) {
  const Folder folder;
  for (const fs::path& path : {folder.path / "none.glb", folder.path / "inner"}) {
    const auto files = read_scene_files(path.string());
    ASSERT_FALSE(files);
    EXPECT_EQ(files.error().code, "file_not_found");
    EXPECT_EQ(files.error().where.find(folder.path.string()), std::string::npos);
  }
}

}  // namespace
}  // namespace kiln::test
