#include "core/reduce/reduce.h"

#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <optional>

#include "core/reduce/clusters.h"
#include "core/reduce/collapse.h"
#include "core/reduce/collect.h"

namespace kiln {
namespace {

constexpr std::uint64_t kBaseBytes = 64ULL << 20;  // program, batches, stacks
constexpr std::uint64_t kLeafBytes = 560;          // a clustered vertex and its two triangles, collapse() included
constexpr std::uint64_t kTexelBytes = 44;          // sums, both textures, their files on the way out
constexpr std::uint64_t kDeepTexelBytes = 50;      // with normals of 16 bits, and those in their file
constexpr std::uint64_t kResultBytes = 400;        // a triangle of the result: mesh, charts, candidate lists
constexpr double kMoreThanAsked = 4;               // vertices that the collapse gets, per vertex of the result
constexpr double kTexelsATriangle = 8;             // of the model, where memory allows

/// The model as the steps see it: tells what passes by, and how much memory is in use.
class Watched {
 public:
  Watched(const TriangleSource& source, const Reduce& params, std::uint64_t& most)
      : source_(source), params_(params), most_(most) {}

  TriangleSource source() const {
    TriangleSource out = source_;
    out.stream = [this](Detail detail, const TriangleSource::Take& take, Threads& threads) {
      return source_.stream(
          detail,
          [&](const TriangleBatch& batch) {
            take(batch);
            look();
            if (params_.advance) params_.advance(batch.first + batch.triangles(), source_.triangles);
          },
          threads);
    };
    return out;
  }
  void look() const { most_ = std::max(most_, own_memory_bytes()); }
  void begin(const std::string& stage, double fraction) const {
    look();
    if (params_.begin) params_.begin(stage, fraction);
  }

