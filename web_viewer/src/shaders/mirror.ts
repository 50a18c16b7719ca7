// What a specular part reflects of the light that arrives at its vertices (core/prt/lobe_table.h):
//   mirror = max(0, sum_i K_i L_i),   K_00 = gain_0 Y_00,   K_lm = sum_j gain_lj Y_lm(axis_j)
//   axis_j = n cos(72 j) + t sin(72 j) degrees,   t = the direction along the surface away from the eye
// L changes with the light only: the worker computes it, and it waits in a texture. K hangs on the eye and is made
// here, at each vertex of each picture, so that a moving camera costs the processor nothing. Mirror is interpolated
// over the triangle, where the format interpolates L: the same at vertices, and as near between them as triangles
// are small.

import { DataTexture, FloatType, RGBAFormat } from 'three';
import { lobeWidth } from '../asset/kiln_reader';

const kAcross = 2048; // texels of a row: any WebGL 2 has as many
export const kLobeRows = 16;
export const kLobeViews = 32;

/// RGBA floats in reading order; what the last row has left over is 0.
export function listTexture(numbers: Float32Array): DataTexture {
  const rows = Math.max(1, Math.ceil(numbers.length / (4 * kAcross)));
  const data = new Float32Array(4 * kAcross * rows);
  data.set(numbers);
  const texture = new DataTexture(data, kAcross, rows, RGBAFormat, FloatType);
  texture.needsUpdate = true;
  return texture;
}

/// Entries of the table padded to whole texels.
export function lobeTexture(lobes: Float32Array, order: number): DataTexture {
  const width = lobeWidth(order);
  const padded = 4 * lobeTexels(order);
  const out = new Float32Array(padded * kLobeRows * kLobeViews);
  for (let entry = 0; entry < kLobeRows * kLobeViews; ++entry)
    out.set(lobes.subarray(entry * width, (entry + 1) * width), entry * padded);
  return listTexture(out);
}

export const lobeTexels = (order: number): number => Math.ceil(lobeWidth(order) / 4);

/// Both shaders: one texel of the table between four entries. LOBE_TEXELS and MIRROR_ORDER are defined.
export const lobeFunctions = /* glsl */ `
uniform highp sampler2D lobes;
vec4 lobeEntry(int row, int view, int k) {
  int at = (row * ${kLobeViews} + view) * LOBE_TEXELS + k;
  return texelFetch(lobes, ivec2(at % ${kAcross}, at / ${kAcross}), 0);
}
vec4 lobeAt(float nv, float roughness, int k) {
  float angle = acos(clamp(nv, 0.0, 1.0));
  vec2 place = vec2(clamp(roughness, 0.0, 1.0) * ${kLobeRows - 1}.0, angle * ${(kLobeViews - 1) / (Math.PI / 2)});
  ivec2 first = min(ivec2(place), ivec2(${kLobeRows - 2}, ${kLobeViews - 2}));
  vec2 share = place - vec2(first);
  return mix(
    mix(lobeEntry(first.x, first.y, k), lobeEntry(first.x, first.y + 1, k), share.y),
    mix(lobeEntry(first.x + 1, first.y, k), lobeEntry(first.x + 1, first.y + 1, k), share.y), share.x);
}`;

/// The vertex shader's part. Harmonics are those of light/sh.ts to band 4.
export const mirrorFunctions = /* glsl */ `
uniform highp sampler2D arriving; // texel v order^2 + i: coefficient i at vertex v
const int kCount = MIRROR_ORDER * MIRROR_ORDER;
void harmonics(vec3 w, out float s[25]) {
  float x = w.x, y = w.y, z = w.z, xx = x * x, yy = y * y, zz = z * z;
  s[0] = 0.28209479177387814;
  s[1] = 0.4886025119029199 * y;
  s[2] = 0.4886025119029199 * z;
  s[3] = 0.4886025119029199 * x;
  s[4] = 1.0925484305920792 * x * y;
  s[5] = 1.0925484305920792 * y * z;
  s[6] = 0.31539156525252005 * (3.0 * zz - 1.0);
  s[7] = 1.0925484305920792 * x * z;
  s[8] = 0.5462742152960396 * (xx - yy);
  s[9] = 0.5900435899266435 * y * (3.0 * xx - yy);
  s[10] = 2.890611442640554 * x * y * z;
  s[11] = 0.4570457994644658 * y * (5.0 * zz - 1.0);
  s[12] = 0.3731763325901154 * z * (5.0 * zz - 3.0);
  s[13] = 0.4570457994644658 * x * (5.0 * zz - 1.0);
  s[14] = 1.445305721320277 * z * (xx - yy);
  s[15] = 0.5900435899266435 * x * (xx - 3.0 * yy);
  s[16] = 2.5033429417967046 * x * y * (xx - yy);
  s[17] = 1.7701307697799304 * y * z * (3.0 * xx - yy);
  s[18] = 0.9461746957575601 * x * y * (7.0 * zz - 1.0);
  s[19] = 0.6690465435572892 * y * z * (7.0 * zz - 3.0);
  s[20] = 0.10578554691520431 * (35.0 * zz * zz - 30.0 * zz + 3.0);
  s[21] = 0.6690465435572892 * x * z * (7.0 * zz - 3.0);
  s[22] = 0.47308734787878004 * (xx - yy) * (7.0 * zz - 1.0);
  s[23] = 1.7701307697799304 * x * z * (xx - 3.0 * yy);
  s[24] = 0.6258357354491761 * (xx * xx - 6.0 * xx * yy + yy * yy);
}
vec3 mirrorAt(int vertex, vec3 n, vec3 v, float roughness) {
  float number[4 * LOBE_TEXELS];
  for (int k = 0; k < LOBE_TEXELS; ++k) {
    vec4 four = lobeAt(dot(n, v), roughness, k);
    for (int i = 0; i < 4; ++i) number[4 * k + i] = four[i];
  }
  vec3 away = n * dot(n, v) - v;
  if (dot(away, away) < 1e-12) away = cross(n, abs(n.x) < 0.5 ? vec3(1.0, 0.0, 0.0) : vec3(0.0, 1.0, 0.0));
  away = normalize(away);
  float kernel[25], y[25];
  for (int i = 0; i < 25; ++i) kernel[i] = 0.0;
  kernel[0] = number[2] * 0.28209479177387814;
  for (int j = 0; j < 5; ++j) {
    float angle = 1.2566370614359172 * float(j);
    harmonics(n * cos(angle) + away * sin(angle), y);
    for (int l = 1; l < MIRROR_ORDER; ++l)
      for (int i = l * l; i < (l + 1) * (l + 1); ++i) kernel[i] += number[5 * l - 2 + j] * y[i];
  }
  vec3 sum = vec3(0.0);
  for (int i = 0; i < kCount; ++i) {
    int at = vertex * kCount + i;
    sum += kernel[i] * texelFetch(arriving, ivec2(at % ${kAcross}, at / ${kAcross}), 0).rgb;
  }
  return max(sum, vec3(0.0));
}`;
