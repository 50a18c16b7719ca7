#include "core/meshless/senders.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

#include "core/mesh/topology.h"
#include "core/meshless/cover.h"
#include "core/meshless/in_sight.h"

namespace kiln {
namespace {

constexpr std::size_t kBlock = 1024;
constexpr std::size_t kMostAsked = 2 * kPacket;  // of those within reach: in folds the nearest are hidden

bool is_double_sided(const Scene& scene, std::uint32_t triangle) {
  return scene.materials[static_cast<std::size_t>(scene.parts[scene.mesh.part[triangle]].material)].double_sided;
}

constexpr float kMostCells = 16;  // for each R^2 of area, beside as many to begin with

/// Barycentrics of corners 1 and 2 from coordinates (a, b) along the edges from `corner`, and back.
Vec2f to_uv(std::uint8_t corner, float a, float b) {
  const float c = 1 - a - b;
  return corner == 0 ? Vec2f{a, b} : corner == 1 ? Vec2f{c, a} : Vec2f{b, c};
}
Vec2f from_uv(std::uint8_t corner, float u, float v) {
  const float w = 1 - u - v;
  return corner == 0 ? Vec2f{u, v} : corner == 1 ? Vec2f{v, w} : Vec2f{w, u};
}

}  // namespace

Senders::Senders(const Tracer& tracer, const PointHierarchy& points, Threads& threads)
    : tracer_(tracer),
      scene_(tracer.scene()),
      points_(points),
      finest_(points.radius.empty() ? 1.0F : points.radius.back()),
      grid_(2 * finest_) {
  const std::size_t triangles = scene_.mesh.triangles.size();
  faces_.resize(triangles);
  std::uint32_t cells = 0;
  for (std::uint32_t t = 0; t < triangles; ++t) {
    faces_[t] = cut(t);
    faces_[t].begin = cells;
    cells += std::uint32_t{faces_[t].columns} * faces_[t].rows;
  }
  cells_.assign(cells, kNone);
  add_new(threads);
}

void Senders::add_new(Threads& threads) {
  PointGrid fresh(2 * finest_);
  for (auto i = static_cast<std::uint32_t>(grid_.size()); i < points_.points.size(); ++i) {
    grid_.add(i, points_.points[i].site.position);
    fresh.add(i, points_.points[i].site.position);
    backs_ = backs_ || points_.points[i].behind;
  }
  if (backs_) back_cells_.resize(cells_.size(), kNone);
  threads.for_blocks(faces_.size(), kBlock, [&](std::size_t begin, std::size_t end) {
    for (auto t = static_cast<std::uint32_t>(begin); t < end; ++t) fill(t, fresh);
  });
  cut_open_cells(cells_);
  cut_open_cells(back_cells_);
  threads.for_blocks(faces_.size(), kBlock, [&](std::size_t begin, std::size_t end) {
    for (auto t = static_cast<std::uint32_t>(begin); t < end; ++t) {
      fill_parts(t, fresh, false);
      if (backs_ && is_double_sided(scene_, t)) fill_parts(t, fresh, true);
    }
  });
}

void Senders::cut_open_cells(Answers& cells) {
  for (std::uint32_t& answer : cells) {
    if (answer != kToCut) continue;
    answer = kCut | static_cast<std::uint32_t>(parts_.size());
    parts_.emplace_back().fill(kNone);
  }
}

void Senders::fill_parts(std::uint32_t triangle, const PointGrid& fresh, bool back) {
  const Face& f = faces_[triangle];
  for (std::uint32_t cell = 0; cell < std::uint32_t{f.columns} * f.rows; ++cell) {
    const std::uint32_t answer = (back ? back_cells_ : cells_)[f.begin + cell];
    if (!is_cut(answer)) continue;
    auto& parts = parts_[answer & ~kCut];
    for (std::uint32_t part = 0; part < kPartsOfCell; ++part) {
      const Area area = area_of(triangle, cell, part);
      if (is_open(parts[part]) && any_near(fresh, site_in(area, {0.5F, 0.5F}).position))
        parts[part] = answer_of(area, back);
    }
  }
}

/// The corner whose edges take the fewest cells.
Senders::Face Senders::cut(std::uint32_t triangle) const {
  const Mesh& mesh = scene_.mesh;
  const Triangle& t = mesh.triangles[triangle];
  Face best;
  float fewest = 0;
  for (std::uint8_t k = 0; k < 3; ++k) {
    const Vec3f& from = mesh.position[t[k]];
    const float columns = std::max(1.0F, std::ceil(length(mesh.position[t[(k + 1) % 3]] - from) / finest_));
    const float rows = std::max(1.0F, std::ceil(length(mesh.position[t[(k + 2) % 3]] - from) / finest_));
    if (fewest > 0 && columns * rows >= fewest) continue;
    fewest = columns * rows;
    if (columns > 65535 || rows > 65535) continue;
    best = {0, static_cast<std::uint16_t>(columns), static_cast<std::uint16_t>(rows), k};
  }
  const auto area = static_cast<float>(triangle_area(mesh, t));
  return fewest <= kMostCells * (1 + area / (finest_ * finest_)) ? best : Face{};
}

void Senders::fill(std::uint32_t triangle, const PointGrid& fresh) {
  const Face& f = faces_[triangle];
  const bool back = backs_ && is_double_sided(scene_, triangle);
  for (std::uint32_t j = 0; j < f.rows; ++j) {
    for (std::uint32_t i = 0; i < f.columns; ++i) {
      if (i * f.rows + j * f.columns >= std::uint32_t{f.columns} * f.rows) break;  // outside, as all to come
      const Area area{triangle, j * f.columns + i};
      const std::uint32_t cell = f.begin + area.cell;
      if (!is_open(cells_[cell]) && !(back && is_open(back_cells_[cell]))) continue;
      if (!any_near(fresh, site_in(area, {0.5F, 0.5F}).position)) continue;
      if (is_open(cells_[cell])) cells_[cell] = answer_of(area, false);
      if (back && is_open(back_cells_[cell])) back_cells_[cell] = answer_of(area, true);
    }
  }
}

bool Senders::any_near(const PointGrid& grid, const Vec3f& place) const {
  bool any = false;
  grid.near(place, kReach * finest_, [&](std::uint32_t, float) { any = true; });
  return any;
}

/// The place at (x, y) of an area, each from 0 to 1, on the lit side.
SurfaceSite Senders::site_in(const Area& area, const Vec2f& at) const {
  const Vec2f uv = uv_in(area, at.x, at.y);
  return site_on(area.triangle, uv.x, uv.y, false);
}

Vec2f Senders::uv_in(const Area& area, float x, float y) const {
  const Face& f = faces_[area.triangle];
  const std::uint32_t i = area.cell % f.columns, j = area.cell / f.columns;
  float a = (static_cast<float>(i) + area.low.x + area.size * x) / f.columns;
  float b = (static_cast<float>(j) + area.low.y + area.size * y) / f.rows;
  if (const float sum = a + b; sum > 1) a /= sum, b /= sum;
  return to_uv(f.corner, a, b);
}

std::uint32_t Senders::answer_of(const Area& area, bool back) const {
  constexpr std::array<Vec2f, 4> kCorners = {{{0.1F, 0.1F}, {0.9F, 0.1F}, {0.1F, 0.9F}, {0.9F, 0.9F}}};
  constexpr float kSmall = 0.5F;  // of R: cells no longer are not looked at more closely
  const auto site = [&](const Vec2f& at) {
    SurfaceSite s = site_in(area, at);
    if (back) s.normal = -s.normal;
    return s;
  };
  const SurfaceSite centre = grouped(site({0.5F, 0.5F}));
  const Search found = search(centre);
  std::array<SurfaceSite, kCorners.size()> corners;
  float longest = 0;
  for (std::size_t k = 0; k < corners.size(); ++k) {
    corners[k] = site(kCorners[k]);
    longest = std::max(longest, length(corners[k].position - corners[0].position));
  }
  const bool is_cell = area.size == 1;
  if (is_cell && longest <= kSmall * finest_) return found.sender == kNone && found.any ? kLook : found.sender;
  const std::uint32_t differs = is_cell ? kToCut : kLook;
  if (std::ranges::any_of(corners, [&](const SurfaceSite& s) { return grouped(s).group != centre.group; }))
    return differs;
  if (found.sender == kNone) return found.any ? differs : kNone;
  return in_sight(tracer_, this->site(found.sender), corners) == (1U << corners.size()) - 1 ? found.sender : differs;
}

SurfaceSite Senders::site_on(std::uint32_t triangle, float u, float v, bool back) const {
  const Mesh& mesh = scene_.mesh;
  const Triangle& t = mesh.triangles[triangle];
  SurfaceSite site;
  site.position = mesh.position[t[0]] * (1 - u - v) + mesh.position[t[1]] * u + mesh.position[t[2]] * v;
  site.normal = normalized(area_vector(mesh, t), mesh.normal[t[0]]);
  const Vec3f shading = mesh.normal[t[0]] + mesh.normal[t[1]] + mesh.normal[t[2]];
  if (is_double_sided(scene_, triangle) && dot(site.normal, shading) < 0) site.normal = -site.normal;
  if (back) site.normal = -site.normal;
  return site;
}

SurfaceSite Senders::grouped(SurfaceSite site) const {
  site.group = group_of(tracer_, {site.position, site.normal, site.position, site.normal}, points_.cover);
  return site;
}

/// The points within `reach` of a site in order, by equation 1, of which `most` are kept.
template <std::size_t most>
std::size_t Senders::near(const SurfaceSite& at, float reach, std::array<Candidate, most>& first) const {
  std::size_t count = 0;
  grid_.near(at.position, reach, [&](std::uint32_t i, float d2) {
    const SurfaceSite& q = points_.points[i].site;
    const float cosine = dot(q.normal, at.normal);
    if (q.group != at.group || cosine <= 0 || d2 > reach * reach * cosine * cosine) return;
    const Candidate c{d2 / (cosine * cosine), i};
    if (count == most && !(c < first.back())) return;
    std::size_t k = count < most ? count++ : most - 1;
    for (; k > 0 && c < first[k - 1]; --k) first[k] = first[k - 1];
    first[k] = c;
  });
  return count;
}

std::uint32_t Senders::nearest(const SurfaceSite& at) const { return search(at).sender; }

Senders::Search Senders::search(const SurfaceSite& at) const {
  std::array<Candidate, kMostAsked> first;
  std::size_t count = near(at, finest_, first);
  if (count > 0 && in_sight(tracer_, at, site(first[0].point))) return {first[0].point, true};
  count = near(at, kReach * finest_, first);
  for (std::size_t k = 0; k < count; k += kPacket) {
    std::array<SurfaceSite, kPacket> sites;
    const std::size_t some = std::min<std::size_t>(kPacket, count - k);
    for (std::size_t i = 0; i < some; ++i) sites[i] = site(first[k + i].point);
    const std::uint32_t seen = in_sight(tracer_, at, std::span(sites).first(some));
    if (seen != 0) return {first[k + static_cast<std::size_t>(std::countr_zero(seen))].point, true};
  }
  return {kNone, count > 0};
}

std::uint32_t Senders::at(std::uint32_t triangle, float u, float v) const {
  const std::uint32_t known = answer_at(cells_, triangle, u, v);
  return known == kLook ? nearest(grouped(site_on(triangle, u, v, false))) : known;
}

std::uint32_t Senders::behind(std::uint32_t triangle, float u, float v) const {
  if (!backs_) return kNone;
  const std::uint32_t known = answer_at(back_cells_, triangle, u, v);
  return known == kLook ? nearest(grouped(site_on(triangle, u, v, true))) : known;
}

std::uint32_t Senders::answer_at(const Answers& cells, std::uint32_t triangle, float u, float v) const {
  const Face& f = faces_[triangle];
  if (f.columns == 0) return kLook;
  const Slot read = cell_at(f, u, v);
  const std::uint32_t answer = cells[read.cell];
  return is_cut(answer) ? parts_[answer & ~kCut][read.part] : answer;
}

Senders::Slot Senders::slot(std::uint32_t triangle, float u, float v, bool back) const {
  const Face& f = faces_[triangle];
  if (f.columns == 0 || (back && !backs_)) return {};
  Slot at = cell_at(f, u, v);
  if (back) at.cell += static_cast<std::uint32_t>(cells_.size());
  return at;
}

Senders::Slot Senders::cell_at(const Face& f, float u, float v) const {
  const Vec2f at = from_uv(f.corner, u, v);
  // A part's number along an edge: those of the first cell, then of the second, and so on.
  const auto part_along = [](float x, std::uint16_t cells) {
    const int parts = static_cast<int>(kParts) * cells;
    return static_cast<std::uint32_t>(std::clamp(static_cast<int>(x * static_cast<float>(parts)), 0, parts - 1));
  };
  const std::uint32_t x = part_along(at.x, f.columns), y = part_along(at.y, f.rows);
  std::uint32_t i = x / kParts;
  const std::uint32_t j = y / kParts;
  // A hit on the far edge may round into a cell that is outside.
  while (i > 0 && i * f.rows + j * f.columns >= std::uint32_t{f.columns} * f.rows) --i;
  return {f.begin + j * f.columns + i, y % kParts * kParts + x % kParts};
}

}  // namespace kiln
