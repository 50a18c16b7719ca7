#include "core/prt/glossy_matrix.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <numbers>

#include "core/base/expects.h"
#include "core/base/random.h"
#include "core/prt/gather_faces.h"
#include "core/prt/ray_origin.h"
#include "core/prt/support_tree.h"
#include "core/sphere/quadrature.h"
#include "core/sphere/sampling.h"
#include "core/sphere/sh.h"
#include "core/trace/surface.h"

namespace kiln {
namespace {

constexpr int kSets = 4;
constexpr std::size_t kMost = sh_count(kMaxShOrder);

using Numbers = std::vector<float>;

/// Directions uniform over the upper half space, with their harmonics.
struct HalfSpace {
  std::vector<Vec3f> direction;
  Numbers harmonics;  // [ray * count + i]
};

HalfSpace half_space(int order, int samples, std::uint64_t seed) {
  HalfSpace out;
  std::array<float, kMost> y;
  for (int k = 0; k < samples; ++k) {
    const Vec2f u = sobol_owen(static_cast<std::uint32_t>(k), seed);
    const auto disk = disk_from_square({u.x, u.y});
    const double r2 = disk.x * disk.x + disk.y * disk.y, stretch = std::sqrt(std::max(0.0, 2 - r2));
    const Vec3f w = to_float(Vec3d{disk.x * stretch, disk.y * stretch, 1 - r2});  // equal areas: z = 1 - r^2
    out.direction.push_back(w);
    evaluate_sh(order, w, y.data());
    out.harmonics.insert(out.harmonics.end(), y.begin(), y.begin() + sh_count(order));
  }
  return out;
}

/// Equation 1 where nothing is hit.
Numbers open_matrix(int order) {
  const auto count = static_cast<std::size_t>(sh_count(order));
  std::vector<double> sum(count * count, 0.0);
  std::array<double, kMost> y;
  const int azimuths = 2 * order + 2;
  for (const QuadratureNode& node : gauss_legendre(2 * order)) {
    const double z = (node.x + 1) / 2, r = std::sqrt(1 - z * z);
    for (int j = 0; j < azimuths; ++j) {
      const double phi = 2 * std::numbers::pi * (j + 0.5) / azimuths;
      const double weight = node.weight / 2 * 2 * std::numbers::pi / azimuths;
      evaluate_sh(order, Vec3d{r * std::cos(phi), r * std::sin(phi), z}, y.data());
      for (std::size_t o = 0; o < count; ++o) {
        for (std::size_t i = 0; i < count; ++i) sum[o * count + i] += weight * y[o] * y[i];
      }
    }
  }
  return {sum.begin(), sum.end()};
}

}  // namespace

struct GlossyMatrixBaker::State {
  State(const Tracer& tracer, const Transfer& light, const GlossyMatrix& params)
      : tracer_(tracer),
        scene_(tracer.scene()),
        light_(light),
        params_(params),
        samples_((params.samples + kPacket - 1) / kPacket * kPacket),
        count_(static_cast<std::size_t>(sh_count(params.order))),
        inputs_(count_ + (params.fixed ? 1 : 0)),
        channels_(static_cast<std::size_t>(params.channels)),
        open_(open_matrix(params.order)),
        faces_(scene_),
        support_(scene_.mesh.position) {
    for (std::uint64_t set = 0; set < kSets; ++set)
      sets_.push_back(half_space(params.order, samples_, mix64(mix64(params.seed ^ 0x676c6f737379ULL) ^ set)));
  }

  std::uint64_t bake(const TransferPoint& point, float* out) const {
    Numbers sky(count_ * count_, 0.0F);                    // of the rays that hit
    Numbers surfaces(channels_ * count_ * inputs_, 0.0F);  // world axes for i, the normal's for o
    Random random(params_.seed, point_key(point));
    const HalfSpace& set = sets_[random.next() % kSets];
    const Basis<float> basis = turned(point.normal, 2 * std::numbers::pi_v<float> * random.uniform());
    const bool traced = support_.rises_above(point.normal, dot(point.normal, point.position) + kOpenTolerance);
    if (traced) trace(point, set, basis, sky, surfaces);
    const float weight = 2 * std::numbers::pi_v<float> / static_cast<float>(samples_);
    for (std::size_t k = 0; k < sky.size(); ++k) sky[k] = open_[k] - weight * sky[k];
    for (std::size_t o = 0; o < count_; ++o) rotate_sh(params_.order, basis, &sky[o * count_], &sky[o * count_]);
    write(basis, sky, surfaces, weight, out);
    return traced ? static_cast<std::uint64_t>(samples_) : 0;
  }

  void open(const Vec3f& normal, float* out) const {
    const Basis<float> basis = basis_around(normal);
    Numbers sky = open_;
    for (std::size_t o = 0; o < count_; ++o) rotate_sh(params_.order, basis, &sky[o * count_], &sky[o * count_]);
    write(basis, sky, Numbers(channels_ * count_ * inputs_, 0.0F), 0, out);
  }

  static Basis<float> turned(const Vec3f& normal, float azimuth) {
    const Basis<float> plain = basis_around(normal);
    const float c = std::cos(azimuth), s = std::sin(azimuth);
    return {plain.x * c + plain.y * s, plain.y * c - plain.x * s, plain.z};
  }

