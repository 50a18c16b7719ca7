#include "core/meshless/link_builder.h"

#include <algorithm>
#include <mutex>

#include "core/base/expects.h"
#include "core/base/random.h"
#include "core/meshless/demand.h"
#include "core/meshless/link_work.h"
#include "core/prt/ray_origin.h"

namespace kiln {
namespace {

constexpr std::size_t kShareBlock = 512, kBatch = 4096;
constexpr int kMostLoneRays = 256;  // of a vertex that gathers for itself: scenes have many that nobody sees

PointHierarchy coarse_part(const PointHierarchy& all, std::size_t levels) {
  PointHierarchy out;
  out.cover = all.cover;
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

LinkBuilder::Work::Work(const Tracer& t, const LinkParams& p, Threads& threads)
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

void LinkBuilder::Work::ask_for_senders(Threads& threads) {
  const std::size_t placed = coarse.points.size(), levels = coarse.levels();
  senders.emplace(tracer, coarse, threads);
  const std::vector<TransferPoint> vertices = vertex_points(tracer.scene().mesh);
  const std::size_t most = std::min<std::size_t>(std::max<std::size_t>(2 * placed, params.most_senders), kMostSenders);
  add_demanded({tracer, faces, placement.seed, vertices, most}, coarse, *senders, threads);
  stats.senders = static_cast<std::uint32_t>(coarse.points.size());
  if (!coarse.demanded) return;
  const std::size_t added = coarse.points.size() - placed;
  PointHierarchy joined = coarse;
  joined.points.insert(joined.points.end(), all.points.begin() + static_cast<std::ptrdiff_t>(placed), all.points.end());
  for (std::size_t level = levels; level < all.levels(); ++level) {
    joined.level_end.push_back(all.level_end[level] + static_cast<std::uint32_t>(added));
    joined.radius.push_back(all.radius[level]);
  }
  all = std::move(joined);
}

void LinkBuilder::Work::run(Threads& threads) {
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

void LinkBuilder::Work::begin_rows(Threads& threads) {
  std::vector<std::uint32_t> own(coarse.points.size());
  for (std::uint32_t i = 0; i < own.size(); ++i) own[i] = i;
  const std::vector<TransferPoint> places = places_of(own);
  sender_rows->add(places, threads, stats.rays);
  link_senders({*sender_rows, 0, places, params.sender_oracle, own}, threads);
  links.children = tree.children;
  for (const std::uint32_t p : own) add_site(all.points[p].site, level_of(p));
  add_readable({*sender_rows, 0, places, params.oracle, own}, own, threads);
}

void LinkBuilder::Work::gather(const std::vector<std::uint32_t>& points, Threads& threads) {
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

std::vector<TransferPoint> LinkBuilder::Work::places_of(const std::vector<std::uint32_t>& points) const {
  std::vector<TransferPoint> places;
  for (const std::uint32_t p : points) places.push_back(transfer_point(all.points[p]));
  return places;
}

void LinkBuilder::Work::add_readable(const Linking& gathered_rows, const std::vector<std::uint32_t>& points,
                                     Threads& threads) {
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

std::uint8_t LinkBuilder::Work::level_of(std::uint32_t point) const {
  return static_cast<std::uint8_t>(std::upper_bound(all.level_end.begin(), all.level_end.end(), point) -
                                   all.level_end.begin());
}

void LinkBuilder::Work::add_site(const SurfaceSite& site, std::uint8_t level) {
  links.sites.push_back({site.position, pack_normal(site.normal), level});
}

void LinkBuilder::Work::make_links(const Linking& task, Threads& threads) {
  for (const auto& row : links_of(task, nullptr, threads)) append_row(row, links);
}

std::vector<std::vector<FullLink>> LinkBuilder::Work::links_of(const Linking& task, std::vector<std::uint64_t>* use,
                                                               Threads& threads) {
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

void LinkBuilder::Work::link_senders(const Linking& task, Threads& threads) {
  std::vector<std::vector<FullLink>> made;
  for (int round = 0; round < 2; ++round) {
    std::vector<std::uint64_t> use(tree.nodes());
    made = links_of(task, &use, threads);
    set_shares(tree, use);
  }
  for (const auto& row : made) append_row(row, links);
}

void LinkBuilder::Work::begin_reading(Threads& threads) {
  read_row = readable(all.levels());
  std::vector<LinkReading::Receiver> receivers;
  for (const std::uint32_t r : read_row) receivers.push_back({all.points[receiver[r]].site, link_row[r]});
  reading.emplace(tracer, LinkReading::Points{receivers, all.cover, params.neighbours}, threads);
}

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
