// asset/field_lamps.ts for each fragment: what a surface mirrors of the lamps that a light field keeps apart.

import type { IUniform } from 'three';
import { type FieldLamp, formOf } from '../asset/field_lamps';
import { kLeastAlpha } from '../asset/mirrored_sky';

/// Of so many lamps.
export function lampUniforms(lamps: readonly FieldLamp[]): Record<string, IUniform> {
  const forms = lamps.map(formOf);
  return {
    lampAt: { value: forms.flatMap(({ at, distant }) => [...at, distant ? 0 : 1]) },
    lampAxis: { value: forms.flatMap(({ axis, outer }) => [...axis, outer]) },
    lampIntensity: { value: forms.flatMap(({ intensity, ramp }) => [...intensity, ramp]) },
    lampRange: { value: forms.map(({ range }) => range) },
  };
}

/// lampHighlights(place, n, v, f0, roughness, lamps): n and v are unit, v not below the horizon of n, and the place is of
/// the unit cube; lamps says how much of each is seen. (The sine between n and the half vector by their cross product: of
/// 1 - (n.h)^2 floats would leave nothing where the lobe is sharp.)
export const lampFunctions = (count: number): string => /* glsl */ `
uniform vec4 lampAt[${count}];
uniform vec4 lampAxis[${count}];
uniform vec4 lampIntensity[${count}];
uniform float lampRange[${count}];
float lampMasked(float alpha, float z) {
  return (sqrt(1.0 + alpha * alpha * max(0.0, 1.0 - z * z) / (z * z)) - 1.0) * 0.5;
}
vec3 lampHighlights(vec3 place, vec3 n, vec3 v, vec3 f0, float roughness, float lamps[${count}]) {
  float above = dot(n, v);
  float z = clamp(above, 1e-3, 1.0);
  float alpha = clamp(roughness * roughness, ${kLeastAlpha}, 1.0);
  vec3 along = v - n * above;
  float size = length(along);
  vec3 eye = n * z + (size > 0.0 ? along / size : vec3(0.0)) * sqrt(1.0 - z * z);
  vec3 sum = vec3(0.0);
  for (int k = 0; k < ${count}; ++k) {
    vec3 to = lampAt[k].w > 0.0 ? lampAt[k].xyz - place : lampAt[k].xyz;
    float squared = dot(to, to);
    if (squared <= 0.0 || lamps[k] <= 0.0) continue;
    vec3 way = to * inversesqrt(squared);
    float l = dot(way, n);
    if (l <= 0.0) continue;
    float share = lamps[k];
    if (lampAt[k].w > 0.0) {
      float cosine = -dot(way, lampAxis[k].xyz);
      float ramp = cosine <= lampAxis[k].w ? 0.0 : min(1.0, (cosine - lampAxis[k].w) / lampIntensity[k].w);
      float ratio = lampRange[k] > 0.0 ? squared / (lampRange[k] * lampRange[k]) : 0.0;
      share *= ramp * ramp * clamp(1.0 - ratio * ratio, 0.0, 1.0) / squared;
    }
    vec3 between = normalize(way + eye);
    vec3 aside = cross(n, between);
    float d = alpha * alpha + (1.0 - alpha * alpha) * min(1.0, dot(aside, aside));
    float masking = 1.0 / (1.0 + lampMasked(alpha, z) + lampMasked(alpha, l));
    float lobe = alpha * alpha / (${Math.PI} * d * d) * masking / (4.0 * z);
    float schlick = pow(clamp(1.0 - dot(eye, between), 0.0, 1.0), 5.0);
    sum += (f0 + (1.0 - f0) * schlick) * lampIntensity[k].rgb * (lobe * share);
  }
  return sum;
}`;
