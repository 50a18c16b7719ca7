#include "core/bake/glossy_plan.h"

#include <algorithm>
#include <cstdio>

#include "core/prt/lobe_table.h"
#include "core/trace/surface.h"

namespace kiln {
namespace {

constexpr std::size_t kTriangles = 1024;  // of a part that are looked at
constexpr double kEnough = 0.01;          // of them

std::string text(float x) {
  char out[32];
  std::snprintf(out, sizeof out, "%.2g", double{x});
  return out;
}

bool looks_specular(const SurfaceFinish& finish) {
  return finish.roughness <= (finish.metallic >= 0.5F ? kGlossyMetal : kGlossyOther);
}

PartFinish finish_of(const Scene& scene, const std::vector<std::uint32_t>& triangles, bool all) {
  PartFinish out;
  std::size_t seen = 0, specular = 0;
  for (std::size_t i = 0; i < triangles.size(); i += 1 + triangles.size() / kTriangles, ++seen) {
    const SurfaceFinish finish = finish_at(scene, surface_point(scene, triangles[i], 1.0F / 3, 1.0F / 3));
    if (!all && !looks_specular(finish)) continue;
    ++specular;
    out.smoothest = std::min(out.smoothest, finish.roughness);
  }
  out.specular = specular > 0 && static_cast<double>(specular) >= kEnough * static_cast<double>(seen);
  if (!out.specular) out.smoothest = 1;
  return out;
}

const Material& material_of(const Scene& scene, std::size_t part) {
  return scene.materials[static_cast<std::size_t>(scene.parts[part].material)];
}

/// "'gold' and 2 more".
std::string names_of(const Scene& scene, const std::vector<PartFinish>& finish) {
  std::vector<std::string> names;
  for (std::size_t part = 0; part < finish.size(); ++part) {
    const std::string name = "'" + material_of(scene, part).name + "'";
    if (finish[part].specular && std::ranges::find(names, name) == names.end()) names.push_back(name);
  }
  return names[0] + (names.size() > 1 ? " and " + std::to_string(names.size() - 1) + " more" : "");
}

Warning too_sharp(int order, float smoothest, const std::string& names) {
  return {"glossy_blurred",
          "Reflections of " + names + " look blurred: at roughness " + text(smoothest) +
              " the lobe is sharper than the " + std::to_string(order) +
              " bands of its matrices. report.json says by how much (glossy.job_light).",
          ""};
}

GlossyDecision decide(const Scene& scene, const std::vector<PartFinish>& finish, int order, const std::string& why) {
  GlossyDecision out;
  float smoothest = 1;
  std::size_t count = 0;
  for (const PartFinish& f : finish) {
    out.plan.parts.push_back(f.specular);
    smoothest = std::min(smoothest, f.smoothest);
    count += f.specular ? 1 : 0;
  }
  out.plan.order = std::min(order, kMaxLobeOrder);
  out.plan.vertex_share = static_cast<double>(vertices_of_parts(scene.mesh, out.plan.parts).size()) /
                          static_cast<double>(std::max<std::size_t>(scene.mesh.position.size(), 1));
  const std::string names = names_of(scene, finish);
  out.value = "matrices of order " + std::to_string(out.plan.order) + " for " + std::to_string(count) + " of " +
              std::to_string(finish.size()) + " parts";
  out.reason = why + names + ", smoothest roughness " + text(smoothest);
  if (smoothest < kSharpest) out.warnings.push_back(too_sharp(out.plan.order, smoothest, names));
  return out;
}

}  // namespace

std::vector<PartFinish> find_specular_parts(const Scene& scene, bool all) {
  std::vector<std::vector<std::uint32_t>> triangles(scene.parts.size());
  for (std::uint32_t t = 0; t < scene.mesh.triangles.size(); ++t) triangles[scene.mesh.part[t]].push_back(t);
  std::vector<PartFinish> out;
  for (std::size_t part = 0; part < triangles.size(); ++part) {
    out.push_back(material_of(scene, part).unlit ? PartFinish{} : finish_of(scene, triangles[part], all));
  }
  return out;
}

std::optional<Warning> shown_as_matte(const Scene& scene) {
  const std::vector<PartFinish> finish = find_specular_parts(scene, false);
  if (std::ranges::none_of(finish, &PartFinish::specular)) return {};
  return Warning{"specular_as_matte",
                 names_of(scene, finish) +
                     ": smooth or metal, and lit as a matte surface that reflects as much. The steps prt and "
                     "lightfield show what they mirror.",
                 ""};
}

GlossyDecision plan_glossy(const Scene& scene, PrtStep::Glossy asked, int order) {
  using Glossy = PrtStep::Glossy;
  if (asked == Glossy::off) return {{}, "skipped", "turned off by the recipe: every surface is diffuse", {}};
  const std::vector<PartFinish> finish = find_specular_parts(scene, asked == Glossy::on);
  if (std::ranges::none_of(finish, [](const PartFinish& f) { return f.specular; })) {
    return {{},
            "skipped",
            asked == Glossy::on
                ? "every part is unlit"
                : "no metal of roughness up to " + text(kGlossyMetal) + ", no other surface up to " +
                      text(kGlossyOther) + ": every surface is diffuse (rougher metals at their full reflectance)",
            {}};
  }
  return decide(scene, finish, order,
                asked == Glossy::on ? "asked for by the recipe: " : "specular reflection shows on ");
}

std::vector<std::uint32_t> vertices_of_parts(const Mesh& mesh, const std::vector<bool>& parts) {
  std::vector<bool> has(mesh.position.size(), false);
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    for (const auto v : mesh.triangles[t]) has[v] = has[v] || parts[mesh.part[t]];
  }
  std::vector<std::uint32_t> out;
  for (std::uint32_t v = 0; v < has.size(); ++v) {
    if (has[v]) out.push_back(v);
  }
  return out;
}

}  // namespace kiln
