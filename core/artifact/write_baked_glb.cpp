// BakedScene -> scene.glb. core/artifact/README.md specifies what is written here.

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "core/artifact/baked_geometry.h"
#include "core/artifact/baked_scene.h"
#include "core/artifact/glb.h"
#include "core/artifact/look.h"
#include "core/artifact/look_json.h"
#include "core/artifact/png.h"
#include "core/artifact/sky_levels.h"
#include "core/base/expects.h"
#include "core/prt/lobe_table.h"

namespace kiln {
namespace {

using json = nlohmann::ordered_json;

constexpr int kFloat = 5126, kUnsignedInt = 5125;
constexpr const char* kTransfer = "KILN_radiance_transfer";
constexpr const char* kField = "KILN_light_field";
constexpr const char* kDraco = "KHR_draco_mesh_compression";

json vec(const Vec3f& v) { return {v.x, v.y, v.z}; }

json field_light_json(const Light& light) {
  constexpr std::array kTypes{"directional", "point", "spot"};
  json out = {{"type", kTypes[static_cast<std::size_t>(light.type)]}, {"intensity", vec(light.intensity)}};
  if (light.type != LightType::point) out["direction"] = vec(light.direction);
  if (light.type == LightType::directional) return out;
  out["position"] = vec(light.position);
  out["range"] = light.range;
  if (light.type == LightType::spot) out["innerConeAngle"] = light.inner_cone, out["outerConeAngle"] = light.outer_cone;
  return out;
}

void check_shape(const BakedScene& baked) {
  const Mesh& mesh = baked.scene.mesh;
  EXPECTS(baked.transfer.order >= 0 && baked.transfer.order <= kMaxShOrder);
  EXPECTS(baked.transfer.order > 0 || (baked.transfer.fixed && baked.light.coefficients.empty()));
  EXPECTS(baked.transfer.channels == 1 || baked.transfer.channels == 3);
  EXPECTS(baked.transfer.vertices() == mesh.position.size() && mesh.normal.size() == mesh.position.size());
  EXPECTS(mesh.part.size() == mesh.triangles.size());
  EXPECTS(std::isnormal(baked.exposure) && baked.exposure > 0);
  const GlossyTransfer& glossy = baked.glossy;
  if (glossy) {
    EXPECTS(glossy.order <= std::min(baked.transfer.order, kMaxLobeOrder));
    EXPECTS(baked.lobes.order == glossy.order && baked.lobes.numbers.size() == LobeTable::size_of(glossy.order));
    EXPECTS(!glossy.vertices.empty() && glossy.rank() >= 1 && glossy.components.stride == glossy.stride());
  }
  const LightField& field = baked.field;
  EXPECTS(field.coefficients.empty() ||
          (field.degree <= kMaxLightFieldDegree && field.vertices() == mesh.position.size()));
  EXPECTS(!field.has_sky() ||
          (field.visibility.size() == kVisibilityCount * mesh.position.size() && baked.sky.size() >= 2));
  EXPECTS(field.lamps.size() <= kMostFieldLamps &&
          field.lamp_visibility.size() == field.lamps.size() * mesh.position.size());
  EXPECTS(!field.has_diffuse() || (baked.transfer.order == 0 && baked.transfer.channels == 3));
  EXPECTS(std::ranges::all_of(baked.light.coefficients, [](const Vec3f& c) { return is_finite(c); }));
}

/// The document under construction and its binary chunk.
class Writer {
 public:
  Writer(const BakedScene& baked, const Encoding& encoding) : baked_(baked), encoding_(encoding) {}

  Result<Bytes> write() {
    const auto vertices = used_vertices(baked_.scene.mesh);
    if (vertices.empty()) return fault("nothing_to_write", "The baked scene has no triangle.");
    transfer_.emplace(baked_.transfer, encoding_.transfer, vertices);
    const auto has_matrix = [&](auto v) { return baked_.glossy.find(v) != GlossyTransfer::kNoMatrix; };
    if (baked_.glossy && encoding_.glossy && std::ranges::any_of(vertices, has_matrix))
      glossy_.emplace(baked_.glossy, encoding_, vertices);
    if (!baked_.field.coefficients.empty()) field_.emplace(baked_.field, encoding_, vertices);
    if (const auto done = add_parts(); !done) return tl::make_unexpected(done.error());
    add_images();
    components_ = add_components(transfer_->form());
    if (field_) field_components_ = add_components(field_->numbers().form());
    add_glossy();
    add_sky();
    std::string text = document().dump(-1, ' ', false, json::error_handler_t::replace);
    return join_glb(std::move(text), std::move(binary_));
  }

