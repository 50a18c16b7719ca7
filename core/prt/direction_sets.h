#pragma once
// Directions with their SH values, made once and shared by all points: cosine-distributed about +z, or uniform on the
// half space of +z or the sphere.
//
// Each set is a two-dimensional Owen-scrambled Sobol point set, mapped to the hemisphere without distortion. It comes
// in rounds: the rays up to the end of each are a stratified set of their own, the last all of them. Within a round
// rays are ordered along a Morton curve, so that sixteen neighbours make a narrow packet. A point picks a set and an
// azimuth by hash: neighbouring points do not share their noise.
// Shape   row(set, ray) has row_width() floats: Y_i of the local direction, zero padded to a multiple of 8
// Cost    sets x samples x (row_width + 3) floats: 0.5 MB for 3 sets of 1024 at order 6

#include <cstdint>
#include <vector>

#include "core/base/vec.h"
#include "core/trace/tracer.h"

namespace kiln {

enum class Spread { cosine, half_sphere, sphere };

class DirectionSets {
 public:
  /// `samples` is rounded up to a multiple of kPacket. `order` 0: directions only. `first` rays make the first round,
  /// twice as many the first two, and so on; all rays are one round where it is 0.
  DirectionSets(int order, int samples, int sets, std::uint64_t seed, int first = 0, Spread = Spread::cosine);

  int samples() const { return samples_; }
  int row_width() const { return row_width_; }
  int sets() const { return sets_; }
  /// Packets up to the end of each round, ascending.
  const std::vector<int>& rounds() const { return rounds_; }

  const float* row(int set, int ray) const {
    return rows_.data() + index(set, ray) * static_cast<std::size_t>(row_width_);
  }

  /// Writes the directions of packet `packet` (rays 16 packet ... + 15), turned into world axes by `basis`.
  void turn(int set, int packet, const Basis<float>& basis, Rays16& out) const;

 private:
  std::size_t index(int set, int ray) const {
    return static_cast<std::size_t>(set) * static_cast<std::size_t>(samples_) + static_cast<std::size_t>(ray);
  }
  int samples_, sets_, row_width_;
  std::vector<int> rounds_;
  std::vector<float> x_, y_, z_, rows_;
};

struct DirectTransfer;
/// The sets that direct transfer takes for these parameters.
DirectionSets transfer_directions(const DirectTransfer&);

/// Which set a point takes and its frame: z along the normal, azimuth by hash.
struct LocalFrame {
  int set = 0;
  Basis<float> basis;
};
LocalFrame local_frame(const DirectionSets&, const Vec3f& normal, std::uint64_t seed, std::uint64_t item);

}  // namespace kiln
