#include "core/prt/direct_transfer.h"

#include <array>
#include <atomic>
#include <bit>

#include "core/base/expects.h"
#include "core/base/random.h"
#include "core/prt/direction_sets.h"
#include "core/prt/morton.h"
#include "core/prt/ray_origin.h"
#include "core/prt/row_sum.h"
#include "core/prt/support_tree.h"
#include "core/sphere/sh.h"

namespace kiln {
namespace {

constexpr int kSets = 3;            // 0.5 MB at order 6 and 1024 samples: the cache of one core
constexpr std::size_t kBlock = 64;  // points of a unit of work

constexpr std::size_t kMaxRow = 104;
using Row = std::array<float, kMaxRow>;

}  // namespace

DirectionSets transfer_directions(const DirectTransfer& params) {
  return DirectionSets(params.order, params.samples, kSets, mix64(params.seed));
}

struct DirectTransferBaker::State {
  State(const Tracer& tracer, const DirectTransfer& params)
      : tracer_(tracer), params_(params), sets_(transfer_directions(params)), support_(tracer.scene().mesh.position) {}

  // Writes the transfer vector of a point; true if it took rays.
  bool bake(const TransferPoint& point, std::uint64_t item, float* out) const {
    if (is_open(point)) {
      clamped_cosine_transfer(params_.order, point.normal, out);
      return false;
    }
    const LocalFrame frame = local_frame(sets_, point.normal, params_.seed, item);
    alignas(64) Row sum{};
    const bool from_closed_form = sum_minority(point, frame, sum);
    project(point, frame, from_closed_form, sum, out);
    return true;
  }

  bool is_open(const TransferPoint& p) const {
    return !support_.rises_above(p.normal, dot(p.normal, p.position) + kOpenTolerance);
  }

  // Traces all rays; sums the rows of the occluded or of the open ones, whichever are fewer. True: of the occluded.
  bool sum_minority(const TransferPoint& point, const LocalFrame& frame, Row& sum) const {
    std::array<std::uint16_t, kMaxPackets> mask;
    const int packets = sets_.samples() / kPacket;
    const int occluded = trace(point, frame, std::span(mask).first(static_cast<std::size_t>(packets)));
    const bool few_occluded = 2 * occluded < sets_.samples();
    for (int p = 0; p < packets; ++p) {
      const auto bits = static_cast<std::uint16_t>(few_occluded ? mask[static_cast<std::size_t>(p)]
                                                                : ~mask[static_cast<std::size_t>(p)]);
      if (bits != 0) add_rows(sets_.row(frame.set, p * kPacket), sets_.row_width(), bits, sum.data());
    }
    return few_occluded;
  }

  int trace(const TransferPoint& point, const LocalFrame& frame, std::span<std::uint16_t> mask) const {
    Rays16 rays;
    const Vec3f origin = ray_origin(point);
    rays.ox.fill(origin.x), rays.oy.fill(origin.y), rays.oz.fill(origin.z), rays.far.fill(kFar);
    int occluded = 0;
    for (std::size_t p = 0; p < mask.size(); ++p) {
      sets_.turn(frame.set, static_cast<int>(p), frame.basis, rays);
      mask[p] = static_cast<std::uint16_t>(tracer_.occluded16(rays));
      occluded += std::popcount(mask[p]);
    }
    return occluded;
  }

  // t = closed form - occluded / N, or open / N; the sum is turned from the local frame into world axes once.
  void project(const TransferPoint& point, const LocalFrame& frame, bool from_closed_form, Row& sum, float* out) const {
    const float weight = 1.0F / static_cast<float>(sets_.samples());
    const int count = sh_count(params_.order);
    rotate_sh(params_.order, frame.basis, sum.data(), sum.data());
    if (from_closed_form) clamped_cosine_transfer(params_.order, point.normal, out);
    for (int i = 0; i < count; ++i) {
      const float part = weight * sum[static_cast<std::size_t>(i)];
      out[i] = from_closed_form ? out[i] - part : part;
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
  state_ = std::make_unique<State>(tracer, params);
}

DirectTransferBaker::~DirectTransferBaker() = default;

std::vector<float> DirectTransferBaker::bake(std::span<const TransferPoint> points, Threads& threads,
                                             TransferStats* stats) const {
  const auto width = static_cast<std::size_t>(sh_count(state_->params_.order));
  std::vector<float> out(points.size() * width);
  const std::vector<std::uint32_t> order = morton_order_of(points);
  std::atomic<std::uint64_t> traced = 0;
  threads.for_blocks(points.size(), kBlock, [&](std::size_t begin, std::size_t end) {
    std::uint64_t count = 0;
    for (std::size_t i = begin; i < end; ++i) {
      const std::uint32_t v = order[i];
      count += state_->bake(points[v], point_key(points[v]), out.data() + v * width) ? 1 : 0;
    }
    traced += count;
  });
  if (stats != nullptr) {
    stats->rays += traced * static_cast<std::uint64_t>(state_->sets_.samples());
    stats->open_points += points.size() - traced;
  }
  return out;
}

std::vector<float> bake_direct_transfer(const Tracer& tracer, std::span<const TransferPoint> points,
                                        const DirectTransfer& params, Threads& threads, TransferStats* stats) {
  return DirectTransferBaker(tracer, params).bake(points, threads, stats);
}

}  // namespace kiln
