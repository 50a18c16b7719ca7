#include "core/bake/lightmap_step.h"

#include <algorithm>
#include <cmath>

#include "core/mesh/topology.h"
#include "core/prt/hidden.h"

namespace kiln {
namespace {

constexpr float kTolerance = 1e-3F;   // beyond [0, 1]: a border drawn on the border of the picture
constexpr double kNoticed = 1e-4;     // of texels or surface: less is rounding at the edges of triangles
constexpr double kTolerated = 0.01;   // of the texels may lie in two charts of the author's
constexpr double kTexelsAVertex = 4;  // for about the error of the vertices (README.md)
constexpr double kPackedFill = 0.7;   // of the picture that packed charts are taken to cover
constexpr int kSideStep = 64, kLeastSide = 64, kMostSide = 8192;
constexpr std::size_t kBlock = 256;
constexpr float kEdge = 0.25F;  // of the brighter of two texels and of the mean: a jump of direct light
constexpr int kParts = 4;       // along a side of a texel at a jump

std::string percent(double share) { return short_text(100 * share) + " %"; }

bool samples_second_set(const Material& m) {
  const auto uses = [](const TextureRef& ref) { return ref.texture >= 0 && ref.uv_set == 1; };
  return uses(m.base_color_texture) || uses(m.metallic_roughness_texture) || uses(m.emission_texture) ||
         uses(m.normal_texture);
}

std::vector<char> shown_triangles(const Mesh& mesh, const std::vector<char>& parts) {
  std::vector<char> out(mesh.triangles.size());
  for (std::size_t t = 0; t < out.size(); ++t) out[t] = parts[mesh.part[t]];
  return out;
}

/// What the coordinates say of the layout.
struct Coordinates {
  bool inside = true;  // [0, 1]
  double area = 0;     // of the picture under triangles
  double flat = 0;     // of the surface whose triangles have no area there
};

Coordinates look_at(const Mesh& mesh, const UvCharts& charts) {
  Coordinates out;
  double surface = 0;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    if (charts.of[t] == kNoChart) continue;
    std::array<Vec2d, 3> uv;
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec2f& c = mesh.uv1[mesh.triangles[t][k]];
      uv[k] = {c.x, c.y};
      const auto [low, high] = std::minmax({c.x, c.y});
      out.inside = out.inside && low >= -kTolerance && high <= 1 + kTolerance;
    }
    const double area = 0.5 * std::abs(cross(uv[1] - uv[0], uv[2] - uv[0]));
    const double of_surface = triangle_area(mesh, mesh.triangles[t]);
    out.area += area, surface += of_surface;
    if (!(area > 0)) out.flat += of_surface;
  }
  if (surface > 0) out.flat /= surface;
  return out;
}

int side_for(double texels, double covered) {
  const double side = std::sqrt(texels / std::max(covered, 1e-3));
  const double steps = std::ceil(std::min(side, double{kMostSide}) / kSideStep);
  return std::clamp(static_cast<int>(steps) * kSideStep, kLeastSide, kMostSide);
}

void warn(Plan& plan, std::string code, std::string message) {
  plan.warnings.push_back({std::move(code), std::move(message), "/steps/0/deliver"});
}

std::string names_of(const Scene& scene, const std::vector<char>& marked) {
  constexpr int kMost = 5;
  std::string out;
  int count = 0;
  for (std::size_t i = 0; i < marked.size(); ++i) {
    if (marked[i] == 0) continue;
    if (++count <= kMost)
      out += (out.empty() ? "" : ", ") + (scene.parts[i].name.empty() ? "(no name)" : scene.parts[i].name);
  }
  return count > kMost ? out + " and " + std::to_string(count - kMost) + " more" : out;
}

