#include "core/artifact/points_glb.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <nlohmann/json.hpp>

#include "core/artifact/glb.h"
#include "core/artifact/glb_arrays.h"
#include "core/artifact/glb_extension.h"

namespace kiln {
namespace {

using json = nlohmann::ordered_json;

constexpr const char* kName = "KILN_meshless_light";
constexpr const char* kPlace = "/extensions/KILN_meshless_light";
constexpr float kFarOut = 4, kMostRadius = 4, kMostLight = 1e30F;  // lengths of the unit cube

static_assert(sizeof(RowSite) == 16 && sizeof(Vec3f) == 12);

template <class T>
std::size_t add_view(json& document, Bytes& binary, const std::vector<T>& numbers) {
  binary.resize((binary.size() + 3) / 4 * 4, 0);
  const std::size_t bytes = numbers.size() * sizeof(T), at = binary.size();
  document["bufferViews"].push_back({{"buffer", 0}, {"byteOffset", at}, {"byteLength", bytes}});
  binary.resize(at + bytes);
  std::memcpy(binary.data() + at, numbers.data(), bytes);
  return document["bufferViews"].size() - 1;
}

bool good_site(const RowSite& s) {
  const Vec3f& p = s.position;
  return is_finite(p) && std::max({std::abs(p.x), std::abs(p.y), std::abs(p.z)}) <= kFarOut &&
         std::ranges::any_of(s.normal, [](std::int8_t n) { return n != 0; });
}

bool good_light(const Vec3f& x) {
  return is_finite(x) && std::max({std::abs(x.x), std::abs(x.y), std::abs(x.z)}) <= kMostLight;
}

/// Levels ascend one by one, each begins where the one before ends, and each site says its own.
void check(const PointField& field, Findings& findings) {
  const std::size_t count = field.sites.size();
  const auto fail = [&](const char* code, const char* what, const char* where) {
    findings.fail(code, what, std::string(kPlace) + where);
  };
  if (field.radius.size() != count || field.coefficients.size() != count)
    fail("slot_count_mismatch", "Each point has a site, a radius and a coefficient.", "/bufferViews");
  bool ascend = field.level_end.size() <= std::size_t{kMaxPointLevels} + 1 &&
                (count == 0 ? field.level_end.empty() || field.level_end.back() == 0
                            : !field.level_end.empty() && field.level_end.back() == count);
  std::uint32_t begin = 0;
  for (std::size_t level = 0; ascend && level < field.level_end.size(); ++level) {
    ascend = field.level_end[level] >= begin;
    for (std::uint32_t p = begin; ascend && p < field.level_end[level]; ++p) ascend = field.sites[p].level == level;
    begin = field.level_end[level];
  }
  if (!ascend) fail("index_out_of_range", "The levels do not ascend to the number of points.", "/levels");
  if (!std::ranges::all_of(field.sites, good_site))
    fail("number_out_of_range", "A site is not near the unit cube, or has no normal.", "/bufferViews/sites");
  if (!std::ranges::all_of(field.radius, [](float r) { return r > 0 && r <= kMostRadius; }))
    fail("number_out_of_range", "A radius is not in its range.", "/bufferViews/radii");
  if (!std::ranges::all_of(field.coefficients, good_light))
    fail("number_out_of_range", "A coefficient is not finite or too large.", "/bufferViews/coefficients");
}

PointField points_in(const Fields& extension, const gltf::BufferBytes& bytes, Findings& findings) {
  const std::uint64_t version = extension.count("version", 0);
  if (version != 1 && version != kPointsVersion)
    findings.fail("unsupported_version", "Only versions 1 and 2 of KILN_meshless_light are read.",
                  extension.pointer("version"));
  if (findings.failed() || version != kPointsVersion) return {};
  PointField out;
  for (const int end : extension.indices("levels", (std::size_t{1} << 31) - 1))
    out.level_end.push_back(static_cast<std::uint32_t>(end));
  const Fields views = extension.object("bufferViews");
  const ArrayViews from(views, bytes, findings);
  out.sites = from.take<RowSite>("sites");
  out.radius = from.take<float>("radii");
  out.coefficients = from.take<Vec3f>("coefficients");
  if (!findings.failed()) check(out, findings);
  return out;
}

}  // namespace

Result<Bytes> add_points(std::span<const std::uint8_t> glb, const PointField& field) {
  KILN_TRY(chunks, split_glb(glb));
  json document = json::parse(chunks.json);
  Bytes binary(chunks.binary.begin(), chunks.binary.end());
  json extension = {{"version", kPointsVersion},
                    {"units", "W m^-2 sr^-1 of value = irradiance / pi; lengths of the unit cube"},
                    {"levels", field.level_end}};
  if (!field.sites.empty()) {
    extension["bufferViews"]["sites"] = add_view(document, binary, field.sites);
    extension["bufferViews"]["radii"] = add_view(document, binary, field.radius);
    extension["bufferViews"]["coefficients"] = add_view(document, binary, field.coefficients);
  }
  document["extensions"][kName] = std::move(extension);
  document["extensionsUsed"].push_back(kName);
  std::sort(document["extensionsUsed"].begin(), document["extensionsUsed"].end());
  document["buffers"][0]["byteLength"] = (binary.size() + 3) / 4 * 4;
  return join_glb(document.dump(-1, ' ', false, json::error_handler_t::replace), std::move(binary));
}

Result<PointField> read_points(std::span<const std::uint8_t> glb) {
  Findings findings("scene.glb");
  PointField out;
  read_root_extension(glb, kName, findings, [&](const Fields& extension, const gltf::BufferBytes& bytes) {
    out = points_in(extension, bytes, findings);
  });
  if (findings.failed()) return tl::make_unexpected(findings.fault());
  return out;
}

}  // namespace kiln
