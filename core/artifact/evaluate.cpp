#include "core/artifact/evaluate.h"

#include "core/base/expects.h"

namespace kiln {
namespace {

float channel_value(const Transfer& transfer, std::size_t vertex, int channel, std::span<const Vec3f> light) {
  const float* t = transfer.at(vertex, channel);
  double sum = transfer.fixed ? t[transfer.slots() - 1] : 0.0;
  for (std::size_t i = 0; i < light.size(); ++i)
    sum += static_cast<double>(t[i]) * light[i][static_cast<std::size_t>(channel)];
  return static_cast<float>(sum);
}

}  // namespace

Vec3f value_at(const Transfer& transfer, std::size_t vertex, std::span<const Vec3f> light) {
  EXPECTS(vertex < transfer.vertices());
  EXPECTS(light.empty() || light.size() == static_cast<std::size_t>(sh_count(transfer.order)));
  return {channel_value(transfer, vertex, 0, light), channel_value(transfer, vertex, 1, light),
          channel_value(transfer, vertex, 2, light)};
}

std::vector<Vec3f> values_of(const Transfer& transfer, std::span<const Vec3f> light) {
  std::vector<Vec3f> out(transfer.vertices());
  for (std::size_t v = 0; v < out.size(); ++v) out[v] = value_at(transfer, v, light);
  return out;
}

Vec3f value_at(const Transfer& transfer, const TrianglePoint& point, std::span<const Vec3f> light) {
  const auto& [a, b, c] = point.triangle;
  return value_at(transfer, a, light) * (1 - point.u - point.v) + value_at(transfer, b, light) * point.u +
         value_at(transfer, c, light) * point.v;
}

}  // namespace kiln
