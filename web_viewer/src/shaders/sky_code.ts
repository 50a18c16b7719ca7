// asset/mirrored_sky.ts for each fragment: what a surface mirrors of the sky that a light field keeps apart.

import { ClampToEdgeWrapping, DataArrayTexture, DataUtils, HalfFloatType, LinearFilter, RepeatWrapping } from 'three';
import { kFacets, kLeastAlpha, kNarrowest, kVisibilityCount, kVisibilityOrder, type MirroredSky } from '../asset/mirrored_sky';
import { harmonicsCode } from './harmonics_code';

/// All levels, one layer each; colours without the sky's unit.
export function skyTexture(sky: MirroredSky): DataArrayTexture {
  const { width, height, depth, rgba } = sky.stack();
  const texture = new DataArrayTexture(Uint16Array.from(rgba, DataUtils.toHalfFloat), width, height, depth);
  texture.type = HalfFloatType;
  texture.minFilter = texture.magFilter = LinearFilter;
  [texture.wrapS, texture.wrapT] = [RepeatWrapping, ClampToEdgeWrapping];
  texture.needsUpdate = true;
  return texture;
}

const terms = Array.from({ length: kVisibilityCount }, (_, i) => `visibility[${i}] * y${i}`);

/// mirroredSky(n, v, f0, roughness, visibility): all unit, v not below the horizon of n. Needs lobeAt (mirror.ts).
export const skyFunctions = /* glsl */ `
uniform highp sampler2DArray sky;
uniform float skyUnit;
float visibleShare(vec3 w, float visibility[${kVisibilityCount}]) {
  float x = w.x, y = w.y, z = w.z;
  ${harmonicsCode(kVisibilityOrder - 1)}
  return clamp(${terms.join(' + ')}, 0.0, 1.0);
}
vec3 blurredSky(vec3 w, float alpha) {
  float last = float(textureSize(sky, 0).z - 1);
  float level = clamp(-2.0 * log2(alpha), 0.0, last);
  float low = min(floor(level), last - 1.0);
  vec2 at = vec2(0.5 + atan(w.z, w.x) * ${1 / (2 * Math.PI)}, acos(clamp(w.y, -1.0, 1.0)) * ${1 / Math.PI});
  return mix(textureLod(sky, vec3(at, low), 0.0).rgb, textureLod(sky, vec3(at, low + 1.0), 0.0).rgb, level - low);
}
vec3 mirroredSky(vec3 n, vec3 v, vec3 f0, float roughness, float visibility[${kVisibilityCount}]) {
  float above = dot(n, v);
  float z = clamp(above, 1e-3, 1.0);
  float alpha = clamp(roughness * roughness, ${kLeastAlpha}, 1.0);
  vec3 along = v - n * above;
  float size = length(along);
  vec3 axis = size > 0.0 ? along / size : vec3(0.0);
  float sine = sqrt(1.0 - z * z);
  float most = length(vec2(z, sine * alpha));
  float lean = atan(sine * alpha, z);
  float middle = tan(lean + asin(clamp((z + most) * 0.5 / most - 1.0, -1.0, 1.0)));
  vec3 sum = vec3(0.0);
  float all = 0.0;
  for (int k = 0; k < ${kFacets}; ++k) {
    float u = (float(k) + 0.5) / ${kFacets}.0;
    float slope = mix(tan(lean + asin(clamp((z + most) * u / most - 1.0, -1.0, 1.0))), middle, z);
    float up = inversesqrt(1.0 + alpha * alpha * slope * slope);
    float facing = (sine * alpha * slope + z) * up;
    vec2 l = vec2(2.0 * facing * alpha * slope * up - sine, 2.0 * facing * up - z);
    if (facing <= 0.0 || l.y <= 0.0) continue;
    float weight = 2.0 / (sqrt(1.0 + alpha * alpha * max(0.0, 1.0 - l.y * l.y) / (l.y * l.y)) + 1.0);
    vec3 w = axis * l.x + n * l.y;
    float width = alpha * max(${kNarrowest}, facing) * sqrt(1.0 + slope * slope);
    sum += blurredSky(w, min(1.0, width)) * (weight * visibleShare(w, visibility));
    all += weight;
  }
  vec2 ab = lobeAt(z, roughness, 0).xy;
  return all > 0.0 ? skyUnit * (f0 * ab.x + ab.y) * sum / all : vec3(0.0);
}`;
