// The lightmap of the step `radiosity`, from recipe to certificate.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/artifact/baked_scene.h"
#include "core/artifact/lightmap_file.h"
#include "core/artifact/points_glb.h"
#include "core/mesh/texel_seams.h"
#include "tests/core/artifact/gltf_samples.h"
#include "tests/core/bake/bake_input.h"

namespace kiln {
namespace {

using testing::file;
using testing::report_of;

/// A box from -1 to 1 that is seen from inside; each wall has four vertices and a rectangle of the picture.
struct Room {
  std::vector<float> position, normal, uv;
  std::vector<std::uint32_t> index;

  /// `fit(wall, u, v)`: where a corner at u, v of its wall lies in the picture.
  template <class Fit>
  explicit Room(const Fit& fit) {
    for (int wall = 0; wall < 6; ++wall) {
      const int axis = wall / 2;
      const float side = wall % 2 == 0 ? -1.0F : 1.0F;
      const auto first = static_cast<std::uint32_t>(position.size() / 3);
      for (const auto& [u, v] : {std::pair{0.0F, 0.0F}, {1.0F, 0.0F}, {1.0F, 1.0F}, {0.0F, 1.0F}}) {
        std::array<float, 3> p{}, n{};
        p[static_cast<std::size_t>(axis)] = side, n[static_cast<std::size_t>(axis)] = -side;
        p[static_cast<std::size_t>((axis + 1) % 3)] = 2 * u - 1,
                                                p[static_cast<std::size_t>((axis + 2) % 3)] = 2 * v - 1;
        position.insert(position.end(), p.begin(), p.end());
        normal.insert(normal.end(), n.begin(), n.end());
        const std::array<float, 2> at = fit(wall, u, v);
        uv.insert(uv.end(), at.begin(), at.end());
      }
      for (const std::uint32_t k : {0, 1, 2, 0, 2, 3}) index.push_back(first + k);
      if (side > 0)
        for (std::size_t k = index.size() - 6; k < index.size(); k += 3) std::swap(index[k + 1], index[k + 2]);
    }
  }
};

/// Three by two rectangles with gaps of 4 % between them.
std::array<float, 2> beside(int wall, float u, float v) {
  const auto column = static_cast<float>(wall % 3), row = static_cast<float>(wall / 3);
  return {(column + 0.02F + 0.96F * u) / 3, (row + 0.02F + 0.96F * v) / 2};
}
std::array<float, 2> on_each_other(int, float u, float v) { return {u, v}; }

struct Made {
  std::string material;
  int nodes = 1;             // of the same mesh, side by side
  bool lamp = false;         // a point light of 3 W/sr at kLamp
  bool half_bare = false;    // the last three walls are a primitive without TEXCOORD_1
  std::string texture = "";  // members of the document
};
constexpr std::array<float, 3> kLamp{0.3F, 0.25F, -0.4F};

Bytes glb_of(const Room& room, const Made& made) {
  test::Sample sample;
  const std::string p = std::to_string(sample.positions(room.position)),
                    n = std::to_string(sample.normals(room.normal));
  const std::string uv = std::to_string(sample.accessor(room.uv, 5126, "VEC2", room.uv.size() / 2));
  const auto primitive = [&](std::size_t first, std::size_t count, bool coordinates) {
    const auto begin = room.index.begin() + static_cast<std::ptrdiff_t>(first);
    const int indices = sample.indices({begin, begin + static_cast<std::ptrdiff_t>(count)});
    return R"({"attributes":{"POSITION":)" + p + R"(,"NORMAL":)" + n + (coordinates ? R"(,"TEXCOORD_1":)" + uv : "") +
           R"(},"material":0,"indices":)" + std::to_string(indices) + "}";
  };
  const std::string primitives =
      made.half_bare ? primitive(0, 18, true) + "," + primitive(18, 18, false) : primitive(0, 36, true);
  std::string nodes, list;
  for (int k = 0; k < made.nodes; ++k) {
    nodes += R"({"mesh":0,"translation":[)" + std::to_string(3 * k) + ",0,0]},";
    list += std::to_string(k) + ",";
  }
  const auto number = [](float x) { return std::to_string(x); };
  nodes += R"({"translation":[)" + number(kLamp[0]) + "," + number(kLamp[1]) + "," + number(kLamp[2]) + "]" +
           (made.lamp ? R"(,"extensions":{"KHR_lights_punctual":{"light":0}}})" : "}");
  list += std::to_string(made.nodes);
  return sample.glb(
      R"("meshes":[{"primitives":[)" + primitives + R"(]}],"materials":[)" + made.material + R"(],"nodes":[)" + nodes +
      R"(],"scenes":[{"nodes":[)" + list + R"(]}],"scene":0)" + made.texture +
      R"(,"extensionsUsed":["KHR_lights_punctual"],"extensions":{"KHR_lights_punctual":{"lights":[{"type":"point","intensity":3}]}})");
}

BakeInput input_of(Bytes scene, const std::string& recipe) {
  BakeInput input;
  input.scene.name = "room.glb";
  input.scene.main = std::move(scene);
  input.recipe = *parse_recipe(recipe);
  return input;
}

/// Walls that glow with radiance .5 and reflect half.
constexpr const char* kFurnace =
    R"({"name":"wall","pbrMetallicRoughness":{"baseColorFactor":[0.5,0.5,0.5,1],"metallicFactor":0},"emissiveFactor":[0.5,0.5,0.5]})";
constexpr const char* kAlone =
    R"({"steps":[{"do":"radiosity","deliver":["lightmap"],"lightmap":{"size":64}}],"quality":"draft"})";

nlohmann::json warning_codes(const nlohmann::json& report) {
  nlohmann::json out = nlohmann::json::array();
  for (const auto& w : report["warnings"]) out.push_back(w["code"]);
  return out;
}

/// Emission over 1 - albedo is 1, everywhere, in texels of charts and beside them.
void expect_furnace(const BakeOutput& output, float tolerance) {
  const auto exact = read_lightmap_exr(file(output, "lightmap.exr"), "lightmap.exr");
  const auto image = read_lightmap(file(output, "scene.glb"));
  ASSERT_TRUE(exact && image);
  ASSERT_EQ(exact->texels.size(), 64U * 64U);
  ASSERT_EQ(image->texels.size(), 64U * 64U);
  for (std::size_t i = 0; i < exact->texels.size(); ++i) {
    for (std::size_t c = 0; c < 3; ++c) {
      EXPECT_NEAR(exact->texels[i][c], 1, tolerance) << i;
      EXPECT_NEAR(image->texels[i][c], exact->texels[i][c], 0.5 * 1.1 / 255);  // half a step of a range of about 1
    }
  }
}

TEST(LightmapBake, OfAWhiteFurnaceIsConstant) {
  Threads threads;
  const auto output = bake(input_of(glb_of(Room(beside), {.material = kFurnace}), kAlone), {}, threads);
  ASSERT_TRUE(output) << output.error().message;
  expect_furnace(*output, 0.01F);
  const nlohmann::json report = report_of(*output), map = report["lightmap"];
  EXPECT_EQ(warning_codes(report), nlohmann::json::array());
  EXPECT_EQ(map["size"], 64);
  EXPECT_EQ(map["hidden_texels"], 0);
  EXPECT_LT(map["certificate"]["relrmse"].get<double>(), 0.01);
  EXPECT_GT(map["certificate"]["points"], 1000);
  EXPECT_TRUE(report["certificate"].is_null());
  EXPECT_EQ(report["result"]["vertices"], 24);  // the mesh is not split
  const auto decoded = read_baked_glb(file(*output, "scene.glb"));
  ASSERT_TRUE(decoded) << decoded.error().message;
  EXPECT_EQ(decoded->scene.materials.size(), 1U);
}

TEST(LightmapBake, OfInstancesAndLayoutsOnOneAnotherIsPackedAnewAndSaysSo) {
  Threads threads;
  const auto output =
      bake(input_of(glb_of(Room(on_each_other), {.material = kFurnace, .nodes = 2}), kAlone), {}, threads);
  ASSERT_TRUE(output) << output.error().message;
  expect_furnace(*output, 0.01F);
  const nlohmann::json report = report_of(*output);
  EXPECT_EQ(warning_codes(report), nlohmann::json::array({"lightmap_charts_packed"}));
  const auto decoded = read_baked_glb(file(*output, "scene.glb"));
  ASSERT_TRUE(decoded);
  Mesh mesh = decoded->scene.mesh;
  const UvCharts charts = find_uv_charts(mesh, std::vector<char>(mesh.triangles.size(), 1));
  EXPECT_EQ(charts.count, 12U);
  EXPECT_EQ(map_texels(mesh, charts, 64).across, 0U);
}

/// Reflects nothing.
constexpr const char* kBlack =
    R"({"name":"wall","pbrMetallicRoughness":{"baseColorFactor":[0,0,0,1],"metallicFactor":0}})";
constexpr const char* kBoth =
    R"({"steps":[{"do":"radiosity","deliver":["vertices","lightmap"],"subdivide":{"triangles":2000},"lightmap":{"size":128}}],"quality":"draft"})";

TEST(LightmapBake, OfAPointLightInABlackRoomIsIntensityTimesCosineOverSquaredDistance) {
  Threads threads;
  const auto output = bake(input_of(glb_of(Room(beside), {.material = kBlack, .lamp = true}), kBoth), {}, threads);
  ASSERT_TRUE(output) << output.error().message;
  const auto decoded = read_baked_glb(file(*output, "scene.glb"));
  const auto map = read_lightmap_exr(file(*output, "lightmap.exr"), "lightmap.exr");
  ASSERT_TRUE(decoded && map);
  const Mesh& mesh = decoded->scene.mesh;
  const UvCharts charts = find_uv_charts(mesh, std::vector<char>(mesh.triangles.size(), 1));
  std::size_t seen = 0;
  for (const TexelPlace& at : map_texels(mesh, charts, 128).places) {
    if (!at.inside) continue;
    const Triangle& t = mesh.triangles[at.triangle];
    const Vec3f unit =
        mesh.position[t[0]] * (1 - at.u - at.v) + mesh.position[t[1]] * at.u + mesh.position[t[2]] * at.v;
    const Vec3d way = Vec3d{kLamp[0], kLamp[1], kLamp[2]} - decoded->scene.frame.to_world(to_double(unit));
    const double squared = dot(way, way), cosine = dot(way, to_double(mesh.normal[t[0]])) / std::sqrt(squared);
    const double value = 3 * cosine / squared / std::numbers::pi;
    EXPECT_NEAR(map->texels[at.texel].x, value, 1e-3 * value);  // 12 bits of a normal, 20 of a coordinate
    ++seen;
  }
  EXPECT_GT(seen, 12000U);
  // What is left is filtering between texels, and 8 bits; vertices of 2000 triangles have more.
  const nlohmann::json report = report_of(*output);
  const double exact = report["lightmap"]["certificate"]["relrmse"],
               image = report["lightmap"]["certificate"]["image"]["relrmse"];
  const double vertices = report["certificate"]["relrmse"];
  std::printf("lightmap %.5f, 8 bits %.5f, vertices %.5f\n", exact, image, vertices);
  EXPECT_LT(exact, 0.005);
  EXPECT_LT(exact, vertices);
  EXPECT_LT(image, 0.02);
}

/// A black floor from -1 to 1, of which a black sheet above keeps the sun that shines straight down where
/// x < kSlant z; the floor is .1 to .9 of the picture.
constexpr double kSlant = 0.4;
Bytes half_shadowed_floor() {
  test::Sample sample;
  const auto square = [&](const std::vector<float>& corners, const std::string& more) {
    const std::string p = std::to_string(sample.positions(corners)),
                      n = std::to_string(sample.normals({0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1, 0}));
    return R"({"attributes":{"POSITION":)" + p + R"(,"NORMAL":)" + n + more + R"(},"material":0,"indices":)" +
           std::to_string(sample.indices({0, 1, 2, 0, 2, 3})) + "}";
  };
  const std::vector<float> uv = {0.1F, 0.9F, 0.9F, 0.9F, 0.9F, 0.1F, 0.1F, 0.1F};
  const std::string on = R"(,"TEXCOORD_1":)" + std::to_string(sample.accessor(uv, 5126, "VEC2", 4));
  const float slant = 1.5F * static_cast<float>(kSlant);
  const std::string floor = square({-1, 0, 1, 1, 0, 1, 1, 0, -1, -1, 0, -1}, on),
                    sheet = square({-3, 0.5F, 1.5F, slant, 0.5F, 1.5F, -slant, 0.5F, -1.5F, -3, 0.5F, -1.5F}, "");
  return sample.glb(
      R"("meshes":[{"primitives":[)" + floor + "," + sheet +
      R"(]}],"materials":[{"doubleSided":true,"pbrMetallicRoughness":{"baseColorFactor":[0,0,0,1],"metallicFactor":0}}],)"
      R"("nodes":[{"mesh":0},{"rotation":[-0.70710678,0,0,0.70710678],"extensions":{"KHR_lights_punctual":{"light":0}}}],)"
      R"("scenes":[{"nodes":[0,1]}],"scene":0,"extensionsUsed":["KHR_lights_punctual"],)"
      R"("extensions":{"KHR_lights_punctual":{"lights":[{"type":"directional","intensity":3}]}})");
}

TEST(LightmapBake, OfAnEdgeOfShadowIsTheShareOfEachTexelThatIsLit) {
  Threads threads;
  const auto output = bake(
      input_of(half_shadowed_floor(),
               R"({"steps":[{"do":"radiosity","deliver":["lightmap"],"lightmap":{"size":40}}],"certificate":false})"),
      {}, threads);
  ASSERT_TRUE(output) << output.error().message;
  const auto map = read_lightmap_exr(file(*output, "lightmap.exr"), "lightmap.exr");
  ASSERT_TRUE(map && map->side == 40);
  // 32 x 32 texels; the share is that of 64 x 64 places of each.
  constexpr int kFirst = 4, kTexels = 32, kPlaces = 64;
  const float full = map->texels[(kFirst + 16) * 40 + kFirst + 30].x;
  ASSERT_GT(full, 0.1F);
  int edge = 0;
  for (int row = 0; row < kTexels; ++row) {
    for (int column = 0; column < kTexels; ++column) {
      double share = 0;
      for (int k = 0; k < kPlaces * kPlaces; ++k) {
        const double x = -1 + 2 * (column + (k % kPlaces + 0.5) / kPlaces) / kTexels,
                     z = -1 + 2 * (row + (k / kPlaces + 0.5) / kPlaces) / kTexels;
        share += x > kSlant * z ? 1.0 / (kPlaces * kPlaces) : 0;
      }
      const float texel = map->texels[static_cast<std::size_t>((row + kFirst) * 40 + column + kFirst)].x;
      // Sixteen places of a texel, in rows of four: the edge passes one of each row by a quarter of a texel at most,
      // and by half that in the mean. A texel that took its centre's light alone would be off by up to a half.
      EXPECT_NEAR(texel / full, share, 0.13) << row << " " << column;
      edge += share > 0.05 && share < 0.95 ? 1 : 0;
    }
  }
  EXPECT_GT(edge, 30);
}

/// A box that is seen from outside: 24 corners with their normals.
struct Block {
  std::vector<float> position, normal;
  std::vector<std::uint32_t> index;

