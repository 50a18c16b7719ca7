#include "tests/bench/light_field_figures.h"

#define STB_IMAGE_WRITE_IMPLEMENTATION
#define STB_IMAGE_WRITE_STATIC
#define STBI_WRITE_NO_STDIO
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wconversion"
#pragma GCC diagnostic ignored "-Wsign-conversion"
#pragma GCC diagnostic ignored "-Wunused-function"
#pragma GCC diagnostic ignored "-Wmissing-field-initializers"
#include <stb_image_write.h>
#pragma GCC diagnostic pop

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <limits>

#include "core/artifact/look.h"
#include "core/lightfield/seen.h"
#include "core/trace/surface.h"

namespace kiln::bench {
namespace {

constexpr int kGrid = 3;  // kGrid x kGrid rays a pixel
constexpr int kGap = 4, kBar = 10;
constexpr std::size_t kPanels = 5;

/// Parallel rays over the mesh seen from `back`.
struct Window {
  Vec3d right, up, back, middle;
  double pixel = 0;  // its side
  int width = 0, height = 0;
};

Window window_of(const Mesh& mesh, const FigureView& view) {
  Window out;
  out.back = normalized(view.back);
  out.right = normalized(cross(view.up, out.back)), out.up = cross(out.back, out.right);
  Vec2d low{1e9, 1e9}, high{-1e9, -1e9};
  for (const Vec3f& p : mesh.position) {
    const double x = dot(to_double(p), out.right), y = dot(to_double(p), out.up);
    low = {std::min(low.x, x), std::min(low.y, y)}, high = {std::max(high.x, x), std::max(high.y, y)};
  }
  constexpr double kMargin = 1.04;
  out.pixel = kMargin * (high.y - low.y) / view.height;
  out.height = view.height;
  out.width = static_cast<int>(std::ceil(kMargin * (high.x - low.x) / out.pixel));
  out.middle = out.right * ((low.x + high.x) / 2) + out.up * ((low.y + high.y) / 2) + out.back * 2;
  return out;
}

/// Mean radiance of each pixel that is all on the mesh, row by row from the top.
struct Seen {
  std::vector<Vec3d> radiance;
  std::vector<std::uint8_t> whole;
};

Seen look(const LitMesh& lit, const Window& window, Threads& threads) {
  Scene scene;
  scene.mesh = lit.mesh;
  scene.parts.resize(1), scene.materials.resize(1);
  const Tracer tracer(scene, threads);
  const auto width = static_cast<std::size_t>(window.width), pixels = width * static_cast<std::size_t>(window.height);
  Seen out{std::vector<Vec3d>(pixels), std::vector<std::uint8_t>(pixels, 1)};
  threads.for_blocks(pixels, width, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const std::size_t column = i % width, row = i / width;
      for (int ray = 0; ray < kGrid * kGrid; ++ray) {
        const int across = ray % kGrid, down = ray / kGrid;
        const double x = static_cast<double>(column) + (across + 0.5) / kGrid - window.width / 2.0;
        const double y = window.height / 2.0 - static_cast<double>(row) - (down + 0.5) / kGrid;
        const Vec3d from = window.middle + window.right * (x * window.pixel) + window.up * (y * window.pixel);
        const Hit hit = tracer.closest(to_float(from), to_float(-window.back), 10);
        if (!hit) {
          out.whole[i] = 0;
          continue;
        }
        const SurfacePoint at = surface_point(scene, hit.triangle, hit.u, hit.v);
        const Vec3d normal = normalized(to_double(at.normal));
        out.radiance[i] +=
            seen_radiance(lit.field, nullptr, {lit.mesh.triangles[hit.triangle], hit.u, hit.v, normal, window.back}) *
            (1.0 / (kGrid * kGrid));
      }
    }
  });
  return out;
}

double mean_of(const Vec3d& c) { return (c.x + c.y + c.z) / 3; }

/// Dark blue, green, yellow: viridis at five places.
Vec3d false_colour(double x) {
  constexpr std::array<Vec3d, 5> kStops{{{0.267, 0.005, 0.329},
                                         {0.229, 0.322, 0.546},
                                         {0.128, 0.567, 0.551},
                                         {0.369, 0.789, 0.383},
                                         {0.993, 0.906, 0.144}}};
  const double at = std::clamp(x, 0.0, 1.0) * (kStops.size() - 1);
  const std::size_t stop = std::min(static_cast<std::size_t>(at), kStops.size() - 2);
  const double t = at - static_cast<double>(stop);
  return kStops[stop] * (1 - t) + kStops[stop + 1] * t;
}

