#pragma once
// How large a coarser level of detail may be on the screen so that nobody sees it take the place of the finer one.
//
// Both are drawn as in preview.h from kEyes eyes around them, kFinest pixels across the sphere around the finest level,
// and averaged to ever smaller pictures, down to 12 pixels: the viewer takes as many samples of a small model
// (web_viewer/src/main/fine_picture.ts). At each size
//   dE = sqrt(mean of the squared CIELAB distance, over the pixels that either level covers), the worst eye's,
// and the answer is the largest size at which, and below which, dE stays under kVisible.
// Paper    CIE 1976 L*a*b* of sRGB under D65; 2.3 is the difference that is just noticed (Mahy et al. 1994)
// Units    pixels across that sphere      Cost  kEyes x kFinest^2 rays for each level: a second at degree 6
// Repeat   same bits for any thread count. Fails  never

#include <vector>

#include "core/artifact/baked_scene.h"
#include "core/base/threads.h"

namespace kiln {

/// Of sRGB values with linear transfer, 0 .. 1.
Vec3d cielab(const Vec3d& linear_srgb);

/// Tone-mapped linear colours of kFinest x kFinest pixels for each eye, and what is covered: alpha 0 or 1.
struct LevelPictures {
  static constexpr int kEyes = 6, kFinest = 384;
  std::vector<Vec4f> pixels;
};

/// `frame`: the finest level's mesh. Images of the scene must have their pixels.
LevelPictures level_pictures(const BakedScene&, const Mesh& frame, Threads&);

struct LevelSwitch {
  static constexpr double kVisible = 2.3;
  int pixels = 0;         // 0: it is seen at every size that was tried; kFinest: at none
  double difference = 0;  // dE there, or at the smallest size
};
LevelSwitch level_switch(const LevelPictures& finer, const LevelPictures& coarser);

}  // namespace kiln
