#include "tests/core/artifact/radiance_samples.h"

#include <cmath>

#include "core/base/random.h"
#include "core/sphere/sh.h"

namespace kiln::test {
namespace {

void append(std::vector<float>& out, const Vec3d& v) {
  for (const double x : {v.x, v.y, v.z}) out.push_back(static_cast<float>(x));
}

/// Harmonics of a lobe of width 1 / sharpness around `axis`, which is 1 there.
std::vector<double> lobe(int degree, const Vec3d& axis, double sharpness) {
  std::vector<double> y(static_cast<std::size_t>(sh_count(degree + 1)));
  evaluate_sh(degree + 1, axis, y.data());
  double sum = 0;
  for (int l = 0, i = 0; l <= degree; ++l) {
    for (; i < (l + 1) * (l + 1); ++i) {
      double& c = y[static_cast<std::size_t>(i)];
      const double weight = std::exp(-l * (l + 1) / (2 * sharpness));
      sum += weight * c * c;
      c *= weight;
    }
  }
  for (double& c : y) c /= sum;
  return y;
}

}  // namespace

std::string RadianceSample::primitive(Sample& sample) const {
  std::string out = "\"attributes\":{\"POSITION\":" + std::to_string(sample.positions(position));
  if (!normal.empty()) out += ",\"NORMAL\":" + std::to_string(sample.normals(normal));
  if (!tangent.empty()) {
    const int accessor = sample.accessor(tangent, 5126, "VEC4", tangent.size() / 4);
    out += ",\"TANGENT\":" + std::to_string(accessor);
  }
  const std::size_t count = function.empty() ? 0 : function[0].coefficients.size() / 3;
  for (std::size_t k = 0; k < count; ++k) {
    std::vector<float> column;
    for (const RadianceFunction& f : function) {
      for (std::size_t c = 0; c < 3; ++c) column.push_back(static_cast<float>(f.coefficients[c * count + k]));
    }
    out +=
        ",\"_RF_" + std::to_string(k) + "\":" + std::to_string(sample.accessor(column, 5126, "VEC3", function.size()));
  }
  return out + "},\"indices\":" + std::to_string(sample.indices(indices));
}

std::string RadianceSample::declaration() const {
  const RadianceFunction& f = function[0];
  return std::string(R"("extensionsUsed":["KILN_radiance_functions"],"extensions":{"KILN_radiance_functions":)") +
         R"({"version":1,"basis":")" + (f.basis == RadianceBasis::harmonics ? "sh" : "polynomial") + R"(","degree":)" +
         std::to_string(f.degree) + R"(,"reflected":)" + (reflected ? "true" : "false") + "}},";
}

Bytes RadianceSample::glb(const std::string& node) const {
  Sample sample;
  const std::string members = primitive(sample);
  return sample.glb(declaration() + one_node(members, node));
}

RadianceSample radiance_triangle(RadianceBasis basis, int degree, bool reflected) {
  RadianceSample out{.position = kTriangle, .indices = {0, 1, 2}, .reflected = reflected};
  const Vec3d normals[] = {normalized(Vec3d{0.3, 0.1, 1}), {0, 0, 1}, normalized(Vec3d{-0.2, 0.4, 0.8})};
  Random random(7, 0);
  for (const Vec3d& n : normals) {
    append(out.normal, n);
    RadianceFunction f{.basis = basis, .degree = degree, .normal = n, .coefficients = {}};
    for (std::size_t i = 0; i < 3 * radiance_count(basis, degree); ++i)
      f.coefficients.push_back(random.uniform_double() - 0.5);
    out.function.push_back(std::move(f));
  }
  return out;
}

RadianceSample radiance_sheet(std::uint32_t n, int degree) {
  RadianceSample out{.reflected = true};
  const auto at = [n](std::uint32_t i, std::uint32_t k) { return i * (n + 1) + k; };
  for (std::uint32_t i = 0; i <= n; ++i) {
    for (std::uint32_t k = 0; k <= n; ++k) {
      const double x = 2.0 * k / n - 1, y = 2.0 * i / n - 1;
      append(out.position, {x, y, 0.1 * std::sin(3 * x) * std::cos(2 * y)});
      const Vec3d normal =
          normalized(Vec3d{-0.3 * std::cos(3 * x) * std::cos(2 * y), 0.2 * std::sin(3 * x) * std::sin(2 * y), 1});
      append(out.normal, normal);
      RadianceFunction f{.basis = RadianceBasis::harmonics, .degree = degree, .normal = normal, .coefficients = {}};
      const std::vector<double> shine = lobe(degree, normalized(Vec3d{0.4 * x, 0.5 * y, 1}), 6);
      for (int c = 0; c < 3; ++c) {
        for (std::size_t j = 0; j < shine.size(); ++j)
          f.coefficients.push_back((c == 0 ? 0.8 : 0.5) * shine[j] + (j == 0 ? 2 + 0.5 * std::sin(2 * x + c) : 0.0));
      }
      out.function.push_back(std::move(f));
      if (i == n || k == n) continue;
      for (const std::uint32_t v : {at(i, k), at(i, k + 1), at(i + 1, k + 1), at(i, k), at(i + 1, k + 1), at(i + 1, k)})
        out.indices.push_back(v);
    }
  }
  return out;
}

}  // namespace kiln::test
