#include "core/meshless/lit_surface.h"

#include "core/base/expects.h"
#include "core/meshless/demand.h"

namespace kiln {
namespace {

constexpr DirectRays kOnPaths{.lamps = {.few = 2, .many = 2}, .sky = kPacket};  // one of hundreds of rays passes there

}  // namespace

LitSurface::LitSurface(const Tracer& tracer, const Environment* sky, const Points& points, Threads& threads)
    : tracer_(tracer),
      part_(tracer.scene().mesh.part.data()),
      faces_(tracer.scene()),
      albedo_(tracer.scene()),
      path_light_(tracer, sky, kOnPaths),
      points_(place_points(tracer, faces_, points.placement, threads)),
      senders_(tracer, points_, threads),
      paths_({tracer_, faces_, albedo_, senders_, &path_light_}) {
  add_demanded({tracer, faces_, points.placement.seed, points.readers}, points_, senders_, threads);
  light_.resize(points_.points.size());
}

void LitSurface::set_light(std::vector<Vec3f> light) {
  EXPECTS(light.size() == points_.points.size());
  light_ = std::move(light);
}

LitSurface::Reflected LitSurface::reflected(const Hit& hit, const Vec3f& direction, Random& random,
                                            std::uint64_t& rays) const {
  const SenderPaths::End end = paths_.follow(hit, direction, random, rays);
  if (end.sender == Senders::kNone) return {end.picked_up, false};
  return {end.picked_up + end.throughput * light_[end.sender], !points_.points[end.sender].pocket};
}

}  // namespace kiln
