#include "core/trace/tracer.h"

#include <embree3/rtcore.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <new>
#include <stdexcept>
#include <string>
#include <vector>

#include "core/base/expects.h"
#include "core/mesh/topology.h"
#include "core/trace/lights.h"
#include "core/trace/surface.h"

namespace kiln {
namespace {

/// How the tracer has to treat a part.
enum class Coverage { full, none, varies };

Coverage coverage_of(const Scene& scene, const Part& part) {
  const Material& material = scene.materials[static_cast<std::size_t>(part.material)];
  if (material.alpha_mode == AlphaMode::opaque) return Coverage::full;
  if (material.base_color_texture.texture >= 0 || part.has_color) return Coverage::varies;
  const float from = material.alpha_mode == AlphaMode::mask ? material.alpha_cutoff : kOpaqueFrom;
  return material.base_color.w >= from ? Coverage::full : Coverage::none;
}

/// The triangles of one Embree geometry. `original` is empty when they are all of the mesh, in order.
struct Selection {
  std::vector<std::uint32_t> original;
  const Scene* scene = nullptr;
  std::vector<std::uint8_t> first = {};  // of each triangle the corner that Embree has first
  std::uint32_t operator[](std::uint32_t primitive) const { return original.empty() ? primitive : original[primitive]; }

  /// Embree's barycentrics as weights of the mesh's corners 1 and 2.
  Vec2f barycentrics(std::uint32_t primitive, float u, float v) const {
    const float w = std::max(0.0F, 1 - u - v);
    return first[primitive] == 0 ? Vec2f{u, v} : first[primitive] == 1 ? Vec2f{w, u} : Vec2f{v, w};
  }
};

/// The corner opposite to the longest edge. Embree takes a triangle's plane from its first corner and the two edges
/// there: from two long edges of a needle it is so wrong that the needle stops rays that start above it.
std::uint8_t steadiest_corner(const Mesh& mesh, const Triangle& t) {
  const auto opposite = [&](std::size_t k) {
    const Vec3f edge = mesh.position[t[(k + 1) % 3]] - mesh.position[t[(k + 2) % 3]];
    return dot(edge, edge);
  };
  std::uint8_t best = 0;
  for (const std::uint8_t k : {std::uint8_t{1}, std::uint8_t{2}}) best = opposite(k) > opposite(best) ? k : best;
  return best;
}

void keep_covered(const RTCFilterFunctionNArguments* args) {
  const auto& selection = *static_cast<const Selection*>(args->geometryUserPtr);
  for (unsigned i = 0; i < args->N; ++i) {
    if (args->valid[i] != -1) continue;
    const std::uint32_t primitive = RTCHitN_primID(args->hit, args->N, i);
    const Vec2f at =
        selection.barycentrics(primitive, RTCHitN_u(args->hit, args->N, i), RTCHitN_v(args->hit, args->N, i));
    const SurfacePoint point{.triangle = selection[primitive], .u = at.x, .v = at.y};
    if (opacity_at(*selection.scene, point) < kOpaqueFrom) args->valid[i] = 0;
  }
}

void check_device(RTCDevice device) {
  const RTCError error = rtcGetDeviceError(device);
  if (error == RTC_ERROR_NONE) return;
  if (error == RTC_ERROR_OUT_OF_MEMORY) throw std::bad_alloc();
  throw std::runtime_error("Embree reports error " + std::to_string(static_cast<int>(error)));
}

using Lanes = std::array<std::uint32_t, kPacket>;

/// Sets the top bit of lane i when values[i] is not finite or from 2^60 on: Embree asserts below 1.84e18.
void mark_out_of_range(const std::array<float, kPacket>& values, Lanes& bad) {
  constexpr std::uint32_t kExponent = 0x7f800000U, kRest = (256U - (127U + 60U)) << 23;
  for (std::size_t i = 0; i < kPacket; ++i) bad[i] |= (std::bit_cast<std::uint32_t>(values[i]) & kExponent) + kRest;
}

/// Embree's asserts also look at lanes that are switched off.
void clear_lanes_from(int count, RTCRay16& ray) {
  for (int i = count; i < kPacket; ++i) {
    ray.org_x[i] = ray.org_y[i] = ray.org_z[i] = ray.dir_x[i] = ray.dir_y[i] = ray.tfar[i] = 0;
    ray.dir_z[i] = 1;
  }
}

void load(const Rays16& rays, int count, RTCRay16& ray, int* valid) {
  EXPECTS(count >= 0 && count <= kPacket);
  Lanes bad{};
  for (const auto* values : {&rays.ox, &rays.oy, &rays.oz, &rays.dx, &rays.dy, &rays.dz})
    mark_out_of_range(*values, bad);
  std::uint32_t any = 0;
  for (int i = 0; i < kPacket; ++i) {
    const auto k = static_cast<std::size_t>(i);
    const std::uint32_t used = i < count ? ~0U : 0U;
    valid[i] = static_cast<int>(used);
    any |= used & (bad[k] | (rays.far[k] >= 0 ? 0U : ~0U));
    ray.tnear[i] = 0;
    ray.time[i] = 0;
    ray.mask[i] = ~0U;  // Debian's Embree has ray masks: 0 would never hit
    ray.id[i] = 0;
    ray.flags[i] = 0;
  }
  EXPECTS((any >> 31) == 0 && "rays are finite");
  std::memcpy(ray.org_x, rays.ox.data(), sizeof ray.org_x);
  std::memcpy(ray.org_y, rays.oy.data(), sizeof ray.org_y);
  std::memcpy(ray.org_z, rays.oz.data(), sizeof ray.org_z);
  std::memcpy(ray.dir_x, rays.dx.data(), sizeof ray.dir_x);
  std::memcpy(ray.dir_y, rays.dy.data(), sizeof ray.dir_y);
  std::memcpy(ray.dir_z, rays.dz.data(), sizeof ray.dir_z);
  std::memcpy(ray.tfar, rays.far.data(), sizeof ray.tfar);
  clear_lanes_from(count, ray);
}

RTCRay single_ray(const Vec3f& origin, const Vec3f& direction, float far) {
  const auto in_range = [](const Vec3f& a) {
    return std::max({std::abs(a.x), std::abs(a.y), std::abs(a.z)}) < 0x1p60F;
  };
  EXPECTS(is_finite(origin) && is_finite(direction) && in_range(origin) && in_range(direction) && far >= 0);
  RTCRay ray{};
  ray.org_x = origin.x, ray.org_y = origin.y, ray.org_z = origin.z;
  ray.dir_x = direction.x, ray.dir_y = direction.y, ray.dir_z = direction.z;
  ray.tfar = far;
  ray.mask = ~0U;
  return ray;
}

RTCIntersectContext incoherent() {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  return context;
}

}  // namespace

struct Tracer::Device {
  const Scene& scene;
  RTCDevice device = nullptr;
  RTCBuffer positions = nullptr;
  RTCScene world = nullptr;
  std::array<Selection, 2> selections;  // 0: stops every ray, 1: asks the material
  EmitterSampler emitters;

