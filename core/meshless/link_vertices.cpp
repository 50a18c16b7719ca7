#include "core/meshless/demand.h"
#include "core/meshless/in_sight.h"
#include "core/meshless/link_work.h"
#include "core/meshless/point_grid.h"

namespace kiln {

LightLinks LinkBuilder::Work::finish(const Mesh& mesh, Threads& threads) {
  LightLinks out = links;
  out.term_begin = {0};
  std::vector<TransferPoint> vertices = vertex_points(mesh);
  if (out.senders == 0) {
    out.term_begin.assign(vertices.size() + 1, 0);
    return out;
  }
  const std::vector<bool> dark;
  for (const StandIn& s : find_stand_ins(mesh, dark, hidden_test(tracer), threads)) vertices[s.vertex] = s.point;
  std::vector<std::vector<RowTerm>> terms(vertices.size());
  threads.for_blocks(vertices.size(), kBlock, [&](std::size_t begin, std::size_t end) {
    for (std::size_t v = begin; v < end; ++v) terms[v] = reading->rows(vertices[v]);
  });
  read_nearest(vertices, terms);
  std::swap(links, out);
  add_lone(vertices, terms, threads);
  std::swap(links, out);
  for (const std::vector<RowTerm>& own : terms) {
    out.terms.insert(out.terms.end(), own.begin(), own.end());
    out.term_begin.push_back(static_cast<std::uint32_t>(out.terms.size()));
  }
  return out;
}

void LinkBuilder::Work::read_nearest(const std::vector<TransferPoint>& vertices,
                                     std::vector<std::vector<RowTerm>>& terms) const {
  std::vector<std::uint32_t> row_of(coarse.points.size(), kUnread);
  for (std::size_t r = 0; r < receiver.size(); ++r) {
    if (receiver[r] < row_of.size()) row_of[receiver[r]] = link_row[r];
  }
  for (std::size_t v = 0; v < vertices.size(); ++v) {
    if (!terms[v].empty()) continue;
    const std::uint32_t s = senders->nearest(reader_site(tracer, vertices[v], coarse.cover));
    if (s != Senders::kNone && row_of[s] != kUnread) terms[v] = {{row_of[s], 255}};
  }
}

void LinkBuilder::Work::add_lone(const std::vector<TransferPoint>& vertices, std::vector<std::vector<RowTerm>>& terms,
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

}  // namespace kiln
