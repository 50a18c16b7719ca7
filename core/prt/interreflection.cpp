#include "core/prt/interreflection.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <optional>

#include "core/base/expects.h"
#include "core/base/shared_loop.h"
#include "core/mesh/topology.h"
#include "core/prt/gather.h"
#include "core/prt/morton.h"
#include "core/prt/support_tree.h"

namespace kiln {
namespace {

constexpr int kSets = 8;            // of directions only: 12 bytes a ray
constexpr std::size_t kBlock = 64;  // vertices of a unit of work

// Later passes average the noise of earlier ones over hundreds of vertices and weaken it by the albedo, twice at least:
// passes before the last two take a quarter of the rays. Measured in core/prt/README.md.
constexpr int kLatePasses = 2, kEarlyShare = 4;

int early_samples(const Interreflection& params) { return std::max(1, params.samples / kEarlyShare); }

// The error is a mean over the surface, so that noise at a vertex of little surface hardly counts: rays in proportion
// to the root of the area around it leave the least for their number (Lagrange). Little is what is small beside the
// median, so that a model on a large floor keeps its rays. No vertex takes fewer than a quarter of them: whoever looks
// closely finds at most twice the noise.
constexpr std::array<int, 3> kShares = {1, 2, 4};

/// Index into kShares of each vertex: the share nearest to the root of its area over the median.
std::vector<std::uint8_t> shares_of(const Mesh& mesh) {
  std::vector<float> area(mesh.position.size());
  for (const Triangle& t : mesh.triangles) {
    for (const std::uint32_t v : t) area[v] += static_cast<float>(triangle_area(mesh, t));
  }
  std::vector<float> sorted = area;
  const auto middle = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2);
  std::nth_element(sorted.begin(), middle, sorted.end());
  std::vector<std::uint8_t> out;
  for (const float a : area) {
    const float root = std::sqrt(a / std::max(*middle, std::numeric_limits<float>::min()));
    out.push_back(root > 0.7F ? 0 : root > 0.35F ? 1 : 2);
  }
  return out;
}

bool is_grey(const Vec3f& x) { return x.x == x.y && x.y == x.z; }

/// Of direct light at vertices, and of lights that may light nothing but places between them.
bool lamps_are_grey(const std::vector<Vec3f>& light, const Scene& scene) {
  return std::ranges::all_of(light, is_grey) && std::ranges::all_of(scene.lights, is_grey, &Light::intensity);
}

// Vectors of one pass: rows for distant light, RGB for lamps.
struct Layer {
  PackedRows rows;
  std::vector<Vec3f> fixed;
};

// The final coefficients of a vertex leave room for two packed rows: T_k and T_{k+1} live where the result will be.
std::size_t pitch_of(const Transfer& t) {
  return std::max(t.stride() * sizeof(float), 2 * PackedRows::row_bytes(t.order, t.channels));
}

class Solver {
 public:
  Solver(const Tracer& tracer, std::vector<float> direct, std::vector<Vec3f> fixed, const Interreflection& params)
      : tracer_(tracer),
        mesh_(tracer.scene().mesh),
        params_(params),
        faces_(tracer.scene()),
        albedo_(tracer.scene()),
        lamps_(tracer),
        face_of_(widest_faces(mesh_)),
        direct_storage_(mesh_.position.size() * PackedRows::row_bytes(params.order, 1)),
        direct_(params.order, 1, direct_storage_.data(), PackedRows::row_bytes(params.order, 1)),
        fixed_direct_(std::move(fixed)) {
    for (std::size_t v = 0; v < mesh_.position.size(); ++v) direct_.store(v, direct.data() + v * count());
    const bool grey = params.bounces == 0 && lamps_are_grey(fixed_direct_, tracer.scene());
    const int channels = grey ? 1 : transfer_channels(faces_, tracer.scene(), fixed_direct_);
    out_ = {.order = params.order, .channels = channels, .fixed = !fixed_direct_.empty(), .coefficients = {}};
    pitch_ = pitch_of(out_);
  }

