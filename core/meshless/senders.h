#pragma once
// Which point stands for the light that leaves a place: the nearest one that the place sees, by table.
// Nearest  by the distance of equation 1 of points.h, |x - x_q| / (n . n_q): a point round a sharp corner is far.
// Sight    in_sight.h: what a wall or a fold of cloth parts does not answer for what is behind it.
// Reach    2 R of the finest level: farther points do not answer, nor do more than the 32 nearest of those within
//          reach. Places without a sender must be followed by paths.
// Table    each triangle is cut into cells of at most R x R along two of its edges, and a cell answers once for all,
//          as at its centre: a hit costs one read. Where the centre's answer is not seen from near the cell's corners
//          and where a gap begins or ends in the cell (cover.h), it is cut into kParts x kParts that answer so in their
//          turn. In parts of which that holds again, and on triangles for which cells take far more than their area
//          deserves (blunt needles), each hit looks for itself.
// Backs    of double-sided faces have cells of their own where points stand on some.
// Memory   12 bytes a triangle, 4 a cell, 64 more for one in parts: about three cells a point
// Repeat   a pure function of its arguments: of two equally near points the first counts

#include <array>
#include <cstdint>
#include <vector>

#include "core/base/threads.h"
#include "core/meshless/point_grid.h"
#include "core/meshless/points.h"
#include "core/scene/scene.h"

namespace kiln {

class Senders {
 public:
  static constexpr std::uint32_t kNone = 0xffffffffU;
  static constexpr float kReach = 2;          // of R
  static constexpr std::uint32_t kParts = 4;  // along each edge of a cell that is cut
  static constexpr std::uint32_t kPartsOfCell = kParts * kParts;

  /// Keeps references to tracer and points.
  Senders(const Tracer&, const PointHierarchy&, Threads&);

  /// Takes in points that were added to the hierarchy behind those known so far: they answer where none did.
  void add_new(Threads&);

  /// The nearest point within reach that the site sees, or kNone.
  std::uint32_t nearest(const SurfaceSite&) const;
  /// The same at a hit on the lit side of a face.
  std::uint32_t at(std::uint32_t triangle, float u, float v) const;
  /// The same on the back of a double-sided face; kNone where no points stand on backs.
  std::uint32_t behind(std::uint32_t triangle, float u, float v) const;
  /// The entries of the table, one after the other, for what is kept beside each answer.
  std::size_t slots() const { return cells_.size() + back_cells_.size() + kPartsOfCell * parts_.size(); }
  /// That of the cell of a hit, whose own answer is its parts' where there are any; kNone: there is no table.
  struct Slot {
    std::uint32_t cell = kNone, part = 0;  // the part's number in a cell
  };
  Slot slot(std::uint32_t triangle, float u, float v, bool back) const;
  /// The first slot of the parts of a cell.
  std::uint32_t slot_of_parts(std::uint32_t answer) const {
    return static_cast<std::uint32_t>(cells_.size() + back_cells_.size()) + (answer & ~kCut) * kPartsOfCell;
  }
  static bool is_cut(std::uint32_t answer) { return answer < kToCut && answer >= kCut; }
  /// Calls f(slot, answer, back, uv) for every entry of a triangle, where uv(x, y) is a place in it, x and y from 0
  /// to 1.
  template <class F>
  void each_slot(std::uint32_t triangle, const F& f) const;
  /// Each hit there looks for itself.
  static bool is_looked_for(std::uint32_t answer) { return answer == kLook; }
  const SurfaceSite& site(std::uint32_t sender) const { return points_.points[sender].site; }
  void prefetch(std::uint32_t triangle) const { __builtin_prefetch(&faces_[triangle]); }

