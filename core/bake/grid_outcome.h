#pragma once
// What the `grid` step brought: the file and what is known of it.

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/artifact/import.h"
#include "core/bake/grid_certificate.h"

namespace kiln {

struct GridPass {
  std::array<int, 3> size{};
  std::uint64_t rays = 0;
  double seconds = 0;
  double relrmse = 0, low = 0, high = 0;  // of the certificate, where there is one
};

struct GridOutcome {
  Bytes file;  // grid.exr
  std::array<int, 3> size{};
  Vec3d spacing;  // world
  GridStats stats;
  int rays = 0;  // of a vertex
  std::optional<GridCertificate> certificate;
  std::vector<GridPass> passes;  // the last is what is delivered
  bool kept = true;              // the promise, where one was made
  std::string ended_by, reason;  // "target_met", "time_spent", "floor"
};

}  // namespace kiln
