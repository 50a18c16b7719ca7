#include "core/reduce/collapse.h"

#include <algorithm>
#include <vector>

#include "core/mesh/collapse_queue.h"

namespace kiln {
namespace {

constexpr std::uint32_t kNone = 0xffffffffU;
constexpr double kTurned = 0.2;     // cosine between a triangle's normals before and after
constexpr double kNeedle = 0.05;    // 4 sqrt(3) area / sum of squared edges: 1 for an equilateral triangle
constexpr double kEvenness = 1e-6;  // of squared edge length beside the error: flat regions collapse short edges first

class Collapser {
 public:
  Collapser(Surface& surface, bool pinch) : s_(surface), pinch_(pinch) {
    const std::size_t vertices = s_.position.size(), triangles = s_.triangles.size();
    head_.assign(vertices, kNone), tail_.assign(vertices, kNone), age_.assign(vertices, 0), mark_.assign(vertices, 0);
    next_.assign(3 * triangles, kNone);
    gone_.assign(triangles, false);
    left_ = triangles;
    for (std::uint32_t corner = 0; corner < 3 * triangles; ++corner) append(vertex_of(corner), corner);
    border_.assign(vertices, false), refused_.assign(vertices, false);
    for (std::uint32_t v = 0; v < vertices; ++v) find_border(v);
  }

  void run(std::size_t target, Threads& threads, const std::function<void(std::size_t)>& tell) {
    for (std::uint32_t v = 0; v < s_.position.size(); ++v) {
      for (const std::uint32_t w : ring(v)) {
        if (v < w) push(v, w);
      }
    }
    for (std::size_t step = 0; left_ > target && !queue_.empty(); ++step) {
      if (step % 4096 == 0) threads.check();
      if (step % 65536 == 0 && tell) tell(left_);
      const Candidate c = queue_.pop();
      if (age_[c.a] + age_[c.b] != c.age) continue;
      const Vec3d place = best_place(c.a, c.b);
      if (may_join(c.a, c.b, place)) {
        join(c.a, c.b, place);
      } else if (is_tetrahedron(c.a) && left_ > 4) {
        const std::vector<std::uint32_t> others = ring(c.a);
        for (const std::uint32_t w : others) drop_around(w);
        ++age_[c.a];
      } else {
        refused_[c.a] = refused_[c.b] = true;
      }
    }
    compact();
  }

 private:
  std::uint32_t vertex_of(std::uint32_t corner) const { return s_.triangles[corner / 3][corner % 3]; }
  void append(std::uint32_t v, std::uint32_t corner) {
    next_[corner] = kNone;
    if (tail_[v] == kNone) {
      head_[v] = corner;
    } else {
      next_[tail_[v]] = corner;
    }
    tail_[v] = corner;
  }

  /// Calls visit(triangle, next vertex, the one after) for each triangle around v.
  template <class Visit>
  void around(std::uint32_t v, const Visit& visit) const {
    for (std::uint32_t corner = head_[v]; corner != kNone; corner = next_[corner]) {
      const std::uint32_t t = corner / 3, c = corner % 3;
      if (!gone_[t]) visit(t, s_.triangles[t][(c + 1) % 3], s_.triangles[t][(c + 2) % 3]);
    }
  }

  /// The neighbours of v, each once, marked with the current stamp.
  const std::vector<std::uint32_t>& ring(std::uint32_t v) {
    ring_.clear();
    ++stamp_;
    const auto add = [&](std::uint32_t w) {
      if (mark_[w] == stamp_) return;
      mark_[w] = stamp_;
      ring_.push_back(w);
    };
    around(v, [&](std::uint32_t, std::uint32_t a, std::uint32_t b) { add(a), add(b); });
    return ring_;
  }

