#include "core/bake/lightmap_step.h"

#include <algorithm>
#include <cmath>
#include <functional>

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
constexpr float kEdge = 0.25F;             // of the brighter of two texels and of the mean: a jump of direct light
constexpr int kParts = 4;                  // along a side of a texel at a jump
constexpr int kPartsOfSmall = 2;           // of a texel of a small chart, and of one whose centre is inside a solid
constexpr std::uint32_t kSmallChart = 64;  // texels: a chart with fewer is small

float largest(const Vec3f& x) { return std::max({std::abs(x.x), std::abs(x.y), std::abs(x.z)}); }

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
  for (const Part& part : scene.parts) look_.push_back(part_look(scene, part));
  choose_places(Tracer(scene, threads), threads);
}

/// Of map_.places: whether the chart has few texels.
std::vector<char> LightmapStep::in_small_charts() const {
  std::vector<std::uint32_t> texels(charts_.count, 0);
  for (const TexelPlace& p : map_.places) texels[charts_.of[p.triangle]] += p.inside ? 1 : 0;
  std::vector<char> out;
  for (const TexelPlace& p : map_.places) out.push_back(texels[charts_.of[p.triangle]] < kSmallChart ? 1 : 0);
  return out;
}

/// The centre of each texel, or its parts, that are not inside solids.
void LightmapStep::choose_places(const Tracer& tracer, Threads& threads) {
  const auto enclosure = enclosure_test(tracer);
  const auto point_of = [&](const TexelPlace& at) { return place_on(surface_, at.triangle, at.u, at.v); };
  std::vector<char> parted = in_small_charts();
  std::vector<Enclosure> centre(map_.places.size());
  threads.for_blocks(centre.size(), kBlock, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      centre[i] = enclosure(point_of(map_.places[i]));
      if (centre[i] != Enclosure::open) parted[i] = 1;
    }
  });
  std::vector<std::uint32_t> wanted;
  for (std::uint32_t i = 0; i < parted.size(); ++i)
    if (parted[i] != 0) wanted.push_back(i);
  const TexelParts parts(surface_, charts_, map_, wanted);
  struct Found {
    std::vector<TransferPoint> at;
    std::vector<char> backs;
  };
  std::vector<Found> found(wanted.size());
  threads.for_blocks(wanted.size(), kBlock, [&](std::size_t begin, std::size_t end) {
    for (std::size_t k = begin; k < end; ++k) {
      for (const TexelPlace& part : parts.of(k, kPartsOfSmall)) {
        const TransferPoint p = point_of(part);
        const Enclosure e = enclosure(p);
        if (e == Enclosure::solid) continue;
        found[k].at.push_back(p), found[k].backs.push_back(e == Enclosure::backs ? 1 : 0);
      }
    }
  });
  const auto chart = [&](std::size_t i) { return charts_.of[map_.places[i].triangle]; };
  std::vector<char> buried(charts_.count, 0), has_parts(charts_.count, 0);
  for (std::size_t i = 0; i < centre.size(); ++i)
    if (centre[i] != Enclosure::open) buried[chart(i)] = 1;
  for (std::size_t k = 0; k < wanted.size(); ++k)
    if (!found[k].at.empty()) has_parts[chart(wanted[k])] = 1;
  for (std::uint32_t i = 0, k = 0; i < parted.size(); ++i) {
    Found own;
    if (parted[i] != 0) own = std::move(found[k++]);
    // Beside a small chart that goes into a solid its own texels say more than the crease at its border.
    const bool beside = parted[i] != 0 && !map_.places[i].inside && has_parts[chart(i)] != 0 && buried[chart(i)] != 0;
    if (own.at.empty() && centre[i] != Enclosure::solid && !beside)
      own = {{point_of(map_.places[i])}, {static_cast<char>(centre[i] == Enclosure::backs ? 1 : 0)}};
    if (own.at.empty()) continue;
    places_.insert(places_.end(), own.at.begin(), own.at.end());
    backs_.insert(backs_.end(), own.backs.begin(), own.backs.end());
    shown_.push_back(i);
    end_.push_back(static_cast<std::uint32_t>(places_.size()));
  }
}