 private:
  std::size_t add_view(std::span<const std::uint8_t> bytes) {
    binary_.resize((binary_.size() + 3) / 4 * 4, 0);
    views_.push_back({{"buffer", 0}, {"byteOffset", binary_.size()}, {"byteLength", bytes.size()}});
    binary_.insert(binary_.end(), bytes.begin(), bytes.end());
    return views_.size() - 1;
  }

  /// The same bytes under a second index: some loaders consume a Draco buffer view at first use (three.js does).
  std::size_t add_view_again(std::size_t view) {
    views_.push_back(json(views_[view]));
    return views_.size() - 1;
  }

  std::size_t add_accessor(json accessor) {
    accessors_.push_back(std::move(accessor));
    return accessors_.size() - 1;
  }

  Result<void> add_parts() {
    return visit_part_primitives(
        baked_, {encoding_, &*transfer_, glossy_ ? &*glossy_ : nullptr, field_ ? &*field_ : nullptr},
        [this](PartPrimitive part) -> Result<void> {
          const std::size_t triangles = part.mesh.triangles.size();
          KILN_TRY(bytes, encode_draco(std::move(part.mesh), encoding_.speed));
          KILN_TRY(decoded, decode_draco(bytes, {std::numeric_limits<std::uint32_t>::max(), triangles, true}));
          add_primitives(part, decoded, add_view(bytes));
          return {};
        });
  }

  /// An accessor without a buffer view, as the Draco extension asks; counts and bounds are those of the decoded data.
  std::size_t add_stream_accessor(const NamedStream& stream, const DecodedMesh& decoded) {
    static constexpr std::array kTypes{"SCALAR", "VEC2", "VEC3", "VEC4"};
    json accessor{{"componentType", kFloat},
                  {"count", decoded.vertices},
                  {"type", kTypes[static_cast<std::size_t>(stream.components - 1)]}};
    if (stream.name == "POSITION") put_bounds(decoded.streams.at(0).values, accessor);
    return add_accessor(std::move(accessor));
  }

  static void put_bounds(const std::vector<float>& positions, json& accessor) {
    std::array<float, 3> low{positions[0], positions[1], positions[2]}, high = low;
    for (std::size_t i = 0; i < positions.size(); ++i) {
      low[i % 3] = std::min(low[i % 3], positions[i]);
      high[i % 3] = std::max(high[i % 3], positions[i]);
    }
    accessor["min"] = low;
    accessor["max"] = high;
  }

  void add_primitives(const PartPrimitive& source, const DecodedMesh& decoded, std::size_t view) {
    const Part& part = baked_.scene.parts[source.part];
    const std::size_t materials = baked_.scene.materials.size(), material = static_cast<std::size_t>(part.material);
    const std::size_t indices =
        add_accessor({{"componentType", kUnsignedInt}, {"count", decoded.triangles.size() * 3}, {"type", "SCALAR"}});
    json baked_attributes, baked_ids, original_attributes, original_ids;
    for (std::uint32_t id = 0; id < source.names.size(); ++id) {
      const NamedStream& stream = source.names[id];
      const std::size_t accessor = add_stream_accessor(stream, decoded);
      if (stream.in_baked) baked_attributes[stream.name] = accessor, baked_ids[stream.name] = id;
      if (stream.in_original) original_attributes[stream.name] = accessor, original_ids[stream.name] = id;
    }
    json baked = primitive_json(baked_attributes, baked_ids, view, indices);
    baked["material"] = materials + material;
    const PartLook look = part_look(baked_.scene, part);
    baked["extensions"][kTransfer] = {
        {"name", part.name}, {"material", material}, {"albedo", vec(look.albedo)}, {"emission", vec(look.emission)}};
    if (baked_attributes.contains(glossy_name(0))) baked["extensions"][kTransfer]["glossy"] = true;
    json original = primitive_json(original_attributes, original_ids, add_view_again(view), indices);
    original["material"] = material;
    baked_primitives_.push_back(std::move(baked));
    original_primitives_.push_back(std::move(original));
  }

  static json primitive_json(const json& attributes, const json& ids, std::size_t view, std::size_t indices) {
    return {{"attributes", attributes},
            {"indices", indices},
            {"mode", 4},
            {"extensions", {{kDraco, {{"bufferView", view}, {"attributes", ids}}}}}};
  }

