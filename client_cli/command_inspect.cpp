// kiln inspect FILE: what an artefact (or a plain scene) holds.
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <tuple>

#include "client_cli/commands.h"
#include "client_cli/files.h"
#include "client_cli/models.h"
#include "client_cli/report_text.h"

namespace kiln {
namespace {

using nlohmann::json;

json scene_facts(const Scene& scene) {
  std::uint64_t image_bytes = 0;
  for (const Image& image : scene.images) image_bytes += image.encoded.size();
  json warnings = json::array();
  for (const Warning& w : scene.warnings)
    warnings.push_back({{"code", w.code}, {"message", w.message}, {"where", w.where}});
  return {{"triangles", scene.mesh.triangles.size()},
          {"vertices", scene.mesh.position.size()},
          {"parts", scene.parts.size()},
          {"materials", scene.materials.size()},
          {"textures", scene.textures.size()},
          {"images", scene.images.size()},
          {"image_bytes", image_bytes},
          {"lights", scene.lights.size()},
          {"world_center", {scene.frame.center.x, scene.frame.center.y, scene.frame.center.z}},
          {"world_size", scene.frame.scale},
          {"warnings", warnings}};
}

/// The radiance functions at the vertices, or null.
json field_facts(const LightField& field) {
  if (field.coefficients.empty()) return nullptr;
  return {{"degree", field.degree}, {"coefficients", 3 * field.count()}, {"vertices", field.vertices()}};
}

/// The meshes of the scene that viewers show; an artefact has its geometry a second time with the original materials.
json shown_meshes(const json& gltf) {
  json meshes = gltf.value("meshes", json::array());
  if (!gltf.contains("scenes") || gltf["scenes"].size() < 2) return meshes;
  json shown = json::array();
  for (const json& node : gltf["scenes"][0].value("nodes", json::array())) {
    const json& used = gltf.at("nodes").at(node.get<std::size_t>());
    if (used.contains("mesh")) shown.push_back(meshes.at(used["mesh"].get<std::size_t>()));
  }
  return shown;
}

/// Every attribute with its type and its number of elements over all primitives.
json attributes_of(const json& gltf) {
  json out = json::object();
  const json meshes = shown_meshes(gltf);
  for (const json& mesh : meshes) {
    for (const json& primitive : mesh.at("primitives")) {
      for (const auto& [name, accessor] : primitive.at("attributes").items()) {
        const json& used = gltf.at("accessors").at(accessor.get<std::size_t>());
        out[name]["type"] = used.at("type");
        out[name]["elements"] = out[name].value("elements", std::uint64_t{0}) + used.at("count").get<std::uint64_t>();
      }
    }
  }
  return out;
}

/// Bytes of compressed geometry. Several views may name the same bytes.
std::uint64_t draco_bytes(const json& gltf) {
  std::map<std::uint64_t, std::uint64_t> length_at;
  const json meshes = gltf.value("meshes", json::array());
  for (const json& mesh : meshes) {
    for (const json& primitive : mesh.at("primitives")) {
      const auto pointer = json::json_pointer("/extensions/KHR_draco_mesh_compression/bufferView");
      if (!primitive.contains(pointer)) continue;
      const json& view = gltf.at("bufferViews").at(primitive[pointer].get<std::size_t>());
      length_at[view.value("byteOffset", std::uint64_t{0})] = view.at("byteLength").get<std::uint64_t>();
    }
  }
  std::uint64_t bytes = 0;
  for (const auto& [offset, length] : length_at) bytes += length;
  return bytes;
}

/// "_PRT_10" after "_PRT_9".
bool natural_less(const std::string& a, const std::string& b) {
  const auto split = [](const std::string& name) {
    const auto digits = name.find_last_not_of("0123456789") + 1;
    return std::make_tuple(name.substr(0, digits), name.size(), name);
  };
  return split(a) < split(b);
}

json light_facts(const BakedScene& baked) {
  const Transfer& t = baked.transfer;
  return {{"order", t.order},           {"coefficients", sh_count(t.order)},
          {"channels", t.channels},     {"fixed", t.fixed},
          {"slots", t.slots()},         {"baked_light", baked.light.name},
          {"exposure", baked.exposure}, {"provenance", json::parse(baked.provenance, nullptr, false)}};
}

json certificate_beside(const std::string& path, const char* pointer) {
  const auto report = (std::filesystem::path(path).parent_path() / "report.json").string();
  if (!file_exists(report)) return nullptr;
  const auto text = read_text(report);
  const json document = text ? json::parse(*text, nullptr, false) : json();
  const json::json_pointer place(pointer);
  return document.is_object() && document.contains(place) ? document[place] : json();
}

json grid_facts(const Grid& grid) {
  const Vec3d &origin = grid.lattice.origin, &spacing = grid.lattice.spacing;
  return {{"size", grid.lattice.size},
          {"origin", {origin.x, origin.y, origin.z}},
          {"spacing", {spacing.x, spacing.y, spacing.z}},
          {"blend", grid.blend == GridBlend::exact ? "exact" : "paper"},
          {"content", grid.content == GridContent::indirect ? "indirect" : "all"},
          {"corners", !grid.cells.empty()}};
}

json facts_of_json(std::string_view text) {
  const json gltf = json::parse(text, nullptr, false);
  if (!gltf.is_object()) return json::object();
  try {
    const json none;
    const json::json_pointer carried("/extensions/KILN_radiance_functions");
    return {{"radiance_functions", gltf.contains(carried) ? gltf[carried] : none},
            {"attributes", attributes_of(gltf)},
            {"draco_bytes", draco_bytes(gltf)},
            {"extensions", gltf.value("extensionsUsed", json::array())}};
  } catch (const json::exception&) {  // the readers have judged this file; facts of a strange one are just left out
    return json::object();
  }
}

Outcome<json> facts_of(const std::string& path) {
  KILN_TRY(bytes, read_file(path));
  json facts = {{"file", base_name(path)}, {"bytes", bytes.size()}};
  if (kind_of(bytes) == FileKind::artefact) {
    KILN_TRY(baked, load_artefact(path));
    facts["kind"] = "artefact";
    facts["light"] = light_facts(baked);
    facts["light_field"] = field_facts(baked.field);
    const bool lit = !baked.field.coefficients.empty();
    facts["certificate"] = certificate_beside(path, lit ? "/lightfield/certificate" : "/certificate");
    if (facts["certificate"].is_null()) facts["certificate"] = certificate_beside(path, "/lightmap/certificate");
    facts.update(scene_facts(baked.scene));
    facts["bytes_per_vertex"] = static_cast<double>(bytes.size()) /
                                static_cast<double>(std::max<std::size_t>(1, baked.scene.mesh.position.size()));
  } else if (kind_of(bytes) == FileKind::grid) {
    KILN_TRY(grid, load_grid(path));
    facts["kind"] = "grid";
    facts["grid"] = grid_facts(grid);
    facts["bytes_per_vertex"] = static_cast<double>(bytes.size()) / static_cast<double>(grid.lattice.vertices());
    facts["certificate"] = certificate_beside(path, "/grid/certificate");
    return facts;
  } else {
    KILN_TRY(lit, load_lit_scene(path));
    facts["kind"] = "scene";
    facts["light_field"] = field_facts(lit.field);
    facts.update(scene_facts(lit.scene));
  }
  facts.update(facts_of_json(gltf_json(bytes)));
  return facts;
}

std::string line(const char* name, const std::string& value) {
  char text[64];
  std::snprintf(text, sizeof text, "%-14s ", name);
  return text + value + "\n";
}

std::string count(const json& facts, const char* name) { return facts[name].dump() + " " + name; }

std::string light_lines(const json& light) {
  const std::string channels = light["channels"] == 1 ? "grey" : "RGB";
  std::string out =
      light["order"] == 0
          ? line("radiosity", channels + ", the light of one job, which cannot be turned")
          : line("transfer", "order " + light["order"].dump() + ": " + light["coefficients"].dump() +
                                 " coefficients, " + channels +
                                 (light["fixed"] == true ? ", and the light of the scene's own lamps" : ""));
  const auto name = light["baked_light"].get<std::string>();
  out += line("baked light", name.empty() ? "none" : name);
  if (light["provenance"].is_object() && !light["provenance"].empty())
    out += line("provenance", light["provenance"].dump());
  return out;
}

std::string field_line(const json& facts) {
  const json field = facts.value("light_field", json());
  if (!field.is_object()) return {};
  const json declared = facts.value("radiance_functions", json());
  std::string basis = "harmonics, reflected";
  if (declared.is_object())
    basis = declared.value("basis", "") + std::string(declared.value("reflected", false) ? ", reflected" : "");
  return line("carries", "radiance functions of degree " + field["degree"].dump() + " at " + field["vertices"].dump() +
                             " vertices (" + basis + "); the step lightfield simplifies them");
}

std::string grid_text(const json& facts) {
  const json& grid = facts["grid"];
  return line("grid",
              grid["size"].dump() + " vertices, " + grid["spacing"].dump() + " apart from " + grid["origin"].dump()) +
         line("light", grid["content"].get<std::string>() + ", " + grid["blend"].get<std::string>() + " blend" +
                           (grid["corners"] == true ? ", corners that count" : "")) +
         line("certificate", facts["certificate"].is_object()
                                 ? certificate_text(json{{"certificate", facts["certificate"]}}.dump())
                                 : "none beside this file");
}

std::string facts_text(const json& facts) {
  std::string out = line("file", facts["file"].get<std::string>() + " (" + facts["kind"].get<std::string>() + "), " +
                                     human_bytes(facts["bytes"].get<double>()));
  if (facts.contains("grid")) return out + grid_text(facts);
  out += line("geometry", count(facts, "triangles") + ", " + count(facts, "vertices") + ", " + count(facts, "parts"));
  out += line("looks", count(facts, "materials") + ", " + count(facts, "textures") + ", " + count(facts, "lights") +
                           "; " + human_bytes(facts["image_bytes"].get<double>()) + " of images");
  out += line("world size", facts["world_size"].dump());
  if (facts.contains("light")) out += light_lines(facts["light"]);
  out += field_line(facts);
  if (facts.contains("draco_bytes") && facts["draco_bytes"] != 0)
    out += line("draco", human_bytes(facts["draco_bytes"].get<double>()));
  if (facts.contains("bytes_per_vertex")) {
    char text[32];
    std::snprintf(text, sizeof text, "%.1f", facts["bytes_per_vertex"].get<double>());
    out += line("per vertex", text + std::string(" bytes"));
  }
  const json attributes = facts.value("attributes", json::object());
  std::vector<std::string> names;
  for (const auto& item : attributes.items()) names.push_back(item.key());
  std::sort(names.begin(), names.end(), natural_less);
  for (const std::string& name : names) {
    const json& attribute = attributes[name];
    out += line("attribute", name + " " + attribute["type"].get<std::string>() + " x " + attribute["elements"].dump());
  }
  for (const json& w : facts["warnings"])
    out += line("warning", w["where"].get<std::string>() + " " + w["message"].get<std::string>());
  if (facts.contains("certificate"))
    out += line("certificate", facts["certificate"].is_object()
                                   ? certificate_text(json{{"certificate", facts["certificate"]}}.dump())
                                   : "none beside this file");
  return out;
}

}  // namespace

Outcome<ExitCode> run(const InspectOptions& options, Session& session) {
  KILN_TRY(facts, facts_of(options.file));
  const auto replace = json::error_handler_t::replace;
  const Outcome<void> written =
      write_text("", session.common.json ? facts.dump(-1, ' ', false, replace) + "\n" : facts_text(facts));
  if (!written) return tl::make_unexpected(written.error());
  return ExitCode::ok;
}

}  // namespace kiln