/// The parts of `parts` that may not get other coordinates, since their textures lie there, leave it.
void leave_textured(const Scene& scene, std::vector<char>& parts, Plan& plan) {
  std::vector<char> left(parts.size(), 0);
  for (std::size_t i = 0; i < parts.size(); ++i) {
    const Material& material = scene.materials[static_cast<std::size_t>(scene.parts[i].material)];
    if (parts[i] == 0 || !samples_second_set(material)) continue;
    left[i] = 1, parts[i] = 0;
  }
  if (std::ranges::count(left, 1) == 0) return;
  warn(plan, "lightmap_coordinates_in_use",
       "Textures lie on TEXCOORD_1 of " + names_of(scene, left) +
           ", which is no layout for one lightmap: these parts keep the light of their vertices.");
}

bool any(const std::vector<char>& flags) { return std::ranges::count(flags, 1) > 0; }

/// The author's layout, or why it is none: empty where it is kept.
std::string reason_to_pack(const Mesh& mesh, const UvCharts& charts, const Coordinates& found, int side) {
  if (!found.inside) return "TEXCOORD_1 leaves [0, 1]";
  const TexelMap map = map_texels(mesh, charts, side);
  const double across = map.inside > 0 ? double(map.across) / double(map.inside) : 0;
  return across > kTolerated ? percent(across) + " of the texels lie in two charts" : std::string{};
}

void warn_of_map(const TexelMap& map, const Coordinates& found, Plan& plan) {
  const double twice = map.inside > 0 ? double(map.within + map.across) / double(map.inside) : 0;
  if (twice > kNoticed)
    warn(plan, "lightmap_charts_overlap",
         percent(twice) + " of the texels lie in two triangles: they show the light of one of them.");
  if (found.flat > kNoticed)
    warn(plan, "lightmap_charts_flat",
         percent(found.flat) + " of the surface has no area in TEXCOORD_1: it shows the light of a line or a dot.");
}

/// As vertex_point: leaning to the middle of its face.
TransferPoint place_on(const Mesh& mesh, std::uint32_t triangle, float u, float v) {
  const Triangle& t = mesh.triangles[triangle];
  const float w = 1 - u - v;
  const auto mix = [&](const std::vector<Vec3f>& x) { return x[t[0]] * w + x[t[1]] * u + x[t[2]] * v; };
  const Vec3f normal = normalized(mix(mesh.normal), mesh.normal[t[0]]);
  return {mix(mesh.position), normal, centroid(mesh, t), normalized(area_vector(mesh, t), normal)};
}

constexpr double kPixelBytes = 110;  // while a picture is laid out, filled, written and read back

/// Before anything of its size is made.
Result<void> check_picture(int side, const Plan& plan, const Limits& limits) {
  const double bytes = static_cast<double>(plan.prediction.memory_bytes) + kPixelBytes * side * side;
  if (bytes <= static_cast<double>(limits.memory_mb << 20)) return {};
  return fault("memory_limit",
               "a lightmap of " + std::to_string(side) + " x " + std::to_string(side) + " would need about " +
                   std::to_string(static_cast<std::uint64_t>(bytes) >> 20) +
                   " MB with the bake and limits.memory_mb allows " + std::to_string(limits.memory_mb) +
                   " MB; lower /steps/0/lightmap/size, or raise the limit",
               "/steps/0/lightmap/size");
}

/// Seconds, memory and bytes of so many texels: as of vertices, and the picture. Measured on Cornell and the chair.
void add_prediction(Prediction& out, const PointCosts& costs, std::size_t places, int side) {
  constexpr double kReadingSeconds = 12e-6;  // of reflected light, at one place
  const double n = static_cast<double>(places), pixels = double(side) * side;
  const auto whole = [](double x) { return static_cast<std::uint64_t>(x); };
  out.rays += whole(n * costs.sky_rays);
  out.seconds += n * (costs.sky_seconds + kReadingSeconds) + 4e-7 * pixels;
  out.memory_bytes += whole(420 * n + kPixelBytes * pixels);
  out.artifact_bytes += whole(8 * pixels);
}

}  // namespace