  /// Images keep their index; one whose bytes were lost becomes a white pixel.
  void add_images() {
    for (const Image& image : baked_.scene.images) {
      const bool lost = image.encoded.empty();
      images_.push_back({{"name", image.name},
                         {"mimeType", lost ? "image/png" : image.mime},
                         {"bufferView", add_view(lost ? white_pixel_png() : image.encoded)}});
    }
  }

  /// The mean and the components, float32, little endian. Nothing for raw numbers.
  std::optional<std::size_t> add_components(const StoredForm& form) {
    if (form.raw()) return {};
    return add_floats(form.components.rows);
  }

  /// The components of the matrices, and the table of lobes.
  void add_glossy() {
    if (!glossy_) return;
    glossy_rows_ = add_floats(baked_.glossy.components.rows);
    lobes_ = add_floats(baked_.lobes.numbers);
  }

  /// The blurred skies that a field keeps apart, and how surfaces mirror them and what they leave to diffuse layers.
  void add_sky() {
    if (field_ && (field_->visibility() || baked_.field.has_diffuse()))
      field_lobes_ = add_floats(albedo_table().numbers);
    if (!field_ || !field_->visibility()) return;
    sky_ = pack_sky(baked_.sky);
    sky_view_ = add_view({reinterpret_cast<const std::uint8_t*>(sky_.texels.data()), sky_.texels.size() * 4});
  }

  json field_lobes() const { return {{"rows", kLobeRows}, {"views", kLobeViews}, {"bufferView", *field_lobes_}}; }

  json sky_extension() const {
    json out = {{"levels", {{"heights", sky_.heights}, {"unit", sky_.unit}, {"bufferView", *sky_view_}}},
                {"lobes", field_lobes()},
                {"mean", vec(baked_.field.sky)},
                {"slope", baked_.field.sky_slope}};
    put_form(out, field_->visibility()->form(), {}, sky_name);
    return out;
  }

  /// The lamps that a field keeps apart, in unit-cube lengths.
  json lamps_extension() const {
    json out, lights = json::array();
    for (const FieldLamp& lamp : baked_.field.lamps) {
      lights.push_back(field_light_json(lamp.light));
      lights.back()["mean"] = vec(lamp.mean);
    }
    out["lights"] = lights;
    put_form(out, field_->lamps()->form(), {}, lamp_name);
    return out;
  }

  std::size_t add_floats(const std::vector<float>& numbers) {
    static_assert(std::endian::native == std::endian::little);
    return add_view({reinterpret_cast<const std::uint8_t*>(numbers.data()), numbers.size() * sizeof(float)});
  }

  json glossy_extension() const {
    const GlossyTransfer& g = baked_.glossy;
    json attributes = json::array();
    for (std::size_t k = 0; k < glossy_->vec4s(); ++k) attributes.push_back(glossy_name(k));
    return {{"order", g.order},
            {"channels", g.channels},
            {"fixed", g.fixed},
            {"components", {{"rank", g.rank()}, {"bufferView", *glossy_rows_}}},
            {"attributes", attributes},
            {"scale", glossy_->form().scale},
            {"offset", glossy_->form().offset},
            {"lobes", {{"rows", kLobeRows}, {"views", kLobeViews}, {"bufferView", *lobes_}}}};
  }

  /// How numbers come from VEC4s: the same members for transfer vectors and r-RFs.
  template <class Name>
  static void put_form(json& out, const StoredForm& form, std::optional<std::size_t> components, const Name& name) {
    json attributes = json::array();
    for (std::size_t k = 0; k < vec4s_of(form.count()); ++k) attributes.push_back(name(k));
    out["form"] = form.raw() ? "raw" : "components";
    out["attributes"] = attributes;
    out["scale"] = form.scale;
    out["offset"] = form.offset;
    if (components) out["components"] = {{"rank", form.components.rank()}, {"bufferView", *components}};
  }

  json transfer_extension() const {
    const Transfer& t = baked_.transfer;
    const auto colors = [](const std::vector<Vec3f>& light) {
      json list = json::array();
      for (const Vec3f& c : light) list.push_back(vec(c));
      return list;
    };
    json out = {{"version", 2},     {"basis", "real-sh"},     {"condonShortley", false}, {"frame", "world, +Y up"},
                {"order", t.order}, {"channels", t.channels}, {"fixed", t.fixed},        {"slots", t.slots()}};
    put_form(out, transfer_->form(), components_, [&](std::size_t k) { return transfer_->name(k); });
    out["light"] = {{"name", baked_.light.name}, {"coefficients", colors(baked_.light.coefficients)}};
    if (!baked_.light.bright.empty()) out["light"]["bright"] = colors(baked_.light.bright);
    out["look"] = {{"exposure", baked_.exposure}, {"toneMap", kToneMapName}};
    out["units"] = "W m^-2 sr^-1";
    if (glossy_) out["glossy"] = glossy_extension();
    return out;
  }

