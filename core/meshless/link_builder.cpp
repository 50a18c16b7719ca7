#include "core/meshless/link_builder.h"

#include <algorithm>
#include <cmath>
#include <mutex>

#include "core/base/expects.h"
#include "core/base/random.h"
#include "core/meshless/basis.h"
#include "core/meshless/demand.h"
#include "core/meshless/free_places.h"
#include "core/meshless/in_sight.h"
#include "core/meshless/link_reading.h"
#include "core/meshless/point_grid.h"
#include "core/prt/morton.h"
#include "core/prt/ray_origin.h"

namespace kiln {
namespace {

constexpr std::size_t kBlock = 128, kShareBlock = 512, kBatch = 4096;
constexpr std::uint32_t kUnread = 0xffffffffU;
constexpr int kMostLoneRays = 256;     // of a vertex that gathers for itself: scenes have many that nobody sees
constexpr double kMostUnsteady = 0.9;  // factor that is believed when it has not become steady
constexpr float kChildReach = 2;       // of the parent level's R

double mean_of(const Vec3f& x) { return (double{x.x} + double{x.y} + double{x.z}) / 3; }
float largest(const Vec3f& x) { return std::max({std::abs(x.x), std::abs(x.y), std::abs(x.z)}); }

PointHierarchy coarse_part(const PointHierarchy& all, std::size_t levels) {
  PointHierarchy out;
  if (levels == 0) return out;
  const auto points = static_cast<std::ptrdiff_t>(all.level_end[levels - 1]);
  out.points.assign(all.points.begin(), all.points.begin() + points);
  out.level_end.assign(all.level_end.begin(), all.level_end.begin() + static_cast<std::ptrdiff_t>(levels));
  out.radius.assign(all.radius.begin(), all.radius.begin() + static_cast<std::ptrdiff_t>(levels));
  return out;
}

/// The finest level, at most `asked`, up to which there are no more points than may send.
std::size_t sender_levels(const PointHierarchy& points, int asked, std::uint32_t most_senders) {
  if (points.levels() == 0) return 0;
  const std::uint32_t most = asked < 0 ? most_senders : kMostSenders;
  std::size_t level =
      asked < 0 ? points.levels() - 1 : std::min<std::size_t>(static_cast<std::size_t>(asked), points.levels() - 1);
  while (level > 0 && points.level_end[level] > most) --level;
  return level + 1;
}

PointPlacement two_sided(PointPlacement placement, const Scene& scene) {
  placement = resolve(placement, scene);
  placement.both_sides = placement.levels;
  return placement;
}

}  // namespace

struct LinkBuilder::Work {
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
  std::vector<std::vector<Vec3f>> lamp;  // of each probe: light at the senders, all reflections
  std::vector<Vec3f> gathered;           // [row * probes + probe]: what one more reflection brings
  std::vector<float> limit;              // of each probe
  std::vector<std::uint32_t> read_row;   // the gathered row of each receiver that is read
  std::optional<LinkReading> reading;
  LightLinks links;
  LinkStats stats;

  Work(const Tracer& t, const LinkParams& p, Threads& threads)
      : tracer(t), params(p), placement(two_sided(p.points, t.scene())), faces(t.scene()), albedo(t.scene()) {
    begin_stage("points");
    all = place_points(tracer, faces, placement, threads);
    coarse = coarse_part(all, sender_levels(all, params.sender_level, params.most_senders));
    for (std::size_t level = 0; level < all.levels(); ++level)
      stats.points.push_back(all.level_end[level] - all.begin(level));
    stats.sender_level = static_cast<int>(coarse.levels()) - 1;
    ask_for_senders(threads);
    paths.emplace(SenderPaths::World{tracer, faces, albedo, *senders, nullptr});
    sender_rows.emplace(*paths, params.rays, params.seed);
    lone_rows.emplace(*paths, std::min(params.rays, kMostLoneRays), mix64(params.seed));
    links.sample_begin = {0}, links.child_begin = {0}, links.link_begin = {0};
  }

