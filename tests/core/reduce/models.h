#pragma once
// Models whose truth is known, as sources of triangles and as PLY files.

#include <cstring>
#include <functional>
#include <string>
#include <vector>

#include "core/artifact/import.h"
#include "core/artifact/triangle_stream.h"
#include "core/mesh/mesh.h"

namespace kiln::testing {

struct Model {
  std::vector<Vec3d> position;
  std::vector<Triangle> triangles;
  std::vector<Vec3f> color;  // of each position, or none
};

/// A lattice of n x m squares; `place` takes u and v in [0, 1].
inline Model sheet(int n, int m, const std::function<Vec3d(double, double)>& place) {
  Model out;
  for (int i = 0; i <= n; ++i) {
    for (int k = 0; k <= m; ++k) out.position.push_back(place(double(i) / n, double(k) / m));
  }
  const auto at = [&](int i, int k) { return static_cast<std::uint32_t>(i * (m + 1) + k); };
  for (int i = 0; i < n; ++i) {
    for (int k = 0; k < m; ++k) {
      out.triangles.push_back({at(i, k), at(i + 1, k), at(i + 1, k + 1)});
      out.triangles.push_back({at(i, k), at(i + 1, k + 1), at(i, k + 1)});
    }
  }
  return out;
}

inline void append(Model& to, Model from) {  // a copy: a model may be appended to itself
  const auto first = static_cast<std::uint32_t>(to.position.size());
  to.position.insert(to.position.end(), from.position.begin(), from.position.end());
  to.color.insert(to.color.end(), from.color.begin(), from.color.end());
  for (const Triangle& t : from.triangles) to.triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
}

/// Six sheets of n x n squares around [-1, 1]^3, wound outwards; seams have bit-equal corners.
inline Model cube(int n) {
  Model out;
  for (int axis = 0; axis < 3; ++axis) {
    for (const double side : {-1.0, 1.0}) {
      append(out, sheet(n, n, [&](double u, double v) {
               Vec3d p;
               const auto a = static_cast<std::size_t>(axis);
               p[a] = side;
               p[(a + (side > 0 ? 1 : 2)) % 3] = 2 * u - 1;
               p[(a + (side > 0 ? 2 : 1)) % 3] = 2 * v - 1;
               return p;
             }));
    }
  }
  return out;
}

/// The cube blown up to the unit sphere: closed, no poles.
inline Model sphere(int n) {
  Model out = cube(n);
  for (Vec3d& p : out.position) p = normalized(p);
  return out;
}

template <class T>
void put(std::string& out, const T& x) {
  out.append(reinterpret_cast<const char*>(&x), sizeof x);
}

inline Bytes to_bytes(const std::string& text) { return {text.begin(), text.end()}; }

inline std::string ply_header(const Model& m, const std::string& format) {
  return "ply\nformat " + format + " 1.0\nelement vertex " + std::to_string(m.position.size()) +
         "\nproperty double x\nproperty double y\nproperty double z\n" +
         (m.color.empty() ? "" : "property float red\nproperty float green\nproperty float blue\n") + "element face " +
         std::to_string(m.triangles.size()) + "\nproperty list uchar int vertex_indices\nend_header\n";
}

inline Bytes binary_ply(const Model& m) {
  std::string out = ply_header(m, "binary_little_endian");
  for (std::size_t v = 0; v < m.position.size(); ++v) {
    put(out, m.position[v]);
    if (!m.color.empty()) put(out, m.color[v]);
  }
  for (const Triangle& t : m.triangles) {
    out += '\3';
    put(out, t);
  }
  return to_bytes(out);
}

inline Bytes ascii_ply(const Model& m) {
  std::string out = ply_header(m, "ascii");
  char line[128];
  for (const Vec3d& p : m.position) {
    std::snprintf(line, sizeof line, "%.17g %.17g %.17g\n", p.x, p.y, p.z);
    out += line;
  }
  for (const auto& [a, b, c] : m.triangles)
    out += "3 " + std::to_string(a) + ' ' + std::to_string(b) + ' ' + std::to_string(c) + '\n';
  return to_bytes(out);
}

inline TriangleSource open(const Bytes& file, Findings& findings) {
  SceneFiles files{.name = "scan.ply", .main = file, .resources = {}};
  return open_triangles(files, {.spill_folder = "/tmp"}, findings);
}

/// Of a file that has to be sound.
inline TriangleSource source_of(const Bytes& file) {
  Findings findings("scan.ply");
  TriangleSource source = open(file, findings);
  if (findings.failed()) throw std::runtime_error(findings.fault().message);
  return source;
}
inline TriangleSource source_of(const Model& model) { return source_of(binary_ply(model)); }

/// What opening the file, or one pass, fails with; an empty fault when nothing does.
inline Fault fault_of(const Bytes& file) {
  Findings findings("scan.ply");
  const TriangleSource source = open(file, findings);
  if (findings.failed()) return findings.fault();
  Threads threads(2);
  const auto done = source.stream(
      Detail::all, [](const TriangleBatch&) {}, threads);
  return done ? Fault{} : done.error();
}

}  // namespace kiln::testing
