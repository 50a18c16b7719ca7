#include "core/meshless/light_links.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/base/expects.h"
#include "core/prt/ray_origin.h"

namespace kiln {
namespace {

constexpr std::size_t kBlock = 256;
constexpr float kAsideStep = 1.0F / 16, kValueStep = 1.0F / 255;

Vec3f value_of(const LightLink& link) {
  return {static_cast<float>(link.value[0]), static_cast<float>(link.value[1]), static_cast<float>(link.value[2])};
}

/// Equation 2 from the leaves up.
void climb(const LightLinks& l, std::vector<Vec3f>& x) {
  for (std::size_t i = 0; l.senders + i < l.nodes(); ++i) {
    Vec3f sum;
    float shares = 0;
    for (std::uint32_t k = l.child_begin[i]; k < l.child_begin[i + 1]; ++k) {
      const auto share = static_cast<float>(l.children[k].share);
      sum += x[l.children[k].node] * share;
      shares += share;
    }
    x[l.senders + i] = shares > 0 ? sum / shares : Vec3f{};
  }
}

/// Equation 3 at one row.
Vec3f row_light(const LightLinks& l, std::size_t row, const std::vector<Vec3f>& x) {
  Vec3f sum;
  for (std::uint32_t k = l.link_begin[row]; k < l.link_begin[row + 1]; ++k) {
    sum += value_of(l.links[k]) * x[l.links[k].node];
  }
  return sum * (l.scale[row] * kValueStep);
}

}  // namespace

double LightLinks::share_of_possible() const {
  const double possible = static_cast<double>(rows()) * senders;
  return possible > 0 ? static_cast<double>(links.size()) / possible : 0;
}

std::array<std::int8_t, 3> pack_normal(const Vec3f& n) {
  const auto pack = [](float x) { return static_cast<std::int8_t>(std::lrint(std::clamp(x, -1.0F, 1.0F) * 127)); };
  return {pack(n.x), pack(n.y), pack(n.z)};
}

Vec3f direct_of(const Light& light, const Tracer& tracer, const Vec3f& origin, const Vec3f& place,
                const Vec3f& normal) {
  const LightArrival arrival = light_arrival(light, to_double(place));
  const double cosine = dot(arrival.direction, to_double(normal));
  if (cosine <= 0 || arrival.irradiance == Vec3d{}) return {};
  Vec3f way = to_float(arrival.direction);
  auto far = static_cast<float>(std::min(arrival.distance, double{kFar}));
  if (std::isfinite(arrival.distance)) {
    const Vec3f clear = light.position - origin;
    far = length(clear);
    if (!(far > 0)) return {};
    way = clear / far;
  }
  if (tracer.occluded(origin, way, far)) return {};
  return to_float(arrival.irradiance * (cosine / std::numbers::pi));
}

std::vector<Vec3f> light_senders(const LightLinks& l, const Light& light, const Tracer& tracer, Threads& threads) {
  std::vector<Vec3f> out(l.senders);
  threads.for_blocks(l.senders, kBlock, [&](std::size_t begin, std::size_t end) {
    for (std::size_t s = begin; s < end; ++s) {
      const std::uint32_t first = l.sample_begin[s], last = l.sample_begin[s + 1];
      for (std::uint32_t k = first; k < last; ++k) {
        const SenderSample& p = l.samples[k];
        const Vec3f normal = unpack_normal(p.normal);
        out[s] += direct_of(light, tracer, offset_origin(p.position, normal), p.position, normal);
      }
      if (last > first) out[s] = out[s] / static_cast<float>(last - first);
    }
  });
  return out;
}

std::vector<Vec3f> solve_nodes(const LightLinks& l, std::span<const Vec3f> direct) {
  EXPECTS(direct.size() == l.senders);
  std::vector<Vec3f> x(l.nodes()), before(l.senders);
  std::copy(direct.begin(), direct.end(), x.begin());
  climb(l, x);
  for (std::uint32_t sweep = 0; sweep < l.sweeps; ++sweep) {
    std::copy(x.begin(), x.begin() + l.senders, before.begin());
    std::vector<Vec3f> next(l.senders);
    for (std::uint32_t s = 0; s < l.senders; ++s) next[s] = direct[s] + row_light(l, s, x);
    std::copy(next.begin(), next.end(), x.begin());
    climb(l, x);
  }
  if (l.sweeps > 0 && l.tail > 0) {
    for (std::uint32_t s = 0; s < l.senders; ++s) x[s] += (x[s] - before[s]) * l.tail;
    climb(l, x);
  }
  return x;
}

std::vector<VectorValue> gather_links(const LightLinks& l, std::span<const Vec3f> nodes, Threads& threads) {
  EXPECTS(nodes.size() == l.nodes());
  std::vector<VectorValue> out(l.rows());
  threads.for_blocks(l.rows(), kBlock, [&](std::size_t begin, std::size_t end) {
    for (std::size_t r = begin; r < end; ++r) {
      VectorValue& sum = out[r];
      for (std::uint32_t k = l.link_begin[r]; k < l.link_begin[r + 1]; ++k) {
        const LightLink& link = l.links[k];
        const Vec3f light = value_of(link) * nodes[link.node] * (l.scale[r] * kValueStep);
        const Vec3f aside = Vec3f{static_cast<float>(link.aside[0]), static_cast<float>(link.aside[1]),
                                  static_cast<float>(link.aside[2])} *
                            kAsideStep;
        sum.value += light;
        for (std::size_t c = 0; c < 3; ++c) sum.turn[c] += aside * light[c];
      }
    }
  });
  return out;
}

std::vector<Vec3f> read_rows(const LightLinks& l, std::span<const VectorValue> rows, std::span<const Vec3f> normals,
                             Threads& threads) {
  EXPECTS(normals.size() == l.vertices() && rows.size() == l.rows());
  std::vector<Vec3f> out(normals.size());
  threads.for_blocks(out.size(), kBlock, [&](std::size_t begin, std::size_t end) {
    for (std::size_t v = begin; v < end; ++v) {
      for (std::uint32_t k = l.term_begin[v]; k < l.term_begin[v + 1]; ++k) {
        out[v] += rows[l.terms[k].row].at(normals[v]) * (static_cast<float>(l.terms[k].weight) * kValueStep);
      }
    }
  });
  return out;
}

std::vector<Vec3f> reflected_light(const LightLinks& l, const Light& light, const Tracer& tracer,
                                   std::span<const Vec3f> normals, Threads& threads) {
  const std::vector<Vec3f> nodes = solve_nodes(l, light_senders(l, light, tracer, threads));
  return read_rows(l, gather_links(l, nodes, threads), normals, threads);
}

}  // namespace kiln