  /// Senders where vertices or rays ask for some; they come before the finer points.
  void ask_for_senders(Threads& threads) {
    const std::size_t placed = coarse.points.size(), levels = coarse.levels();
    senders.emplace(tracer, coarse, placement, threads);
    const std::vector<TransferPoint> vertices = vertex_points(tracer.scene().mesh);
    const std::vector<std::uint32_t> group = groups_of(tracer.scene().mesh);
    std::vector<Readings::Place> readers;
    for (std::size_t v = 0; v < vertices.size(); ++v) readers.push_back({vertices[v], group[v]});
    const std::size_t most =
        std::min<std::size_t>(std::max<std::size_t>(2 * placed, params.most_senders), kMostSenders);
    add_demanded({tracer, faces, placement, readers, most}, coarse, *senders, threads);
    stats.senders = static_cast<std::uint32_t>(coarse.points.size());
    if (!coarse.demanded) return;
    const std::size_t added = coarse.points.size() - placed;
    PointHierarchy joined = coarse;
    joined.points.insert(joined.points.end(), all.points.begin() + static_cast<std::ptrdiff_t>(placed),
                         all.points.end());
    for (std::size_t level = levels; level < all.levels(); ++level) {
      joined.level_end.push_back(all.level_end[level] + static_cast<std::uint32_t>(added));
      joined.radius.push_back(all.radius[level]);
    }
    all = std::move(joined);
  }

  void begin_stage(std::string_view name) const {
    if (params.stage) params.stage(name);
  }

  std::size_t probes() const { return lamp.size(); }

  void run(Threads& threads) {
    if (coarse.points.empty() || params.bounces == 0) return;
    begin_stage("rows");
    const SenderSamples samples = sample_senders(*paths, coarse, mix64(params.seed ^ 0x73616d706c65ULL), threads);
    tree = grow_sender_tree(tracer, coarse, samples.area, threads);
    EXPECTS(tree.nodes() <= kMostNodes);
    links.senders = tree.senders;
    links.sample_begin = samples.begin;
    links.samples = samples.samples;
    links.child_begin = tree.child_begin;
    links.children = tree.children;
    begin_rows(threads);
    begin_stage("receivers");
    light_probes(threads);
    for (std::size_t r = 0; r < receiver.size(); ++r) measure(*sender_rows, r);
    sender_rows.reset();
    refine(threads);
    begin_reading(threads);
  }

  void begin_reading(Threads& threads) {
    read_row = readable(all.levels());
    std::vector<LinkReading::Receiver> receivers;
    for (const std::uint32_t r : read_row) receivers.push_back({all.points[receiver[r]].site, link_row[r]});
    reading.emplace(tracer, receivers, params.neighbours, threads);
  }

  /// Rows `first` and on of `from`, those of them that are `chosen`.
  struct Linking {
    const GatherRows& from;
    std::size_t first;
    const std::vector<TransferPoint>& places;
    const LinkOracle& oracle;
    const std::vector<std::uint32_t>& chosen;
  };

  /// The senders' rows: coarse links for the sweeps, fine ones for whoever reads there.
  void begin_rows(Threads& threads) {
    std::vector<std::uint32_t> own(coarse.points.size());
    for (std::uint32_t i = 0; i < own.size(); ++i) own[i] = i;
    const std::vector<TransferPoint> places = places_of(own);
    sender_rows->add(places, threads, stats.rays);
    link_senders({*sender_rows, 0, places, params.sender_oracle, own}, threads);
    links.children = tree.children;
    for (const std::uint32_t p : own) add_site(all.points[p].site, level_of(p));
    add_readable({*sender_rows, 0, places, params.oracle, own}, own, threads);
  }

  /// More receivers, a batch at a time: what was traced is let go when its links are made.
  void gather(const std::vector<std::uint32_t>& points, Threads& threads) {
    for (std::size_t first = 0; first < points.size(); first += kBatch) {
      const std::vector<std::uint32_t> batch(
          points.begin() + static_cast<std::ptrdiff_t>(first),
          points.begin() + static_cast<std::ptrdiff_t>(std::min(points.size(), first + kBatch)));
      std::vector<std::uint32_t> every(batch.size());
      for (std::uint32_t i = 0; i < every.size(); ++i) every[i] = i;
      const std::vector<TransferPoint> places = places_of(batch);
      GatherRows rows(*paths, params.rays, params.seed);
      rows.add(places, threads, stats.rays);
      add_readable({rows, 0, places, params.oracle, every}, batch, threads);
      for (std::size_t i = 0; i < batch.size(); ++i) measure(rows, i);
    }
  }

