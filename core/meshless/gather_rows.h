#pragma once
// Rows of the transport operator between points, traced once and read at every bounce.
//   (T x)(p) = c_p + 1/N sum over N cosine rays of rho_k x[s_k],   s_k = the sender nearest to where ray k lands (1)
// x is irradiance / pi at the senders. Rays are followed as in sender_paths.h: rho_k is the throughput, and what paths
// pick up is the row's constant c_p.
// Paper   Lehtinen et al. 2007, section 6.3, GATHER.   Differs  the paper evaluates the basis at every hit of every
//         bounce, four fifths of its time; a row is a list of senders and albedos, so a bounce is a sparse sweep. Rays
//         are Owen-scrambled Sobol points in eight sets, turned by a random azimuth, instead of one Hammersley set.
// Memory  12 bytes a ray.   Cost  N closest-hit rays and N look-ups a row; 1-2 ns a ray in a sweep
// Error   that of N cosine rays, the light of a sender's disk taken as one, albedo rounded to 2^-17
// Repeat  same bits for any thread count

#include <algorithm>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/base/threads.h"
#include "core/meshless/sender_paths.h"
#include "core/prt/direction_sets.h"

namespace kiln {

/// One ray that found a sender.
struct RowEntry {
  std::uint32_t sender = 0;
  std::array<std::uint16_t, 3> albedo{};  // 65535 is 1
  std::uint16_t ray = 0;
};

/// Irradiance / pi as a linear function of the normal, for each of R, G, B:
///   value(n') = value + n' . turn_c,  turn_c = 1/N sum of light_k (w_k / (n . w_k) - n)                          (2)
/// Rays that graze count as if they did so at kGrazing: their noise would be all that is seen.
struct VectorValue {
  Vec3f value;
  std::array<Vec3f, 3> turn;  // at right angles to n

  Vec3f at(const Vec3f& normal) const {
    return {std::max(0.0F, value.x + dot(turn[0], normal)), std::max(0.0F, value.y + dot(turn[1], normal)),
            std::max(0.0F, value.z + dot(turn[2], normal))};
  }
};

class GatherRows {
 public:
  /// `rays` is rounded up to a multiple of kPacket. Keeps a reference to the paths.
  GatherRows(const SenderPaths&, int rays, std::uint64_t seed);

  /// Traces a row for each point and appends them in order. Adds the rays sent to `rays`.
  /// A point whose first kFirstRays rays all end at dark backs is inside a solid and takes no more.
  void add(std::span<const TransferPoint>, Threads&, std::uint64_t& rays);
  static constexpr int kFirstRays = 4 * kPacket;  // a stratified set of their own
  std::size_t size() const { return row_.size(); }

  /// Equation 1.
  Vec3f apply(std::size_t row, std::span<const Vec3f> senders) const;
  /// Equations 1 and 2; c_p has no direction. `point` is the one that the row was traced for.
  VectorValue apply_vector(std::size_t row, const TransferPoint& point, std::span<const Vec3f> senders) const;

  /// The rays of a row that found a sender.
  std::span<const RowEntry> entries(std::size_t row) const {
    return std::span(chunks_[row_[row].chunk]).subspan(row_[row].first, row_[row].count);
  }
  /// c_p of equation 1.
  Vec3f constant(std::size_t row) const { return row_[row].constant; }

  /// One ray of a row: its share of equation 1 for a sender of 1, and w / (n . w) - n of equation 2.
  struct Ray {
    std::uint32_t sender = 0;
    Vec3f value, aside;
  };
  /// Of each entry of the row, in order; `point` is the one that the row was traced for.
  std::vector<Ray> rays_of(std::size_t row, const TransferPoint& point) const;
  int rays() const { return sets_.samples(); }

 private:
  static constexpr std::size_t kChunk = 64;  // rows: one unit of work and of memory
  struct Row {
    std::uint32_t chunk = 0, first = 0, count = 0;
    Vec3f constant;
  };
  /// One row in the making.
  struct Work {
    std::vector<RowEntry>& entries;
    Row& row;
    Random random;
    std::uint64_t rays = 0;
  };
  void trace(const TransferPoint&, Work&) const;

  const SenderPaths& paths_;
  DirectionSets sets_;
  std::uint64_t seed_;
  std::vector<Row> row_;
  std::vector<std::vector<RowEntry>> chunks_;
};

}  // namespace kiln