Result<void> plan_lightmap(const Scene& scene, const Recipe& recipe, Plan& plan) {
  const RadiosityStep& step = *recipe.radiosity;
  const Mesh& mesh = scene.mesh;
  LightmapPlan out;
  std::vector<char> missing;
  for (const Part& part : scene.parts) {
    out.parts.push_back(part.has_uv1 ? 1 : 0);
    missing.push_back(part.has_uv1 ? 0 : 1);
  }
  const auto refuse = [](const std::string& what) {
    return fault("no_lightmap_coordinates",
                 what + "; take lightmap out of /steps/0/deliver, or unwrap the model into TEXCOORD_1",
                 "/steps/0/deliver");
  };
  if (!any(out.parts)) return refuse("no primitive has TEXCOORD_1, which a lightmap lies on");
  if (any(missing))
    warn(plan, "lightmap_parts_missing",
         "No TEXCOORD_1 on " + names_of(scene, missing) + ": these parts keep the light of their vertices.");

  UvCharts charts = find_uv_charts(mesh, shown_triangles(mesh, out.parts));
  Coordinates found = look_at(mesh, charts);
  const double vertices = 0.55 * static_cast<double>(mesh.triangles.size() + plan.triangles_of_quality);
  const double wanted = kTexelsAVertex * vertices;
  out.side = step.lightmap_size.value_or(side_for(wanted, found.area));
  if (auto fits = check_picture(out.side, plan, recipe.limits); !fits) return fits;
  const std::string reason = reason_to_pack(mesh, charts, found, out.side);
  Mesh laid_out = mesh;
  if (!reason.empty()) {
    leave_textured(scene, out.parts, plan);
    if (!any(out.parts)) return refuse(reason + ", and textures lie there");
    out.side = step.lightmap_size.value_or(side_for(wanted, kPackedFill));
    if (auto fits = check_picture(out.side, plan, recipe.limits); !fits) return fits;
    charts = find_uv_charts(mesh, shown_triangles(mesh, out.parts));
    auto packed = pack_uv_charts(mesh, charts, out.side);
    if (!packed)
      return fault("lightmap_too_small",
                   "the " + std::to_string(charts.count) + " charts of TEXCOORD_1 do not fit into " +
                       std::to_string(out.side) + " x " + std::to_string(out.side) +
                       " texels; raise /steps/0/lightmap/size (at most 8192)",
                   "/steps/0/lightmap/size");
    warn(plan, "lightmap_charts_packed",
         reason + ": charts were packed anew, and TEXCOORD_1 of scene.glb is that of the lightmap.");
    laid_out.uv1 = *packed;
    out.uv1 = std::move(*packed);
    found = look_at(laid_out, charts);
  }
  const TexelMap map = map_texels(laid_out, charts, out.side);
  warn_of_map(map, found, plan);
  decide(plan, "lightmap", std::to_string(out.side) + " x " + std::to_string(out.side),
         step.lightmap_size ? "asked for by the recipe"
                            : "about " + short_text(kTexelsAVertex) + " texels for each vertex of this quality");
  decide(plan, "lightmap charts", std::to_string(charts.count),
         reason.empty() ? "the layout of TEXCOORD_1 is kept" : "packed anew: " + reason);
  add_prediction(plan.prediction, plan.costs, map.places.size(), out.side);
  plan.lightmap = std::move(out);
  return {};
}

