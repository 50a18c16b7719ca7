#include "core/meshless/gather_rows.h"

#include <algorithm>
#include <cmath>

#include "core/base/random.h"
#include "core/base/shared_loop.h"
#include "core/prt/ray_origin.h"

namespace kiln {
namespace {

constexpr int kSets = 8;
constexpr float kGrazing = 0.1F;  // cosine below which a ray's share in (2) grows no more

std::uint16_t to_fixed(float x) { return static_cast<std::uint16_t>(std::lrint(std::clamp(x, 0.0F, 1.0F) * 65535)); }

}  // namespace

GatherRows::GatherRows(const SenderPaths& paths, int rays, std::uint64_t seed)
    : paths_(paths), sets_(0, rays, kSets, mix64(seed), kFirstRays), seed_(seed) {}

void GatherRows::add(std::span<const TransferPoint> points, Threads& threads, std::uint64_t& rays) {
  const std::size_t first_row = row_.size(), first_chunk = chunks_.size();
  row_.resize(first_row + points.size());
  chunks_.resize(first_chunk + (points.size() + kChunk - 1) / kChunk);
  BlockCounts sent(points.size(), kChunk);
  run_loop({.name = "rows",
            .items = points.size(),
            .block = kChunk,
            .body =
                [&](std::size_t begin, std::size_t end) {
                  const std::size_t chunk = first_chunk + begin / kChunk;
                  std::vector<RowEntry>& entries = chunks_[chunk];
                  std::uint64_t own = 0;
                  entries.reserve((end - begin) * static_cast<std::size_t>(sets_.samples()));
                  for (std::size_t i = begin; i < end; ++i) {
                    Row& row = row_[first_row + i];
                    row.chunk = static_cast<std::uint32_t>(chunk);
                    row.first = static_cast<std::uint32_t>(entries.size());
                    Work work{entries, row, Random(seed_, point_key(points[i]), 1)};
                    trace(points[i], work);
                    row.count = static_cast<std::uint32_t>(entries.size()) - row.first;
                    own += work.rays;
                  }
                  sent.at(begin) = own;
                  entries.shrink_to_fit();
                },
            .pass =
                [&](std::size_t begin, std::size_t end, ItemStream& stream) {
                  stream.pass(std::span(row_).subspan(first_row + begin, end - begin));
                  for (std::size_t i = begin; i < end; i += kChunk) stream.pass(chunks_[first_chunk + i / kChunk]);
                  sent.pass(begin, end, stream);
                }},
           threads);
  rays += sent.sum();
}

void GatherRows::trace(const TransferPoint& point, Work& work) const {
  const LocalFrame frame = local_frame(sets_, point.normal, seed_, point_key(point));
  const Vec3f origin = ray_origin(point);
  Rays16 rays;
  Hits16 hits;
  rays.ox.fill(origin.x), rays.oy.fill(origin.y), rays.oz.fill(origin.z), rays.far.fill(kFar);
  int dark = 0;
  for (int packet = 0; packet < sets_.samples() / kPacket; ++packet) {
    if (packet * kPacket == kFirstRays && dark == kFirstRays) break;
    sets_.turn(frame.set, packet, frame.basis, rays);
    paths_.world().tracer.closest16(rays, hits);
    work.rays += kPacket;
    for (std::size_t i = 0; i < kPacket; ++i) {
      if (hits.triangle[i] == kNoHit) continue;
      const Hit hit{hits.t[i], hits.u[i], hits.v[i], hits.triangle[i], false};
      const Vec3f w{rays.dx[i], rays.dy[i], rays.dz[i]};
      if (paths_.world().faces.side(hit.triangle, w) == HitSide::dark) ++dark;
      const SenderPaths::End end = paths_.follow(hit, w, work.random, work.rays);
      work.row.constant += end.picked_up;
      if (end.sender == Senders::kNone) continue;
      const Vec3f& t = end.throughput;
      const auto ray = static_cast<std::uint16_t>(static_cast<std::size_t>(packet * kPacket) + i);
      work.entries.push_back({end.sender, {to_fixed(t.x), to_fixed(t.y), to_fixed(t.z)}, ray});
    }
  }
  work.row.constant = work.row.constant / static_cast<float>(sets_.samples());
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

VectorValue GatherRows::apply_vector(std::size_t index, const TransferPoint& point,
                                     std::span<const Vec3f> senders) const {
  VectorValue out{row_[index].constant, {}};
  for (const Ray& ray : rays_of(index, point)) {
    const Vec3f light = ray.value * senders[ray.sender];
    out.value += light;
    for (std::size_t c = 0; c < 3; ++c) out.turn[c] += ray.aside * light[c];
  }
  return out;
}

std::vector<GatherRows::Ray> GatherRows::rays_of(std::size_t index, const TransferPoint& point) const {
  const Row& row = row_[index];
  const LocalFrame frame = local_frame(sets_, point.normal, seed_, point_key(point));
  const float unit = 1.0F / 65535 / static_cast<float>(sets_.samples());
  std::vector<Ray> out;
  out.reserve(row.count);
  Rays16 rays;
  int packet = -1;
  for (std::uint32_t k = 0; k < row.count; ++k) {
    const RowEntry& entry = chunks_[row.chunk][row.first + k];
    if (entry.ray / kPacket != packet) sets_.turn(frame.set, packet = entry.ray / kPacket, frame.basis, rays);
    const std::size_t lane = entry.ray % kPacket;
    const Vec3f w{rays.dx[lane], rays.dy[lane], rays.dz[lane]};
    const float cosine = dot(w, point.normal);
    Ray& ray = out.emplace_back();
    ray.sender = entry.sender;
    ray.aside = (w - point.normal * cosine) / std::max(cosine, kGrazing);
    for (std::size_t c = 0; c < 3; ++c) ray.value[c] = static_cast<float>(entry.albedo[c]) * unit;
  }
  return out;
}

}  // namespace kiln
