#include "core/prt/split_measure.h"

#include <algorithm>
#include <cmath>

namespace kiln {
namespace {

double contrast(Values a, Values b, bool relative) {
  double difference = 0, sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    difference += (a[i] - b[i]) * (a[i] - b[i]);
    sum += (a[i] + b[i]) * (a[i] + b[i]);
  }
  if (!relative) return std::sqrt(difference);
  return sum > 0 ? std::sqrt(difference / sum) : 0;
}

double mean_angle(const std::array<Vec3f, 3>& normal) {
  const Vec3f mean = normalized(normal[0] + normal[1] + normal[2], normal[0]);
  double sum = 0;
  for (const Vec3f& n : normal) sum += std::acos(std::clamp(dot(n, mean), -1.0F, 1.0F));
  return sum / 3;
}

}  // namespace

float edge_measure(const Subdivide& s, const std::array<Values, 3>& corner, const std::array<Vec3f, 3>& normal) {
  const bool relative = s.measure == SplitMeasure::eq2;
  double sum = 0;
  for (std::size_t k = 0; k < 3; ++k) sum += contrast(corner[k], corner[(k + 1) % 3], relative);
  if (s.measure == SplitMeasure::eq4) sum /= 1 + s.alpha * mean_angle(normal);
  return static_cast<float>(sum);
}

float residual_measure(const std::array<Values, 3>& corner, const std::array<Values, 3>& middle, Values centroid,
                       double area) {
  double at_middles = 0, at_centroid = 0;
  for (std::size_t i = 0; i < centroid.size(); ++i) {
    const std::array<double, 3> c = {corner[0][i], corner[1][i], corner[2][i]};
    for (std::size_t k = 0; k < 3; ++k) {
      const double difference = middle[k][i] - 0.5 * (c[k] + c[(k + 1) % 3]);
      at_middles += difference * difference;
    }
    const double difference = centroid[i] - (c[0] + c[1] + c[2]) / 3;
    at_centroid += difference * difference;
  }
  return static_cast<float>(std::sqrt(area * (2.0 / 15 * at_middles + 9.0 / 20 * at_centroid)));
}

}  // namespace kiln
