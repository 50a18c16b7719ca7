#include "core/prt/direct_transfer.h"

#include <array>
#include <bit>

#include "core/base/expects.h"
#include "core/base/random.h"
#include "core/base/shared_loop.h"
#include "core/prt/direction_sets.h"
#include "core/prt/morton.h"
#include "core/prt/ray_origin.h"
#include "core/prt/row_sum.h"
#include "core/prt/support_tree.h"
#include "core/sphere/sh.h"

namespace kiln {
namespace {

constexpr int kSets = 3;            // 0.5 MB at order 6 and 1024 samples: the cache of one core
constexpr int kFirstRound = 64;     // rays
constexpr std::size_t kBlock = 64;  // points of a unit of work

constexpr std::size_t kMaxRow = 104;
using Row = std::array<float, kMaxRow>;

}  // namespace

DirectionSets transfer_directions(const DirectTransfer& params) {
  return DirectionSets(params.order, params.samples, kSets, mix64(params.seed), params.tolerance > 0 ? kFirstRound : 0);
}

struct DirectTransferBaker::State {
  State(const Tracer& tracer, const DirectTransfer& params)
      : tracer_(tracer), params_(params), sets_(transfer_directions(params)), support_(tracer.scene().mesh.position) {}

  // Writes the transfer vector of a point and counts its rays; true if it took any.
  bool bake(const TransferPoint& point, std::uint64_t item, std::uint64_t& rays, float* out) const {
    if (is_open(point)) {
      clamped_cosine_transfer(params_.order, point.normal, out);
      return false;
    }
    const LocalFrame frame = local_frame(sets_, point.normal, params_.seed, item);
    Sum sum = sample(point, frame, rays);
    project(point, frame, sum, out);
    return true;
  }

  bool is_open(const TransferPoint& p) const {
    return !support_.rises_above(p.normal, dot(p.normal, p.position) + kOpenTolerance);
  }

  // Sum over the rows of the occluded or of the open rays, whichever were fewer in the first round.
  struct Sum {
    alignas(64) Row row{};
    bool of_occluded = false;
    int rays = 0;
  };

  Sum sample(const TransferPoint& point, const LocalFrame& frame, std::uint64_t& rays) const {
    Sum sum;
    std::array<std::uint16_t, kMaxPackets> mask;
    Row before{};  // mean of the rounds before
    for (const int end : sets_.rounds()) {
      const int begin = sum.rays / kPacket;
      const int occluded = trace(point, frame, begin, std::span(mask).first(static_cast<std::size_t>(end - begin)));
      if (begin == 0) sum.of_occluded = 2 * occluded < end * kPacket;
      for (int p = begin; p < end; ++p) {
        const std::uint16_t hit = mask[static_cast<std::size_t>(p - begin)];
        const auto bits = static_cast<std::uint16_t>(sum.of_occluded ? hit : ~hit);
        if (bits != 0) add_rows(sets_.row(frame.set, p * kPacket), sets_.row_width(), bits, sum.row.data());
      }
      sum.rays = end * kPacket;
      if (params_.tolerance > 0 && settled(sum, before, begin > 0)) break;
    }
    rays += static_cast<std::uint64_t>(sum.rays);
    return sum;
  }

  // Whether the error that is left is likely below the tolerance; moves `before` on to the mean of `sum`.
  bool settled(const Sum& sum, Row& before, bool has_before) const {
    constexpr float kLeft = 0.7F;
    float squared = 0;
    for (int l = 0; l < params_.order; ++l) {
      float band = 0;
      for (int i = l * l; i < (l + 1) * (l + 1); ++i) {
        float& mean = before[static_cast<std::size_t>(i)];
        const float now = sum.row[static_cast<std::size_t>(i)] / static_cast<float>(sum.rays);
        band += (now - mean) * (now - mean);
        mean = now;
      }
      squared += params_.band_power[static_cast<std::size_t>(l)] * band;
    }
    return has_before && kLeft * squared <= params_.tolerance * params_.tolerance;
  }

