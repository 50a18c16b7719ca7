#pragma once
// How often light passes over the links between senders until the rest may be guessed.
// Method  x_k = T x_{k-1} for the light x_0 of some lamps; from the fourth on the sums of x_k fall by a steady factor
// r,
//         and what is left is the geometric series r / (1 - r)
// Shape   lamps[k][sender], W m^-2 on a white receiver;  area[sender]

#include <span>
#include <vector>

#include "core/base/vec.h"
#include "core/meshless/light_links.h"

namespace kiln {

inline constexpr int kFewestLinkSweeps = 4, kMostLinkSweeps = 48;
inline constexpr double kLinkTail = 1e-3;  // of the light: the largest doubt in the rest

inline double mean_of(const Vec3f& rgb) { return (double{rgb.x} + double{rgb.y} + double{rgb.z}) / 3; }

/// Mean of the channels, summed over the area.
double light_over_area(std::span<const Vec3f> light, std::span<const float> area);

/// Sets sweeps and tail of the links, each lamp counting as much: `bounces` - 1 and none, or, where it is negative, as
/// many as it takes. Returns the share of the light that was left to the tail.
double count_sweeps(LightLinks&, std::span<const float> area, const std::vector<std::vector<Vec3f>>& lamps,
                    int bounces);

}  // namespace kiln