  Transfer solve(Threads& threads, TransferStats* stats, ProbeNoise* noise) {
    if (params_.bounces > 0) plan_work();
    if (params_.bounces > 0 && !fixed_direct_.empty()) find_spots();
    out_.coefficients.resize(mesh_.position.size() * (pitch_ / sizeof(float)));
    Layer light = layer(0);  // T_0 = D
    for (std::size_t v = 0; v < mesh_.position.size(); ++v) {
      store(light, v, direct_row(v), fixed_at(v), params_.bounces > 0);
    }
    if (params_.bounces > 0) iterate(light, threads, stats, noise);
    unpack(light);
    return std::move(out_);
  }

 private:
  using Row = std::array<float, 3 * sh_count(kMaxShOrder)>;
  std::size_t count() const { return static_cast<std::size_t>(sh_count(params_.order)); }

  Layer layer(std::size_t half) {
    auto* first = reinterpret_cast<std::byte*>(out_.coefficients.data());
    const std::size_t offset = half * PackedRows::row_bytes(out_.order, out_.channels);
    return {PackedRows(out_.order, out_.channels, first + offset, pitch_), fixed_direct_};
  }

  Row direct_row(std::size_t v) const {
    Row row;
    direct_.load(v, row.data());
    for (int c = 1; c < out_.channels; ++c)
      std::copy_n(row.data(), count(), row.data() + static_cast<std::size_t>(c) * count());
    return row;
  }
  Vec3f fixed_at(std::size_t v) const { return fixed_direct_.empty() ? Vec3f{} : fixed_direct_[v]; }

  // Stores T, or on a part of one albedo the light that leaves it, when another pass will read it.
  void store(Layer& to, std::size_t v, Row row, Vec3f fixed, bool exit) const {
    if (exit && face_of_[v] != kNoFace && faces_.is_plain(face_of_[v])) {
      const Vec3f albedo = faces_.plain(mesh_.part[face_of_[v]]);
      for (int c = 0; c < out_.channels; ++c) {
        for (std::size_t i = 0; i < count(); ++i)
          row[static_cast<std::size_t>(c) * count() + i] *= albedo[static_cast<std::size_t>(c)];
      }
      fixed = fixed * albedo;
    }
    to.rows.store(v, row.data());
    if (!to.fixed.empty()) to.fixed[v] = fixed;
  }

  void find_spots() {
    double light = 0, all = 0;
    for (const Triangle& t : mesh_.triangles) {
      const double area = triangle_area(mesh_, t) / 3;
      for (const std::uint32_t v : t)
        light += area * (fixed_direct_[v].x + fixed_direct_[v].y + fixed_direct_[v].z) / 3;
      all += 3 * area;
    }
    spots_.emplace(tracer_, all > 0 ? light / all : 0, params_.seed);
    if (spots_->empty()) return;
    shares_.emplace(*spots_, lamps_, mesh_, [this](std::uint32_t v) { return point_of(v); });
    spot_source_.emplace(SpotSource{*spots_, *shares_, fixed_direct_});
  }

  // The order of work, and who needs any: before the rows are there, since both take memory for a while.
  void plan_work() {
    order_ = morton_order(mesh_.position);
    share_ = shares_of(mesh_);
    const SupportTree support(mesh_.position);
    for (std::size_t v = 0; v < mesh_.position.size(); ++v) {
      const Vec3f& n = mesh_.normal[v];
      sees_surfaces_.push_back(support.rises_above(n, dot(n, mesh_.position[v]) + kOpenTolerance));
    }
  }

