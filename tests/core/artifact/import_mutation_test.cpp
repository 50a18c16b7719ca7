// Damage at random: seeded mutations of small files of every kind (2000, or KILN_MUTATIONS) never crash, and what is
// accepted is valid.
#include <draco/compression/encode.h>
#include <gtest/gtest.h>
#include <meshoptimizer.h>

#include <cmath>

#include "tests/core/artifact/gltf_samples.h"
#include "tests/core/artifact/mutated.h"

namespace kiln::test {
namespace {

/// What everything behind the importer relies on.
void expect_valid(const Scene& scene) {
  const Mesh& mesh = scene.mesh;
  ASSERT_EQ(mesh.normal.size(), mesh.position.size());
  ASSERT_EQ(mesh.part.size(), mesh.triangles.size());
  for (const auto size : {mesh.uv0.size(), mesh.uv1.size(), mesh.color.size(), mesh.tangent.size()}) {
    ASSERT_TRUE(size == 0 || size == mesh.position.size());
  }
  for (std::size_t v = 0; v < mesh.position.size(); ++v) {
    const Vec3f& p = mesh.position[v];
    ASSERT_TRUE(std::abs(p.x) <= 0.5F && std::abs(p.y) <= 0.5F && std::abs(p.z) <= 0.5F);
    ASSERT_NEAR(length(mesh.normal[v]), 1, 1e-5);
  }
  for (const Triangle& t : mesh.triangles) {
    for (const std::uint32_t v : t) ASSERT_LT(v, mesh.position.size());
  }
  for (const std::uint32_t part : mesh.part) ASSERT_LT(part, scene.parts.size());
  for (const Part& part : scene.parts) ASSERT_LT(static_cast<std::size_t>(part.material), scene.materials.size());
  for (const Material& m : scene.materials) {
    for (const TextureRef* ref : {&m.base_color_texture, &m.emission_texture, &m.normal_texture}) {
      ASSERT_LT(ref->texture, static_cast<int>(scene.textures.size()));
    }
  }
  for (const Texture& t : scene.textures) ASSERT_LT(t.image, static_cast<int>(scene.images.size()));
  ASSERT_TRUE(is_finite(scene.frame.center) && scene.frame.scale > 0 && std::isfinite(scene.frame.scale));
}

Bytes plain_sample() {
  Sample s;
  s.positions(cube_positions());
  s.indices(cube_indices());
  s.accessor<std::uint8_t>(std::vector<std::uint8_t>(32, 200), 5121, "VEC4", 8, ",\"normalized\":true");
  const auto png = tiny_png();
  const int image = s.add_view(s.blob().add(png), png.size());
  return s.glb(
      one_node("\"attributes\":{\"POSITION\":0,\"COLOR_0\":2},\"indices\":1,\"material\":0", "\"scale\":[1,2,-1]") +
      ",\"materials\":[{\"pbrMetallicRoughness\":{\"baseColorTexture\":{\"index\":0}}}],\"textures\":[{\"source\":0}],"
      "\"images\":[{\"mimeType\":\"image/png\",\"bufferView\":" +
      std::to_string(image) + "}]");
}

Bytes sparse_sample() {
  Sample s;
  s.positions(cube_positions());
  s.indices(cube_indices());
  const auto index_at = s.blob().add(std::vector<std::uint16_t>{1, 2});
  const auto value_at = s.blob().add(std::vector<float>{2, 0, 0, 0, 4, 0});
  const int indices = s.add_view(index_at, 4), values = s.add_view(value_at, 24);
  s.add_accessor(
      "\"bufferView\":0,\"componentType\":5126,\"count\":8,\"type\":\"VEC3\",\"sparse\":{\"count\":2,\"indices\":{"
      "\"bufferView\":" +
      std::to_string(indices) + ",\"componentType\":5123},\"values\":{\"bufferView\":" + std::to_string(values) + "}}");
  return s.glb(one_node("\"attributes\":{\"POSITION\":2},\"indices\":1",
                        "\"extensions\":{\"EXT_mesh_gpu_instancing\":{\"attributes\":{\"TRANSLATION\":0}}}"));
}

Bytes draco_sample() {
  draco::Mesh mesh;
  const auto positions = cube_positions();
  const auto indices = cube_indices();
  mesh.set_num_points(8);
  draco::GeometryAttribute type;
  type.Init(draco::GeometryAttribute::POSITION, nullptr, 3, draco::DT_FLOAT32, false, 12, 0);
  const int id = mesh.AddAttribute(type, true, 8);
  for (std::uint32_t v = 0; v < 8; ++v)
    mesh.attribute(id)->SetAttributeValue(draco::AttributeValueIndex(v), &positions[3 * v]);
  for (std::size_t i = 0; i < indices.size(); i += 3) {
    mesh.AddFace({draco::PointIndex(indices[i]), draco::PointIndex(indices[i + 1]), draco::PointIndex(indices[i + 2])});
  }
  draco::Encoder encoder;
  encoder.SetAttributeQuantization(draco::GeometryAttribute::POSITION, 11);
  draco::EncoderBuffer buffer;
  EXPECT_TRUE(encoder.EncodeMeshToBuffer(mesh, &buffer).ok());
  Sample s;
  const std::vector<char> stream(buffer.data(), buffer.data() + buffer.size());
  s.add_view(s.blob().add(stream), stream.size());
  s.add_accessor("\"componentType\":5126,\"count\":8,\"type\":\"VEC3\"");
  s.add_accessor("\"componentType\":5125,\"count\":36,\"type\":\"SCALAR\"");
  return s.glb(
      one_node("\"attributes\":{\"POSITION\":0},\"indices\":1,\"extensions\":{\"KHR_draco_mesh_compression\":"
               "{\"bufferView\":0,\"attributes\":{\"POSITION\":0}}}"));
}

/// JSON of a view of a fallback buffer that `stream` decodes to.
void add_meshopt(Sample& s, const std::vector<unsigned char>& stream, std::size_t offset, std::size_t stride,
                 std::size_t count, const char* mode) {
  const auto at = s.blob().add(stream);
  s.add_view(offset, stride * count, 0,
             ",\"extensions\":{\"EXT_meshopt_compression\":{\"buffer\":0,\"byteOffset\":" + std::to_string(at) +
                 ",\"byteLength\":" + std::to_string(stream.size()) + ",\"byteStride\":" + std::to_string(stride) +
                 ",\"count\":" + std::to_string(count) + ",\"mode\":\"" + mode + "\"}}");
}

Bytes meshopt_sample() {
  const auto positions = cube_positions();
  const auto indices = cube_indices();
  std::vector<unsigned char> vertices(meshopt_encodeVertexBufferBound(8, 12)),
      triangles(meshopt_encodeIndexBufferBound(36, 8));
  vertices.resize(meshopt_encodeVertexBuffer(vertices.data(), vertices.size(), positions.data(), 8, 12));
  triangles.resize(meshopt_encodeIndexBuffer(triangles.data(), triangles.size(), indices.data(), 36));
  Sample s;
  s.blob().add(std::vector<std::uint8_t>(240));  // views must lie inside of the buffer they stand for
  add_meshopt(s, vertices, 0, 12, 8, "ATTRIBUTES");
  add_meshopt(s, triangles, 96, 4, 36, "TRIANGLES");
  s.add_accessor("\"bufferView\":0,\"componentType\":5126,\"count\":8,\"type\":\"VEC3\"");
  s.add_accessor("\"bufferView\":1,\"componentType\":5125,\"count\":36,\"type\":\"SCALAR\"");
  return s.glb(one_node("\"attributes\":{\"POSITION\":0},\"indices\":1"));
}

Bytes ply_sample() {
  const std::string header =
      "ply\nformat binary_little_endian 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
      "element face 1\nproperty list uchar int vertex_indices\nend_header\n";
  Bytes out(header.begin(), header.end());
  Blob body;
  body.add(kTriangle);
  out.insert(out.end(), body.bytes.begin(), body.bytes.end());
  append_bytes(out, {3, 0, 0, 0, 0, 1, 0, 0, 0, 2, 0, 0, 0});
  return out;
}

/// The length in a GLB's header is mended half of the time, so that more gets past it.
Bytes mutated_file(const Bytes& sample, Random& random) {
  Bytes file = mutated(sample, random, 12);
  if (file.size() >= 12 && file[0] == 'g' && random.next() % 2 == 0) {
    for (std::size_t i = 0; i < 4; ++i) file[8 + i] = static_cast<std::uint8_t>(file.size() >> (8 * i));
  }
  return file;
}

/// Of several samples in turn; more than a hundredth must be accepted, or the mutations are too harsh to test anything.
void expect_answered_or_valid(const char* kind, const std::vector<Bytes>& samples) {
  std::size_t accepted = 0;
  Costs costs;
  const std::uint64_t count = mutation_count();
  for (std::uint64_t i = 0; i < count; ++i) {
    Random random(20060, i);
    const Bytes file = mutated_file(samples[i % samples.size()], random);
    const auto scene = costs.of([&] { return import_bytes(file); });
    SCOPED_TRACE(i);
    if (scene) {
      ++accepted;
      expect_valid(*scene);
    } else {
      EXPECT_NE(scene.error().code, "out_of_memory");
      EXPECT_FALSE(scene.error().code.empty() || scene.error().message.empty());
    }
    if (testing::Test::HasFailure()) return;
  }
  EXPECT_GT(accepted, count / 100);
  costs.expect_small(kind, count, accepted);
}

TEST(ImportMutation, TheSamplesThemselvesAreAccepted) {
  for (const Bytes& file : {plain_sample(), sparse_sample(), draco_sample(), meshopt_sample(), ply_sample()}) {
    const auto scene = import_bytes(file);
    ASSERT_TRUE(scene) << scene.error().code << " " << scene.error().where;
    expect_valid(*scene);
  }
}

TEST(ImportMutation, DamagedGlbsAreAnsweredOrValid) {
  expect_answered_or_valid("glb", {plain_sample(), sparse_sample(), draco_sample(), meshopt_sample()});
}

TEST(ImportMutation, DamagedPlysAreAnsweredOrValid) { expect_answered_or_valid("ply", {ply_sample()}); }

}  // namespace
}  // namespace kiln::test
