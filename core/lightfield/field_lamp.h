#pragma once
// What distances between vertices need to know of a lamp that is kept apart: few bands of a blurred highlight, as large
// as the whole one, and how it changes with the normal.
// Repeat  a pure function of its arguments

#include <span>

#include "core/lightfield/light_field.h"

namespace kiln {

/// With the lobe that distances see.
FieldLamp make_field_lamp(const Light&, const Vec3f& mean);

/// Mean square of how highlights change with the normal, RGB, per square radian (as LightField::sky_slope).
double lamp_slope(std::span<const FieldLamp>);

}  // namespace kiln
