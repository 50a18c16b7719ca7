#include "core/prt/gather.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/mesh/topology.h"
#include "core/prt/row_sum.h"
#include "core/sphere/sh.h"

namespace kiln {
namespace {

void prefetch_row(const std::int16_t* row, int stride) {
  const auto* bytes = reinterpret_cast<const char*>(row);
  for (int line = 0; line < stride * 2; line += 64) __builtin_prefetch(bytes + line);
}

}  // namespace

Gatherer::Gatherer(const GatherSource& source)
    : source_(source),
      paths_(source.tracer, source.lamps, source.albedo, source.order, !source.fixed.empty(),
             source.spots != nullptr ? &source.spots->spots : nullptr) {
  const auto stride = static_cast<std::size_t>(source.rows.stride());
  plain_sum_.resize(stride);
  textured_sum_.resize(stride);
  weight_.resize(stride + 8);  // fill_weights runs over
  result_.resize(static_cast<std::size_t>(source.rows.width()));
}

void Gatherer::gather(const TransferPoint& point) {
  const std::uint64_t key = point_key(point) + static_cast<std::uint64_t>(source_.pass);
  const LocalFrame frame = local_frame(source_.sets, point.normal, source_.seed, key);
  random_ = Random(source_.seed, key, 1);
  std::fill(textured_sum_.begin(), textured_sum_.end(), 0.0F);
  std::fill(plain_sum_.begin(), plain_sum_.end(), 0);
  fixed_ = {};
  normal_ = point.normal;
  paths_.clear();

  const Vec3f origin = ray_origin(point);
  for (Packet& p : packets_) {
    p.rays.ox.fill(origin.x), p.rays.oy.fill(origin.y), p.rays.oz.fill(origin.z), p.rays.far.fill(kFar);
  }
  const int count = source_.sets.samples() / kPacket;
  const auto packet = [&](int step) -> Packet& { return packets_[static_cast<std::size_t>(step) % packets_.size()]; };
  for (int step = 0; step < count + 3; ++step) {
    if (step < count) trace(packet(step), frame, step);
    if (step >= 1 && step < count + 1) choose(packet(step - 1));
    if (step >= 2 && step < count + 2) tap(packet(step - 2));
    if (step >= 3) add(packet(step - 3));
  }
  rays_ += static_cast<std::uint64_t>(source_.sets.samples());
  finish();
  if (source_.spots == nullptr) return;
  fixed_ += source_.spots->spots.look({origin, normal_}, source_.sets.samples(), random_);
  rays_ += static_cast<std::uint64_t>(BrightSpots::looks(source_.sets.samples()));
}

void Gatherer::trace(Packet& packet, const LocalFrame& frame, int index) {
  source_.sets.turn(frame.set, index, frame.basis, packet.rays);
  source_.tracer.closest16(packet.rays, packet.hits);
  const std::vector<Triangle>& triangles = source_.tracer.scene().mesh.triangles;
  for (const std::uint32_t t : packet.hits.triangle) {
    if (t == kNoHit) continue;
    __builtin_prefetch(&triangles[t]);
    __builtin_prefetch(&source_.tracer.scene().mesh.part[t]);
    source_.faces.prefetch(t);
  }
}

void Gatherer::choose(Packet& packet) {
  const std::vector<Triangle>& triangles = source_.tracer.scene().mesh.triangles;
  std::uint64_t bits = 0;
  for (std::size_t i = 0; i < kPacket; ++i, bits >>= 16) {
    if (i % 4 == 0) bits = random_.next();
    const std::uint32_t t = packet.hits.triangle[i];
    packet.vertex[i] = kNoHit;
    if (t == kNoHit) continue;
    const Vec3f direction{packet.rays.dx[i], packet.rays.dy[i], packet.rays.dz[i]};
    const float u = packet.hits.u[i], v = packet.hits.v[i];
    const HitSide side = source_.faces.side(t, direction);
    if (side == HitSide::flipped) {
      BrightSpots::Gathering by;
      if (source_.spots != nullptr) by = gathering(t, direction, packet.hits.t[i]);
      paths_.add({t, u, v, direction, {1, 1, 1}, source_.pass, by}, random_);
    }
    if (side != HitSide::front) continue;
    const float pick = (static_cast<float>(bits & 0xffffU) + 0.5F) * 0x1p-16F;
    const std::uint32_t vertex = triangles[t][pick < u ? 1 : pick < u + v ? 2 : 0];
    packet.vertex[i] = vertex;
    prefetch_row(source_.rows.row(vertex), source_.rows.stride());
    if (!source_.fixed.empty()) __builtin_prefetch(&source_.fixed[vertex]);
    if (!source_.faces.is_plain(t)) source_.albedo.prefetch(t);
  }
}

void Gatherer::tap(Packet& packet) {
  for (std::size_t i = 0; i < kPacket; ++i) {
    const std::uint32_t t = packet.hits.triangle[i];
    if (packet.vertex[i] == kNoHit || source_.faces.is_plain(t)) continue;
    const auto draw = static_cast<std::uint32_t>(random_.next());
    packet.tap[i] = source_.albedo.tap(t, packet.hits.u[i], packet.hits.v[i], draw);
  }
}

void Gatherer::add(const Packet& packet) {
  std::array<const std::int16_t*, kPacket> rows;
  std::size_t count = 0;
  for (std::size_t i = 0; i < kPacket; ++i) {
    const std::uint32_t vertex = packet.vertex[i];
    if (vertex == kNoHit) continue;
    if (source_.faces.is_plain(packet.hits.triangle[i])) {
      rows[count++] = source_.rows.row(vertex);
      if (source_.fixed.empty()) continue;
      fixed_ += source_.fixed[vertex];
      if (source_.spots != nullptr)
        fixed_ +=
            left_to_looks(packet, i) * -source_.faces.plain(source_.tracer.scene().mesh.part[packet.hits.triangle[i]]);
    } else {
      add_textured(packet, i);
    }
  }
  if (count > 0) add_short_rows(std::span(rows).first(count), source_.rows.stride(), plain_sum_.data());
}

void Gatherer::add_textured(const Packet& packet, std::size_t lane) {
  const Vec3f albedo = source_.albedo.read(packet.tap[lane]);
  const std::array<float, 3> rgb = {albedo.x, albedo.y, albedo.z};
  fill_weights(rgb.data(), source_.channels, sh_count(source_.order), weight_.data());
  const std::uint32_t vertex = packet.vertex[lane];
  add_weighted_row(source_.rows.row(vertex), weight_.data(), source_.rows.stride(), textured_sum_.data());
  if (source_.fixed.empty()) return;
  fixed_ += albedo * source_.fixed[vertex];
  if (source_.spots != nullptr) fixed_ += left_to_looks(packet, lane) * -albedo;
}

BrightSpots::Gathering Gatherer::gathering(std::uint32_t triangle, const Vec3f& direction, float distance) const {
  const Mesh& mesh = source_.tracer.scene().mesh;
  const Vec3f face = normalized(area_vector(mesh, mesh.triangles[triangle]), -direction);
  const float cosine = std::max(dot(normal_, direction), 0.0F), facing = std::abs(dot(face, direction));
  const int rays = source_.sets.samples();
  return {rays, static_cast<float>(rays) * cosine * facing /
                    (std::numbers::pi_v<float> * std::max(distance * distance, 1e-20F))};
}

/// Direct light of the vertex that was read which looks find, before it is reflected.
Vec3f Gatherer::left_to_looks(const Packet& packet, std::size_t lane) const {
  const std::uint32_t vertex = packet.vertex[lane], triangle = packet.hits.triangle[lane];
  const auto shares = source_.spots->shares.of(vertex);
  if (shares.empty()) return {};
  const Vec3f direction{packet.rays.dx[lane], packet.rays.dy[lane], packet.rays.dz[lane]};
  const Vec3f origin{packet.rays.ox[lane], packet.rays.oy[lane], packet.rays.oz[lane]};
  const float distance = packet.hits.t[lane];
  const BrightSpots::Gathering by = gathering(triangle, direction, distance);
  const Mesh& mesh = source_.tracer.scene().mesh;
  const Vec3f face = normalized(area_vector(mesh, mesh.triangles[triangle]), -direction);
  Vec3f sum;
  for (const SpotShares::Share& s : shares)
    sum += s.share * source_.spots->spots.share_of_looks(s.lamp, origin + direction * distance, face, by);
  return sum * source_.spots->direct[vertex];
}

void Gatherer::finish() {
  paths_.finish(random_);
  const float weight = 1.0F / static_cast<float>(source_.sets.samples());
  for (std::size_t i = 0; i < result_.size(); ++i) {
    const float rows = source_.rows.unit(static_cast<int>(i)) * (static_cast<float>(plain_sum_[i]) + textured_sum_[i]);
    result_[i] = weight * (rows + paths_.rows()[i]);
  }
  fixed_ = (fixed_ + paths_.fixed()) * weight;
}

}  // namespace kiln
