#include "tests/core/prt/reference_set.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>

#include "core/artifact/import.h"

namespace kiln::testing {
namespace {

std::vector<char> read_bytes(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

// The reference files put positions, then normals, at the start of the binary chunk.
struct Elements {
  std::vector<Vec3f> position, normal;
};

Elements read_elements(const std::string& glb, std::size_t count) {
  const std::vector<char> bytes = read_bytes(glb);
  std::uint32_t json_length = 0;
  std::memcpy(&json_length, bytes.data() + 12, 4);
  const char* data = bytes.data() + 20 + json_length + 8;
  Elements e{std::vector<Vec3f>(count), std::vector<Vec3f>(count)};
  std::memcpy(static_cast<void*>(e.position.data()), data, count * 12);
  std::memcpy(static_cast<void*>(e.normal.data()), data + count * 12, count * 12);
  return e;
}

}  // namespace

std::optional<Scene> load_scene(const std::string& shared, const std::string& path) {
  const std::string file = shared + "/models/" + path;
  if (!std::filesystem::exists(file)) return std::nullopt;
  Result<SceneFiles> files = read_scene_files(file);
  if (!files) return std::nullopt;
  Result<Scene> scene = import_scene(*files);
  if (!scene) return std::nullopt;
  return std::move(*scene);
}

std::optional<ReferenceSet> load_reference_set(const std::string& shared, const std::string& name) {
  std::optional<Scene> scene = load_scene(shared, "references/" + name + ".glb");
  if (!scene) return std::nullopt;
  ReferenceSet set{.scene = std::move(*scene), .element = {}, .vertex = {}, .folder = shared + "/models/references/"};
  const std::vector<char> mask = read_bytes(set.folder + name + ".mask.u8");
  const Elements elements = read_elements(set.folder + name + ".glb", mask.size());

  const Mesh& mesh = set.scene.mesh;
  std::multimap<std::array<float, 3>, std::uint32_t> at;
  for (std::uint32_t v = 0; v < mesh.position.size(); ++v) {
    at.insert({{mesh.position[v].x, mesh.position[v].y, mesh.position[v].z}, v});
  }
  for (std::uint32_t e = 0; e < mask.size(); ++e) {
    if (mask[e] == 0) continue;
    const Vec3f p = to_float(set.scene.frame.to_unit(to_double(elements.position[e])));
    const auto [begin, end] = at.equal_range({p.x, p.y, p.z});
    const auto best = std::max_element(begin, end, [&](const auto& a, const auto& b) {
      return dot(mesh.normal[a.second], elements.normal[e]) < dot(mesh.normal[b.second], elements.normal[e]);
    });
    if (best == end) continue;
    set.element.push_back(e);
    set.vertex.push_back(best->second);
  }
  return set;
}

std::vector<Vec3f> ReferenceSet::values(const std::string& name) const {
  const std::vector<char> bytes = read_bytes(folder + name + ".f32");
  std::vector<Vec3f> out(element.size());
  for (std::size_t i = 0; i < element.size(); ++i) {
    std::memcpy(static_cast<void*>(&out[i]), bytes.data() + 12 * std::size_t{element[i]}, 12);
  }
  return out;
}

RelativeError relative_error(const std::vector<Vec3f>& values, const std::vector<Vec3f>& reference) {
  std::vector<double> square(values.size());
  double mean = 0;
  for (std::size_t i = 0; i < values.size(); ++i) {
    const Vec3d d = to_double(values[i]) - to_double(reference[i]);
    square[i] = dot(d, d) / 3;
    mean += (double{reference[i].x} + reference[i].y + reference[i].z) / 3;
  }
  mean /= static_cast<double>(values.size());
  std::sort(square.begin(), square.end());
  const auto root_mean = [&](std::size_t count) {
    double sum = 0;
    for (std::size_t i = 0; i < count; ++i) sum += square[i];
    return std::sqrt(sum / static_cast<double>(count)) / mean;
  };
  return {root_mean(square.size()), root_mean(square.size() - square.size() / 100)};
}

}  // namespace kiln::testing