  int trace(const TransferPoint& point, const LocalFrame& frame, int first, std::span<std::uint16_t> mask) const {
    Rays16 rays;
    const Vec3f origin = ray_origin(point);
    rays.ox.fill(origin.x), rays.oy.fill(origin.y), rays.oz.fill(origin.z), rays.far.fill(kFar);
    int occluded = 0;
    for (std::size_t p = 0; p < mask.size(); ++p) {
      sets_.turn(frame.set, first + static_cast<int>(p), frame.basis, rays);
      mask[p] = static_cast<std::uint16_t>(tracer_.occluded16(rays));
      occluded += std::popcount(mask[p]);
    }
    return occluded;
  }

  // t = closed form - occluded / N, or open / N; the sum is turned from the local frame into world axes once.
  void project(const TransferPoint& point, const LocalFrame& frame, Sum& sum, float* out) const {
    const float weight = 1.0F / static_cast<float>(sum.rays);
    const int count = sh_count(params_.order);
    rotate_sh(params_.order, frame.basis, sum.row.data(), sum.row.data());
    if (sum.of_occluded) clamped_cosine_transfer(params_.order, point.normal, out);
    for (int i = 0; i < count; ++i) {
      const float part = weight * sum.row[static_cast<std::size_t>(i)];
      out[i] = sum.of_occluded ? out[i] - part : part;
    }
  }

  static constexpr std::size_t kMaxPackets = 65536 / kPacket;
  const Tracer& tracer_;
  const DirectTransfer params_;
  DirectionSets sets_;
  SupportTree support_;
};

DirectTransferBaker::DirectTransferBaker(const Tracer& tracer, const DirectTransfer& params) {
  EXPECTS(params.order >= 1 && params.order <= kMaxShOrder);
  EXPECTS(params.samples >= 1 && params.samples <= 65536);
  EXPECTS(params.tolerance == 0 || params.band_power.size() == static_cast<std::size_t>(params.order));
  state_ = std::make_unique<State>(tracer, params);
}

DirectTransferBaker::~DirectTransferBaker() = default;

std::vector<float> DirectTransferBaker::bake(std::span<const TransferPoint> points, Threads& threads,
                                             TransferStats* stats) const {
  const auto width = static_cast<std::size_t>(sh_count(state_->params_.order));
  std::vector<float> out(points.size() * width);
  const std::vector<std::uint32_t> order = morton_order_of(points);
  BlockCounts traced(points.size(), kBlock), rays(points.size(), kBlock);
  const auto row = [&](std::size_t i) { return std::span(out).subspan(order[i] * width, width); };
  run_loop({.name = "direct transfer",
            .items = points.size(),
            .block = kBlock,
            .body =
                [&](std::size_t begin, std::size_t end) {
                  std::uint64_t count = 0, sent = 0;
                  for (std::size_t i = begin; i < end; ++i) {
                    const TransferPoint& p = points[order[i]];
                    count += state_->bake(p, point_key(p), sent, row(i).data()) ? 1 : 0;
                  }
                  traced.at(begin) = count, rays.at(begin) = sent;
                },
            .pass =
                [&](std::size_t begin, std::size_t end, ItemStream& stream) {
                  for (std::size_t i = begin; i < end; ++i) stream.pass(row(i));
                  traced.pass(begin, end, stream);
                  rays.pass(begin, end, stream);
                }},
           threads);
  if (stats != nullptr) {
    stats->rays += rays.sum();
    stats->open_points += points.size() - traced.sum();
  }
  return out;
}

std::vector<float> bake_direct_transfer(const Tracer& tracer, std::span<const TransferPoint> points,
                                        const DirectTransfer& params, Threads& threads, TransferStats* stats) {
  return DirectTransferBaker(tracer, params).bake(points, threads, stats);
}

}  // namespace kiln
