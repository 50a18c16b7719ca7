#include "core/artifact/baked_header.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>

#include "core/artifact/json_fields.h"
#include "core/lightfield/field_lamp.h"

namespace kiln {
namespace {

using nlohmann::json;

constexpr const char* kExtension = "KILN_radiance_transfer";
constexpr const char* kPlace = "/extensions/KILN_radiance_transfer";
constexpr double kLargest = 1e38;  // anything above might not fit a float

/// The element at a pointer, or null if there is none.
const json& at(const json& root, const std::string& pointer) {
  static const json nothing;
  const json::json_pointer place(pointer);
  return root.contains(place) ? root.at(place) : nothing;
}

/// Numbers that a float holds; `count` of them.
std::vector<double> numbers(const json& array, const std::string& place, std::size_t count, Findings& findings) {
  std::vector<double> out(count, 0);
  if (!array.is_array() || array.size() != count) {
    findings.fail("slot_count_mismatch", "There must be " + std::to_string(count) + " numbers.", place);
    return out;
  }
  for (std::size_t i = 0; i < count; ++i) {
    if (array[i].is_number()) out[i] = array[i].get<double>();
    if (!array[i].is_number() || !(std::abs(out[i]) <= kLargest)) {
      findings.fail("number_out_of_range", "This is not a number that a float holds.", place + "/" + std::to_string(i));
      return out;
    }
  }
  return out;
}

void check_basis(const Fields& extension, Findings& findings) {
  if (extension.text("basis") != "real-sh" || extension.flag("condonShortley", true)) {
    findings.fail("not_a_baked_scene", "The basis must be real-sh without the Condon-Shortley phase.",
                  extension.pointer("basis"));
  }
}

void check_version(const Fields& extension, std::uint64_t least, std::uint64_t most, Findings& findings) {
  const std::uint64_t version = extension.count("version", 0);
  if (version >= least && version <= most) return;
  const std::string known = (least < most ? "s " + std::to_string(least) + " to " : " ") + std::to_string(most);
  findings.fail("unsupported_version",
                "Only version" + known + " of the extension " + (least < most ? "are" : "is") + " read.",
                extension.pointer("version"));
}

Transfer read_shape(const Fields& extension, Findings& findings) {
  Transfer out;
  const std::uint64_t order = extension.count("order", kMaxShOrder + 1), channels = extension.count("channels", 0);
  if (order > kMaxShOrder || (order == 0 && !extension.flag("fixed", false))) {
    findings.fail("number_out_of_range", "The order must be 1 to 10, or 0 with fixed light.",
                  extension.pointer("order"));
    return out;
  }
  if (channels != 1 && channels != 3) {
    findings.fail("number_out_of_range", "There must be 1 or 3 channels.", extension.pointer("channels"));
    return out;
  }
  out = {static_cast<int>(order), static_cast<int>(channels), extension.flag("fixed", false), {}};
  if (extension.count("slots", 0) != static_cast<std::uint64_t>(out.slots())) {
    findings.fail("slot_count_mismatch", "Order and fixed light ask for another number of slots.",
                  extension.pointer("slots"));
  }
  return out;
}

/// `name_of(k)` is that of VEC4 k.
void check_attribute_names(const Fields& extension, const auto& name_of, std::size_t numbers, Findings& findings) {
  const std::vector<std::string> names = extension.texts("attributes");
  bool right = names.size() == vec4s_of(numbers);
  for (std::size_t k = 0; right && k < names.size(); ++k) right = names[k] == name_of(k);
  if (!right) {
    findings.fail("slot_count_mismatch", "The attributes must be " + name_of(0) + " and on, four numbers in each.",
                  extension.pointer("attributes"));
  }
}

/// How numbers of a shape come from VEC4s. Leaves it raw, or with rows of zeros for the caller to fill from `view`.
template <class Name>
StoredForm read_form(const json& root, const Fields& extension, const Transfer& shape, const Name& name_of, int& view,
                     Findings& findings) {
  StoredForm out;
  if (const std::string form = extension.text("form"); form == "components") {
    const Fields components = extension.object("components");
    const std::uint64_t rank = components.count("rank", 0);
    if (rank < 1 || rank > shape.stride()) {
      findings.fail("number_out_of_range", "There must be at least one component, and no more than slots.",
                    components.pointer("rank"));
      return out;
    }
    view = components.index("bufferView", 1u << 30);
    out.components = {shape.stride(), std::vector<float>((rank + 1) * shape.stride())};
  } else if (form != "raw") {
    findings.fail("not_a_baked_scene", "The form must be raw or components.", extension.pointer("form"));
    return out;
  }
  const std::size_t count = out.expected_count(shape);
  check_attribute_names(extension, name_of, count, findings);
  const std::string scale = extension.pointer("scale"), offset = extension.pointer("offset");
  out.scale = numbers(at(root, scale), scale, count, findings);
  out.offset = numbers(at(root, offset), offset, count, findings);
  return out;
}

constexpr const char* kFieldPlace = "/extensions/KILN_light_field";

/// What the r-RFs leave to the sky, if they do.
void read_sky(const json& root, const Fields& extension, BakedHeader& out, Findings& findings) {
  constexpr std::uint64_t kMostLevels = 32, kMostHeight = 1024;
  if (!extension.has("sky")) return;
  const Fields fields = extension.object("sky"), levels = fields.object("levels"), lobes = fields.object("lobes");
  BakedHeader::Sky sky;
  int no_components = -1;
  sky.form = read_form(root, fields, visibility_shape(), sky_name, no_components, findings);
  if (!sky.form.raw())
    return findings.fail("not_a_baked_scene", "What is seen of the sky must be raw.", fields.pointer("form"));
  const std::string place = levels.pointer("heights");
  const json& heights = at(root, place);
  if (!heights.is_array() || heights.size() < 2 || heights.size() > kMostLevels)
    return findings.fail("number_out_of_range", "There must be 2 to 32 levels.", place);
  for (const json& height : heights) {
    if (!height.is_number_unsigned() || height.get<std::uint64_t>() < 2 || height.get<std::uint64_t>() > kMostHeight)
      return findings.fail("number_out_of_range", "A level must be 2 to 1024 texels high.", place);
    sky.levels.heights.push_back(height.get<int>());
  }
  sky.levels.unit = levels.number("unit", 1);
  if (!(sky.levels.unit > 0 && sky.levels.unit <= kLargest))
    return findings.fail("number_out_of_range", "The unit must be above zero.", levels.pointer("unit"));
  if (lobes.count("rows", 0) != kLobeRows || lobes.count("views", 0) != kLobeViews)
    return findings.fail("slot_count_mismatch", "The table of lobes must have 16 rows of 32 views.",
                         lobes.pointer("rows"));
  sky.levels_view = levels.index("bufferView", 1u << 30);
  const std::string mean = fields.pointer("mean");
  const auto c = numbers(at(root, mean), mean, 3, findings);
  if (findings.failed()) return;
  sky.mean = {static_cast<float>(c[0]), static_cast<float>(c[1]), static_cast<float>(c[2])};
  sky.slope = fields.number("slope", 0);
  if (!(sky.slope >= 0 && sky.slope <= kLargest))
    return findings.fail("number_out_of_range", "A slope is not below zero.", fields.pointer("slope"));
  out.sky = std::move(sky);
}

Vec3f float_vector(const std::array<double, 3>& x) {
  return {static_cast<float>(x[0]), static_cast<float>(x[1]), static_cast<float>(x[2])};
}

/// One of them, in unit-cube lengths.
FieldLamp read_lamp(const Fields& fields, Findings& findings) {
  constexpr double kHalfTurn = 0.5 * std::numbers::pi + 1e-6, kUnit = 1e-3;
  Light out;
  const std::string type = fields.text("type");
  if (type != "directional" && type != "point" && type != "spot")
    findings.fail("not_a_baked_scene", "A lamp is directional, a point or a spot.", fields.pointer("type"));
  out.type = type == "directional" ? LightType::directional : type == "spot" ? LightType::spot : LightType::point;
  const auto in_range = [&](const char* member, double x, double most) {
    if (!(x >= 0 && x <= most))
      findings.fail("number_out_of_range", "The number is not in range.", fields.pointer(member));
    return static_cast<float>(x);
  };
  const auto vector = [&](const char* member, double least) {
    const std::array<double, 3> x = fields.numbers<3>(member, {-HUGE_VAL, 0, 0});
    for (const double c : x)
      if (!(c >= least && c <= kLargest))
        findings.fail("number_out_of_range", "These are not three numbers in range.", fields.pointer(member));
    return float_vector(x);
  };
  out.intensity = vector("intensity", 0);
  const Vec3f mean = vector("mean", 0);
  if (out.type != LightType::point) {
    out.direction = vector("direction", -1 - kUnit);
    if (std::abs(double{length(out.direction)} - 1) > kUnit)
      findings.fail("number_out_of_range", "A direction has length 1.", fields.pointer("direction"));
  }
  if (out.type != LightType::directional) {
    out.position = vector("position", -kLargest);
    out.range = in_range("range", fields.number("range", 0), kLargest);
  }
  if (out.type == LightType::spot) {
    out.outer_cone = in_range("outerConeAngle", fields.number("outerConeAngle", -1), kHalfTurn);
    out.inner_cone = in_range("innerConeAngle", fields.number("innerConeAngle", -1), double{out.outer_cone});
  }
  return findings.failed() ? FieldLamp{} : make_field_lamp(out, mean);
}

/// What the r-RFs leave to lamps, if they do.
void read_lamps(const json& root, const Fields& extension, BakedHeader& out, Findings& findings) {
  if (!extension.has("lamps")) return;
  const Fields fields = extension.object("lamps");
  const std::size_t count = fields.size("lights");
  if (count < 1 || count > kMostFieldLamps)
    return findings.fail("number_out_of_range", "There must be 1 to " + std::to_string(kMostFieldLamps) + " lamps.",
                         fields.pointer("lights"));
  fields.for_each("lights", [&](const Fields& lamp) { out.lamps.push_back(read_lamp(lamp, findings)); });
  if (findings.failed()) return;
  int no_components = -1;
  out.lamp_form = read_form(root, fields, lamp_shape(count), lamp_name, no_components, findings);
  if (!out.lamp_form.raw())
    findings.fail("not_a_baked_scene", "What is seen of lamps must be raw.", fields.pointer("form"));
}

/// What the r-RFs leave to diffuse light, if they do: the transfer vectors hold it.
void read_diffuse(const json& root, const Fields& extension, BakedHeader& out, Findings& findings) {
  if (!extension.has("diffuse")) return;
  const Fields fields = extension.object("diffuse"), lobes = fields.object("lobes");
  if (out.shape.order != 0 || out.shape.channels != 3)
    return findings.fail("not_a_baked_scene", "Diffuse light is a transfer of order 0 with three channels.",
                         extension.pointer("diffuse"));
  if (lobes.count("rows", 0) != kLobeRows || lobes.count("views", 0) != kLobeViews)
    return findings.fail("slot_count_mismatch", "The table of lobes must have 16 rows of 32 views.",
                         lobes.pointer("rows"));
  const std::string mean = fields.pointer("mean");
  const auto c = numbers(at(root, mean), mean, 3, findings);
  if (findings.failed()) return;
  if (!std::ranges::all_of(c, [](double x) { return x >= 0; }))
    return findings.fail("number_out_of_range", "A colour is not below zero.", mean);
  out.diffuse_color = Vec3f{static_cast<float>(c[0]), static_cast<float>(c[1]), static_cast<float>(c[2])};
}

/// The r-RFs, if there are any.
void read_field(const json& root, BakedHeader& out, Findings& findings) {
  if (!at(root, kFieldPlace).is_object()) return;
  const Fields extension(at(root, kFieldPlace), kFieldPlace, findings);
  check_version(extension, 1, 4, findings);
  check_basis(extension, findings);
  if (!extension.flag("reflected", false))
    findings.fail("not_a_baked_scene", "Radiance functions must be reflected.", extension.pointer("reflected"));
  const std::uint64_t degree = extension.count("degree", kMaxLightFieldDegree + 1);
  if (degree > kMaxLightFieldDegree)
    findings.fail("number_out_of_range", "The degree must be 0 to 8.", extension.pointer("degree"));
  if (findings.failed()) return;
  out.has_field = true;
  out.field_shape = field_shape(static_cast<int>(degree));
  out.field_form = read_form(root, extension, out.field_shape, field_name, out.field_view, findings);
  read_sky(root, extension, out, findings);
  read_lamps(root, extension, out, findings);
  out.emission_apart = extension.flag("emissionApart", false);
  read_diffuse(root, extension, out, findings);
}

/// The matrices, if there are any: their shape, with rows of zeros for the caller to fill.
void read_glossy(const json& root, const Fields& extension, BakedHeader& out, Findings& findings) {
  if (!extension.has("glossy")) return;
  const Fields glossy = extension.object("glossy"), components = glossy.object("components"),
               lobes = glossy.object("lobes");
  const std::uint64_t order = glossy.count("order", 0), channels = glossy.count("channels", 0);
  const auto most = static_cast<std::uint64_t>(std::min(out.shape.order, kMaxLobeOrder));
  if (order < 1 || order > most || (channels != 1 && channels != 3)) {
    return findings.fail("number_out_of_range",
                         "Matrices have 1 or 3 channels and an order of at most 5 and that of the transfer vectors.",
                         glossy.pointer("order"));
  }
  GlossyTransfer shape{static_cast<int>(order), static_cast<int>(channels), glossy.flag("fixed", false), {}, {}, {}};
  const std::uint64_t rank = components.count("rank", 0);
  if (rank < 1 || rank > shape.stride()) {
    return findings.fail("number_out_of_range", "There must be at least one component, and no more than numbers.",
                         components.pointer("rank"));
  }
  if (lobes.count("rows", 0) != kLobeRows || lobes.count("views", 0) != kLobeViews) {
    return findings.fail("slot_count_mismatch", "The table of lobes must have 16 rows of 32 views.",
                         lobes.pointer("rows"));
  }
  shape.components = {shape.stride(), std::vector<float>((rank + 1) * shape.stride())};
  out.glossy_view = components.index("bufferView", 1u << 30);
  out.lobes_view = lobes.index("bufferView", 1u << 30);
  check_attribute_names(glossy, glossy_name, rank, findings);
  const std::string place = std::string(kPlace) + "/glossy";
  out.glossy_form.scale = numbers(at(root, place + "/scale"), place + "/scale", rank, findings);
  out.glossy_form.offset = numbers(at(root, place + "/offset"), place + "/offset", rank, findings);
  out.glossy = std::move(shape);
}

/// A colour for each coefficient of the order, or none at all.
std::vector<Vec3f> read_colors(const json& root, const std::string& place, int order, Findings& findings) {
  std::vector<Vec3f> out;
  const json& list = at(root, place);
  if (!list.is_array() || list.empty()) return out;
  if (list.size() != static_cast<std::size_t>(sh_count(order))) {
    findings.fail("slot_count_mismatch", "The light must have one colour for each coefficient.", place);
    return out;
  }
  for (std::size_t i = 0; i < list.size() && !findings.failed(); ++i) {
    const auto c = numbers(list[i], place + "/" + std::to_string(i), 3, findings);
    out.push_back({static_cast<float>(c[0]), static_cast<float>(c[1]), static_cast<float>(c[2])});
  }
  return out;
}

BakedLight read_light(const json& root, const Fields& extension, int order, Findings& findings) {
  const std::string place = std::string(kPlace) + "/light/";
  return {.name = extension.object("light").text("name"),
          .coefficients = read_colors(root, place + "coefficients", order, findings),
          .bright = read_colors(root, place + "bright", order, findings)};
}

float read_exposure(const Fields& extension, Findings& findings) {
  const Fields look = extension.object("look");
  const double exposure = look.number("exposure", 1);
  if (!(exposure > 0 && exposure <= kLargest)) {
    findings.fail("number_out_of_range", "The exposure must be above zero.", look.pointer("exposure"));
  }
  return static_cast<float>(exposure);
}

std::vector<BakedHeader::PartHeader> read_parts(const json& root, Findings& findings) {
  std::vector<BakedHeader::PartHeader> out;
  const json& meshes = at(root, "/meshes");
  if (!meshes.is_array() || meshes.empty()) return out;
  Fields(meshes[0], "/meshes/0", findings).for_each("primitives", [&](const Fields& primitive) {
    if (!primitive.has_extension(kExtension)) {
      findings.fail("not_a_baked_scene", "A primitive of mesh 0 lacks its extension.", primitive.pointer());
      return;
    }
    const Fields part = primitive.extension(kExtension);
    out.push_back({part.text("name"), part.index("material", 1u << 30), part.flag("glossy", false)});
  });
  return out;
}

}  // namespace

BakedHeader read_baked_header(std::span<const std::uint8_t> text, Findings& findings) {
  const json root = json::parse(text.begin(), text.end(), nullptr, /*allow_exceptions=*/false);
  BakedHeader out;
  if (!at(root, kPlace).is_object()) {
    findings.fail("not_a_baked_scene", "The file has no KILN_radiance_transfer extension: Kiln did not bake it.");
    return out;
  }
  const Fields extension(at(root, kPlace), kPlace, findings);
  check_version(extension, 2, 2, findings);
  check_basis(extension, findings);
  out.shape = read_shape(extension, findings);
  if (findings.failed()) return out;
  const auto name = [&](std::size_t k) { return stored_name(out.shape, k); };
  out.form = read_form(root, extension, out.shape, name, out.components_view, findings);
  read_field(root, out, findings);
  read_glossy(root, extension, out, findings);
  out.light = read_light(root, extension, out.shape.order, findings);
  out.exposure = read_exposure(extension, findings);
  const json& provenance = at(root, "/asset/extras/kiln");
  out.provenance = provenance.is_object() ? provenance.dump(-1, ' ', false, json::error_handler_t::replace) : "{}";
  out.parts = read_parts(root, findings);
  return out;
}

}  // namespace kiln