  json field_extension() const {
    const bool emission = baked_.field.emission_apart, diffuse = baked_.field.has_diffuse();
    json out = {{"version", diffuse           ? 4
                            : emission        ? 3
                            : field_->lamps() ? 2
                                              : 1},
                {"basis", "real-sh"},
                {"condonShortley", false},
                {"frame", "world, +Y up"},
                {"reflected", true},
                {"degree", baked_.field.degree}};
    put_form(out, field_->numbers().form(), field_components_, field_name);
    out["units"] = "W m^-2 sr^-1";
    if (field_->visibility()) out["sky"] = sky_extension();
    if (field_->lamps()) out["lamps"] = lamps_extension();
    if (emission) out["emissionApart"] = true;
    if (diffuse) out["diffuse"] = {{"mean", vec(baked_.field.diffuse_color)}, {"lobes", field_lobes()}};
    return out;
  }

  void put_scenes(json& out, const json& light_nodes) const {
    const Frame& frame = baked_.scene.frame;
    const auto node = [&](const char* name, int mesh) -> json {
      return {{"name", name},
              {"mesh", mesh},
              {"translation", {frame.center.x, frame.center.y, frame.center.z}},
              {"scale", {frame.scale, frame.scale, frame.scale}}};
    };
    json nodes = json::array({node("baked", 0), node("original", 1)}), original = json::array({1});
    for (const json& light : light_nodes) {
      original.push_back(nodes.size());
      nodes.push_back(light);
    }
    out["scene"] = 0;
    out["scenes"] =
        json::array({{{"name", "baked"}, {"nodes", json::array({0})}}, {{"name", "original"}, {"nodes", original}}});
    out["nodes"] = nodes;
    out["meshes"] = json::array({{{"name", "baked"}, {"primitives", baked_primitives_}},
                                 {{"name", "original"}, {"primitives", original_primitives_}}});
  }

  json extensions_used(const LookJson& look) const {
    std::vector<std::string> out = look.extensions;
    out.insert(out.end(), {kDraco, kTransfer});
    if (field_) out.push_back(kField);
    std::ranges::sort(out);
    return out;
  }

  json document() const {
    const LookJson look = look_json(baked_.scene);
    json out;
    out["asset"] = {{"version", "2.0"},
                    {"generator", "Kiln"},
                    {"extras", {{"kiln", json::parse(baked_.provenance.empty() ? "{}" : baked_.provenance)}}}};
    out["extensionsUsed"] = extensions_used(look);
    out["extensionsRequired"] = json::array({kDraco});
    out["extensions"][kTransfer] = transfer_extension();
    if (field_) out["extensions"][kField] = field_extension();
    const json lights = json::parse(look.lights);
    if (!lights.empty()) out["extensions"]["KHR_lights_punctual"]["lights"] = lights;
    put_scenes(out, json::parse(look.light_nodes));
    out["materials"] = json::parse(look.materials);
    const auto put = [&](const char* name, json array) {
      if (!array.empty()) out[name] = std::move(array);
    };
    put("textures", json::parse(look.textures));
    put("samplers", json::parse(look.samplers));
    put("images", images_);
    out["accessors"] = accessors_;
    out["bufferViews"] = views_;
    out["buffers"] = json::array({{{"byteLength", (binary_.size() + 3) / 4 * 4}}});
    return out;
  }

  const BakedScene& baked_;
  const Encoding& encoding_;
  std::optional<StoredTransfer> transfer_;
  std::optional<StoredGlossy> glossy_;
  std::optional<StoredField> field_;
  std::optional<std::size_t> components_, field_components_, glossy_rows_, lobes_, sky_view_,
      field_lobes_;  // buffer views
  PackedSky sky_;
  Bytes binary_;
  json views_ = json::array(), accessors_ = json::array(), images_ = json::array();
  json baked_primitives_ = json::array(), original_primitives_ = json::array();
};

}  // namespace

Result<Bytes> write_baked_glb(const BakedScene& baked, const Encoding& encoding) {
  check_shape(baked);
  return Writer(baked, encoding).write();
}

}  // namespace kiln
