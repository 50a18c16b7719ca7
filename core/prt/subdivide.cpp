#include "core/prt/subdivide.h"

#include <algorithm>
#include <queue>

#include "core/base/expects.h"
#include "core/mesh/topology.h"
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

class Subdivider {
 public:
  Subdivider(const Mesh& input, int width, const ValueSource& source, const Subdivide& params)
      : mesh_(input), width_(static_cast<std::size_t>(width)), source_(source), params_(params) {
    evaluate(vertex_points(input));
  }

  // Figure 2 of the paper, in rounds.
  void run(Threads& threads) {
    queue_new_leaves(threads);
    while (mesh_.closed_triangles() < params_.triangles && !queue_.empty()) {
      split_round();
      queue_new_leaves(threads);
    }
  }

  Subdivided finish(std::size_t input_vertices) {
    ClosedMesh closed = mesh_.close(input_vertices);
    evaluate(mesh_.take_new_points());
    Subdivided result{.mesh = std::move(closed.mesh), .depth = std::move(closed.depth), .evaluated = evaluated_};
    result.values.reserve(closed.vertex.size() * width_);
    for (const std::uint32_t v : closed.vertex) {
      const Values values = at(v);
      result.values.insert(result.values.end(), values.begin(), values.end());
    }
    return result;
  }

 private:
  Values at(std::uint32_t vertex) const { return Values(values_).subspan(vertex * width_, width_); }

  std::vector<float> call_source(const std::vector<TransferPoint>& points) {
    if (points.empty()) return {};
    std::vector<float> values = source_(points);
    EXPECTS(values.size() == points.size() * width_);
    evaluated_ += points.size();
    return values;
  }

  void evaluate(const std::vector<TransferPoint>& points) {
    const std::vector<float> values = call_source(points);
    values_.insert(values_.end(), values.begin(), values.end());
  }

  void split_round() {
    const float least = kRound * queue_.top().error;
    while (!queue_.empty() && queue_.top().error >= least && mesh_.closed_triangles() < params_.triangles) {
      const std::uint32_t leaf = queue_.top().leaf;
      queue_.pop();
      mesh_.split(leaf, params_.triangles);
    }
  }

  // Estimates the error of every leaf that came since the last call and queues those above the threshold.
  void queue_new_leaves(Threads& threads) {
    threads.check();
    const auto end = static_cast<std::uint32_t>(mesh_.leaves().size());
    std::vector<std::uint32_t> fresh;
    for (std::uint32_t leaf = seen_leaves_; leaf < end; ++leaf) {
      if (mesh_.leaves()[leaf].depth < params_.max_depth) fresh.push_back(leaf);
    }
    seen_leaves_ = end;
    const std::vector<float> error =
        params_.measure == SplitMeasure::residual ? residuals(fresh, threads) : edge_errors(fresh, threads);
    for (std::size_t i = 0; i < fresh.size(); ++i) {
      if (error[i] > params_.threshold && error[i] > 0) queue_.push({error[i], fresh[i]});
    }
  }

  std::vector<float> edge_errors(const std::vector<std::uint32_t>& leaves, Threads& threads) {
    evaluate(mesh_.take_new_points());
    std::vector<float> error(leaves.size());
    threads.for_blocks(leaves.size(), kBlock, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        const auto& [a, b, c] = mesh_.leaves()[leaves[i]].corner;
        const std::vector<Vec3f>& normal = mesh_.mesh().normal;
        error[i] = edge_measure(params_, {at(a), at(b), at(c)}, {normal[a], normal[b], normal[c]});
      }
    });
    return error;
  }

  // Midpoints become vertices when their edge splits, so their values are kept; a centroid never does.
  std::vector<float> residuals(const std::vector<std::uint32_t>& leaves, Threads& threads) {
    std::vector<Triangle> middle;
    std::vector<TransferPoint> centroid;
    for (const std::uint32_t index : leaves) {
      const SplitLeaf leaf = mesh_.leaves()[index];
      const auto& [a, b, c] = leaf.corner;
      middle.push_back({mesh_.midpoint(leaf, a, b), mesh_.midpoint(leaf, b, c), mesh_.midpoint(leaf, c, a)});
      centroid.push_back(centroid_point(leaf.corner));
    }
    evaluate(mesh_.take_new_points());
    const std::vector<float> inner = call_source(centroid);

    std::vector<float> error(leaves.size());
    threads.for_blocks(leaves.size(), kBlock, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        const Triangle& corner = mesh_.leaves()[leaves[i]].corner;
        const auto& [a, b, c] = corner;
        const auto& [ab, bc, ca] = middle[i];
        error[i] = residual_measure({at(a), at(b), at(c)}, {at(ab), at(bc), at(ca)},
                                    Values(inner).subspan(i * width_, width_), triangle_area(mesh_.mesh(), corner));
      }
    });
    return error;
  }

  TransferPoint centroid_point(const Triangle& corner) const {
    const auto& [a, b, c] = corner;
    const Mesh& m = mesh_.mesh();
    const Vec3f face_normal = normalized(area_vector(m, corner), m.normal[a]);
    const Vec3f middle = (m.position[a] + m.position[b] + m.position[c]) / 3.0F;
    return {.position = middle,
            .normal = normalized(m.normal[a] + m.normal[b] + m.normal[c], face_normal),
            .inward = middle,
            .face_normal = face_normal};
  }

  static constexpr std::size_t kBlock = 256;
  SplitMesh mesh_;
  std::size_t width_;
  const ValueSource& source_;
  const Subdivide& params_;
  std::vector<float> values_;  // of every vertex of mesh_, used in the end or not
  std::priority_queue<Candidate> queue_;
  std::uint32_t seen_leaves_ = 0;
  std::uint64_t evaluated_ = 0;
};

}  // namespace

Subdivided subdivide(const Mesh& input, int width, const ValueSource& source, const Subdivide& params,
                     Threads& threads) {
  EXPECTS(width > 0);
  EXPECTS(params.max_depth >= 0 && params.max_depth <= kMaxSplitDepth);
  if (params.triangles <= input.triangles.size() || params.max_depth == 0) {
    const std::vector<TransferPoint> points = vertex_points(input);
    return {input, points.empty() ? std::vector<float>{} : source(points),
            std::vector<std::uint8_t>(input.triangles.size(), 0), points.size()};
  }
  Subdivider subdivider(input, width, source, params);
  subdivider.run(threads);
  return subdivider.finish(input.position.size());
}

}  // namespace kiln