  void find_border(std::uint32_t v) {
    for (const std::uint32_t w : ring(v)) {
      if (border_[v]) return;
      border_[v] = shared(v, w) == 1;
    }
  }
  std::size_t shared(std::uint32_t v, std::uint32_t w) const {
    std::size_t n = 0;
    around(v, [&](std::uint32_t, std::uint32_t a, std::uint32_t b) { n += a == w || b == w ? 1 : 0; });
    return n;
  }

  Vec3d best_place(std::uint32_t a, std::uint32_t b) const {
    const Quadric q = s_.sample[a].quadric + s_.sample[b].quadric;
    const Vec3d pa = s_.position[a], pb = s_.position[b], middle = (pa + pb) * 0.5;
    const Vec3d best = least_point(q, middle);
    return length(best - middle) <= 2 * length(pb - pa) ? best : q.at(pa) < q.at(pb) ? pa : pb;
  }

  void push(std::uint32_t v, std::uint32_t w) {
    const auto [a, b] = std::minmax(v, w);
    const Quadric q = s_.sample[a].quadric + s_.sample[b].quadric;
    const Vec3d edge = s_.position[b] - s_.position[a];
    const double even = kEvenness * (s_.sample[a].weight + s_.sample[b].weight) * dot(edge, edge);
    queue_.push({static_cast<float>(q.at(best_place(a, b)) + even), a, b, age_[a] + age_[b]});
  }

  /// Whether a triangle around v (but not w) would turn over or become a needle with v at `place`.
  bool spoils(std::uint32_t v, std::uint32_t w, const Vec3d& place) const {
    bool bad = false;
    around(v, [&](std::uint32_t, std::uint32_t a, std::uint32_t b) {
      if (bad || a == w || b == w) return;
      const Vec3d pa = s_.position[a], pb = s_.position[b], pv = s_.position[v];
      const Vec3d before = cross(pa - pv, pb - pv), after = cross(pa - place, pb - place);
      const double was = length(before), is = length(after);
      if (was == 0) return;
      if (dot(before, after) < kTurned * was * is || is == 0) bad = true;
      const auto shape = [&](const Vec3d& p, double area2) {
        return 3.4641016151377544 * area2 / (dot(pa - p, pa - p) + dot(pb - p, pb - p) + dot(pa - pb, pa - pb));
      };
      const double shaped = shape(place, is);
      if (shaped < kNeedle && shaped < shape(pv, was)) bad = true;
    });
    return bad;
  }

  bool may_join(std::uint32_t a, std::uint32_t b, const Vec3d& place) {
    const std::size_t between = shared(a, b);
    if (!pinch_) {
      if (border_[a] && border_[b] && between != 1) return false;
      ring(a);
      common_.clear();
      bool closed = false;
      around(b, [&](std::uint32_t, std::uint32_t x, std::uint32_t y) {
        for (const std::uint32_t w : {x, y}) {
          if (w != a && mark_[w] == stamp_ && std::find(common_.begin(), common_.end(), w) == common_.end())
            common_.push_back(w);
        }
      });
      if (common_.size() != between) return false;
      const auto is_common = [&](std::uint32_t w) {
        return std::find(common_.begin(), common_.end(), w) != common_.end();
      };
      around(b, [&](std::uint32_t, std::uint32_t x, std::uint32_t y) { closed |= is_common(x) && is_common(y); });
      if (closed) return false;
    }
    return !spoils(a, b, place) && !spoils(b, a, place);
  }

