#pragma once
// What solver: meshless of the `prt` step will do, and what it did.

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/meshless/glossy_points.h"
#include "core/meshless/transfer_sweeps.h"

namespace kiln {

struct MeshlessPlan {
  PointPlacement points;      // what the recipe fixes; the rest follows from the refined mesh
  float eps = 0.02F;          // of reflected light (core/meshless/transfer_sweeps.h)
  float eps_transfer = 0.1F;  // of matrices (core/meshless/glossy_points.h)
};

struct Plan;
struct Effort;
struct PrtStep;

/// Decides on it where the step asks for it.
void plan_meshless(Plan&, const Scene&, const PrtStep&, const Effort&);

/// Points for reflected light on all of a scene: half as many as it has, or will have, vertices.
PointPlacement sweep_points(const MeshlessPlan&, const Scene&, double vertices);
/// Points for the matrices of so many vertices on some parts: three tenths as many.
PointPlacement matrix_points(const MeshlessPlan&, const Scene&, const std::vector<bool>& parts, double vertices);

/// Seconds by what they went into; what begins several times adds up.
class StageClock {
 public:
  void begin(std::string_view stage);
  void end();
  const std::vector<std::pair<std::string, double>>& seconds() const { return seconds_; }

 private:
  std::vector<std::pair<std::string, double>> seconds_;
  std::size_t running_ = 0;  // 1 + its place; 0: none
  double since_ = 0;
};

/// For the report.
struct MeshlessOutcome {
  std::optional<TransferSweepStats> sweeps;  // none where nothing is reflected
  StageClock sweep_clock;
  std::optional<GlossyPointStats> matrices;  // none where there are no matrices
  std::size_t matrix_vertices = 0;
  std::uint64_t matrix_rays = 0;
  StageClock matrix_clock;
};

}  // namespace kiln
