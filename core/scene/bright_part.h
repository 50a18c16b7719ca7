#pragma once
// The part of a distant light that few bands of harmonics cannot hold: a sun, a lamp on a wall.
// What is cut from it swings below 0 beside its lobe, by several times the sky: a place that sees a little of the sky
// there would be black, or of the colour of the one channel that stays above. Light in two parts, the bright and the
// rest, is known to be at least 0 in each: whoever adds up what is above 0 of both is nearer to the truth wherever that
// changes anything.

#include "core/scene/environment.h"

namespace kiln {

inline constexpr double kBright = 8;  // times the mean of the rest; the CIE clear sky has 5 beside its sun

/// Of each texel what is above kBright times the mean over all directions of what is left, in the colour of the texel.
/// Darkness (1 x 1) where nothing is.
Environment bright_part(const Environment&);

}  // namespace kiln