  void trace(const TransferPoint& point, const HalfSpace& set, const Basis<float>& basis, Numbers& sky,
             Numbers& surfaces) const {
    Rays16 rays;
    Hits16 hits;
    const Vec3f origin = ray_origin(point);
    rays.ox.fill(origin.x), rays.oy.fill(origin.y), rays.oz.fill(origin.z), rays.far.fill(kFar);
    for (std::size_t first = 0; first < set.direction.size(); first += kPacket) {
      for (std::size_t k = 0; k < kPacket; ++k) {
        const Vec3f w = basis.to_world(set.direction[first + k]);
        rays.dx[k] = w.x, rays.dy[k] = w.y, rays.dz[k] = w.z;
      }
      tracer_.closest16(rays, hits);
      for (std::size_t k = 0; k < kPacket; ++k) {
        if (hits.triangle[k] == kNoHit) continue;
        const float* y = &set.harmonics[(first + k) * count_];
        add(y, y, count_, sky.data());
        add_surface({rays.dx[k], rays.dy[k], rays.dz[k]}, hits, k, y, surfaces.data());
      }
    }
  }

  /// sum[o][i] += y[o] * row[i].
  void add(const float* y, const float* row, std::size_t width, float* sum) const {
    for (std::size_t o = 0; o < count_; ++o, sum += width) {
      for (std::size_t i = 0; i < width; ++i) sum[i] += y[o] * row[i];
    }
  }

  /// What the surface sends back along the ray, as rows over the inputs.
  void add_surface(const Vec3f& direction, const Hits16& hits, std::size_t k, const float* y, float* sum) const {
    const std::uint32_t t = hits.triangle[k];
    const HitSide side = faces_.side(t, direction);
    if (side == HitSide::dark || (!params_.reflected && !params_.fixed)) return;
    const SurfacePoint p = surface_point(scene_, t, hits.u[k], hits.v[k]);
    const Vec3f emitted = params_.fixed ? emission_at(scene_, p) : Vec3f{};
    const bool reflects = params_.reflected && side == HitSide::front;
    const Vec3f albedo = reflects ? albedo_at(scene_, p) : Vec3f{};
    const std::array<float, 3> corner{1 - p.u - p.v, p.u, p.v};
    std::array<float, kMost + 1> row;
    for (std::size_t c = 0; c < channels_; ++c, sum += count_ * inputs_) {
      row.fill(0);
      for (std::size_t j = 0; reflects && j < 3; ++j) {
        const float* from = light_.at(scene_.mesh.triangles[t][j], static_cast<int>(c));
        const float weight = corner[j] * albedo[c];
        for (std::size_t i = 0; i < count_; ++i) row[i] += weight * from[i];
        if (params_.fixed) row[count_] += weight * from[light_.slots() - 1];
      }
      if (params_.fixed) row[count_] += emitted[c];
      add(y, row.data(), inputs_, sum);
    }
  }

  /// Joins both parts and turns the harmonics of the arriving light into world axes.
  void write(const Basis<float>& basis, const Numbers& sky, const Numbers& surfaces, float weight, float* out) const {
    std::array<float, kMost> column;
    for (std::size_t c = 0; c < channels_; ++c, out += count_ * inputs_) {
      const float* reflected = surfaces.data() + c * count_ * inputs_;
      for (std::size_t i = 0; i < inputs_; ++i) {
        for (std::size_t o = 0; o < count_; ++o)
          column[o] = weight * reflected[o * inputs_ + i] + (i < count_ ? sky[o * count_ + i] : 0);
        rotate_sh(params_.order, basis, column.data(), column.data());
        for (std::size_t o = 0; o < count_; ++o) out[o * inputs_ + i] = column[o];
      }
    }
  }

  const Tracer& tracer_;
  const Scene& scene_;
  const Transfer& light_;
  const GlossyMatrix params_;
  const int samples_;
  const std::size_t count_, inputs_, channels_;
  const Numbers open_;  // [o][i]
  const GatherFaces faces_;
  const SupportTree support_;
  std::vector<HalfSpace> sets_;
};

GlossyMatrix another_draw(const GlossyMatrix& first) {
  GlossyMatrix out = first;
  out.seed = mix64(first.seed ^ 0x6e6f697365ULL);
  return out;
}

GlossyMatrixBaker::GlossyMatrixBaker(const Tracer& tracer, const Transfer& light, const GlossyMatrix& params) {
  EXPECTS(params.order >= 1 && params.order <= std::min(light.order, kMaxShOrder));
  EXPECTS(params.channels == 3 || params.channels == 1);
  EXPECTS(params.samples >= 1 && params.samples <= 65536);
  EXPECTS(!params.fixed || !params.reflected || light.fixed);
  EXPECTS(light.vertices() == tracer.scene().mesh.position.size());
  state_ = std::make_unique<State>(tracer, light, params);
}

GlossyMatrixBaker::~GlossyMatrixBaker() = default;

std::size_t GlossyMatrixBaker::stride() const { return state_->channels_ * state_->count_ * state_->inputs_; }

std::uint64_t GlossyMatrixBaker::bake(const TransferPoint& point, float* out) const { return state_->bake(point, out); }

std::vector<float> GlossyMatrixBaker::bake(std::span<const TransferPoint> points, Threads& threads,
                                           std::uint64_t& rays) const {
  std::vector<float> out(points.size() * stride());
  std::atomic<std::uint64_t> traced = 0;
  threads.for_blocks(points.size(), 1,
                     [&](std::size_t n, std::size_t) { traced += bake(points[n], &out[n * stride()]); });
  rays += traced;
  return out;
}

void GlossyMatrixBaker::open(const Vec3f& normal, float* out) const { state_->open(normal, out); }

}  // namespace kiln
