#include "core/lightfield/mirrored_sky.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/base/expects.h"
#include "core/prt/lobe_table.h"
#include "core/trace/ggx.h"

namespace kiln {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr int kLeastHeight = 8, kMostHeight = 256;
constexpr int kDraws = 256;  // of the sky for each texel
constexpr int kFacets = 8;
constexpr double kNarrowest = 0.15;  // of alpha: blurs between facets must meet

/// Means of four texels each, by their solid angles.
Environment half_as_high(const Environment& e) {
  Environment out{.name = {}, .width = e.width / 2, .height = e.height / 2, .radiance = {}};
  const auto at = [&](int x, int y) {
    return to_double(
        e.radiance[static_cast<std::size_t>(y) * static_cast<std::size_t>(e.width) + static_cast<std::size_t>(x)]);
  };
  const auto area = [&](int y) { return std::cos(kPi * y / e.height) - std::cos(kPi * (y + 1) / e.height); };
  for (int y = 0; y < out.height; ++y) {
    const double upper = area(2 * y), lower = area(2 * y + 1), share = 0.5 / (upper + lower);
    for (int x = 0; x < out.width; ++x) {
      const Vec3d top = at(2 * x, 2 * y) + at(2 * x + 1, 2 * y);
      const Vec3d bottom = at(2 * x, 2 * y + 1) + at(2 * x + 1, 2 * y + 1);
      out.radiance.push_back(to_float((top * upper + bottom * lower) * share));
    }
  }
  return out;
}

/// Means of the sky over solid angles, for draws that stand for one each (Krivanek and Colbert 2008).
class SkyPyramid {
 public:
  explicit SkyPyramid(const Environment& sky) {
    const int parts = std::clamp(2 * sky.height / kMostHeight, 2, 16);
    levels_.push_back(averaged_sky(kMostHeight, parts, [&](const Vec3f& w) { return environment_radiance(sky, w); }));
    while (levels_.back().height > 2) levels_.push_back(half_as_high(levels_.back()));
  }
  Vec3d around(const Vec3d& w, double solid_angle) const {
    const double last = static_cast<double>(levels_.size() - 1);
    const double level = std::clamp(std::log2(std::sqrt(solid_angle) * kMostHeight / kPi), 0.0, last);
    const auto low = std::min(static_cast<std::size_t>(level), levels_.size() - 2);
    const double share = level - static_cast<double>(low);
    return to_double(environment_radiance(levels_[low], to_float(w))) * (1 - share) +
           to_double(environment_radiance(levels_[low + 1], to_float(w))) * share;
  }

 private:
  std::vector<Environment> levels_;  // each half as high as the one before
};

/// 1 + Lambda of Smith's masking, for an alpha.
double masking(double alpha, double z) {
  return (std::sqrt(1 + alpha * alpha * std::max(0.0, 1 - z * z) / (z * z)) + 1) / 2;
}

/// A direction of the lobe of an eye on the normal, and the solid angle it stands for.
struct Draw {
  Vec3d l;
  double weight = 0, solid_angle = 0;
};

/// Evenly by facets: Hammersley's set. Weights sum to 1.
std::vector<Draw> draws_of(double alpha) {
  std::vector<Draw> out;
  double all = 0;
  for (unsigned k = 0; k < kDraws; ++k) {
    double turn = 0, digit = 0.5;
    for (unsigned bits = k; bits != 0; bits >>= 1U, digit /= 2) turn += (bits & 1U) * digit;
    const double u = (k + 0.5) / kDraws, tan2 = alpha * alpha * u / (1 - u);
    const double c = 1 / std::sqrt(1 + tan2), s = std::sqrt(std::max(0.0, 1 - c * c)), up = 2 * c * c - 1;
    if (!(up > 0)) continue;
    const double d = c * c * (alpha * alpha - 1) + 1, density = alpha * alpha / (4 * kPi * d * d);
    out.push_back({{2 * s * c * std::cos(2 * kPi * turn), 2 * s * c * std::sin(2 * kPi * turn), up},
                   1 / masking(alpha, up),
                   1 / (kDraws * density)});
    all += out.back().weight;
  }
  for (Draw& draw : out) draw.weight /= all;
  return out;
}

double alpha_of(std::size_t level) { return std::exp2(-0.5 * static_cast<double>(level)); }

/// The height of a map whose texels are no wider than alpha.
int height_for(double alpha) {
  int height = kLeastHeight;
  while (height < kMostHeight && height < kPi / alpha) height *= 2;
  return height;
}

Environment blur(const SkyPyramid& sky, double alpha, Threads& threads) {
  const std::vector<Draw> draws = draws_of(alpha);
  const int height = height_for(alpha);
  Environment out{.name = {}, .width = 2 * height, .height = height, .radiance = {}};
  const auto width = static_cast<std::size_t>(out.width);
  out.radiance.resize(width * static_cast<std::size_t>(height));
  threads.for_blocks(static_cast<std::size_t>(height), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin * width; i < end * width; ++i) {
      const std::size_t row = i / width, column = i % width;
      const double up = kPi * (0.5 - (static_cast<double>(row) + 0.5) / height);
      const double around = 2 * kPi * ((static_cast<double>(column) + 0.5) / out.width - 0.5);
      const Basis<double> frame =
          basis_around(Vec3d{std::cos(up) * std::cos(around), std::sin(up), std::cos(up) * std::sin(around)});
      Vec3d sum;
      for (const Draw& draw : draws) sum += sky.around(frame.to_world(draw.l), draw.solid_angle) * draw.weight;
      out.radiance[i] = to_float(sum);
    }
  });
  return out;
}

