#include "core/lightfield/polynomial_space.h"

#include <numbers>
#include <vector>

#include "core/lightfield/hemisphere_norm.h"

namespace kiln {
namespace {

/// Equation 1 in the local frame, as sums over pairs of harmonics of equal m.
struct Fold {
  struct Term {
    std::size_t even, odd;
    double factor;
  };
  std::vector<Term> terms;
  std::vector<std::size_t> odd;

  explicit Fold(int degree) {
    const HemisphereNorm norm(degree);
    const std::size_t count = norm.count();
    std::vector<double> coordinates(count * count);  // column k: those of harmonic k
    for (std::size_t k = 0; k < count; ++k) coordinates[k * count + k] = 1;
    norm.to_coordinates({0, 0, 1}, count, coordinates.data());
    const auto integral = [&](std::size_t a, std::size_t b) {
      double sum = 0;
      for (std::size_t i = 0; i < count; ++i) sum += coordinates[i * count + a] * coordinates[i * count + b];
      return 2 * std::numbers::pi * sum;
    };
    for (int l = 0; l <= degree; ++l) {
      for (int m = -l; m <= l; ++m) {
        if ((l + m) % 2 == 0) continue;
        odd.push_back(index(l, m));
        for (int k = std::abs(m); k <= degree; ++k) {
          if ((k + m) % 2 == 0) terms.push_back({index(k, m), index(l, m), 2 * integral(index(k, m), index(l, m))});
        }
      }
    }
  }

  void operator()(double* c) const {
    for (const Term& t : terms) c[t.even] += t.factor * c[t.odd];
    for (const std::size_t i : odd) c[i] = 0;
  }

  static std::size_t index(int l, int m) { return static_cast<std::size_t>(l * (l + 1) + m); }
};

}  // namespace

void keep_polynomials(LightField& field, std::span<const Vec3f> normal, Threads& threads) {
  const Fold fold(field.degree);
  const std::size_t count = field.count();
  threads.for_blocks(normal.size(), 256, [&](std::size_t begin, std::size_t end) {
    std::vector<double> c(count);
    for (std::size_t v = begin; v < end; ++v) {
      const Basis<double> up = basis_around(to_double(normal[v]));
      const Basis<double> down{{up.x.x, up.y.x, up.z.x}, {up.x.y, up.y.y, up.z.y}, {up.x.z, up.y.z, up.z.z}};
      for (std::size_t k = 0; k < 3; ++k) {
        const std::span<float> given = field.of(v).subspan(k * count, count);
        c.assign(given.begin(), given.end());
        rotate_sh(field.degree + 1, down, c.data(), c.data());
        fold(c.data());
        rotate_sh(field.degree + 1, up, c.data(), c.data());
        for (std::size_t i = 0; i < count; ++i) given[i] = static_cast<float>(c[i]);
      }
    }
  });
}

}  // namespace kiln