std::uint8_t byte_of(double shown) { return static_cast<std::uint8_t>(std::lround(255 * std::clamp(shown, 0.0, 1.0))); }

double srgb(double x) { return x <= 0.0031308 ? 12.92 * x : 1.055 * std::pow(x, 1 / 2.4) - 0.055; }

/// Panels from left to right on white.
class Sheet {
 public:
  explicit Sheet(const Window& window)
      : window_(window),
        width_(static_cast<int>(kPanels) * (window.width + kGap) + kBar),
        pixels_(static_cast<std::size_t>(3 * width_ * window.height), 255) {}

  void put(int x, int y, const Vec3d& shown) {
    for (std::size_t c = 0; c < 3; ++c) pixels_[static_cast<std::size_t>(3 * (y * width_ + x)) + c] = byte_of(shown[c]);
  }
  /// `colour(pixel)` of a panel where `seen` is whole.
  template <class Colour>
  void panel(std::size_t which, const Seen& seen, const Colour& colour) {
    for (std::size_t i = 0; i < seen.whole.size(); ++i) {
      const int x = static_cast<int>(i) % window_.width, y = static_cast<int>(i) / window_.width;
      if (seen.whole[i] != 0) put(static_cast<int>(which) * (window_.width + kGap) + x, y, colour(i));
    }
  }
  void bar() {
    for (int y = 0; y < window_.height; ++y) {
      for (int x = width_ - kBar; x < width_; ++x) put(x, y, false_colour(1 - (y + 0.5) / window_.height));
    }
  }
  /// A JPEG: a third of a PNG of the same pixels.
  Bytes jpeg() const {
    constexpr int kQuality = 90;
    Bytes out;
    const auto append = [](void* to, void* data, int size) {
      const auto* first = static_cast<const std::uint8_t*>(data);
      static_cast<Bytes*>(to)->insert(static_cast<Bytes*>(to)->end(), first, first + size);
    };
    stbi_write_jpg_to_func(append, &out, width_, window_.height, 3, pixels_.data(), kQuality);
    return out;
  }

 private:
  const Window& window_;
  int width_;
  std::vector<std::uint8_t> pixels_;
};

}  // namespace

bool write_figure(const std::string& path, const Figure& figure, const FigureView& view, Threads& threads) {
  const Window window = window_of(figure.original.mesh, view);
  const Seen original = look(figure.original, window, threads);
  std::vector<float> light;
  double mean = 0;
  for (std::size_t i = 0; i < original.whole.size(); ++i) {
    if (original.whole[i] == 0) continue;
    const Vec3f c = to_float(original.radiance[i]);
    light.push_back(std::max({c.x, c.y, c.z}));
    mean += mean_of(original.radiance[i]);
  }
  if (light.empty()) return false;
  mean /= static_cast<double>(light.size());
  std::ranges::sort(light);
  const float exposure = exposure_for(light[light.size() * 9 / 10]);
  const auto shown = [&](const Seen& seen) {
    return [&seen, exposure](std::size_t i) {
      const Vec3f c = tone_map(to_float(seen.radiance[i]) * exposure);
      return Vec3d{srgb(double{c.x}), srgb(double{c.y}), srgb(double{c.z})};
    };
  };
  Sheet sheet(window);
  sheet.panel(0, original, shown(original));
  std::size_t next = 1;
  for (const auto& [name, lit] : {std::pair("ours", &figure.ours), std::pair("rival", &figure.rival)}) {
    Seen seen = look(*lit, window, threads);
    double sum = 0;
    std::size_t count = 0;
    sheet.panel(next++, seen, shown(seen));
    for (std::size_t i = 0; i < seen.whole.size(); ++i) seen.whole[i] &= original.whole[i];
    sheet.panel(next++, seen, [&](std::size_t i) {
      const Vec3d d = seen.radiance[i] - original.radiance[i];
      const double difference = mean_of({std::abs(d.x), std::abs(d.y), std::abs(d.z)}) / mean;
      sum += difference, ++count;
      return false_colour(difference / view.scale);
    });
    std::printf(R"({"figure":"%s","by":"%s","triangles":%zu,"degree":%d,"mean_difference":%.4f,"top_of_bar":%.3g})"
                "\n",
                path.c_str(), name, lit->mesh.triangles.size(), lit->field.degree,
                sum / static_cast<double>(std::max<std::size_t>(1, count)), view.scale);
  }
  sheet.bar();
  const Bytes jpeg = sheet.jpeg();
  std::ofstream file(path, std::ios::binary);
  file.write(reinterpret_cast<const char*>(jpeg.data()), static_cast<std::streamsize>(jpeg.size()));
  return file.good();
}

}  // namespace kiln::bench