  void join(std::uint32_t a, std::uint32_t b, const Vec3d& place) {
    around(b, [&](std::uint32_t t, std::uint32_t x, std::uint32_t y) {
      if (x == a || y == a) gone_[t] = true, --left_;
    });
    for (std::uint32_t corner = head_[b]; corner != kNone; corner = next_[corner])
      if (!gone_[corner / 3]) s_.triangles[corner / 3][corner % 3] = a;
    if (head_[b] != kNone) {
      if (head_[a] == kNone)
        head_[a] = head_[b];
      else
        next_[tail_[a]] = head_[b];
      tail_[a] = tail_[b];
      head_[b] = tail_[b] = kNone;
    }
    drop_twins(a);
    prune(a);
    s_.position[a] = place;
    Sample& sample = s_.sample[a];
    const Sample& other = s_.sample[b];
    sample.quadric += other.quadric, sample.color += other.color, sample.weight += other.weight;
    border_[a] = border_[a] || border_[b];
    ++age_[a], ++age_[b];
    const std::vector<std::uint32_t> neighbours = ring(a);
    for (const std::uint32_t w : neighbours) push(a, w);
    for (const std::uint32_t w : neighbours) {
      if (!refused_[w]) continue;
      refused_[w] = false;
      for (const std::uint32_t x : ring(w)) {
        if (x != a) push(w, x);
      }
    }
  }

  /// A closed piece of four triangles: it can only go as a whole.
  bool is_tetrahedron(std::uint32_t v) {
    const std::vector<std::uint32_t> others = ring(v);
    if (others.size() != 3 || triangles_at(v) != 3) return false;
    return std::all_of(others.begin(), others.end(), [&](std::uint32_t w) {
      const auto& around_w = ring(w);
      const auto is_own = [&](std::uint32_t x) {
        return x == v || std::find(others.begin(), others.end(), x) != others.end();
      };
      return triangles_at(w) == 3 && around_w.size() == 3 && std::all_of(around_w.begin(), around_w.end(), is_own);
    });
  }
  std::size_t triangles_at(std::uint32_t v) const {
    std::size_t n = 0;
    around(v, [&](std::uint32_t, std::uint32_t, std::uint32_t) { ++n; });
    return n;
  }
  void drop_around(std::uint32_t v) {
    around(v, [&](std::uint32_t t, std::uint32_t, std::uint32_t) { gone_[t] = true, --left_; });
    ++age_[v];
  }

  /// Two triangles around v with the same corners: one stays where they look the same way, none where they look against
  /// each other.
  void drop_twins(std::uint32_t v) {
    if (!pinch_) return;  // the link condition leaves none
    around(v, [&](std::uint32_t t, std::uint32_t a, std::uint32_t b) {
      around(v, [&](std::uint32_t o, std::uint32_t x, std::uint32_t y) {
        if (o <= t || gone_[t] || gone_[o]) return;
        const bool same = a == x && b == y, against = a == y && b == x;
        if (same || against) gone_[o] = true, --left_;
        if (against) gone_[t] = true, --left_;
      });
    });
  }

  /// Takes corners of triangles that are gone out of the list of v.
  void prune(std::uint32_t v) {
    std::uint32_t corner = head_[v];
    head_[v] = tail_[v] = kNone;
    while (corner != kNone) {
      const std::uint32_t following = next_[corner];
      if (!gone_[corner / 3]) append(v, corner);
      corner = following;
    }
  }

  void compact() {
    std::size_t kept = 0;
    for (std::size_t t = 0; t < s_.triangles.size(); ++t) {
      const auto [a, b, c] = s_.triangles[t];
      if (!gone_[t] && a != b && b != c && c != a) s_.triangles[kept++] = {a, b, c};
    }
    s_.triangles.resize(kept);
  }

  Surface& s_;
  bool pinch_;
  std::size_t left_ = 0;
  std::vector<std::uint32_t> head_, tail_, next_, age_, mark_, ring_, common_;
  std::uint32_t stamp_ = 0;
  std::vector<bool> gone_, border_;
  std::vector<bool> refused_;  // an edge of it may be taken once what is around has changed
  CollapseQueue queue_;
};

}  // namespace

void collapse(Surface& surface, std::size_t triangles, Threads& threads, const std::function<void(std::size_t)>& tell) {
  if (surface.triangles.size() > triangles) Collapser(surface, false).run(triangles, threads, tell);
  if (surface.triangles.size() > triangles) Collapser(surface, true).run(triangles, threads, tell);
  drop_unused(surface);
}

}  // namespace kiln