/// Slopes, in alphas, of the facets that an eye at height z sees along its plane: quantile u of
///   density ~ (1 + t^2)^(-3/2) max(0, z + sine alpha t)                                                            (2)
/// which with t = tan(phi) is the cosine of an angle about `lean`.
class VisibleSlopes {
 public:
  VisibleSlopes(double alpha, double z, double sine)
      : lean_(std::atan2(sine * alpha, z)), most_(std::hypot(z, sine * alpha)), z_(z) {}
  double at(double u) const {
    const double sum = -most_ + (z_ + most_) * u;
    return std::tan(lean_ + std::asin(std::clamp(sum / most_, -1.0, 1.0)));
  }

 private:
  double lean_, most_, z_;
};

}  // namespace

double visibility_along(const SkyVisibility& visibility, const Vec3d& w) {
  std::array<double, kVisibilityCount> terms{};
  evaluate_sh(kVisibilityOrder, w, terms.data());
  double sum = 0;
  for (std::size_t i = 0; i < kVisibilityCount; ++i) sum += double{visibility[i]} * terms[i];
  return std::clamp(sum, 0.0, 1.0);
}

SkyLevels blur_sky(const Environment& sky, double least, Threads& threads) {
  const SkyPyramid pyramid(sky);
  SkyLevels out;
  do out.push_back(blur(pyramid, alpha_of(out.size()), threads));
  while (out.size() < 2 || (alpha_of(out.size() - 1) > least && kPi / alpha_of(out.size() - 1) <= kMostHeight));
  return out;
}

double mean_square_slope(const Environment& level, double over) {
  double squares = 0, all = 0;
  for (int y = 0; y < level.height; ++y) {
    const double up = kPi * (0.5 - (y + 0.5) / level.height), sine = std::cos(up);
    for (int x = 0; x < level.width; ++x) {
      const double around = 2 * kPi * ((x + 0.5) / level.width - 0.5);
      const Vec3d w{sine * std::cos(around), std::sin(up), sine * std::sin(around)};
      const Basis<double> frame = basis_around(w);
      for (const Vec3d& aside : {frame.x, frame.y}) {
        const Vec3d there = w * std::cos(over) + aside * std::sin(over);
        const Vec3f off = environment_radiance(level, to_float(there)) - environment_radiance(level, to_float(w));
        squares += sine * double{dot(off, off)};
      }
      all += sine;
    }
  }
  return squares / (all * over * over);
}

MirroredSky::MirroredSky(const SkyLevels& levels) : levels_(levels) { EXPECTS(levels.size() >= 2); }

Vec3d MirroredSky::blurred(const Vec3d& w, double alpha) const {
  const double level = std::clamp(-2 * std::log2(alpha), 0.0, static_cast<double>(levels_.size() - 1));
  const auto low = std::min(static_cast<std::size_t>(level), levels_.size() - 2);
  const double share = level - static_cast<double>(low);
  return to_double(environment_radiance(levels_[low], to_float(w))) * (1 - share) +
         to_double(environment_radiance(levels_[low + 1], to_float(w))) * share;
}

Vec3d MirroredSky::seen(const Surface& s, const SkyVisibility& visibility, const Vec3d& view) const {
  constexpr double kGrazing = 1e-3;
  const double above = dot(s.normal, view), z = std::clamp(above, kGrazing, 1.0), alpha = ggx_alpha(s.roughness);
  const Vec3d x = normalized(view - s.normal * above, basis_around(s.normal).x);
  const double sine = std::sqrt(1 - z * z);
  const double spread = 1 - z;  // what the blur's own width, z of the lobe's, leaves to the facets
  const VisibleSlopes slopes(alpha, z, sine);
  const double middle = slopes.at(0.5);
  Vec3d sum;
  double all = 0;
  for (int k = 0; k < kFacets; ++k) {
    const double slope = middle + spread * (slopes.at((k + 0.5) / kFacets) - middle);
    const double up = 1 / std::sqrt(1 + alpha * alpha * slope * slope);
    const Vec3d h{alpha * slope * up, 0, up};
    const double facing = sine * h.x + z * h.z;
    const Vec3d l{2 * facing * h.x - sine, 0, 2 * facing * h.z - z};
    if (!(facing > 0) || !(l.z > 0)) continue;
    const double weight = 1 / masking(alpha, l.z);
    const double width = alpha * std::max(kNarrowest, facing) * std::sqrt(1 + slope * slope);
    const Vec3d w = x * l.x + s.normal * l.z;
    sum += blurred(w, std::min(1.0, width)) * (weight * visibility_along(visibility, w));
    all += weight;
  }
  return all > 0 ? lobe_at(albedo_table(), z, s.roughness).albedo(s.f0) * sum / all : Vec3d{};
}

}  // namespace kiln
