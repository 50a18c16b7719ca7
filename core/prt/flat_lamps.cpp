#include "core/prt/flat_lamps.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

#include "core/base/expects.h"
#include "core/base/random.h"
#include "core/mesh/topology.h"
#include "core/prt/morton.h"
#include "core/sphere/sampling.h"

namespace kiln {
namespace {

constexpr double kShortfall = 1 - 4e-6;  // a shadow ray ends this fraction before its lamp, which would stop it
constexpr double kLeft = 0.7;            // as of other lamps (lamps.cpp)
constexpr double kFlat = 1e-6;           // of the unit cube: how far a lamp's triangles may leave its plane

/// One edge's term of Lambert's sum.
double edge_term(const Vec3d& a, const Vec3d& b, const Vec3d& n) {
  const Vec3d side = cross(a, b);
  const double sine = length(side);
  if (!(sine > 0)) return 0;  // seen end on
  return std::atan2(sine, dot(a, b)) * (dot(side, n) / sine);
}

const Material& material_of(const Scene& scene, std::uint32_t triangle) {
  return scene.materials[static_cast<std::size_t>(scene.parts[scene.mesh.part[triangle]].material)];
}

}  // namespace

double loop_form_factor(std::span<const Vec3d> loop, const Vec3d& at, const Vec3d& n) {
  double sum = 0;
  std::optional<Vec3d> left, first_back;  // where the loop sank below the horizon, and first came back above it
  for (std::size_t k = 0; k < loop.size(); ++k) {
    const Vec3d a = loop[k] - at, b = loop[(k + 1) % loop.size()] - at;
    const double up_a = dot(a, n), up_b = dot(b, n);
    if (up_a < 0 && up_b < 0) continue;
    if (up_a >= 0 && up_b >= 0) {
      sum += edge_term(a, b, n);
      continue;
    }
    const Vec3d crossing = a + (b - a) * (up_a / (up_a - up_b));
    if (up_a >= 0) {
      sum += edge_term(a, crossing, n);
      left = crossing;
    } else {
      if (left) {
        sum += edge_term(*left, crossing, n);
        left.reset();
      } else {
        first_back = crossing;
      }
      sum += edge_term(crossing, b, n);
    }
  }
  if (left && first_back) sum += edge_term(*left, *first_back, n);
  return sum / (2 * std::numbers::pi);
}

std::optional<FlatLamps> FlatLamps::find(const Tracer& tracer) {
  if (tracer.emitters().empty()) return {};
  const Scene& scene = tracer.scene();
  const Mesh& mesh = scene.mesh;
  FlatLamps out(tracer);
  std::vector<std::uint32_t> part_of;
  for (const std::uint32_t t : tracer.emitters().triangles()) {
    const Material& material = material_of(scene, t);
    const Vec3d face = to_double(area_vector(mesh, mesh.triangles[t]));
    if (!(length(face) > 0)) continue;
    if (material.emission_texture.texture >= 0 || material.alpha_mode != AlphaMode::opaque) return {};
    const Vec3d place = to_double(mesh.position[mesh.triangles[t][0]]), normal = normalized(face);
    std::size_t l = 0;
    for (; l < out.lamps_.size(); ++l) {
      const Lamp& lamp = out.lamps_[l];
      if (part_of[l] == mesh.part[t] && dot(lamp.normal, normal) > 1 - kFlat &&
          std::abs(dot(lamp.normal, place - lamp.place)) < kFlat) {
        break;
      }
    }
    if (l == out.lamps_.size()) {
      if (l == kMostLamps) return {};
      part_of.push_back(mesh.part[t]);
      out.lamps_.push_back({to_double(material.emission), normal, place, material.double_sided, {}, {}, {}});
    }
    out.lamps_[l].triangles.push_back(t);
  }
  for (Lamp& lamp : out.lamps_) {
    if (!out.outline_of(lamp)) return {};
    std::vector<Vec3f> centers;
    for (const std::uint32_t t : lamp.triangles) {
      const auto& [a, b, c] = mesh.triangles[t];
      centers.push_back((mesh.position[a] + mesh.position[b] + mesh.position[c]) / 3.0F);
    }
    std::vector<std::uint32_t> along;
    double sum = 0;
    for (const std::uint32_t i : morton_order(centers)) {
      along.push_back(lamp.triangles[i]);
      lamp.area.push_back(sum += triangle_area(mesh, mesh.triangles[lamp.triangles[i]]));
    }
    lamp.triangles = std::move(along);
  }
  return out;
}

/// The edges that no neighbour shares, straight runs joined. False when they are too many, or not a simple outline.
bool FlatLamps::outline_of(Lamp& lamp) const {
  const Mesh& mesh = tracer_->scene().mesh;
  using Key = std::array<float, 3>;
  const auto key = [&](std::uint32_t v) {
    const Vec3f& p = mesh.position[v];
    return Key{p.x + 0.0F, p.y + 0.0F, p.z + 0.0F};
  };
  std::map<std::pair<Key, Key>, int> edges;
  for (const std::uint32_t t : lamp.triangles) {
    for (std::size_t k = 0; k < 3; ++k) {
      const Key a = key(mesh.triangles[t][k]), b = key(mesh.triangles[t][(k + 1) % 3]);
      const auto back = edges.find({b, a});
      if (back == edges.end()) {
        if (++edges[{a, b}] > 1) return false;  // two triangles lie on one another
      } else {
        edges.erase(back);
      }
    }
  }
  std::map<Key, std::vector<Key>> next;
  for (const auto& [edge, count] : edges) next[edge.first].push_back(edge.second);
  const auto point = [](const Key& k) { return Vec3d{k[0], k[1], k[2]}; };
  std::map<Key, Key> before;
  for (const auto& [from, to] : next) {
    if (to.size() != 1 || !before.emplace(to[0], from).second) return false;  // touches itself
  }
  for (const auto& [from, to] : next) {
    if (!before.contains(from)) return false;
  }
  const auto is_corner = [&](const Key& k) {
    const Vec3d in = normalized(point(k) - point(before.at(k))), out = normalized(point(next.at(k)[0]) - point(k));
    return dot(in, out) < 0 || length(cross(in, out)) > kFlat;
  };
  std::size_t corners = 0;
  std::map<Key, bool> walked;
  for (const auto& [start, to] : next) {
    if (walked[start]) continue;
    std::vector<Vec3d> loop;
    for (Key at = start; !walked[at]; at = next.at(at)[0]) {
      walked[at] = true;
      if (is_corner(at)) loop.push_back(point(at));
    }
    corners += loop.size();
    if (loop.size() < 3) return false;
    lamp.outline.push_back(std::move(loop));
  }
  return corners <= kMostEdges;
}

Vec3d FlatLamps::point_of(const Lamp& lamp, const Vec2f& u) const {
  const Mesh& mesh = tracer_->scene().mesh;
  const double at = u.x * lamp.area.back();
  auto i = static_cast<std::size_t>(std::upper_bound(lamp.area.begin(), lamp.area.end(), at) - lamp.area.begin());
  i = std::min(i, lamp.area.size() - 1);
  const double low = i == 0 ? 0 : lamp.area[i - 1], size = lamp.area[i] - low;
  const double rest = size > 0 ? std::clamp((at - low) / size, 0.0, 1.0) : 0;
  const auto& [a, b, c] = mesh.triangles[lamp.triangles[i]];
  const Vec2<double> uv = uniform_triangle({rest, u.y});
  return to_double(mesh.position[a]) * (1 - uv.x - uv.y) + to_double(mesh.position[b]) * uv.x +
         to_double(mesh.position[c]) * uv.y;
}

void FlatLamps::add_points(const Lamp& lamp, const Receiver& at, int first, int last, const SobolPoints& points,
                           Sums& sums) const {
  const Vec3d origin = to_double(at.origin), n = to_double(at.normal);
  for (int begin = first; begin < last; begin += kPacket) {
    const int count = std::min(kPacket, last - begin);
    Rays16 rays;
    rays.ox.fill(at.origin.x), rays.oy.fill(at.origin.y), rays.oz.fill(at.origin.z);
    std::array<double, kPacket> weight{};
    for (int i = 0; i < count; ++i) {
      const auto k = static_cast<std::size_t>(i);
      const Vec3d way = point_of(lamp, points.pair(static_cast<std::uint32_t>(begin + i))) - origin;
      const double distance2 = dot(way, way), distance = std::sqrt(distance2);
      const Vec3f direction = distance > 0 ? to_float(way * (1 / distance)) : Vec3f{};
      rays.dx[k] = direction.x, rays.dy[k] = direction.y, rays.dz[k] = direction.z;
      rays.far[k] = static_cast<float>(distance * kShortfall);
      const double cosines = std::max(0.0, dot(way, n)) * std::abs(dot(way, lamp.normal));
      if (distance > 0) weight[k] = cosines / (distance2 * distance2);
    }
    const std::uint32_t hidden = tracer_->occluded16(rays, count);
    for (int i = 0; i < count; ++i) {
      const double w = weight[static_cast<std::size_t>(i)];
      const bool visible = (hidden >> i & 1U) == 0;
      sums.all += w;
      if (visible) sums.visible += w;
      if (w > 0) (visible ? sums.seen : sums.hidden) = true;
    }
  }
}

double FlatLamps::visible_share(const Lamp& lamp, const Receiver& at, const LampRays& budget, std::uint64_t seed,
                                std::uint64_t& rays) const {
  EXPECTS(budget.many <= LampRays::kMost);
  const SobolPoints points(seed);
  Sums sums;
  double share = 0, change = 0;  // squared; the last round's, or a half of the one before
  for (int done = 0, round = 1, end = budget.few; done < end; ++round) {
    add_points(lamp, at, done, end, points, sums);
    rays += static_cast<std::uint64_t>(end - done);
    done = end;
    const double now = sums.all > 0 ? sums.visible / sums.all : 0, step = now - std::exchange(share, now);
    if (sums.seen != sums.hidden) break;  // else mixed, or all points lie below the horizon and what rises was missed
    change = round == 1 ? 0 : std::max(step * step, change / 4);
    if (budget.tolerance > 0 && round > 2 && kLeft * change / 3 <= double{budget.tolerance} * budget.tolerance) break;
    end = std::max(done, budget.tolerance > 0 ? std::min(2 * done, budget.many) : budget.many);
  }
  return share;
}

Vec3f FlatLamps::light_at(const Receiver& at, const LampRays& budget, std::uint64_t seed, std::uint64_t& rays) const {
  const Vec3d origin = to_double(at.origin), n = to_double(at.normal);
  Vec3d light;
  for (std::size_t l = 0; l < lamps_.size(); ++l) {
    const Lamp& lamp = lamps_[l];
    const double side = dot(lamp.normal, origin - lamp.place);
    if (side <= 0 && (side == 0 || !lamp.double_sided)) continue;
    double form = 0;
    for (const std::vector<Vec3d>& loop : lamp.outline) form += loop_form_factor(loop, origin, n);
    const Vec3d open = lamp.radiance * std::abs(form);
    if (!(length(open) > 0)) continue;
    LampRays own = budget;
    own.tolerance /= static_cast<float>(length(open) * std::sqrt(static_cast<double>(lamps_.size())));
    light += open * visible_share(lamp, at, own, mix64(seed + l), rays);
  }
  return to_float(light);
}

}  // namespace kiln