  explicit Device(const Scene& s) : scene(s), selections{Selection{{}, &s}, Selection{{}, &s}}, emitters(s) {}
  ~Device() {
    if (world) rtcReleaseScene(world);
    if (positions) rtcReleaseBuffer(positions);
    if (device) rtcReleaseDevice(device);
  }
  Device(const Device&) = delete;
  Device& operator=(const Device&) = delete;

  void build();
  std::size_t select();
  void add_geometry(unsigned id, std::size_t count);
};

/// Fills the selections; returns how many triangles stop every ray.
std::size_t Tracer::Device::select() {
  std::vector<Coverage> coverage;
  for (const Part& part : scene.parts) coverage.push_back(coverage_of(scene, part));
  const std::size_t count = scene.mesh.triangles.size();
  if (std::all_of(coverage.begin(), coverage.end(), [](Coverage c) { return c == Coverage::full; })) return count;
  for (std::uint32_t t = 0; t < count; ++t) {
    const Coverage c = coverage[scene.mesh.part[t]];
    if (c != Coverage::none) selections[c == Coverage::full ? 0 : 1].original.push_back(t);
  }
  return selections[0].original.size();
}

void Tracer::Device::add_geometry(unsigned id, std::size_t count) {
  if (count == 0) return;
  RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
  rtcSetGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, positions, 0, sizeof(Vec3f),
                       scene.mesh.position.size());
  auto* triangles = static_cast<Triangle*>(
      rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, sizeof(Triangle), count));
  check_device(device);
  selections[id].first.resize(count);
  for (std::uint32_t i = 0; i < count; ++i) {
    const Triangle& t = scene.mesh.triangles[selections[id][i]];
    const std::size_t k = selections[id].first[i] = steadiest_corner(scene.mesh, t);
    triangles[i] = {t[k], t[(k + 1) % 3], t[(k + 2) % 3]};
  }
  if (id == 1) {
    rtcSetGeometryUserData(geometry, &selections[1]);
    rtcSetGeometryIntersectFilterFunction(geometry, keep_covered);
    rtcSetGeometryOccludedFilterFunction(geometry, keep_covered);
  }
  rtcCommitGeometry(geometry);
  rtcAttachGeometryByID(world, geometry, id);
  rtcReleaseGeometry(geometry);
}