  // T_{k+1} = D + K T_k, `bounces` times.
  void iterate(Layer& light, Threads& threads, TransferStats* stats, ProbeNoise* noise) {
    const std::vector<DirectionSets> many = shared_sets(params_.samples), few = shared_sets(early_samples(params_));
    Layer next = layer(1);
    std::uint64_t sent = 0;
    for (int pass = 0; pass < params_.bounces; ++pass) {
      const std::vector<DirectionSets>& sets = pass + kLatePasses < params_.bounces ? few : many;
      std::vector<GatherSource> sources;
      for (const DirectionSets& s : sets)
        sources.push_back({tracer_, lamps_, faces_, albedo_, s, light.rows, light.fixed, params_.order, out_.channels,
                           pass, params_.seed, spot_source_ ? &*spot_source_ : nullptr});
      const std::uint64_t rays = gather_all(sources, pass, next, threads);
      if (stats != nullptr) stats->rays += rays;
      if (noise != nullptr && pass + 1 == params_.bounces) noise->difference = draw_probes_twice(sources);
      std::swap(light, next);
      sent += static_cast<std::uint64_t>(sets.front().samples());
      if (params_.progress) params_.progress(sent, rays_per_vertex(params_));
    }
  }

  /// One pass over all vertices, into `next`. Returns the rays sent.
  std::uint64_t gather_all(const std::vector<GatherSource>& sources, int pass, Layer& next, Threads& threads) const {
    BlockCounts rays(order_.size(), kBlock);
    run_loop({.name = "reflections",
              .items = order_.size(),
              .block = kBlock,
              .body =
                  [&](std::size_t begin, std::size_t end) {
                    std::vector<Gatherer> gatherers(sources.begin(), sources.end());
                    for (std::size_t i = begin; i < end; ++i)
                      update(order_[i], gatherers[share_[order_[i]]], pass, next);
                    for (const Gatherer& g : gatherers) rays.at(begin) += g.rays();
                  },
              .pass =
                  [&](std::size_t begin, std::size_t end, ItemStream& stream) {
                    for (std::size_t i = begin; i < end; ++i) {
                      stream.pass(next.rows.numbers(order_[i]));
                      if (!next.fixed.empty()) stream.pass(next.fixed[order_[i]]);
                    }
                    rays.pass(begin, end, stream);
                  }},
             threads);
    return rays.sum();
  }

  std::vector<DirectionSets> shared_sets(int samples) const {
    std::vector<DirectionSets> out;
    for (const int share : kShares) out.emplace_back(0, std::max(1, samples / share), kSets, mix64(params_.seed));
    return out;
  }

  std::vector<float> draw_probes_twice(const std::vector<GatherSource>& first) const {
    std::vector<GatherSource> second = first;
    for (GatherSource& s : second) s.seed = mix64(s.seed ^ 0x6e6f697365ULL);
    std::vector<Gatherer> once(first.begin(), first.end()), again(second.begin(), second.end());
    const std::size_t slots = count() + (out_.fixed ? 1 : 0);
    std::vector<float> difference(params_.probes.size() * 3 * slots, 0.0F);
    float* to = difference.data();
    for (const std::uint32_t v : params_.probes) {
      if (sees_surfaces_[v]) {
        Gatherer &a = once[share_[v]], &b = again[share_[v]];
        a.gather(point_of(v));
        b.gather(point_of(v));
        for (std::size_t c = 0; c < 3; ++c) {
          const std::size_t from = (out_.channels == 1 ? 0 : c) * count();
          for (std::size_t i = 0; i < count(); ++i) to[c * slots + i] = b.result()[from + i] - a.result()[from + i];
          if (out_.fixed) to[c * slots + count()] = b.fixed()[c] - a.fixed()[c];
        }
      }
      to += 3 * slots;
    }
    return difference;
  }

  void update(std::uint32_t v, Gatherer& gatherer, int pass, Layer& next) const {
    Row row = direct_row(v);
    Vec3f fixed = fixed_at(v);
    if (sees_surfaces_[v]) {
      gatherer.gather(point_of(v));
      const std::span<const float> reflected = gatherer.result();
      for (std::size_t i = 0; i < reflected.size(); ++i) row[i] += reflected[i];
      fixed += gatherer.fixed();
      limit_transfer({.order = params_.order, .channels = out_.channels, .coefficients = {}}, row.data());
    }
    store(next, v, row, fixed, pass + 1 < params_.bounces);
  }