/// Of each place: whether it sees nothing but backs and has next to no light.
std::vector<char> LightmapStep::inside_solids(const LitPlaces& lit) const {
  double mean = 0;
  for (std::size_t i = 0; i < places_.size(); ++i) mean += double{largest(lit.direct[i] + lit.reflected[i])};
  mean /= static_cast<double>(std::max<std::size_t>(1, places_.size()));
  std::vector<char> out;
  for (std::size_t i = 0; i < places_.size(); ++i)
    out.push_back(backs_[i] != 0 && double{largest(lit.direct[i] + lit.reflected[i])} <= kDarkInside * mean ? 1 : 0);
  return out;
}

/// For each texel that is shown, over its places that are not inside solids; 0 where all are.
std::vector<Vec3f> LightmapStep::means(std::span<const Vec3f> of_places, std::span<const char> inside) const {
  std::vector<Vec3f> out;
  for (std::size_t t = 0, i = 0; t < shown_.size(); ++t) {
    Vec3f sum;
    float count = 0;
    for (; i < end_[t]; ++i) {
      if (inside[i] == 0) sum += of_places[i], count += 1;
    }
    out.push_back(count > 0 ? sum / count : Vec3f{});
  }
  return out;
}

/// Texels at jumps of direct light take its mean over their parts.
void LightmapStep::soften(const LitPlaces& lit, std::vector<Vec3f>& direct, Threads& threads) const {
  double mean = 0;
  for (const Vec3f& x : direct) mean += double{largest(x)} / static_cast<double>(direct.size());
  const std::vector<std::uint32_t> edge = edges([&](std::size_t a, std::size_t b) {
    const float apart = largest(direct[a] - direct[b]);
    return apart > kEdge * std::max({largest(direct[a]), largest(direct[b]), static_cast<float>(mean)});
  });
  std::vector<std::uint32_t> wanted;
  for (const std::uint32_t t : edge) wanted.push_back(shown_[t]);
  const TexelParts texels(surface_, charts_, map_, wanted);
  std::vector<TransferPoint> parts;
  std::vector<std::size_t> end;  // of each edge texel
  for (std::size_t k = 0; k < wanted.size(); ++k) {
    for (const TexelPlace& at : texels.of(k, kParts)) parts.push_back(place_on(surface_, at.triangle, at.u, at.v));
    end.push_back(parts.size());
  }
  const std::vector<Vec3f> light = lit.direct_at(parts);
  const auto enclosure = enclosure_test(lit.tracer);
  std::vector<Enclosure> around(parts.size());
  threads.for_blocks(parts.size(), kBlock, [&](std::size_t begin, std::size_t stop) {
    for (std::size_t k = begin; k < stop; ++k) around[k] = enclosure(parts[k]);
  });
  for (std::size_t k = 0, i = 0; k < edge.size(); ++k) {
    Vec3f sum;
    float count = 0;
    for (; i < end[k]; ++i) {
      if (around[i] == Enclosure::solid || (around[i] == Enclosure::backs && light[i] == Vec3f{})) continue;
      sum += light[i], count += 1;
    }
    if (count > 0) direct[edge[k]] = sum / count;
  }
}

