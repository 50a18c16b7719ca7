#include "core/meshless/gather_rows.h"

#include <algorithm>
#include <atomic>
#include <cmath>

#include "core/base/random.h"
#include "core/mesh/topology.h"
#include "core/prt/ray_origin.h"
#include "core/sphere/sampling.h"

namespace kiln {
namespace {

constexpr int kSets = 8;
constexpr DirectRays kOnPaths{.lamps = {.few = 4, .many = 4}, .sky = 4};  // one of hundreds of rays passes by there

std::uint16_t to_fixed(float x) { return static_cast<std::uint16_t>(std::lrint(std::clamp(x, 0.0F, 1.0F) * 65535)); }

}  // namespace

GatherRows::GatherRows(const World& world, int rays, std::uint64_t seed)
    : world_(world), sets_(0, rays, kSets, mix64(seed)), seed_(seed) {}

void GatherRows::add(std::span<const TransferPoint> points, Threads& threads, std::uint64_t& rays) {
  const std::size_t first_row = row_.size(), first_chunk = chunks_.size();
  row_.resize(first_row + points.size());
  chunks_.resize(first_chunk + (points.size() + kChunk - 1) / kChunk);
  std::atomic<std::uint64_t> sent = 0;
  threads.for_blocks(points.size(), kChunk, [&](std::size_t begin, std::size_t end) {
    const std::size_t chunk = first_chunk + begin / kChunk;
    std::vector<RowEntry>& entries = chunks_[chunk];
    entries.reserve((end - begin) * static_cast<std::size_t>(sets_.samples()));
    std::uint64_t own = 0;
    for (std::size_t i = begin; i < end; ++i) {
      Row& row = row_[first_row + i];
      row.chunk = static_cast<std::uint32_t>(chunk);
      row.first = static_cast<std::uint32_t>(entries.size());
      trace(points[i], entries, row, own);
      row.count = static_cast<std::uint32_t>(entries.size()) - row.first;
    }
    entries.shrink_to_fit();
    sent += own;
  });
  rays += sent;
}

void GatherRows::trace(const TransferPoint& point, std::vector<RowEntry>& entries, Row& row,
                       std::uint64_t& sent) const {
  const std::uint64_t key = point_key(point);
  const LocalFrame frame = local_frame(sets_, point.normal, seed_, key);
  Random random(seed_, key, 1);
  const Vec3f origin = ray_origin(point);
  Rays16 rays;
  Hits16 hits;
  rays.ox.fill(origin.x), rays.oy.fill(origin.y), rays.oz.fill(origin.z), rays.far.fill(kFar);
  for (int packet = 0; packet < sets_.samples() / kPacket; ++packet) {
    sets_.turn(frame.set, packet, frame.basis, rays);
    world_.tracer.closest16(rays, hits);
    for (std::size_t i = 0; i < kPacket; ++i) {
      if (hits.triangle[i] == kNoHit) continue;
      const Hit hit{hits.t[i], hits.u[i], hits.v[i], hits.triangle[i], false};
      Vec3f throughput{1, 1, 1};
      std::uint32_t sender = Senders::kNone;
      if (!follow(hit, {rays.dx[i], rays.dy[i], rays.dz[i]}, throughput, random, row, sent, sender)) continue;
      entries.push_back({sender, {to_fixed(throughput.x), to_fixed(throughput.y), to_fixed(throughput.z), 0}});
    }
  }
  sent += static_cast<std::uint64_t>(sets_.samples());
  row.constant = row.constant / static_cast<float>(sets_.samples());
}

/// From a hit to the first sender. False where the path ends without one.
bool GatherRows::follow(Hit hit, Vec3f direction, Vec3f& throughput, Random& random, Row& row, std::uint64_t& sent,
                        std::uint32_t& sender) const {
  const Mesh& mesh = world_.tracer.scene().mesh;
  for (;;) {
    const HitSide side = world_.faces.side(hit.triangle, direction);
    if (side == HitSide::dark) return false;
    const std::uint32_t part = mesh.part[hit.triangle];
    if (world_.faces.is_plain(hit.triangle)) {
      throughput = throughput * world_.faces.plain(part);
    } else {
      const auto draw = static_cast<std::uint32_t>(random.next());
      throughput = throughput * world_.albedo.read(world_.albedo.tap(hit.triangle, hit.u, hit.v, draw));
    }
    const float most = std::max({throughput.x, throughput.y, throughput.z});
    if (!(most > 0)) return false;
    if (side == HitSide::front) {
      sender = world_.senders.at(hit.triangle, hit.u, hit.v);
      if (sender != Senders::kNone) return true;
    }
    // No sender stands for this place: light it, and go on in a random direction while the throughput lasts.
    const Triangle& t = mesh.triangles[hit.triangle];
    Vec3f up = normalized(area_vector(mesh, t), mesh.normal[t[0]]);
    if (dot(up, direction) > 0) up = -up;
    const Vec3f place =
        mesh.position[t[0]] * (1 - hit.u - hit.v) + mesh.position[t[1]] * hit.u + mesh.position[t[2]] * hit.v;
    const Vec3f origin = offset_origin(place, up);
    row.constant += throughput * world_.light.at({origin, up}, kOnPaths, random.next(), sent);
    const float alive = std::min(1.0F, most);
    if (random.uniform() >= alive) return false;
    throughput = throughput / alive;
    const float x = random.uniform(), y = random.uniform();
    direction = normalized(basis_around(up).to_world(cosine_hemisphere(Vec2f{x, y})), up);
    hit = world_.tracer.closest(origin, direction, kFar);
    ++sent;
    if (!hit) return false;
  }
}

Vec3f GatherRows::apply(std::size_t index, std::span<const Vec3f> senders) const {
  constexpr float kUnit = 1.0F / 65535;
  const Row& row = row_[index];
  const RowEntry* entry = chunks_[row.chunk].data() + row.first;
  Vec3f sum;
  for (std::uint32_t k = 0; k < row.count; ++k) {
    const Vec3f& x = senders[entry[k].sender];
    sum.x += static_cast<float>(entry[k].albedo[0]) * x.x;
    sum.y += static_cast<float>(entry[k].albedo[1]) * x.y;
    sum.z += static_cast<float>(entry[k].albedo[2]) * x.z;
  }
  return row.constant + sum * (kUnit / static_cast<float>(sets_.samples()));
}

}  // namespace kiln
