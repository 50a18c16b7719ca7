#include "core/lightfield/radiance_function.h"

#include "core/base/expects.h"
#include "core/sphere/hemispherical_polynomials.h"
#include "core/sphere/sh.h"

namespace kiln {
namespace {

/// Calls visit(coefficients of one channel) for R, G and B.
template <class Function, class Visit>
void each_channel(Function& f, const Visit& visit) {
  const std::size_t count = radiance_count(f.basis, f.degree);
  EXPECTS(f.coefficients.size() == 3 * count);
  for (std::size_t c = 0; c < 3; ++c) visit(f.coefficients.data() + c * count);
}

/// (J^T J)^-1 J^T (p - p1): how far p's foot is along the two edges. Zero where the triangle has no area.
Vec2d along_edges(const std::array<Vec3d, 3>& t, const Vec3d& p) {
  const Vec3d u = t[1] - t[0], v = t[2] - t[0], d = p - t[0];
  const Vec3d n = cross(u, v);
  const double area2 = dot(n, n);
  if (!(area2 > 0)) return {};
  return {dot(cross(d, v), n) / area2, dot(cross(u, d), n) / area2};
}

}  // namespace

std::size_t radiance_count(RadianceBasis basis, int degree) {
  return static_cast<std::size_t>(basis == RadianceBasis::harmonics ? sh_count(degree + 1) : polynomial_count(degree));
}

Vec3d at_or_above_horizon(const Vec3d& normal, const Vec3d& w) {
  const double height = dot(normal, w);
  return height >= 0 ? w : normalized(w - normal * height, basis_around(normal).x);
}

Vec3d reflect_direction(const Vec3d& normal, const Vec3d& w) { return normal * (2 * dot(normal, w)) - w; }

Vec3d evaluate(const RadianceFunction& f, const Vec3d& w) {
  const Vec3d seen = at_or_above_horizon(f.normal, w);
  std::vector<double> values(radiance_count(f.basis, f.degree));
  if (f.basis == RadianceBasis::harmonics) {
    evaluate_sh(f.degree + 1, seen, values.data());
  } else {
    evaluate_polynomials(f.degree, basis_around(f.normal).to_local(seen), values.data());
  }
  Vec3d out;
  std::size_t channel = 0;
  each_channel(f, [&](const double* c) {
    for (std::size_t i = 0; i < values.size(); ++i) out[channel] += c[i] * values[i];
    ++channel;
  });
  return out;
}

void reflect_harmonics(int degree, const Vec3d& normal, double* coefficients) {
  // R_n is half a turn about n: its own inverse, a symmetric matrix.
  const Basis<double> turn{reflect_direction(normal, {1, 0, 0}), reflect_direction(normal, {0, 1, 0}),
                           reflect_direction(normal, {0, 0, 1})};
  rotate_sh(degree + 1, turn, coefficients, coefficients);
}

RadianceFunction reflected(const RadianceFunction& f) {
  RadianceFunction out = f;
  each_channel(out, [&](double* c) {
    if (f.basis == RadianceBasis::harmonics) {
      reflect_harmonics(f.degree, f.normal, c);
    } else {
      reflect_polynomials(f.degree, c);
    }
  });
  return out;
}

RadianceFunction to_harmonics(const RadianceFunction& f) {
  if (f.basis == RadianceBasis::harmonics) return f;
  RadianceFunction out{.basis = RadianceBasis::harmonics, .degree = f.degree, .normal = f.normal, .coefficients = {}};
  const std::size_t count = radiance_count(out.basis, out.degree);
  each_channel(f, [&](const double* c) {
    const std::size_t at = out.coefficients.size();
    out.coefficients.resize(at + count);
    polynomials_to_sh(f.degree, c, out.coefficients.data() + at);
    rotate_sh(f.degree + 1, basis_around(f.normal), out.coefficients.data() + at, out.coefficients.data() + at);
  });
  return out;
}

Vec3d interpolate_reflected(const RadianceTriangle& t, const Vec3d& barycentrics, const Vec3d& w) {
  Vec3d out;
  for (std::size_t c = 0; c < 3; ++c) out += evaluate(t.reflected[c], w) * barycentrics[c];
  return out;
}

Vec3d interpolate(const RadianceTriangle& t, const Vec3d& barycentrics, const Vec3d& normal, const Vec3d& w) {
  return interpolate_reflected(t, barycentrics, reflect_direction(normal, w));
}

std::array<Vec3d, 3> gradient(const RadianceTriangle& t, const Vec3d& w) {
  const Vec3d first = evaluate(t.reflected[0], w);
  const Vec3d rise[] = {evaluate(t.reflected[1], w) - first, evaluate(t.reflected[2], w) - first};
  // The columns of J (J^T J)^-1 are the gradients of the two coordinates along the edges.
  Vec3d along[2];
  for (std::size_t axis = 0; axis < 3; ++axis) {
    Vec3d step;
    step[axis] = 1;
    const Vec2d moved = along_edges(t.position, t.position[0] + step);
    along[0][axis] = moved.x, along[1][axis] = moved.y;
  }
  std::array<Vec3d, 3> out;
  for (std::size_t channel = 0; channel < 3; ++channel)
    out[channel] = along[0] * rise[0][channel] + along[1] * rise[1][channel];
  return out;
}

Vec3d extrapolate_reflected(const RadianceTriangle& t, const Vec3d& p, const Vec3d& w) {
  const std::array<Vec3d, 3> slope = gradient(t, w);
  const Vec3d step = p - t.position[0];
  return evaluate(t.reflected[0], w) + Vec3d{dot(slope[0], step), dot(slope[1], step), dot(slope[2], step)};
}

Vec3d foot_barycentrics(const std::array<Vec3d, 3>& triangle, const Vec3d& p) {
  const Vec2d along = along_edges(triangle, p);
  return {1 - along.x - along.y, along.x, along.y};
}

}  // namespace kiln