  std::vector<TransferPoint> places_of(const std::vector<std::uint32_t>& points) const {
    std::vector<TransferPoint> places;
    for (const std::uint32_t p : points) places.push_back(transfer_point(all.points[p]));
    return places;
  }

  /// Fine links of those of the gathered points that stand on the side of the vertex normals.
  void add_readable(const Linking& gathered_rows, const std::vector<std::uint32_t>& points, Threads& threads) {
    std::vector<std::uint32_t> read;
    for (std::uint32_t i = 0; i < points.size(); ++i) {
      const std::uint32_t p = points[i];
      receiver.push_back(p);
      const bool read_it = !all.points[p].behind;
      link_row.push_back(read_it ? static_cast<std::uint32_t>(links.rows() + read.size()) : kUnread);
      if (read_it) read.push_back(i);
      const std::size_t level = level_of(p);
      stats.gathered.resize(std::max(stats.gathered.size(), level + 1));
      ++stats.gathered[level];
    }
    make_links({gathered_rows.from, gathered_rows.first, gathered_rows.places, gathered_rows.oracle, read}, threads);
    for (const std::uint32_t i : read) add_site(all.points[points[i]].site, level_of(points[i]));
  }

  std::uint8_t level_of(std::uint32_t point) const {
    return static_cast<std::uint8_t>(std::upper_bound(all.level_end.begin(), all.level_end.end(), point) -
                                     all.level_end.begin());
  }

  void add_site(const SurfaceSite& site, std::uint8_t level) {
    links.sites.push_back({site.position, pack_normal(site.normal), level});
  }

  void make_links(const Linking& task, Threads& threads) {
    for (const auto& row : links_of(task, nullptr, threads)) append_row(row, links);
  }

  /// `use`: what the rows use of each node is added (link_rows.h).
  std::vector<std::vector<FullLink>> links_of(const Linking& task, std::vector<std::uint64_t>* use, Threads& threads) {
    std::vector<std::vector<FullLink>> made(task.chosen.size());
    std::mutex joining;
    threads.for_blocks(made.size(), kShareBlock, [&](std::size_t begin, std::size_t end) {
      LinkMaker maker(tree, task.oracle);
      std::vector<std::uint64_t> own(use != nullptr ? tree.nodes() : 0);
      for (std::size_t i = begin; i < end; ++i) {
        const std::uint32_t row = task.chosen[i];
        const LinkMaker::Use counted{own, use != nullptr ? tree.area[row] : 0};
        made[i] =
            maker.links_of(task.from.rays_of(task.first + row, task.places[row]), use != nullptr ? &counted : nullptr);
      }
      const std::lock_guard<std::mutex> lock(joining);  // whole numbers: in any order
      for (std::size_t n = 0; n < own.size(); ++n) (*use)[n] += own[n];
    });
    return made;
  }

  /// The senders' rows. Which nodes they use depends on the shares, and the shares on what they use: the links are
  /// those of the second round, the shares what these use.
  void link_senders(const Linking& task, Threads& threads) {
    std::vector<std::vector<FullLink>> made;
    for (int round = 0; round < 2; ++round) {
      std::vector<std::uint64_t> use(tree.nodes());
      made = links_of(task, &use, threads);
      set_shares(tree, use);
    }
    for (const auto& row : made) append_row(row, links);
  }

  /// Lamps in free places, their light at the senders, and how many sweeps it takes.
  void light_probes(Threads& threads) {
    const std::vector<Vec3f> places = free_places(tracer, kProbes, mix64(params.seed ^ 0x70726f6265ULL));
    std::vector<std::vector<Vec3f>> direct;
    for (const Vec3f& place : places) {
      const Light light{.intensity = {1, 1, 1}, .position = place};
      direct.push_back(light_senders(links, light, tracer, threads));
    }
    // Even light has a say too: what no probe reaches is part of the scene.
    std::vector<std::vector<Vec3f>> counted = direct;
    counted.emplace_back(links.senders, Vec3f{1, 1, 1});
    count_sweeps(counted);
    for (const auto& e : direct) {
      std::vector<Vec3f> x = solve_nodes(links, e);
      const double mean = over_area(x);
      double area = 0;
      for (std::size_t s = 0; s < links.senders; ++s) area += tree.area[s];
      limit.push_back(static_cast<float>(params.eps * mean / std::max(1.0, area)));
      x.resize(links.senders);
      lamp.push_back(std::move(x));
    }
  }

