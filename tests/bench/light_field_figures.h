#pragma once
// Pictures of light fields side by side, for the figures of core/lightfield/README.md.

#include <string>

#include "core/base/threads.h"
#include "core/lightfield/lit_mesh.h"

namespace kiln::bench {

struct FigureView {
  Vec3d back{0, 0, 1}, up{0, 1, 0};  // towards the eye; upwards in the picture
  int height = 300;                  // pixels of a panel; its width follows the mesh
  double scale = 0.5;                // difference at the top of the colour bar, in means of the original's radiance
};

/// Writes a JPEG: the original, ours, its difference, the rival, its difference, and the bar of the differences (0
/// below). Prints the mean difference of both over what is seen. False where the file cannot be written.
struct Figure {
  const LitMesh &original, &ours, &rival;
};
bool write_figure(const std::string& path, const Figure&, const FigureView&, Threads&);

}  // namespace kiln::bench