 private:
  const TriangleSource& source_;
  const Reduce& params_;
  std::uint64_t& most_;
};

int power_of_two(double side) {
  int out = 64;
  while (out < side && out < 8192) out *= 2;
  return out;
}

/// Eight texels for a triangle of the model, or those of its texture. Measured: core/reduce/README.md.
std::uint64_t texel_bytes(const Reduce& params) { return params.normal_bits == 16 ? kDeepTexelBytes : kTexelBytes; }

int map_side(const TriangleSource& source, const Reduce& params, std::uint64_t usable) {
  if (params.map_side >= 0) return params.map_side;
  const auto most = static_cast<double>(usable) / static_cast<double>(texel_bytes(params));
  const double wanted =
      std::max(kTexelsATriangle * static_cast<double>(source.triangles), static_cast<double>(source.texels));
  int side = power_of_two(std::sqrt(wanted));
  side = std::max(side, power_of_two(std::sqrt(20.0 * static_cast<double>(params.triangles))));
  side = std::min(side, 4096);
  while (side > 64 && double(side) * side > most) side /= 2;
  return side;
}

/// The map as planned, or a finer one where its charts take more; nothing where memory does not allow that.
std::optional<Atlas> atlas_of(const Surface& surface, const ReducePlan& plan) {
  if (plan.map_side == 0) return std::nullopt;
  Atlas atlas = make_charts(surface.position, surface.triangles);
  for (int side = plan.map_side; side <= std::max(plan.map_side, plan.most_map_side); side *= 2) {
    if (place_charts(atlas, side)) return atlas;
  }
  return std::nullopt;
}

tl::unexpected<Fault> too_little(std::uint64_t needed, const Reduce& params) {
  const auto megabytes = [](std::uint64_t bytes) { return std::to_string((bytes + (1 << 20) - 1) >> 20); };
  return fault("memory_limit", "the reduction would need about " + megabytes(needed) +
                                   " MB and limits.memory_mb allows " + megabytes(params.memory_bytes) +
                                   " MB; lower /steps/0/triangles or /steps/0/normal_map, or raise the limit");
}

}  // namespace

std::uint64_t own_memory_bytes() {
  std::ifstream file("/proc/self/statm");
  std::uint64_t total = 0, resident = 0, of_files = 0;
  file >> total >> resident >> of_files;
  return (resident - std::min(resident, of_files)) * static_cast<std::uint64_t>(::sysconf(_SC_PAGESIZE));
}

Result<ReducePlan> plan_reduction(const TriangleSource& source, const Reduce& params) {
  ReducePlan plan;
  plan.unchanged = source.triangles <= params.triangles;
  const std::uint64_t taken = kBaseBytes + source.memory_bytes;
  const std::uint64_t limit = params.memory_bytes / 10 * 9;
  const std::uint64_t usable = limit > taken ? limit - taken : 0;
  const std::uint64_t result = params.triangles * kResultBytes;
  if (plan.unchanged) {
    plan.memory_bytes = taken + source.triangles * kCollectedBytes;
    plan.seconds = 2e-6 * static_cast<double>(source.triangles);
    return plan;
  }
  plan.map_side = map_side(source, params, usable > result ? usable - result : 0);
  plan.most_map_side = 8192;
  while (std::uint64_t(plan.most_map_side) * std::uint64_t(plan.most_map_side) * texel_bytes(params) + result >
             usable &&
         plan.most_map_side > 64)
    plan.most_map_side /= 2;
  const std::uint64_t whole = source.triangles * kCollectedBytes;
  const auto wanted = static_cast<std::uint64_t>(kMoreThanAsked * 0.5 * static_cast<double>(params.triangles));
  std::uint64_t first = whole;
  plan.in_core = whole <= usable;
  if (!plan.in_core) {
    plan.vertices = std::min(wanted, usable / kLeafBytes);
    const std::uint64_t surface = plan.vertices * 140;
    const std::uint64_t room = usable > surface ? (usable - surface) / kCellBytes : 0;
    plan.cells =
        params.method == ReduceMethod::cluster ? std::min(room, plan.vertices) : std::min(room, 16 * plan.vertices);
    first = std::max(plan.cells * kCellBytes + surface, plan.vertices * kLeafBytes);
  }
  const auto texels = static_cast<std::uint64_t>(plan.map_side) * static_cast<std::uint64_t>(plan.map_side);
  plan.memory_bytes = taken + std::max(first, result + texels * texel_bytes(params));
  const auto in = static_cast<double>(source.triangles), out = static_cast<double>(params.triangles);
  const double collapsed = plan.in_core ? in - out : kMoreThanAsked * out;
  plan.seconds =
      (plan.in_core ? 1.5e-6 : 0.7e-6) * in + 3e-6 * collapsed + 2e-5 * out + 4e-7 * static_cast<double>(texels);
  if (2 * plan.vertices < params.triangles && !plan.in_core)
    return too_little(taken + params.triangles / 2 * kLeafBytes, params);
  if (plan.memory_bytes > params.memory_bytes) return too_little(plan.memory_bytes, params);
  return plan;
}

Result<Reduced> reduce(const TriangleSource& file, const ReducePlan& plan, const Reduce& params, Threads& threads) {
  if (plan.memory_bytes > params.memory_bytes) return too_little(plan.memory_bytes, params);
  Reduced out;
  const Watched watched(file, params, out.own_memory_bytes);
  const TriangleSource source = watched.source();
  watched.begin("measure", 0.1);
  KILN_TRY(extent, measure(source, threads));
  out.frame = extent.frame();
  out.input_triangles = extent.triangles;

  watched.begin(plan.in_core || plan.unchanged ? "collect" : "cluster", 0.4);
  const auto first = [&]() -> Result<Surface> {
    if (plan.in_core || plan.unchanged) return collect(source, extent, threads);
    const bool adaptive = params.method == ReduceMethod::adaptive;
    return cluster(source, extent, {.cells = plan.cells, .vertices = adaptive ? plan.vertices : 0}, threads);
  };
  KILN_TRY(surface, first());
  out.clustered_triangles = surface.triangles.size();
  threads.check();
  watched.begin("collapse", 0.6);
  const std::size_t before = surface.triangles.size();
  if (!plan.unchanged && before > params.triangles) {
    collapse(surface, params.triangles, threads, [&](std::size_t left) {
      watched.look();
      if (params.advance) params.advance(before - left, before - params.triangles);
    });
  }
  if (surface.triangles.empty()) {
    return fault("nothing_left", "All triangles are smaller than a cell, or have no area: ask for more triangles.",
                 source.name);
  }
  watched.begin("atlas", 0.65);
  const std::optional<Atlas> atlas = atlas_of(surface, plan);
  out.map_left_out = plan.map_side > 0 && !atlas;
  out.mesh = delivered_mesh(surface, atlas ? &*atlas : nullptr, source.colors);
  surface = {};
  if (atlas) out.charts = atlas->charts.size();

  watched.begin("project", 0.9);
  const double diagonal = length(extent.high - extent.low) / out.frame.scale;
  const Projecting what{.mesh = out.mesh,
                        .atlas = atlas ? &*atlas : nullptr,
                        .frame = out.frame,
                        .diagonal = diagonal > 0 ? diagonal : 1,
                        .triangles = extent.triangles,
                        .seed = params.seed};
  KILN_TRY(projection, project(source, what, threads));
  out.error = projection.error;
  out.plain_normal_degrees = out.normal_degrees = normal_error(out.mesh, nullptr, projection.probes);
  watched.begin("maps", 0.95);
  if (!atlas) return out;
  out.maps = make_maps(out.mesh, *atlas, projection.texels, source.colors, params.normal_bits, threads);
  watched.look();
  out.normal_degrees = normal_error(out.mesh, &out.maps, projection.probes);
  return out;
}

}  // namespace kiln