  double over_area(std::span<const Vec3f> x) const {
    double sum = 0;
    for (std::size_t s = 0; s < links.senders; ++s) sum += mean_of(x[s]) * tree.area[s];
    return sum;
  }

  /// As many as it takes until what the geometric rest of the series may be wrong by is below kLinkTail of the light.
  void count_sweeps(const std::vector<std::vector<Vec3f>>& direct) {
    links.tail = 0;
    if (params.bounces > 0) {
      links.sweeps = static_cast<std::uint32_t>(params.bounces - 1);
      return;
    }
    links.sweeps = 1;                               // one at a time: x' = e + T x is e' = x - e carried on
    std::vector<std::vector<Vec3f>> step = direct;  // the newest power of T on each lamp
    std::vector<double> scale;                      // each lamp counts as much
    for (const auto& e : direct) scale.push_back(over_area(e) > 0 ? 1 / over_area(e) : 0);
    double light = 0, size_before = 0, ratio_before = 0;
    for (std::size_t k = 0; k < direct.size(); ++k) light += scale[k] * over_area(direct[k]);
    std::uint32_t sweeps = 0;
    double ratio = 0;
    while (light > 0 && sweeps < kMostLinkSweeps) {
      double size = 0;
      for (std::size_t k = 0; k < step.size(); ++k) {
        std::vector<Vec3f> next = solve_nodes(links, step[k]);
        for (std::size_t s = 0; s < links.senders; ++s) step[k][s] = next[s] - step[k][s];
        size += scale[k] * over_area(step[k]);
      }
      ++sweeps;
      light += size;
      ratio = size_before > 0 ? std::clamp(size / size_before, 0.0, 0.999) : 0;
      const double rest = size * ratio / (1 - ratio);
      const double doubt = rest * std::min(1.0, std::abs(ratio - ratio_before) / (1 - ratio));
      stats.left = rest / light;
      if (!(size > 0) || (sweeps >= kFewestLinkSweeps && doubt <= kLinkTail * light)) break;
      size_before = size, ratio_before = ratio;
    }
    links.sweeps = sweeps;
    if (sweeps == kMostLinkSweeps) ratio = std::min(ratio, kMostUnsteady);
    links.tail = static_cast<float>(ratio / (1 - ratio));
  }

  /// What the probes bring to a row.
  void measure(const GatherRows& rows, std::size_t row) {
    for (std::size_t k = 0; k < probes(); ++k) gathered.push_back(rows.apply(row, lamp[k]));
  }

  /// The rows that vertices may read: those on the side of the vertex normals, of levels below `levels`.
  std::vector<std::uint32_t> readable(std::size_t levels) const {
    std::vector<std::uint32_t> out;
    for (std::uint32_t r = 0; r < receiver.size(); ++r) {
      if (!all.points[receiver[r]].behind && receiver[r] < all.level_end[levels - 1]) out.push_back(r);
    }
    return out;
  }

  MeshlessBasis basis_of(const std::vector<std::uint32_t>& some, Threads& threads) const {
    std::vector<SurfaceSite> sites;
    for (const std::uint32_t r : some) sites.push_back(all.points[receiver[r]].site);
    const std::uint32_t end[] = {static_cast<std::uint32_t>(sites.size())};
    return {sites, end, threads, params.neighbours};
  }

  void refine(Threads& threads) {
    if (probes() == 0) return;
    for (std::size_t level = coarse.levels(); level < all.levels(); ++level) {
      // Parents of the first finer points are those of the last level of senders, asked for or not.
      const std::size_t first = level == coarse.levels() ? coarse.placed_levels() - 1 : level - 1;
      const std::vector<std::uint32_t> chosen = children_of(mispredicted(first, level, threads), level);
      if (chosen.empty()) return;
      gather(chosen, threads);
    }
  }