LightmapStep::LightmapStep(const Scene& scene, const Plan& plan, Threads& threads) : surface_(scene.mesh) {
  const Mesh& mesh = surface_;
  const LightmapPlan& p = *plan.lightmap;
  charts_ = find_uv_charts(mesh, shown_triangles(mesh, p.parts));
  map_ = map_texels(mesh, charts_, p.side);
  seams_ = find_seams(mesh, charts_, p.side);
  lightmap_ = {.side = p.side, .texels = {}, .parts = p.parts};
  written_.assign(scene.parts.size(), 0);
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    written_[mesh.part[t]] = 1;
    if (charts_.of[t] != kNoChart)
      area_ += triangle_area(mesh, mesh.triangles[t]) * scene.frame.scale * scene.frame.scale;
  }
  const Tracer tracer(scene, threads);
  const HiddenTest hidden = hidden_test(tracer);
  std::vector<TransferPoint> all(map_.places.size());
  std::vector<char> seen(all.size(), 0);
  threads.for_blocks(all.size(), kBlock, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const TexelPlace& at = map_.places[i];
      all[i] = place_on(mesh, at.triangle, at.u, at.v);
      seen[i] = hidden(all[i]) ? 0 : 1;
    }
  });
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (seen[i] == 0) continue;
    places_.push_back(all[i]);
    look_.push_back(part_look(scene, scene.parts[mesh.part[map_.places[i].triangle]]));
    of_map_.push_back(static_cast<std::uint32_t>(i));
  }
}

/// Places all over texel `place`, as far as its own triangle reaches.
void LightmapStep::add_parts(std::size_t place, std::vector<TransferPoint>& out) const {
  const TexelPlace& at = map_.places[of_map_[place]];
  std::array<Vec2d, 3> c;  // in texels
  for (std::size_t k = 0; k < 3; ++k) {
    const Vec2f& uv = surface_.uv1[surface_.triangles[at.triangle][k]];
    c[k] = {double{uv.x} * map_.side, double{uv.y} * map_.side};
  }
  const Vec2d e1 = c[1] - c[0], e2 = c[2] - c[0];
  const double twice = cross(e1, e2);
  if (twice == 0) return;
  for (int part = 0; part < kParts * kParts; ++part) {
    const int column = part % kParts, row = part / kParts;
    const Vec2d off{(column + 0.5) / kParts - 0.5, (row + 0.5) / kParts - 0.5};
    const double u = double{at.u} + cross(off, e2) / twice, v = double{at.v} + cross(e1, off) / twice;
    if (u >= 0 && v >= 0 && u + v <= 1)
      out.push_back(place_on(surface_, at.triangle, static_cast<float>(u), static_cast<float>(v)));
  }
}

std::vector<Vec3f> LightmapStep::softened(const LitPlaces& lit, Threads& threads) const {
  std::vector<Vec3f> out(lit.direct.begin(), lit.direct.end());
  const auto largest = [](const Vec3f& x) { return std::max({std::abs(x.x), std::abs(x.y), std::abs(x.z)}); };
  double mean = 0;
  for (const Vec3f& x : out) mean += double{largest(x)} / static_cast<double>(out.size());
  const std::vector<char> edge = edges([&](std::size_t a, std::size_t b) {
    const float apart = largest(lit.direct[a] - lit.direct[b]);
    return apart > kEdge * std::max({largest(lit.direct[a]), largest(lit.direct[b]), static_cast<float>(mean)});
  });
  std::vector<TransferPoint> parts;
  std::vector<std::uint32_t> of;  // the place of each
  for (std::size_t i = 0; i < edge.size(); ++i) {
    if (edge[i] != 0) add_parts(i, parts);
    of.resize(parts.size(), static_cast<std::uint32_t>(i));
  }
  const std::vector<Vec3f> light = lit.direct_at(parts);
  const HiddenTest hidden = hidden_test(lit.tracer);
  std::vector<char> seen(parts.size());
  threads.for_blocks(parts.size(), kBlock, [&](std::size_t begin, std::size_t end) {
    for (std::size_t k = begin; k < end; ++k) seen[k] = hidden(parts[k]) ? 0 : 1;
  });
  for (std::size_t k = 0; k < parts.size();) {
    const std::uint32_t place = of[k];
    Vec3f sum;
    float count = 0;
    for (; k < parts.size() && of[k] == place; ++k) {
      if (seen[k] != 0) sum += light[k], count += 1;
    }
    if (count > 0) out[place] = sum / count;
  }
  return out;
}