  Block(const std::array<float, 3>& low, const std::array<float, 3>& high) {
    for (std::size_t wall = 0; wall < 6; ++wall) {
      const std::size_t axis = wall / 2;
      const bool top = wall % 2 == 1;
      const auto first = static_cast<std::uint32_t>(position.size() / 3);
      for (const auto& [u, v] : {std::pair{0, 0}, {1, 0}, {1, 1}, {0, 1}}) {
        std::array<float, 3> p{}, n{};
        p[axis] = top ? high[axis] : low[axis], n[axis] = top ? 1.0F : -1.0F;
        p[(axis + 1) % 3] = u != 0 ? high[(axis + 1) % 3] : low[(axis + 1) % 3];
        p[(axis + 2) % 3] = v != 0 ? high[(axis + 2) % 3] : low[(axis + 2) % 3];
        position.insert(position.end(), p.begin(), p.end());
        normal.insert(normal.end(), n.begin(), n.end());
      }
      for (const std::uint32_t k : top ? std::array{0U, 1U, 2U, 0U, 2U, 3U} : std::array{0U, 2U, 1U, 0U, 3U, 2U})
        index.push_back(first + k);
    }
  }
};

/// A square with coordinates, black like the block beside it, and a sun of 3 W/m^2 turned by a quaternion.
struct Square {
  std::vector<float> corners, normal, uv;
};
Bytes square_and_block(const Square& square, const Block& block, bool double_sided, const std::string& turn) {
  test::Sample sample;
  std::vector<float> normals;
  for (int k = 0; k < 4; ++k) normals.insert(normals.end(), square.normal.begin(), square.normal.end());
  const auto primitive = [&](const std::vector<float>& p, const std::vector<float>& n,
                             const std::vector<std::uint32_t>& index, const std::string& more) {
    const std::string positions = std::to_string(sample.positions(p)), all = std::to_string(sample.normals(n));
    return R"({"attributes":{"POSITION":)" + positions + R"(,"NORMAL":)" + all + more + R"(},"material":0,"indices":)" +
           std::to_string(sample.indices(index)) + "}";
  };
  const std::string on = R"(,"TEXCOORD_1":)" + std::to_string(sample.accessor(square.uv, 5126, "VEC2", 4));
  const std::string shown = primitive(square.corners, normals, {0, 1, 2, 0, 2, 3}, on),
                    beside = primitive(block.position, block.normal, block.index, "");
  return sample.glb(R"("meshes":[{"primitives":[)" + shown + "," + beside + R"(]}],"materials":[{"doubleSided":)" +
                    (double_sided ? "true" : "false") +
                    R"(,"pbrMetallicRoughness":{"baseColorFactor":[0,0,0,1],"metallicFactor":0}}],)"
                    R"("nodes":[{"mesh":0},{"rotation":)" +
                    turn +
                    R"(,"extensions":{"KHR_lights_punctual":{"light":0}}}],)"
                    R"("scenes":[{"nodes":[0,1]}],"scene":0,"extensionsUsed":["KHR_lights_punctual"],)"
                    R"("extensions":{"KHR_lights_punctual":{"lights":[{"type":"directional","intensity":3}]}})");
}

/// The lightmap of such a scene. Certificates count what is shown below a box of double-sided faces, which is dark.
Lightmap lightmap_of(Bytes scene, int side, Threads& threads, bool certified = true) {
  const std::string recipe = R"({"steps":[{"do":"radiosity","deliver":["lightmap"],"lightmap":{"size":)" +
                             std::to_string(side) + R"(}}],"quality":"draft"})";
  const auto output = bake(input_of(std::move(scene), recipe), {}, threads);
  EXPECT_TRUE(output) << output.error().message;
  if (!output) return {};
  if (certified) {
    EXPECT_LT(report_of(*output)["lightmap"]["certificate"]["relrmse"].get<double>(), 0.01);
  }
  return *read_lightmap_exr(file(*output, "lightmap.exr"), "lightmap.exr");
}

/// Under a sun that shines straight down a floor is lit up to the foot of a box. What lies below the box is dark, even
/// where its faces are double-sided, and filtering would carry the dark out.
TEST(LightmapBake, AFloorIsLitUpToTheFootOfABox) {
  Threads threads;
  const Square floor{
      {-1, 0, 1, 1, 0, 1, 1, 0, -1, -1, 0, -1}, {0, 1, 0}, {0.1F, 0.9F, 0.9F, 0.9F, 0.9F, 0.1F, 0.1F, 0.1F}};
  const Block box({-0.37F, 0, -0.29F}, {0.33F, 0.5F, 0.31F});
  for (const bool double_sided : {false, true}) {
    const Lightmap map = lightmap_of(square_and_block(floor, box, double_sided, "[-0.70710678,0,0,0.70710678]"), 40,
                                     threads, !double_sided);
    ASSERT_EQ(map.texels.size(), 1600U);
    const float full = 3 / std::numbers::pi_v<float>;
    for (int k = 0; k < 100 * 100; ++k) {
      const float x = -0.995F + 0.0199F * static_cast<float>(k % 100),
                  z = -0.995F + 0.0199F * static_cast<float>(k / 100);
      if (x > -0.38F && x < 0.34F && z > -0.3F && z < 0.32F) continue;  // below it, and a hundredth around it
      // Half floats of the EXR, and the light of parts that touch the box.
      EXPECT_NEAR(map.at({0.5F + 0.4F * x, 0.5F + 0.4F * z}).x, full, 2e-3F * full) << x << " " << z;
    }
    // In the middle below it: of double-sided faces it might be a dark room.
    EXPECT_NEAR(map.at({0.5F, 0.5F}).x, double_sided ? 0 : full, 2e-3F * full);
  }
}

/// A strip of three by three texels stands in a block up to less than half of its highest texels, as a button in cloth.
TEST(LightmapBake, ATexelWhoseCentreIsBuriedShowsItsPartThatIsSeen) {
  Threads threads;
  const float low = 8.0F / 32, high = 11.0F / 32;
  const Square strip{{0, 0.08F, 0.3F, 0, 0.08F, -0.3F, 0, -0.52F, -0.3F, 0, -0.52F, 0.3F},
                     {1, 0, 0},
                     {low, low, high, low, high, high, low, high}};
  Square front = strip;  // wound so that its front looks along +x
  std::swap_ranges(front.corners.begin() + 3, front.corners.begin() + 6, front.corners.begin() + 9);
  std::swap_ranges(front.uv.begin() + 2, front.uv.begin() + 4, front.uv.begin() + 6);
  const Block block({-1, -1, -1}, {1, 0, 1});
  const Lightmap map = lightmap_of(square_and_block(front, block, false, "[0,0.70710678,0,0.70710678]"), 32, threads);
  ASSERT_EQ(map.texels.size(), 1024U);
  for (int column = 8; column < 11; ++column)
    EXPECT_NEAR(map.texels[8 * 32 + static_cast<std::size_t>(column)].x, 3 / std::numbers::pi, 2e-3) << column;
}

TEST(LightmapBake, AfterReduceIsRefusedByItsOwnStep) {
  Threads threads;
  const auto refused = bake(
      testing::input_of("room", R"({"steps":[{"do":"reduce","ratio":0.5},{"do":"radiosity","deliver":["lightmap"]}]})"),
      {}, threads);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, "no_lightmap_coordinates");
  EXPECT_EQ(refused.error().where, "/steps/1/deliver");
  EXPECT_NE(refused.error().message.find("/steps/1/deliver"), std::string::npos) << refused.error().message;
}

TEST(LightmapBake, ThreadCountChangesNotOneByte) {
  Threads one(1), three(3);
  const Bytes scene = glb_of(Room(on_each_other), {.material = kFurnace, .lamp = true});
  const auto a = bake(input_of(scene, kAlone), {}, one), b = bake(input_of(scene, kAlone), {}, three);
  ASSERT_TRUE(a && b);
  EXPECT_EQ(file(*a, "scene.glb"), file(*b, "scene.glb"));
  EXPECT_EQ(file(*a, "lightmap.exr"), file(*b, "lightmap.exr"));
}

TEST(LightmapBake, WithoutCoordinatesIsRefusedAndOfSomePartsIsAWarning) {
  Threads threads;
  const auto refused = plan_json(testing::input_of("room", kBoth), threads);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, "no_lightmap_coordinates");
  EXPECT_EQ(refused.error().where, "/steps/0/deliver");
  const auto output =
      bake(input_of(glb_of(Room(beside), {.material = kFurnace, .half_bare = true}), kAlone), {}, threads);
  ASSERT_TRUE(output) << output.error().message;
  EXPECT_EQ(warning_codes(report_of(*output)), nlohmann::json::array({"lightmap_parts_missing"}));
  const auto image = read_lightmap(file(*output, "scene.glb"));
  ASSERT_TRUE(image);
  EXPECT_EQ(image->parts, (std::vector<char>{1, 0}));
}

