// Real, orthonormal spherical harmonics without the Condon-Shortley phase, as core/sphere/sh.h:
//   Y(0,0) = 0.282095, Y(1,-1) = 0.488603 y, Y(1,0) = 0.488603 z, Y(1,1) = 0.488603 x;  index i = l(l+1)+m.
// "Order n" means bands 0..n-1: n*n coefficients. RGB light is flat: light[3 * i + channel].

import { sphereQuadrature } from './quadrature';

export const shCount = (order: number): number => order * order;

/// Writes Y_i(x, y, z) for all i of `order` to out[offset + i]. The direction is unit.
///   Y(l, +-m) = sqrt(2) P(l, m)(z) { Re | Im } (x + iy)^m,  P normalised and divided by sin^m
export function evaluateSh(
  order: number,
  x: number,
  y: number,
  z: number,
  out: Float32Array | Float64Array,
  offset = 0,
): void {
  const above = recurrence(order);
  let cosine = 1; // Re (x + iy)^m
  let sine = 0; // Im (x + iy)^m
  let sectoral = Math.sqrt(1 / (4 * Math.PI)); // P(m, m)
  for (let m = 0; m < order; ++m) {
    let below = 0; // P(l-1, m) / a(l, m)
    let here = sectoral; // P(l, m)
    for (let l = m; l < order; ++l) {
      const centre = offset + l * (l + 1);
      if (m === 0) {
        out[centre] = here;
      } else {
        out[centre + m] = Math.SQRT2 * here * cosine;
        out[centre - m] = Math.SQRT2 * here * sine;
      }
      const next = above[(l + 1) * (order + 1) + m] * (z * here - below);
      below = here / above[(l + 1) * (order + 1) + m];
      here = next;
    }
    sectoral *= Math.sqrt((2 * m + 3) / (2 * m + 2));
    [cosine, sine] = [x * cosine - y * sine, x * sine + y * cosine];
  }
}

const recurrences = new Map<number, Float64Array>();

/// a(l, m) at l * (order + 1) + m of  P(l, m) = a(l, m) (z P(l-1, m) - P(l-2, m) / a(l-1, m)),  l to `order`.
function recurrence(order: number): Float64Array {
  let above = recurrences.get(order);
  if (above) return above;
  recurrences.set(order, (above = new Float64Array((order + 1) ** 2)));
  for (let l = 1; l <= order; ++l)
    for (let m = 0; m < l; ++m) above[l * (order + 1) + m] = Math.sqrt((4 * l * l - 1) / (l * l - m * m));
  return above;
}

/// SH coefficients of a function on the sphere: `radiance` writes RGB for a direction. With 16 rows the built-in skies come out
/// within 1.1e-4 at order 10 (measured against 128).
export function projectFunction(
  order: number,
  radiance: (x: number, y: number, z: number, rgb: Float64Array) => void,
  rows = 16,
): Float32Array {
  const sums = new Float64Array(3 * shCount(order));
  const basis = new Float64Array(shCount(order));
  const rgb = new Float64Array(3);
  for (const { x, y, z, weight } of sphereQuadrature(rows)) {
    radiance(x, y, z, rgb);
    evaluateSh(order, x, y, z, basis);
    accumulate(sums, basis, rgb, weight);
  }
  return Float32Array.from(sums);
}

/// sums[3 i + c] += weight * basis[i] * rgb[c]
export function accumulate(sums: Float64Array, basis: Float64Array, rgb: ArrayLike<number>, weight: number): void {
  for (let i = 0; i < basis.length; ++i) {
    const scaled = weight * basis[i];
    sums[3 * i] += scaled * rgb[0];
    sums[3 * i + 1] += scaled * rgb[1];
    sums[3 * i + 2] += scaled * rgb[2];
  }
}

/// Light turned about +Y: positive degrees turn +Z towards +X, as Environment::rotation_deg does.
///   c'_i = sum_j c_j integral Y_j(u) Y_i(R u) du, band by band, by a quadrature that is exact for the order
export function rotateAboutY(order: number, light: Float32Array, degrees: number): Float32Array {
  if (degrees === 0) return light.slice();
  const [cos, sin] = [Math.cos((degrees * Math.PI) / 180), Math.sin((degrees * Math.PI) / 180)];
  const before = new Float64Array(shCount(order));
  const after = new Float64Array(shCount(order));
  const sums = new Float64Array(light.length);
  const rgb = new Float64Array(3);
  for (const { x, y, z, weight } of sphereQuadrature(order)) {
    evaluateSh(order, x, y, z, before);
    evaluateSh(order, cos * x + sin * z, y, cos * z - sin * x, after);
    lightAlong(before, light, rgb);
    accumulate(sums, after, rgb, weight);
  }
  return Float32Array.from(sums);
}

/// Radiance that SH light sends from the direction whose basis values are given.
export function lightAlong(basis: ArrayLike<number>, light: ArrayLike<number>, rgb: Float64Array): void {
  rgb.fill(0);
  for (let i = 0; i < basis.length; ++i) {
    rgb[0] += basis[i] * light[3 * i];
    rgb[1] += basis[i] * light[3 * i + 1];
    rgb[2] += basis[i] * light[3 * i + 2];
  }
}

/// Light of another order: bands beyond `order` are dropped, missing ones are zero.
export function withOrder(light: ArrayLike<number>, order: number): Float32Array {
  const out = new Float32Array(3 * shCount(order));
  for (let i = 0; i < Math.min(out.length, light.length); ++i) out[i] = light[i];
  return out;
}

/// The transfer vector of an unoccluded white Lambertian point: t_lm = A_l / pi * Y_lm(n) (Ramamoorthi and Hanrahan 2001).
export function clampedCosineTransfer(order: number, x: number, y: number, z: number): Float32Array {
  const out = new Float32Array(shCount(order));
  evaluateSh(order, x, y, z, out);
  for (let l = 0; l < order; ++l) {
    const scale = clampedCosineBand(l);
    for (let i = l * l; i < (l + 1) * (l + 1); ++i) out[i] *= scale;
  }
  return out;
}

/// A_l / pi: 1, 2/3, 1/4, 0, -1/24, ...
export function clampedCosineBand(l: number): number {
  if (l === 1) return 2 / 3;
  if (l % 2 === 1) return 0;
  let binomial = 1; // l! / (2^l (l/2)!^2)
  for (let k = 1; k <= l / 2; ++k) binomial *= (l / 2 + k) / (4 * k);
  return ((l / 2) % 2 === 1 ? 2 : -2) * (binomial / ((l + 2) * (l - 1)));
}
