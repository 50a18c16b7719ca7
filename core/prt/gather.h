#pragma once
// One pass of interreflection at one vertex: (K T)(x) from closest-hit rays.
//
// A ray takes the stored vector of one corner of the face it hits, drawn with its barycentric as probability: the
// expectation is the interpolated vector, at a third of the memory traffic. Rows of parts with one albedo are stored
// multiplied by it, so most hits are a sum of integers; other hits weigh the row by the albedo at the hit.
// Four packets are in flight (trace, choose, tap, add), so that memory is asked for before it is needed.

#include <cstdint>
#include <span>
#include <vector>

#include "core/prt/direction_sets.h"
#include "core/prt/flipped_paths.h"
#include "core/prt/gather_faces.h"
#include "core/prt/packed_rows.h"
#include "core/prt/ray_origin.h"
#include "core/prt/spot_shares.h"

namespace kiln {

/// Spots near lamps, and the direct light of the lamps at each vertex.
struct SpotSource {
  const BrightSpots& spots;
  const SpotShares& shares;
  const std::vector<Vec3f>& direct;
};

/// What a pass reads. `fixed` is empty or one RGB a vertex; it and `rows` hold exit light on plain parts.
struct GatherSource {
  const Tracer& tracer;
  const Lamps& lamps;
  const GatherFaces& faces;
  const HitAlbedo& albedo;
  const DirectionSets& sets;
  const PackedRows& rows;
  const std::vector<Vec3f>& fixed;
  int order = 6;
  int channels = 3;
  int pass = 0;  // reflections already in `rows`
  std::uint64_t seed = 0;
  const SpotSource* spots = nullptr;
};

/// Sums of one vertex, and room to work in. One for each block of vertices.
class Gatherer {
 public:
  explicit Gatherer(const GatherSource&);

  /// (K T) at a point: channels x order^2 numbers in result(), and the lamp light in fixed().
  void gather(const TransferPoint&);
  std::span<const float> result() const { return result_; }
  const Vec3f& fixed() const { return fixed_; }
  std::uint64_t rays() const { return rays_ + paths_.rays(); }

 private:
  struct Packet {
    Rays16 rays;
    Hits16 hits;
    std::array<std::uint32_t, kPacket> vertex;  // the corner drawn, or kNoHit
    std::array<HitAlbedo::Tap, kPacket> tap;    // where the part is not plain
  };
  void trace(Packet&, const LocalFrame&, int packet);
  void choose(Packet&);
  void tap(Packet&);
  void add(const Packet&);
  void add_textured(const Packet&, std::size_t lane);
  BrightSpots::Gathering gathering(std::uint32_t triangle, const Vec3f& direction, float distance) const;
  Vec3f left_to_looks(const Packet&, std::size_t lane) const;
  void finish();

  const GatherSource& source_;
  std::array<Packet, 4> packets_;
  Random random_{0, 0};
  std::vector<std::int32_t> plain_sum_;
  std::vector<float> textured_sum_, weight_, result_;
  FlippedPaths paths_;
  Vec3f fixed_, normal_;
  std::uint64_t rays_ = 0;
};

}  // namespace kiln
