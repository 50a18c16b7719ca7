#include "core/prt/subdivide.h"

#include <algorithm>
#include <cmath>
#include <deque>
#include <optional>
#include <queue>

#include "core/base/expects.h"
#include "core/mesh/topology.h"
#include "core/prt/fit_vertices.h"
#include "core/prt/row_store.h"
#include "core/prt/split_measure.h"
#include "core/prt/split_mesh.h"

namespace kiln {
namespace {

// A round splits every queued triangle whose error is at least this fraction of the largest. The error of a child is
// about half its parent's or less, so a round takes what the strict queue would take next, and fills a batch.
constexpr float kRound = 0.6F;

struct Candidate {
  float error;
  std::uint32_t leaf;
  friend bool operator<(const Candidate& a, const Candidate& b) {  // the queue's top: largest error, lowest leaf
    return a.error != b.error ? a.error < b.error : a.leaf > b.leaf;
  }
};

/// The estimate to seven bits. Nothing finer is known, and equal errors are split in the order of the mesh, side by
/// side, which leaves fewer T-vertices.
float coarse(float error) {
  int exponent = 0;
  const float mantissa = std::frexp(error, &exponent);
  return std::ldexp(std::round(mantissa * 128), exponent - 7);
}

class Subdivider {
 public:
  Subdivider(const Mesh& input, const ValueSource& source, const Subdivide& params)
      : mesh_(std::in_place, input), rows_(source.width), source_(source), params_(params) {
    const std::vector<TransferPoint> points = vertex_points(input);
    for (std::size_t i = 0; i < points.size(); i += kBatch) {
      evaluate(std::span(points).subspan(i, std::min(kBatch, points.size() - i)));
    }
  }

  // Figure 2 of the paper, in rounds.
  void run(Threads& threads) {
    queue_new_leaves(threads);
    while (mesh_->closed_triangles() < params_.triangles && !queue_.empty()) {
      split_round();
      queue_new_leaves(threads);
    }
  }

  Subdivided finish(std::size_t input_vertices, Threads& threads) {
    ClosedMesh closed = mesh_->close(input_vertices);
    evaluate(mesh_->take_new_points());
    mesh_.reset();  // its tables are not wanted any more; the fit needs the room
    Subdivided result;
    result.stand_ins = stand_in(closed, threads);
    if (params_.measure == SplitMeasure::residual) {
      result.values = fit_vertices(closed, std::move(rows_), source_.bounded, threads);
    } else {
      result.values.resize(closed.point.size() * rows_.width());
      for (std::size_t v = 0; v < closed.point.size(); ++v) {
        rows_.load(closed.point[v], result.values.data() + v * rows_.width());
      }
    }
    result.mesh = std::move(closed.mesh);
    result.depth = std::move(closed.depth);
    result.evaluated = evaluated_;
    return result;
  }

 private:
  /// Gives hidden vertices the rows of their stand-ins, and takes back what hidden middles said.
  std::vector<StandIn> stand_in(ClosedMesh& closed, Threads& threads) {
    if (!source_.hidden) return {};
    std::vector<bool> dark;
    for (const std::uint32_t point : closed.point) dark.push_back(is_dark(point));
    std::vector<StandIn> found = find_stand_ins(closed.mesh, dark, source_.hidden, threads);
    give_rows(found, closed);
    drop_hidden_middles(closed, threads);
    return found;
  }

  void give_rows(const std::vector<StandIn>& stand_ins, ClosedMesh& closed) {
    std::vector<TransferPoint> points;
    for (const StandIn& s : stand_ins) {
      closed.point[s.vertex] = static_cast<std::uint32_t>(rows_.size() + points.size());
      points.push_back(s.point);
    }
    evaluate(points);
  }

