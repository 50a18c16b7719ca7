#pragma once
// Ray queries against a scene: the one wrapper over Embree.
//
// A surface stops rays where its coverage (opacity_at) is at least one half: alpha masks as drawn, blending by the same
// rule. Only parts whose coverage varies pay for an intersection filter.
// Units   unit-cube lengths.   Repeat  same bits for any thread count (the tree is built by one thread: 0.3 s per
// million triangles).   Fails  never on a valid Scene; ContractViolation for a ray that is not finite.

#include <array>
#include <cstdint>
#include <memory>

#include "core/base/threads.h"
#include "core/base/vec.h"
#include "core/scene/scene.h"

namespace kiln {

inline constexpr std::uint32_t kNoHit = 0xffffffffU;
inline constexpr int kPacket = 16;

/// Sixteen rays, structure of arrays. Directions are unit and everything is finite (the caller's promise; checked),
/// except that `far` may be infinite.
struct alignas(64) Rays16 {
  std::array<float, kPacket> ox, oy, oz, dx, dy, dz, far;
};

/// t, u and v mean something only where `triangle` is not kNoHit.
struct alignas(64) Hits16 {
  std::array<float, kPacket> t, u, v;
  std::array<std::uint32_t, kPacket> triangle;  // index into Scene::mesh.triangles, or kNoHit
};

struct Hit {
  float t = 0, u = 0, v = 0;  // barycentrics of corners 1 and 2
  std::uint32_t triangle = kNoHit;
  bool back = false;  // the ray came from behind the face
  explicit operator bool() const { return triangle != kNoHit; }
};

/// Moves a surface point off its face so that rays leaving into the half space of `n` neither hit the face again nor
/// jump over a neighbour 1e-5 away (Waechter and Binder 2019, whose steps the unit cube turns into one length, 1.9e-6).
Vec3f offset_origin(const Vec3f& point, const Vec3f& n);

class EmitterSampler;

class Tracer {
 public:
  /// Keeps a reference to the scene, which must outlive it and not change.
  Tracer(const Scene& scene, Threads& threads);
  ~Tracer();
  Tracer(const Tracer&) = delete;
  Tracer& operator=(const Tracer&) = delete;

  /// Bit i of the result is set when ray i (of the first `count`) meets anything before its far end.
  std::uint32_t occluded16(const Rays16& rays, int count = kPacket) const;
  void closest16(const Rays16& rays, Hits16& hits, int count = kPacket) const;

  bool occluded(const Vec3f& origin, const Vec3f& direction, float far) const;
  Hit closest(const Vec3f& origin, const Vec3f& direction, float far) const;

  const Scene& scene() const;
  /// Of the scene's emissive triangles (core/trace/lights.h), made once.
  const EmitterSampler& emitters() const;

 private:
  struct Device;
  std::unique_ptr<Device> device_;
};

}  // namespace kiln