  /// Points of levels from `level` to below `end` whose light the coarser ones do not predict.
  std::vector<std::uint32_t> mispredicted(std::size_t level, std::size_t end, Threads& threads) const {
    std::vector<std::uint32_t> asked;
    for (std::uint32_t r = 0; r < receiver.size(); ++r) {
      const std::uint32_t p = receiver[r];
      if (p >= all.begin(level) && p < all.level_end[end - 1] && !all.points[p].behind) asked.push_back(r);
    }
    if (level == 0) {
      std::vector<std::uint32_t> out;
      for (const std::uint32_t r : asked) out.push_back(receiver[r]);
      return out;
    }
    const std::vector<std::uint32_t> known = readable(level);
    const MeshlessBasis basis = basis_of(known, threads);
    std::vector<char> wrong(asked.size());
    threads.for_blocks(asked.size(), kBlock, [&](std::size_t begin, std::size_t end) {
      std::vector<BasisTerm> terms;
      for (std::size_t i = begin; i < end; ++i) {
        terms.clear();
        wrong[i] = basis.terms(all.points[receiver[asked[i]]].site, 1, terms) != Cover::functions ? 1 : 0;
        for (std::size_t k = 0; k < probes() && wrong[i] == 0; ++k) {
          Vec3f predicted;
          for (const BasisTerm& t : terms) predicted += gathered[known[t.function] * probes() + k] * t.value;
          wrong[i] = largest(gathered[asked[i] * probes() + k] - predicted) > limit[k] ? 1 : 0;
        }
      }
    });
    std::vector<std::uint32_t> out;
    for (std::size_t i = 0; i < asked.size(); ++i) {
      if (wrong[i] != 0) out.push_back(receiver[asked[i]]);
    }
    return out;
  }

  /// The points of a level around points of the level above.
  std::vector<std::uint32_t> children_of(const std::vector<std::uint32_t>& parents, std::size_t level) const {
    const float reach = kChildReach * all.radius[level - 1];
    PointGrid grid(2 * reach);
    for (const std::uint32_t p : parents) grid.add(p, all.points[p].site.position);
    std::vector<std::uint32_t> out;
    for (std::uint32_t p = all.begin(level); p < all.level_end[level]; ++p) {
      const SurfaceSite& site = all.points[p].site;
      bool near = false;
      grid.near(site.position, reach, [&](std::uint32_t q, float d2) {
        const float cosine = dot(site.normal, all.points[q].site.normal);
        near = near || (site.group == all.points[q].site.group && cosine > 0 && d2 <= reach * reach * cosine * cosine);
      });
      if (near && !all.points[p].behind) out.push_back(p);
    }
    return out;
  }