 private:
  /// Cells (i, j) of a triangle along the edges from `corner` to the next and to the one before it.
  struct Face {
    std::uint32_t begin = 0;
    std::uint16_t columns = 0, rows = 0;  // 0: look up
    std::uint8_t corner = 0;
  };
  Face cut(std::uint32_t triangle) const;
  /// An answer, and whether there was any point to ask.
  struct Search {
    std::uint32_t sender = kNone;
    bool any = false;
  };
  struct Candidate {
    float scaled = 0;  // d^2 / cos^2
    std::uint32_t point = kNone;
    bool operator<(const Candidate& o) const { return scaled != o.scaled ? scaled < o.scaled : point < o.point; }
  };
  /// A cell of a triangle, numbered row by row, or a square part of it.
  struct Area {
    std::uint32_t triangle = 0, cell = 0;
    Vec2f low{0, 0};
    float size = 1;
  };
  using Answers = std::vector<std::uint32_t>;  // of cells
  void fill(std::uint32_t triangle, const PointGrid& fresh);
  void cut_open_cells(Answers& cells);
  void fill_parts(std::uint32_t triangle, const PointGrid& fresh, bool back);
  bool any_near(const PointGrid&, const Vec3f&) const;
  static Area area_of(std::uint32_t triangle, std::uint32_t cell, std::uint32_t part);
  Vec2f uv_in(const Area&, float x, float y) const;
  SurfaceSite site_in(const Area&, const Vec2f& at) const;
  std::uint32_t answer_of(const Area&, bool back) const;
  template <std::size_t most>
  std::size_t near(const SurfaceSite&, float reach, std::array<Candidate, most>& first) const;
  Search search(const SurfaceSite&) const;
  SurfaceSite site_on(std::uint32_t triangle, float u, float v, bool back) const;
  /// The site with its group (cover.h), which the two above leave open.
  SurfaceSite grouped(SurfaceSite) const;
  Slot cell_at(const Face&, float u, float v) const;
  std::uint32_t answer_at(const Answers& cells, std::uint32_t triangle, float u, float v) const;

  static constexpr std::uint32_t kLook = 0xfffffffeU;   // each hit looks for itself
  static constexpr std::uint32_t kToCut = 0xfffffffdU;  // of a cell
  static constexpr std::uint32_t kCut = 1U << 31;       // of a cell: the rest says which parts are its own
  static bool is_open(std::uint32_t answer) { return answer == kNone || answer == kLook; }

  const Tracer& tracer_;
  const Scene& scene_;
  const PointHierarchy& points_;
  bool backs_ = false;
  float finest_ = 0;
  PointGrid grid_;
  std::vector<Face> faces_;
  Answers cells_, back_cells_;
  std::vector<std::array<std::uint32_t, kPartsOfCell>> parts_;
};

inline Senders::Area Senders::area_of(std::uint32_t triangle, std::uint32_t cell, std::uint32_t part) {
  constexpr float kSize = 1.0F / kParts;
  const std::uint32_t column = part % kParts, row = part / kParts;
  return {triangle, cell, {static_cast<float>(column) * kSize, static_cast<float>(row) * kSize}, kSize};
}

template <class F>
void Senders::each_slot(std::uint32_t triangle, const F& f) const {
  const Face& face = faces_[triangle];
  const auto visit = [&](std::uint32_t slot, std::uint32_t answer, bool back, const Area& area) {
    f(slot, answer, back, [&](float x, float y) { return uv_in(area, x, y); });
  };
  for (std::uint32_t cell = 0; cell < std::uint32_t{face.columns} * face.rows; ++cell) {
    for (const Answers* cells : {&cells_, &back_cells_}) {
      if (cells->empty()) continue;
      const std::uint32_t answer = (*cells)[face.begin + cell];
      const bool back = cells == &back_cells_;
      const auto before = static_cast<std::uint32_t>(back ? cells_.size() : 0);
      visit(before + face.begin + cell, answer, back, {triangle, cell});
      for (std::uint32_t part = 0; is_cut(answer) && part < kPartsOfCell; ++part)
        visit(slot_of_parts(answer) + part, parts_[answer & ~kCut][part], back, area_of(triangle, cell, part));
    }
  }
}

}  // namespace kiln