TEST(LightmapBake, KeepsCoordinatesThatTexturesLieOn) {
  Threads threads;
  std::string textured = kFurnace;
  textured.replace(textured.find("\"metallicFactor\""), 0, R"("baseColorTexture":{"index":0,"texCoord":1},)");
  const std::string texture = R"(,"textures":[{"source":0}],"images":[{"uri":"data:image/png;base64,)" +
                              test::base64(test::tiny_png()) + R"("}])";
  const auto kept =
      plan_json(input_of(glb_of(Room(beside), {.material = textured, .texture = texture}), kAlone), threads);
  ASSERT_TRUE(kept) << kept.error().message;
  const auto refused =
      plan_json(input_of(glb_of(Room(on_each_other), {.material = textured, .texture = texture}), kAlone), threads);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, "no_lightmap_coordinates");
}

TEST(LightmapBake, OfHostileCoordinatesIsALightmapOrAFault) {
  Threads threads;
  const auto plan = [&](const auto& fit) {
    return plan_json(input_of(glb_of(Room(fit), {.material = kFurnace}), kAlone), threads);
  };
  const auto codes = [](const Result<std::string>& text) { return warning_codes(nlohmann::json::parse(*text)); };
  const auto huge = plan([](int, float u, float v) { return std::array{3e37F * u, -3e37F * v}; });
  ASSERT_TRUE(huge) << huge.error().message;
  EXPECT_EQ(codes(huge)[0], "lightmap_charts_packed");
  const auto dot = plan([](int, float, float) { return std::array{0.5F, 0.5F}; });
  ASSERT_TRUE(dot) << dot.error().message;
  EXPECT_EQ(codes(dot), nlohmann::json::array({"lightmap_charts_flat"}));
  const auto line = plan([](int wall, float u, float) {
    return std::array{0.1F + 0.8F * u, 0.1F * static_cast<float>(wall)};
  });
  ASSERT_TRUE(line) << line.error().message;
  const auto none = plan([](int, float u, float) { return std::array{u, std::nanf("")}; });
  ASSERT_FALSE(none);  // refused on import
  EXPECT_EQ(none.error().code, "non_finite_geometry");
}

