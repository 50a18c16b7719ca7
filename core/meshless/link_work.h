#pragma once
// What making links works on (link_builder.h); its own files alone include this. link_builder.cpp places points and
// makes rows, link_refine.cpp chooses receivers, link_vertices.cpp says what the vertices of a mesh read,
// link_errors.cpp what rows lose.

#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "core/meshless/basis.h"
#include "core/meshless/gather_rows.h"
#include "core/meshless/link_builder.h"
#include "core/meshless/link_reading.h"
#include "core/meshless/sender_tree.h"
#include "core/meshless/senders.h"

namespace kiln {

struct LinkBuilder::Work {
  static constexpr std::uint32_t kUnread = 0xffffffffU;
  static constexpr std::size_t kBlock = 128;

  const Tracer& tracer;
  LinkParams params;
  PointPlacement placement;
  GatherFaces faces;
  HitAlbedo albedo;
  PointHierarchy all, coarse;
  std::optional<Senders> senders;
  std::optional<SenderPaths> paths;
  std::optional<GatherRows> sender_rows, lone_rows;
  SenderTree tree;
  std::vector<std::uint32_t> receiver;   // the point of each gathered row
  std::vector<std::uint32_t> link_row;   // of each gathered row: the row of links that vertices read, or kUnread
  std::vector<std::vector<Vec3f>> lamp;  // of each probe: light at the nodes, all reflections
  std::vector<Vec3f> gathered;           // [row * probes + probe]: what one more reflection brings
  std::vector<float> limit;              // of each probe
  std::vector<std::uint32_t> read_row;   // the gathered row of each receiver that is read
  std::optional<LinkReading> reading;
  LightLinks links;
  LinkStats stats;

  Work(const Tracer&, const LinkParams&, Threads&);
  void run(Threads&);
  std::size_t probes() const { return lamp.size(); }

  /// Rows `first` and on of `from`, those of them that are `chosen`.
  struct Linking {
    const GatherRows& from;
    std::size_t first;
    const std::vector<TransferPoint>& places;
    const LinkOracle& oracle;
    const std::vector<std::uint32_t>& chosen;
  };

  /// Senders where vertices or rays ask for some; they come before the finer points.
  void ask_for_senders(Threads&);
  /// The senders' rows: coarse links for the sweeps, fine ones for whoever reads there.
  void begin_rows(Threads&);
  /// More receivers, a batch at a time: what was traced is let go when its links are made.
  void gather(const std::vector<std::uint32_t>& points, Threads&);
  std::vector<TransferPoint> places_of(const std::vector<std::uint32_t>& points) const;
  /// Fine links of those of the gathered points that stand on the side of the vertex normals.
  void add_readable(const Linking& gathered_rows, const std::vector<std::uint32_t>& points, Threads&);
  std::uint8_t level_of(std::uint32_t point) const;
  void add_site(const SurfaceSite& site, std::uint8_t level);
  void make_links(const Linking& task, Threads&);
  /// `use`: what the rows use of each node is added (link_rows.h).
  std::vector<std::vector<FullLink>> links_of(const Linking& task, std::vector<std::uint64_t>* use, Threads&);
  /// The senders' rows. Which nodes they use depends on the shares, and the shares on what they use: the links are
  /// those of the second round, the shares what these use.
  void link_senders(const Linking& task, Threads&);
  void begin_reading(Threads&);

  /// Lamps in free places, their light at the senders, and how many sweeps it takes.
  void light_probes(Threads&);
  /// What the probes bring to a row.
  void measure(const GatherRows& rows, std::size_t row);
  /// The rows that vertices may read: those on the side of the vertex normals, of levels below `levels`.
  std::vector<std::uint32_t> readable(std::size_t levels) const;
  MeshlessBasis basis_of(const std::vector<std::uint32_t>& some, Threads&) const;
  void refine(Threads&);
  /// Points of levels from `level` to below `end` whose light the coarser ones do not predict.
  std::vector<std::uint32_t> mispredicted(std::size_t level, std::size_t end, Threads&) const;
  /// The points of a level around points of the level above.
  std::vector<std::uint32_t> children_of(const std::vector<std::uint32_t>& parents, std::size_t level) const;
  std::vector<float> probe_light(std::span<const TransferPoint> places, Threads&) const;

  LinkErrors errors_at(std::span<const TransferPoint> places, Threads&) const;

  LightLinks finish(const Mesh& mesh, Threads&);
  /// Vertices that see no receiver well enough take what the nearest sender receives.
  void read_nearest(const std::vector<TransferPoint>& vertices, std::vector<std::vector<RowTerm>>& terms) const;
  /// Rows for vertices that see no point at all; one does for those that see each other within the finest R.
  void add_lone(const std::vector<TransferPoint>& vertices, std::vector<std::vector<RowTerm>>& terms, Threads&);

  void begin_stage(std::string_view name) const {
    if (params.stage) params.stage(name);
  }
};

}  // namespace kiln