  std::vector<float> probe_light(std::span<const TransferPoint> places, Threads& threads) const {
    std::vector<float> out(places.size() * probes(), 0.0F);
    if (probes() == 0) return out;
    threads.for_blocks(places.size(), kBlock, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        const Reading::Seen near = reading->seen(places[i], 0);
        std::vector<float> light(probes());
        for (const BasisTerm& t : near.terms) {
          const std::size_t first = read_row[t.function] * probes();
          for (std::size_t k = 0; k < probes(); ++k)
            light[k] += t.value * static_cast<float>(mean_of(gathered[first + k]));
        }
        for (std::size_t k = 0; k < probes() && near.sum > 0; ++k)
          out[i * probes() + k] = limit[k] > 0 ? params.eps * light[k] / (near.sum * limit[k]) : 0;
      }
    });
    return out;
  }

  // Step 5.

  LightLinks finish(const Mesh& mesh, Threads& threads) {
    LightLinks out = links;
    out.term_begin = {0};
    std::vector<TransferPoint> vertices = vertex_points(mesh);
    if (out.senders == 0) {
      out.term_begin.assign(vertices.size() + 1, 0);
      return out;
    }
    const std::vector<bool> dark;
    for (const StandIn& s : find_stand_ins(mesh, dark, hidden_test(tracer), threads)) vertices[s.vertex] = s.point;
    const std::vector<std::uint32_t> group = groups_of(mesh);
    std::vector<std::vector<RowTerm>> terms(vertices.size());
    threads.for_blocks(vertices.size(), kBlock, [&](std::size_t begin, std::size_t end) {
      for (std::size_t v = begin; v < end; ++v) terms[v] = reading->rows(vertices[v], group[v]);
    });
    read_nearest(vertices, group, terms);
    std::swap(links, out);
    add_lone(vertices, terms, threads);
    std::swap(links, out);
    for (const std::vector<RowTerm>& own : terms) {
      out.terms.insert(out.terms.end(), own.begin(), own.end());
      out.term_begin.push_back(static_cast<std::uint32_t>(out.terms.size()));
    }
    return out;
  }

  /// Vertices that see no receiver well enough take what the nearest sender receives.
  void read_nearest(const std::vector<TransferPoint>& vertices, const std::vector<std::uint32_t>& group,
                    std::vector<std::vector<RowTerm>>& terms) const {
    std::vector<std::uint32_t> row_of(coarse.points.size(), kUnread);
    for (std::size_t r = 0; r < receiver.size(); ++r) {
      if (receiver[r] < row_of.size()) row_of[receiver[r]] = link_row[r];
    }
    for (std::size_t v = 0; v < vertices.size(); ++v) {
      if (!terms[v].empty()) continue;
      const std::uint32_t s = senders->nearest(reader_site({vertices[v], group[v]}, coarse.radius.back()));
      if (s != Senders::kNone && row_of[s] != kUnread) terms[v] = {{row_of[s], 255}};
    }
  }

  /// Rows for vertices that see no point at all; one does for those that see each other within the finest R.
  void add_lone(const std::vector<TransferPoint>& vertices, std::vector<std::vector<RowTerm>>& terms,
                Threads& threads) {
    const float reach = all.radius.back();
    PointGrid grid(2 * reach);
    std::vector<TransferPoint> places;
    for (std::size_t v = 0; v < vertices.size(); ++v) {
      if (!terms[v].empty()) continue;
      const SurfaceSite site{vertices[v].position, vertices[v].normal};
      auto row = static_cast<std::uint32_t>(places.size());
      grid.near(site.position, reach, [&](std::uint32_t i, float d2) {
        const SurfaceSite other{places[i].position, places[i].normal};
        const float cosine = dot(site.normal, other.normal);
        if (i >= row || cosine <= 0 || d2 > reach * reach * cosine * cosine) return;
        if (in_sight(tracer, site, other)) row = i;
      });
      terms[v] = {{static_cast<std::uint32_t>(links.rows()) + row, 255}};
      if (row < places.size()) continue;
      grid.add(row, site.position);
      places.push_back(vertices[v]);
    }
    stats.alone = places.size();
    lone_rows->add(places, threads, stats.rays);
    for (const TransferPoint& p : places) add_site({p.position, p.normal, 0}, RowSite::kLone);
    std::vector<std::uint32_t> every(places.size());
    for (std::uint32_t i = 0; i < every.size(); ++i) every[i] = i;
    make_links({*lone_rows, 0, places, params.oracle, every}, threads);
  }

  std::vector<std::uint32_t> groups_of(const Mesh& mesh) const {
    std::vector<std::uint32_t> group(mesh.position.size(), 0);
    if (!placement.groups_by_part) return group;
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
      for (const std::uint32_t v : mesh.triangles[t]) group[v] = mesh.part[t];
    }
    return group;
  }
};

LinkBuilder::LinkBuilder(const Tracer& tracer, const LinkParams& params, Threads& threads) {
  EXPECTS(params.rays >= 1 && params.rays <= 65536 && params.neighbours >= 1);
  work_ = std::make_unique<Work>(tracer, params, threads);
  work_->run(threads);
}

LinkBuilder::~LinkBuilder() = default;

std::size_t LinkBuilder::probes() const { return work_->probes(); }

std::vector<float> LinkBuilder::probe_light(std::span<const TransferPoint> places, Threads& threads) const {
  return work_->probe_light(places, threads);
}

LightLinks LinkBuilder::finish(const Mesh& mesh, Threads& threads) { return work_->finish(mesh, threads); }

const LinkStats& LinkBuilder::stats() const { return work_->stats; }

}  // namespace kiln