TEST(LightmapBake, MoreTexelsThanMemoryAllowsAreRefusedWithNumbers) {
  Threads threads;
  const auto refused = plan_json(
      input_of(
          glb_of(Room(beside), {.material = kFurnace}),
          R"({"steps":[{"do":"radiosity","deliver":["lightmap"],"lightmap":{"size":4096}}],"limits":{"memory_mb":1024}})"),
      threads);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, "memory_limit");
  EXPECT_NE(refused.error().message.find("/steps/0/lightmap/size"), std::string::npos);
}

TEST(PointsBake, OfAWhiteFurnaceIsOneEverywhereByTheBasisThatTheFileDescribes) {
  Threads threads;
  const auto output = bake(input_of(glb_of(Room(beside), {.material = kFurnace}),
                                    R"({"steps":[{"do":"radiosity","deliver":["points"]}],"quality":"draft"})"),
                           {}, threads);
  ASSERT_TRUE(output) << output.error().message;
  const auto field = read_points(file(*output, "scene.glb"));
  ASSERT_TRUE(field) << field.error().message;
  EXPECT_EQ(report_of(*output)["points"]["levels"].back(), field->sites.size());
  ASSERT_GT(field->sites.size(), 1000U);
  const MeshlessBasis basis = basis_of(*field, threads);
  for (std::uint32_t j = 0; j < basis.functions(); ++j) EXPECT_EQ(basis.radius(j), field->radius[j]);
  // Walls of the unit cube; functions of a level add up to 1, so that what is left is the noise of light at points.
  for (const SurfaceSite& p : {SurfaceSite{{0, -0.5F, 0}, {0, 1, 0}},
                               {{0.31F, 0.5F, -0.2F}, {0, -1, 0}},
                               {{0.5F, 0.49F, 0.49F}, {-1, 0, 0}}}) {
    const Vec3f light = basis.evaluate(field->coefficients, p, basis.levels());
    for (std::size_t c = 0; c < 3; ++c) EXPECT_NEAR(light[c], 1, 0.02F);
  }
}

TEST(PointsBake, WithVerticesLeavesThemAsTheyAre) {
  Threads threads;
  const Bytes scene = glb_of(Room(beside), {.material = kFurnace});
  const auto recipe = [](const std::string& deliver) {
    return R"({"steps":[{"do":"radiosity","subdivide":{"triangles":200})" + deliver +
           R"(}],"quality":"draft","certificate":false})";
  };
  const auto plain = bake(input_of(scene, recipe("")), {}, threads);
  const auto both = bake(input_of(scene, recipe(R"(,"deliver":["vertices","points"])")), {}, threads);
  ASSERT_TRUE(plain && both);
  const auto a = read_baked_glb(file(*plain, "scene.glb")), b = read_baked_glb(file(*both, "scene.glb"));
  ASSERT_TRUE(a && b);
  EXPECT_EQ(a->transfer.coefficients, b->transfer.coefficients);
}

}  // namespace
}  // namespace kiln
