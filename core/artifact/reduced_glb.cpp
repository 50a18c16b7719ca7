#include "core/artifact/reduced_glb.h"

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>

#include "core/artifact/glb.h"
#include "core/artifact/png.h"

namespace kiln {
namespace {

using json = nlohmann::ordered_json;

constexpr int kFloat = 5126, kUnsignedInt = 5125, kLinear = 9729, kLinearMipmaps = 9987, kClamp = 33071;
constexpr int kVertices = 34962, kIndices = 34963;

class Writer {
 public:
  explicit Writer(const ReducedGlb& what) : what_(what) {}

  Result<Bytes> write() {
    json out;
    out["asset"] = {{"version", "2.0"},
                    {"generator", "Kiln"},
                    {"extras", {{"kiln", json::parse(what_.provenance.empty() ? "{}" : what_.provenance)}}}};
    const Vec3d& c = what_.frame.center;
    const double s = what_.frame.scale;
    out["scene"] = 0;
    out["scenes"] = json::array({{{"nodes", json::array({0})}}});
    out["nodes"] =
        json::array({{{"name", what_.name}, {"mesh", 0}, {"translation", {c.x, c.y, c.z}}, {"scale", {s, s, s}}}});
    out["meshes"] = json::array({{{"name", what_.name}, {"primitives", json::array({primitive()})}}});
    out["materials"] = json::array({material()});
    if (!images_.empty()) {
      out["textures"] = textures_;
      out["images"] = images_;
      out["samplers"] =
          json::array({{{"magFilter", kLinear}, {"minFilter", kLinearMipmaps}, {"wrapS", kClamp}, {"wrapT", kClamp}}});
    }
    out["accessors"] = accessors_;
    out["bufferViews"] = views_;
    out["buffers"] = json::array({{{"byteLength", (binary_.size() + 3) / 4 * 4}}});
    return join_glb(out.dump(-1, ' ', false, json::error_handler_t::replace), std::move(binary_));
  }

 private:
  template <class T>
  std::size_t add_view(const std::vector<T>& values, int target) {
    binary_.resize((binary_.size() + 3) / 4 * 4, 0);
    const std::size_t bytes = values.size() * sizeof(T);
    json view = {{"buffer", 0}, {"byteOffset", binary_.size()}, {"byteLength", bytes}};
    if (target > 0) view["target"] = target;
    views_.push_back(std::move(view));
    const auto* from = reinterpret_cast<const std::uint8_t*>(values.data());
    binary_.insert(binary_.end(), from, from + bytes);
    return views_.size() - 1;
  }
  template <class T>
  std::size_t add_accessor(const std::vector<T>& values, const char* type, json more = json::object()) {
    more["bufferView"] = add_view(values, kVertices);
    more["componentType"] = kFloat;
    more["count"] = values.size();
    more["type"] = type;
    accessors_.push_back(std::move(more));
    return accessors_.size() - 1;
  }

  json bounds() const {
    Vec3f low = what_.mesh.position.front(), high = low;
    for (const Vec3f& p : what_.mesh.position) {
      for (std::size_t a = 0; a < 3; ++a) low[a] = std::min(low[a], p[a]), high[a] = std::max(high[a], p[a]);
    }
    return {{"min", {low.x, low.y, low.z}}, {"max", {high.x, high.y, high.z}}};
  }

  json primitive() {
    const Mesh& mesh = what_.mesh;
    json attributes;
    attributes["POSITION"] = add_accessor(mesh.position, "VEC3", bounds());
    attributes["NORMAL"] = add_accessor(mesh.normal, "VEC3");
    if (!mesh.tangent.empty()) attributes["TANGENT"] = add_accessor(mesh.tangent, "VEC4");
    if (!mesh.uv0.empty()) attributes["TEXCOORD_0"] = add_accessor(mesh.uv0, "VEC2");
    if (!mesh.color.empty() && what_.maps.color.empty()) attributes["COLOR_0"] = add_accessor(mesh.color, "VEC4");
    const std::size_t view = add_view(mesh.triangles, kIndices);
    accessors_.push_back({{"bufferView", view},
                          {"componentType", kUnsignedInt},
                          {"count", 3 * mesh.triangles.size()},
                          {"type", "SCALAR"}});
    return {{"attributes", attributes}, {"indices", accessors_.size() - 1}, {"material", 0}, {"mode", 4}};
  }

  json texture(const char* name, const std::vector<std::uint8_t>& pixels, int bits) {
    const Bytes png = write_png({what_.maps.side, what_.maps.side, 3, bits}, pixels);
    images_.push_back({{"name", name}, {"mimeType", "image/png"}, {"bufferView", add_view(png, 0)}});
    textures_.push_back({{"sampler", 0}, {"source", images_.size() - 1}});
    return {{"index", textures_.size() - 1}};
  }

  json material() {
    json out = {{"name", "reduced"}, {"pbrMetallicRoughness", {{"metallicFactor", 0}, {"roughnessFactor", 1}}}};
    if (!what_.maps.color.empty())
      out["pbrMetallicRoughness"]["baseColorTexture"] = texture("base colour", what_.maps.color, 8);
    if (what_.maps.side > 0) out["normalTexture"] = texture("normals", what_.maps.normal, what_.maps.normal_bits);
    return out;
  }

  const ReducedGlb& what_;
  Bytes binary_;
  json views_ = json::array(), accessors_ = json::array(), images_ = json::array(), textures_ = json::array();
};

}  // namespace

Result<Bytes> write_reduced_glb(const ReducedGlb& what) { return Writer(what).write(); }

}  // namespace kiln