/// Texels that are shown, ascending, beside which, in their own chart, one stands that `differs(a, b)` from them.
template <class Differs>
std::vector<std::uint32_t> LightmapStep::edges(const Differs& differs) const {
  constexpr std::uint32_t kNone = 0xffffffffU;
  const auto width = static_cast<std::size_t>(map_.side);
  std::vector<std::uint32_t> place(width * width, kNone);
  for (std::size_t i = 0; i < shown_.size(); ++i) place[map_.places[shown_[i]].texel] = static_cast<std::uint32_t>(i);
  const auto chart = [&](std::uint32_t p) { return charts_.of[map_.places[shown_[p]].triangle]; };
  std::vector<char> differing(shown_.size(), 0);
  const auto compare = [&](std::uint32_t a, std::uint32_t b) {
    if (a != kNone && b != kNone && chart(a) == chart(b) && differs(a, b)) differing[a] = differing[b] = 1;
  };
  for (std::size_t i = 0; i < place.size(); ++i) {
    if ((i + 1) % width != 0) compare(place[i], place[i + 1]);
    if (i + width < place.size()) compare(place[i], place[i + width]);
  }
  std::vector<std::uint32_t> out;
  for (std::uint32_t i = 0; i < differing.size(); ++i)
    if (differing[i] != 0) out.push_back(i);
  return out;
}

void LightmapStep::light(const LitPlaces& lit, Threads& threads) {
  const std::size_t count = static_cast<std::size_t>(map_.side) * static_cast<std::size_t>(map_.side);
  const std::vector<char> inside = inside_solids(lit);
  std::vector<Vec3f> direct = means(lit.direct, inside);
  const std::vector<Vec3f> reflected = means(lit.reflected, inside);
  soften(lit, direct, threads);
  lightmap_.texels.assign(count, {});
  std::vector<char> known(count, 0);
  std::vector<std::uint32_t> solid;
  for (std::size_t i = 0; i < shown_.size(); ++i) {
    const TexelPlace& at = map_.places[shown_[i]];
    if (std::all_of(inside.begin() + (i == 0 ? 0 : end_[i - 1]), inside.begin() + end_[i], std::identity{})) {
      solid.push_back(shown_[i]);
      continue;
    }
    lightmap_.texels[at.texel] = direct[i] + reflected[i];
    known[at.texel] = 1;
  }
  const std::vector<std::uint32_t> dark = out_of_reach(solid, known);
  hidden_ = map_.places.size() - static_cast<std::size_t>(std::ranges::count_if(
                                     map_.places, [&](const TexelPlace& p) { return known[p.texel] != 0; }));
  hidden_ -= dark.size();
  fill_texels(map_, charts_, std::move(known), lightmap_.texels);
  for (const std::uint32_t texel : dark) lightmap_.texels[texel] = {};
  stitch_seams(seams_, map_, lightmap_.texels);
}

/// Texels of `solid` that no known texel of their chart touches, so that filtering does not read them with one: they
/// stay black, since a dark room may look like that too.
std::vector<std::uint32_t> LightmapStep::out_of_reach(std::span<const std::uint32_t> solid,
                                                      std::span<const char> known) const {
  const int side = map_.side;
  std::vector<std::uint32_t> chart(known.size(), kNoChart);
  for (const TexelPlace& p : map_.places)
    if (known[p.texel] != 0) chart[p.texel] = charts_.of[p.triangle];
  std::vector<std::uint32_t> out;
  for (const std::uint32_t i : solid) {
    const std::uint32_t own = charts_.of[map_.places[i].triangle];
    const std::uint32_t texel = map_.places[i].texel;
    const int x = static_cast<int>(texel) % side, y = static_cast<int>(texel) / side;
    bool read = false;
    for (int row = std::max(0, y - 1); row <= std::min(side - 1, y + 1); ++row) {
      for (int column = std::max(0, x - 1); column <= std::min(side - 1, x + 1); ++column)
        read =
            read ||
            chart[static_cast<std::size_t>(row) * static_cast<std::size_t>(side) + static_cast<std::size_t>(column)] ==
                own;
    }
    if (!read) out.push_back(texel);
  }
  return out;
}

float LightmapStep::exposure() const {
  constexpr double kPercentile = 0.9;
  std::vector<float> bright;
  for (const std::uint32_t i : shown_) {
    const PartLook& look = look_[surface_.part[map_.places[i].triangle]];
    const Vec3f c = look.albedo * lightmap_.texels[map_.places[i].texel] + look.emission;
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
  out.hidden = hidden_;
  out.texels = map_.places.size() - hidden_;
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