void Tracer::Device::build() {
  device = rtcNewDevice(nullptr);
  if (!device) throw std::runtime_error("Embree has no device for this processor");
  const std::size_t bytes = scene.mesh.position.size() * sizeof(Vec3f);
  positions = rtcNewBuffer(device, bytes + 16);  // Embree reads 16 bytes at the last vertex
  check_device(device);
  if (bytes > 0) std::memcpy(rtcGetBufferData(positions), scene.mesh.position.data(), bytes);
  world = rtcNewScene(device);
  const std::size_t opaque = select();
  add_geometry(0, opaque);
  add_geometry(1, selections[1].original.size());
  rtcCommitScene(world);
  check_device(device);
}

Vec3f offset_origin(const Vec3f& point, const Vec3f& n) {
  // Inside the unit cube their integer steps are bounded by one length: 32 ulps of 0.5. A hit is computed to within
  // 4 ulps, so nothing is met twice, and a neighbour at 1e-5 stays in front.
  constexpr float kStep = 0x1p-19F;  // 1.9e-6
  return point + n * kStep;
}

Tracer::Tracer(const Scene& scene, Threads& threads) : device_(std::make_unique<Device>(scene)) {
  threads.check();
  // One thread builds, whatever is asked for: a parallel build leaves the tree, and so which of two equally near
  // triangles is reported, to chance.
  Threads(1).run([this] { device_->build(); });
}

Tracer::~Tracer() = default;

const Scene& Tracer::scene() const { return device_->scene; }

const EmitterSampler& Tracer::emitters() const { return device_->emitters; }

std::uint32_t Tracer::occluded16(const Rays16& rays, int count) const {
  RTCRay16 ray;
  alignas(64) int valid[kPacket];
  load(rays, count, ray, valid);
  RTCIntersectContext context = incoherent();
  rtcOccluded16(valid, device_->world, &context, &ray);
  std::uint32_t mask = 0;
  for (int i = 0; i < kPacket; ++i) mask |= static_cast<std::uint32_t>(valid[i] != 0 && ray.tfar[i] < 0) << i;
  return mask;
}

void Tracer::closest16(const Rays16& rays, Hits16& hits, int count) const {
  RTCRayHit16 query;
  alignas(64) int valid[kPacket];
  load(rays, count, query.ray, valid);
  std::fill_n(query.hit.geomID, kPacket, RTC_INVALID_GEOMETRY_ID);
  std::fill_n(query.hit.instID[0], kPacket, RTC_INVALID_GEOMETRY_ID);
  RTCIntersectContext context = incoherent();
  rtcIntersect16(valid, device_->world, &context, &query);
  std::memcpy(hits.t.data(), query.ray.tfar, sizeof query.ray.tfar);
  for (std::size_t i = 0; i < kPacket; ++i) {
    hits.triangle[i] = kNoHit;
    if (query.hit.geomID[i] == RTC_INVALID_GEOMETRY_ID) continue;
    const Selection& selection = device_->selections[query.hit.geomID[i]];
    const Vec2f at = selection.barycentrics(query.hit.primID[i], query.hit.u[i], query.hit.v[i]);
    hits.triangle[i] = selection[query.hit.primID[i]];
    hits.u[i] = at.x, hits.v[i] = at.y;
  }
}

bool Tracer::occluded(const Vec3f& origin, const Vec3f& direction, float far) const {
  RTCRay ray = single_ray(origin, direction, far);
  RTCIntersectContext context = incoherent();
  rtcOccluded1(device_->world, &context, &ray);
  return ray.tfar < 0;
}

Hit Tracer::closest(const Vec3f& origin, const Vec3f& direction, float far) const {
  RTCRayHit query{};
  query.ray = single_ray(origin, direction, far);
  query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  query.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
  RTCIntersectContext context = incoherent();
  rtcIntersect1(device_->world, &context, &query);
  if (query.hit.geomID == RTC_INVALID_GEOMETRY_ID) return {};
  const Selection& selection = device_->selections[query.hit.geomID];
  const std::uint32_t triangle = selection[query.hit.primID];
  const Vec2f at = selection.barycentrics(query.hit.primID, query.hit.u, query.hit.v);
  const Vec3f face = area_vector(scene().mesh, scene().mesh.triangles[triangle]);
  return {.t = query.ray.tfar, .u = at.x, .v = at.y, .triangle = triangle, .back = dot(face, direction) > 0};
}

}  // namespace kiln
