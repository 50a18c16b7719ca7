#pragma once
// Makes the links of a scene (light_links.h): senders, their tree, rows of senders and of more receivers, and what the
// vertices of a mesh read.
//  1. Points on all levels; those up to `sender_level` are senders, on both sides of double-sided faces, so that no
//     light is lost on backs.
//  2. Each sender gathers (gather_rows.h), and its row becomes links (link_rows.h): few for the sweeps
//     among senders, and more for vertices that read there.
//  3. Finer points on the side of the vertex normals gather where one of kProbes lamps in free places lights a point
//     otherwise than the points before it predict: by more than eps times the mean light of that lamp.
//  4. After so many sweeps what is left of the lamps' light is taken for a geometric series (link_sweeps.h).
//  5. Vertices read the receivers around them that they see (reading.h); one without any takes the nearest sender that
//     it sees, and gathers for itself where there is none.
// Paper   Lehtinen et al. 2007, section 6.5.   Differs  receivers are refined by what lamps do, not by the kernel
// alone;
//         one flat set of receivers is read by Shepard weights, as in radiosity.h, instead of splatting the hierarchy
// Repeat  same bits for any thread count.   Fails  never on a valid Scene; Cancelled if stopped

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string_view>

#include "core/meshless/light_links.h"
#include "core/meshless/link_rows.h"
#include "core/meshless/lit_surface.h"
#include "core/prt/hidden.h"

namespace kiln {

inline constexpr std::uint32_t kAutoSenders = 12000;

struct LinkParams {
  PointPlacement points;  // both_sides is set by the builder
  int sender_level = -1;  // -1: the finest with at most `most_senders` points
  std::uint32_t most_senders = kAutoSenders;
  int rays = 1024;    // of a gather
  float eps = 0.02F;  // prediction error that asks for finer points, of a lamp's mean light
  LinkOracle oracle, sender_oracle{.split = 0.01F, .largest = 0.08F};
  int bounces = -1;     // reflections; -1: all. 0: no links
  int neighbours = 10;  // of a vertex
  std::uint64_t seed = 0;
  std::function<void(std::string_view stage)> stage = {};  // told as each begins: points, rows, receivers
};

inline constexpr int kProbes = 12;
inline constexpr std::uint32_t kMostSenders = 48000;  // so that nodes fit 16 bits

struct LinkStats {
  std::uint64_t rays = 0;
  std::vector<std::uint32_t> points, gathered;  // on each level
  std::uint32_t senders = 0;
  int sender_level = 0;
  std::size_t alone = 0;  // vertices with rows of their own
  double left = 0;        // of the probes' light after the sweeps, before the tail
};

/// What rows lose, of the root mean square of the light of the probe lamps over places: `noise` of their rays in what
/// is read there, from a second draw of the row that counts most; `links`, to groups instead of single senders.
struct LinkErrors {
  double noise = 0, links = 0;
  std::uint64_t rays = 0;
};

class LinkBuilder {
 public:
  /// Does steps 1 to 4. Keeps a reference to the tracer.
  LinkBuilder(const Tracer&, const LinkParams&, Threads&);
  ~LinkBuilder();
  LinkBuilder(const LinkBuilder&) = delete;
  LinkBuilder& operator=(const LinkBuilder&) = delete;

  /// How many lamps receivers were refined for, and what each reflects to places (mean of red, green and blue over the
  /// lamp's mean light): value[place * probes + probe]. Places that no receiver reaches are told 0.
  std::size_t probes() const;
  std::vector<float> probe_light(std::span<const TransferPoint>, Threads&) const;

  LinkErrors errors_at(std::span<const TransferPoint>, Threads&) const;
  /// What any places read, as vertices do that see some receiver; nothing at others.
  std::vector<std::vector<RowTerm>> readings_at(std::span<const TransferPoint>, Threads&) const;

  /// Step 5 for the vertices of a mesh on the same surface, and the whole operator.
  LightLinks finish(const Mesh&, Threads&);
  const LinkStats& stats() const;

 private:
  struct Work;
  std::unique_ptr<Work> work_;
};

}  // namespace kiln
