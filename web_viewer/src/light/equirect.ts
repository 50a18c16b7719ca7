// Equirectangular radiance maps and spherical harmonics, conventions of core/scene/environment.h:
//   u = 0.5 + atan2(z, x) / (2 pi),   v from the top = 0.5 - asin(y) / pi

import { accumulate, evaluateSh, lightAlong, shCount } from './sh';

/// Rows from the top; `stride` numbers per texel, the first three are R, G, B.
export interface EquirectMap {
  width: number;
  height: number;
  stride: 3 | 4;
  data: Float32Array;
}

export interface Direction {
  x: number;
  y: number;
  z: number;
}

export function directionAt(u: number, v: number): Direction {
  const azimuth = 2 * Math.PI * (u - 0.5);
  const height = Math.PI * (0.5 - v);
  const radius = Math.cos(height);
  return { x: radius * Math.cos(azimuth), y: Math.sin(height), z: radius * Math.sin(azimuth) };
}

/// Texels this many or more across are taken as constant at their centre; coarser maps are sampled several times each.
const kFineWidth = 512;

/// SH coefficients of a map. Each sample counts with its exact solid angle, so that a constant map of radiance 1 gives
/// exactly sqrt(4 pi) in band 0. Cost: width * height * order^2.
export function projectEquirect(map: EquirectMap, order: number): Float32Array {
  const split = Math.max(1, Math.ceil(kFineWidth / map.width));
  const [columns, rows] = [map.width * split, map.height * split];
  const basis = new Float64Array(shCount(order));
  const sums = new Float64Array(3 * basis.length);
  const rgb = new Float64Array(3);
  for (let row = 0; row < rows; ++row) {
    const solidAngle =
      ((2 * Math.PI) / columns) * (Math.cos((Math.PI * row) / rows) - Math.cos((Math.PI * (row + 1)) / rows));
    for (let column = 0; column < columns; ++column) {
      const { x, y, z } = directionAt((column + 0.5) / columns, (row + 0.5) / rows);
      const texel = map.stride * (Math.floor(row / split) * map.width + Math.floor(column / split));
      for (let c = 0; c < 3; ++c) rgb[c] = map.data[texel + c];
      evaluateSh(order, x, y, z, basis);
      accumulate(sums, basis, rgb, solidAngle);
    }
  }
  return Float32Array.from(sums);
}

const kBright = 8; // times the mean of the rest

/// The part of a map that few bands cannot hold, as core/scene/bright_part.h has it; null: it has none.
export function brightOf(map: EquirectMap): EquirectMap | null {
  const sizes = Float64Array.from({ length: map.width * map.height }, (_, i) => {
    const at = i * map.stride;
    return (map.data[at] + map.data[at + 1] + map.data[at + 2]) / 3;
  });
  let most = Infinity;
  for (let round = 0; round < 64; ++round) most = kBright * meanBelow(map, sizes, most);
  if (!sizes.some((size) => size > most)) return null;
  const data = Float32Array.from(map.data, (x, at) => {
    const size = sizes[Math.floor(at / map.stride)];
    return size > most ? x * (1 - most / size) : 0;
  });
  return { ...map, data };
}

/// Over all directions, of what is left where nothing is larger than `most`.
function meanBelow(map: EquirectMap, sizes: Float64Array, most: number): number {
  let [sum, weights] = [0, 0];
  for (let row = 0; row < map.height; ++row) {
    const weight = Math.cos((0.5 - (row + 0.5) / map.height) * Math.PI);
    for (let column = 0; column < map.width; ++column) sum += weight * Math.min(most, sizes[row * map.width + column]);
    weights += weight * map.width;
  }
  return sum / weights;
}

/// A function on the sphere as a picture of `width` x `width / 2` texels, rows from the top, RGBA.
export function functionToEquirect(
  radiance: (x: number, y: number, z: number, rgb: Float64Array) => void,
  width: number,
): EquirectMap {
  const height = width / 2;
  const data = new Float32Array(4 * width * height).fill(1);
  const rgb = new Float64Array(3);
  const equator = Array.from({ length: width }, (_, column) => directionAt((column + 0.5) / width, 0.5));
  for (let row = 0, to = 0; row < height; ++row) {
    const { y } = directionAt(0, (row + 0.5) / height);
    const radius = Math.sqrt(1 - y * y);
    for (let column = 0; column < width; ++column, to += 4) {
      radiance(radius * equator[column].x, y, radius * equator[column].z, rgb);
      for (let c = 0; c < 3; ++c) data[to + c] = rgb[c];
    }
  }
  return { width, height, stride: 4, data };
}

/// SH light as a picture. Where harmonics ring it is negative.
export function lightToEquirect(order: number, light: ArrayLike<number>, width: number): EquirectMap {
  const basis = new Float64Array(shCount(order));
  const radiance = (x: number, y: number, z: number, rgb: Float64Array) => {
    evaluateSh(order, x, y, z, basis);
    lightAlong(basis, light, rgb);
  };
  return functionToEquirect(radiance, width);
}

/// The light blurred by the kernel (1 + cos)^n, n = order - 1: band l times n! (n + 1)! / ((n - l)! (n + l + 1)!).
/// The kernel is nowhere negative: light that was positive before it was cut to harmonics is so again.
export function softened(order: number, light: ArrayLike<number>): Float32Array {
  const factors = [1];
  for (let l = 1; l < order; ++l) factors.push((factors[l - 1] * (order - l)) / (order + l));
  return Float32Array.from(
    { length: 3 * shCount(order) },
    (_, i) => light[i] * factors[Math.floor(Math.sqrt(Math.floor(i / 3)))],
  );
}

/// Halves a map until it is at most `width` wide: each 2 x 2 block becomes its mean, weighted by solid angle.
export function shrinkEquirect(map: EquirectMap, width: number): EquirectMap {
  let out = map;
  while (out.width > width && out.width % 2 === 0 && out.height % 2 === 0) out = halve(out);
  return out;
}

function halve(map: EquirectMap): EquirectMap {
  const [width, height] = [map.width / 2, map.height / 2];
  const data = new Float32Array(map.stride * width * height);
  const band = (row: number) => Math.cos((Math.PI * row) / map.height) - Math.cos((Math.PI * (row + 1)) / map.height);
  for (let row = 0; row < height; ++row) {
    const upper = band(2 * row) / (band(2 * row) + band(2 * row + 1));
    for (let column = 0; column < width; ++column) {
      const from = map.stride * (2 * row * map.width + 2 * column);
      const below = from + map.stride * map.width;
      const to = map.stride * (row * width + column);
      for (let c = 0; c < map.stride; ++c) {
        const top = map.data[from + c] + map.data[from + map.stride + c];
        const bottom = map.data[below + c] + map.data[below + map.stride + c];
        data[to + c] = 0.5 * (upper * top + (1 - upper) * bottom);
      }
    }
  }
  return { width, height, stride: map.stride, data };
}