/// Places beside which, in their own chart, one stands that `differs(a, b)` from them.
template <class Differs>
std::vector<char> LightmapStep::edges(const Differs& differs) const {
  constexpr std::uint32_t kNone = 0xffffffffU;
  const auto width = static_cast<std::size_t>(map_.side);
  std::vector<std::uint32_t> place(width * width, kNone);
  for (std::size_t i = 0; i < of_map_.size(); ++i) place[map_.places[of_map_[i]].texel] = static_cast<std::uint32_t>(i);
  const auto chart = [&](std::uint32_t p) { return charts_.of[map_.places[of_map_[p]].triangle]; };
  std::vector<char> out(of_map_.size(), 0);
  const auto compare = [&](std::uint32_t a, std::uint32_t b) {
    if (a != kNone && b != kNone && chart(a) == chart(b) && differs(a, b)) out[a] = out[b] = 1;
  };
  for (std::size_t i = 0; i < place.size(); ++i) {
    if ((i + 1) % width != 0) compare(place[i], place[i + 1]);
    if (i + width < place.size()) compare(place[i], place[i + width]);
  }
  return out;
}

void LightmapStep::light(const LitPlaces& lit, Threads& threads) {
  const std::size_t count = static_cast<std::size_t>(map_.side) * static_cast<std::size_t>(map_.side);
  const std::vector<Vec3f> direct = softened(lit, threads);
  lightmap_.texels.assign(count, {});
  std::vector<char> known(count, 0);
  for (std::size_t i = 0; i < direct.size(); ++i) {
    const std::uint32_t texel = map_.places[of_map_[i]].texel;
    lightmap_.texels[texel] = direct[i] + lit.reflected[i];
    known[texel] = 1;
  }
  fill_texels(map_, charts_, std::move(known), lightmap_.texels);
  stitch_seams(seams_, map_, lightmap_.texels);
}

float LightmapStep::exposure() const {
  constexpr double kPercentile = 0.9;
  std::vector<float> bright;
  for (std::size_t i = 0; i < places_.size(); ++i) {
    const Vec3f c = look_[i].albedo * lightmap_.texels[map_.places[of_map_[i]].texel] + look_[i].emission;
    if (const float most = std::max({c.x, c.y, c.z}); most > 0) bright.push_back(most);
  }
  if (bright.empty()) return 1;
  const auto at = bright.begin() + static_cast<std::ptrdiff_t>(kPercentile * static_cast<double>(bright.size() - 1));
  std::nth_element(bright.begin(), at, bright.end());
  return exposure_for(*at);
}

Result<LightmapOutcome> LightmapStep::finish(Bytes& glb, const Job& job, BakeLog& log, Threads& threads) const {
  LightmapOutcome out;
  const std::size_t before = glb.size();
  KILN_TRY(with, add_lightmap(glb, lightmap_, written_));
  glb = std::move(with);
  out.image_bytes = glb.size() - before;
  out.exr = write_lightmap_exr(lightmap_, job.provenance);
  KILN_TRY(image, read_lightmap(glb));
  KILN_TRY(exact, read_lightmap_exr(out.exr, "lightmap.exr"));
  exact.parts = image.parts;
  out.texels = places_.size();
  out.hidden = map_.places.size() - places_.size();
  out.seam_places = seams_.size();
  out.texels_per_metre = area_ > 0 ? std::sqrt(static_cast<double>(map_.inside) / area_) : 0;
  if (job.recipe.certificate) {
    out.certificate = certify_lightmap(
        {job.decoded, exact, image, job.truth, job.sky, job.bounces, log.rays(), job.recipe.seed}, threads);
  }
  out.lightmap = std::move(exact);
  return out;
}

}  // namespace kiln