  TransferPoint point_of(std::uint32_t v) const {
    const auto found = std::ranges::lower_bound(params_.stand_ins, v, {}, &StandIn::vertex);
    if (found != params_.stand_ins.end() && found->vertex == v) return found->point;
    return vertex_point(mesh_, v, face_of_[v]);
  }

  // Packed rows become coefficients in place: a vertex's place ends before the rows of the next.
  void unpack(const Layer& light) {
    float* to = out_.coefficients.data();
    Row row;
    for (std::size_t v = 0; v < mesh_.position.size(); ++v) {
      light.rows.load(v, row.data());
      for (int c = 0; c < out_.channels; ++c) {
        to = std::copy_n(row.data() + static_cast<std::size_t>(c) * count(), count(), to);
        if (out_.fixed) *to++ = light.fixed[v][static_cast<std::size_t>(c)];
      }
    }
    out_.coefficients.resize(mesh_.position.size() * out_.stride());
  }

  const Tracer& tracer_;
  const Mesh& mesh_;
  const Interreflection& params_;
  GatherFaces faces_;
  HitAlbedo albedo_;
  Lamps lamps_;
  std::vector<std::uint32_t> face_of_;
  std::vector<std::byte> direct_storage_;
  PackedRows direct_;
  std::vector<Vec3f> fixed_direct_;
  std::vector<std::uint32_t> order_;
  std::vector<bool> sees_surfaces_;
  std::vector<std::uint8_t> share_;
  std::optional<BrightSpots> spots_;
  std::optional<SpotShares> shares_;
  std::optional<SpotSource> spot_source_;
  Transfer out_;
  std::size_t pitch_ = 0;
};

}  // namespace

std::uint64_t rays_per_vertex(const Interreflection& params) {
  const int late = std::min(params.bounces, kLatePasses);
  return static_cast<std::uint64_t>(late) * static_cast<std::uint64_t>(params.samples) +
         static_cast<std::uint64_t>(params.bounces - late) * static_cast<std::uint64_t>(early_samples(params));
}

int transfer_channels(const GatherFaces& faces, const Scene& scene, const std::vector<Vec3f>& fixed_direct) {
  return faces.grey() && lamps_are_grey(fixed_direct, scene) ? 1 : 3;
}

void limit_transfer(const Transfer& shape, float* row) {
  constexpr float kAll = 0.28209479F;  // Y(0,0)
  const auto count = static_cast<std::size_t>(sh_count(shape.order));
  for (int c = 0; c < shape.channels; ++c, row += shape.slots()) {
    if (row[0] <= kAll) continue;
    const float share = kAll / row[0];
    for (std::size_t i = 0; i < count; ++i) row[i] *= share;
  }
}

Transfer bake_interreflection(const Tracer& tracer, const Mesh& mesh, std::vector<float> direct,
                              std::vector<Vec3f> fixed_direct, const Interreflection& params, Threads& threads,
                              TransferStats* stats, ProbeNoise* noise) {
  EXPECTS(params.order >= 1 && params.order <= kMaxShOrder);
  EXPECTS(params.bounces >= 0 && params.samples >= 1 && params.samples <= 65536);
  EXPECTS(mesh.position.size() == tracer.scene().mesh.position.size());
  EXPECTS(direct.size() == mesh.position.size() * static_cast<std::size_t>(sh_count(params.order)));
  EXPECTS(fixed_direct.empty() || fixed_direct.size() == mesh.position.size());
  Solver solver(tracer, std::move(direct), std::move(fixed_direct), params);
  return solver.solve(threads, stats, noise);
}

}  // namespace kiln