  void drop_hidden_middles(ClosedMesh& closed, Threads& threads) const {
    const auto suspect = [&](const EdgeSample& s) {  // between two dark vertices it does no harm
      return is_dark(s.point) && !(is_dark(closed.point[s.a]) && is_dark(closed.point[s.b]));
    };
    std::vector<MeshEdge> edges;
    for (const EdgeSample& s : closed.samples) {
      if (suspect(s)) edges.push_back({std::min(s.a, s.b), std::max(s.a, s.b)});
    }
    std::ranges::sort(edges);
    const std::vector<bool> hidden = hidden_middles(closed.mesh, edges, source_.hidden, threads);
    std::erase_if(closed.samples, [&](const EdgeSample& s) {
      if (!suspect(s)) return false;
      const auto at = std::ranges::lower_bound(edges, MeshEdge{std::min(s.a, s.b), std::max(s.a, s.b)});
      return bool{hidden[static_cast<std::size_t>(at - edges.begin())]};
    });
  }

  bool is_dark(std::uint32_t point) const {
    std::array<float, RowStore::kFour> y{};
    for (std::size_t four = 0; four < rows_.fours(); ++four) {
      rows_.load_four(point, four, y.data());
      if (std::ranges::any_of(y, [](float value) { return value != 0; })) return false;
    }
    return true;
  }

  std::vector<float> call_source(std::span<const TransferPoint> points, bool rough = false) {
    if (points.empty()) return {};
    std::vector<float> values = rough && source_.rough ? source_.rough(points) : source_.values(points);
    EXPECTS(values.size() == points.size() * rows_.width());
    evaluated_ += points.size();
    return values;
  }

  void evaluate(std::span<const TransferPoint> points) { rows_.append(call_source(points)); }

  void split_round() {
    const float least = kRound * queue_.top().error;
    while (!queue_.empty() && queue_.top().error >= least && mesh_->closed_triangles() < params_.triangles) {
      const std::uint32_t leaf = queue_.top().leaf;
      queue_.pop();
      if (!mesh_->split(leaf, params_.triangles)) {
        if (++refused_ == kMostRefused) queue_ = {};
        continue;
      }
      refused_ = 0;
    }
  }

  // Estimates the error of every leaf that came since the last call and queues those above the threshold.
  void queue_new_leaves(Threads& threads) {
    const auto end = static_cast<std::uint32_t>(mesh_->leaves().size());
    while (seen_leaves_ < end) {
      threads.check();
      std::vector<std::uint32_t> fresh;
      for (; seen_leaves_ < end && fresh.size() < kBatch; ++seen_leaves_) {
        if (mesh_->leaves()[seen_leaves_].depth < params_.max_depth) fresh.push_back(seen_leaves_);
      }
      const std::vector<float> error =
          params_.measure == SplitMeasure::residual ? residuals(fresh, threads) : edge_errors(fresh, threads);
      for (std::size_t i = 0; i < fresh.size(); ++i) {
        if (error[i] > params_.threshold && error[i] > 0) queue_.push({coarse(error[i]), fresh[i]});
      }
    }
  }

  /// Rows of some points, unpacked: the columns of `points` one after the other.
  template <std::size_t N>
  std::array<Values, N> load(const std::array<std::uint32_t, N>& points, std::vector<float>& room) const {
    std::array<Values, N> rows;
    room.resize(N * rows_.width());
    for (std::size_t k = 0; k < N; ++k) {
      rows_.load(points[k], room.data() + k * rows_.width());
      rows[k] = Values(room).subspan(k * rows_.width(), rows_.width());
    }
    return rows;
  }

  std::array<std::uint32_t, 3> points_of(const Triangle& corner) const {
    return {mesh_->point_of(corner[0]), mesh_->point_of(corner[1]), mesh_->point_of(corner[2])};
  }

  std::vector<float> edge_errors(const std::vector<std::uint32_t>& leaves, Threads& threads) {
    evaluate(mesh_->take_new_points());
    std::vector<float> error(leaves.size());
    threads.for_blocks(leaves.size(), kBlock, [&](std::size_t begin, std::size_t end) {
      std::vector<float> room;
      for (std::size_t i = begin; i < end; ++i) {
        const Triangle& corner = mesh_->leaves()[leaves[i]].corner;
        const std::vector<Vec3f>& normal = mesh_->mesh().normal;
        error[i] = edge_measure(params_, load(points_of(corner), room),
                                {normal[corner[0]], normal[corner[1]], normal[corner[2]]});
      }
    });
    return error;
  }

