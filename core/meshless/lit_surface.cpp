#include "core/meshless/lit_surface.h"

#include "core/base/expects.h"
#include "core/base/random.h"
#include "core/meshless/demand.h"

namespace kiln {
namespace {

constexpr std::size_t kBlock = 256;
constexpr DirectRays kOnPaths{.lamps = {.few = 2, .many = 2}, .sky = kPacket};  // one of hundreds of rays passes there

}  // namespace

LitSurface::LitSurface(const Tracer& tracer, const Environment* sky, const Points& points, Threads& threads)
    : tracer_(tracer),
      faces_(tracer.scene()),
      albedo_(tracer.scene()),
      path_light_(tracer, sky, kOnPaths),
      points_(place_points(tracer, faces_, points.placement, threads)),
      senders_(tracer, points_, threads),
      paths_({tracer_, faces_, albedo_, senders_, &path_light_}) {
  add_demanded({tracer, faces_, points.placement.seed, points.readers}, points_, senders_, threads);
  light_.resize(points_.points.size());
}

void LitSurface::set_light(std::vector<Vec3f> light, Threads& threads) {
  EXPECTS(light.size() == points_.points.size());
  light_ = std::move(light);
  exits_.assign(senders_.slots(), {});
  threads.for_blocks(tracer_.scene().mesh.triangles.size(), kBlock, [&](std::size_t begin, std::size_t end) {
    for (auto t = static_cast<std::uint32_t>(begin); t < end; ++t) {
      senders_.each_slot(t, [&](std::uint32_t slot, std::uint32_t answer, bool back, const auto& uv) {
        Exit& exit = exits_[slot];
        if (Senders::is_cut(answer)) exit.kind = Exit::kParts + senders_.slot_of_parts(answer);
        if (Senders::is_looked_for(answer)) {
          const Vec2f at = uv(0.5F, 0.5F);
          answer = back ? senders_.behind(t, at.x, at.y) : senders_.at(t, at.x, at.y);
        }
        if (answer >= points_.points.size()) return;
        exit.kind = points_.points[answer].pocket ? Exit::kPocket : Exit::kLit;
        exit.light = mean_albedo(t, uv) * light_[answer];
      });
    }
  });
}

/// Over a cell, of which uv(x, y) are the barycentrics of a place.
Vec3f LitSurface::mean_albedo(std::uint32_t triangle, const std::function<Vec2f(float, float)>& uv) const {
  if (faces_.is_plain(triangle)) return faces_.plain(tracer_.scene().mesh.part[triangle]);
  constexpr int kAlong = 4;
  Vec3f sum;
  for (int y = 0; y < kAlong; ++y) {
    for (int x = 0; x < kAlong; ++x) {
      const auto middle = [](int at) { return (static_cast<float>(at) + 0.5F) / kAlong; };
      const Vec2f at = uv(middle(x), middle(y));
      const auto draw = static_cast<std::uint32_t>(mix64(std::uint64_t{triangle} * kAlong * kAlong + y * kAlong + x));
      sum += albedo_.read(albedo_.tap(triangle, at.x, at.y, draw));
    }
  }
  return sum / float{kAlong * kAlong};
}

LitSurface::Reflected LitSurface::reflected(const Hit& hit, const Vec3f& direction, Random& random,
                                            std::uint64_t& rays) const {
  const HitSide side = faces_.side(hit.triangle, direction);
  if (side == HitSide::dark) return {};
  return reflected(look(hit, side == HitSide::flipped), hit, direction, random, rays);
}

LitSurface::Reflected LitSurface::follow(const Hit& hit, const Vec3f& direction, Random& random, std::uint64_t& rays,
                                         bool alone) const {
  const SenderPaths::End end = paths_.follow(hit, direction, random, rays, alone);
  if (end.sender == Senders::kNone) return {end.picked_up, false};
  return {end.picked_up + end.throughput * light_[end.sender], !points_.points[end.sender].pocket};
}

}  // namespace kiln