  // Midpoints become vertices when their edge splits, so their values are kept; a centroid never does.
  std::vector<float> residuals(const std::vector<std::uint32_t>& leaves, Threads& threads) {
    std::vector<std::array<std::uint32_t, 6>> points;  // corners, then the middles that follow each
    std::vector<TransferPoint> centroid;
    for (const std::uint32_t index : leaves) {
      const SplitLeaf leaf = mesh_->leaves()[index];
      const auto& [a, b, c] = leaf.corner;
      const auto [pa, pb, pc] = points_of(leaf.corner);
      points.push_back({pa, pb, pc, mesh_->middle_point(leaf, a, b), mesh_->middle_point(leaf, b, c),
                        mesh_->middle_point(leaf, c, a)});
      centroid.push_back(centroid_point(leaf.corner));
    }
    evaluate(mesh_->take_new_points());
    RowStore inner(rows_.width());  // rounded as the others are: a constant has no residual
    inner.append(call_source(centroid, true));

    std::vector<float> error(leaves.size());
    threads.for_blocks(leaves.size(), kBlock, [&](std::size_t begin, std::size_t end) {
      std::vector<float> room, middle(rows_.width());
      for (std::size_t i = begin; i < end; ++i) {
        const auto [a, b, c, ab, bc, ca] = load(points[i], room);
        inner.load(i, middle.data());
        error[i] = residual_measure({a, b, c}, {ab, bc, ca}, middle,
                                    triangle_area(mesh_->mesh(), mesh_->leaves()[leaves[i]].corner));
      }
    });
    return error;
  }

  TransferPoint centroid_point(const Triangle& corner) const {
    const auto& [a, b, c] = corner;
    const Mesh& m = mesh_->mesh();
    const Vec3f face_normal = normalized(area_vector(m, corner), m.normal[a]);
    const Vec3f middle = (m.position[a] + m.position[b] + m.position[c]) / 3.0F;
    return {.position = middle,
            .normal = normalized(m.normal[a] + m.normal[b] + m.normal[c], face_normal),
            .inward = middle,
            .face_normal = face_normal};
  }

  static constexpr std::size_t kBlock = 256;
  static constexpr int kMostRefused =
      256;  // splits one after another: the budget is full, and each attempt costs memory
  // Leaves or points at a time: 20 MB not packed yet. The same for any number of threads, since others may compute
  // them.
  static constexpr std::size_t kBatch = 32768;
  std::optional<SplitMesh> mesh_;
  RowStore rows_;  // of every point of mesh_
  const ValueSource& source_;
  const Subdivide& params_;
  std::priority_queue<Candidate, std::deque<Candidate>> queue_;
  std::uint32_t seen_leaves_ = 0;
  int refused_ = 0;
  std::uint64_t evaluated_ = 0;
};

/// The input with a value at each vertex.
Subdivided sample_vertices(const Mesh& input, const ValueSource& source, Threads& threads) {
  Subdivided out{input, {}, std::vector<std::uint8_t>(input.triangles.size(), 0)};
  const std::vector<TransferPoint> points = vertex_points(input);
  const auto evaluate = [&](const std::vector<TransferPoint>& at) {
    out.evaluated += at.size();
    return at.empty() ? std::vector<float>{} : source.values(at);
  };
  out.values = evaluate(points);
  if (!source.hidden) return out;

  out.stand_ins = find_stand_ins(input, {}, source.hidden, threads);
  std::vector<TransferPoint> moved;
  for (const StandIn& s : out.stand_ins) moved.push_back(s.point);
  const std::vector<float> values = evaluate(moved);
  for (std::size_t i = 0; i < moved.size(); ++i) {
    std::copy_n(values.data() + i * source.width, source.width,
                out.values.data() + out.stand_ins[i].vertex * source.width);
  }
  return out;
}

}  // namespace

Subdivided subdivide(const Mesh& input, const ValueSource& source, const Subdivide& params, Threads& threads) {
  EXPECTS(source.width > 0);
  EXPECTS(params.max_depth >= 0 && params.max_depth <= kMaxSplitDepth);
  if (params.triangles <= input.triangles.size() || params.max_depth == 0)
    return sample_vertices(input, source, threads);
  Subdivider subdivider(input, source, params);
  subdivider.run(threads);
  return subdivider.finish(input.position.size(), threads);
}

}  // namespace kiln
