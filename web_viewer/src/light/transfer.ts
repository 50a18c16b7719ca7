// Transfer vectors beyond the light they give (asset/kiln_reader.ts): what the false colours show. Pure functions: the worker
// calls them, tests call them.
//
// t[c][i] of vertex v is coefficients[(v * channels + c) * slots + i]; slots = order^2, one more when `fixed` (light of the
// scene's own lamps). A file stores numbers from which they follow: the coefficients themselves, or the weights of components
// and, of a scene with lamps, the lamps' light of each channel after them:
//   coefficient[s] = mean[s] + sum_k number[k] row_k[s],  s = c * slots + i

import type { StoredTransfer } from '../asset/kiln_reader';

export interface TransferShape {
  order: number;
  channels: 1 | 3;
  slots: number;
}

/// The coefficients of every vertex, from its `_PRT_k` arrays.
export function coefficientsOf(transfer: StoredTransfer, attributes: readonly Float32Array[]): Float32Array {
  const { channels, slots, fixed, components, rows } = transfer;
  const numbers = decoded(transfer, attributes);
  if (!components) return numbers;
  const [stride, count] = [channels * slots, transfer.scale.length];
  const out = new Float32Array((numbers.length / count) * stride);
  const sums = new Float64Array(stride);
  for (let to = 0, from = 0; to < out.length; to += stride, from += count) {
    for (let s = 0; s < stride; ++s) sums[s] = rows[s];
    for (let k = 0; k < components.rank; k += kTogether) addRows(sums, numbers, from + k, rows, k, components.rank);
    out.set(sums, to);
    if (fixed) for (let c = 0; c < channels; ++c) out[to + (c + 1) * slots - 1] = numbers[from + components.rank + c];
  }
  return out;
}

const kTogether = 4; // rows that are added in one pass: nearly twice as fast as one sum after the other

/// Adds rows k .. k + 3 below `rank`, by the numbers at `from`.
function addRows(
  sums: Float64Array,
  numbers: Float32Array,
  from: number,
  rows: Float32Array,
  k: number,
  rank: number,
): void {
  const stride = sums.length;
  const weight = (i: number) => (k + i < rank ? numbers[from + i] : 0);
  const row = (i: number) => (k + i < rank ? k + i + 1 : 0) * stride;
  const [a, b, c, d] = [weight(0), weight(1), weight(2), weight(3)];
  const [p, q, r, t] = [row(0), row(1), row(2), row(3)];
  for (let s = 0; s < stride; ++s) sums[s] += a * rows[p + s] + b * rows[q + s] + c * rows[r + s] + d * rows[t + s];
}

/// offset + scale * stored of every number, those of a vertex together. The last attribute may be padded.
function decoded({ scale, offset }: StoredTransfer, attributes: readonly Float32Array[]): Float32Array {
  const stride = scale.length;
  const out = new Float32Array((attributes[0].length / 4) * stride);
  attributes.forEach((stored, k) => {
    const width = Math.min(4, stride - 4 * k);
    for (let from = 0, to = 4 * k; from < stored.length; from += 4, to += stride)
      for (let i = 0; i < width; ++i) out[to + i] = offset[4 * k + i] + scale[4 * k + i] * stored[from + i];
  });
  return out;
}

/// Where to refine: of each triangle the sum over its edges of |t_a - t_b| (Krivanek et al. 2004, eq. 3), over all SH slots
/// of all channels; times the square root of the triangle's area when `weighted`, the L2 form of the bake's default measure.
export function triangleMeasure(
  shape: TransferShape,
  coefficients: Float32Array,
  positions: Float32Array,
  indices: ArrayLike<number>,
  weighted: boolean,
): Float32Array {
  const out = new Float32Array(indices.length / 3);
  for (let t = 0; t < out.length; ++t) {
    const [a, b, c] = [indices[3 * t], indices[3 * t + 1], indices[3 * t + 2]];
    const sum =
      distance(shape, coefficients, a, b) + distance(shape, coefficients, b, c) + distance(shape, coefficients, c, a);
    out[t] = weighted ? sum * Math.sqrt(triangleArea(positions, a, b, c)) : sum;
  }
  return out;
}

function distance(shape: TransferShape, coefficients: Float32Array, a: number, b: number): number {
  const count = shape.order * shape.order;
  const stride = shape.channels * shape.slots;
  let sum = 0;
  for (let channel = 0; channel < shape.channels; ++channel) {
    const [from, to] = [a * stride + channel * shape.slots, b * stride + channel * shape.slots];
    for (let i = 0; i < count; ++i) {
      const difference = coefficients[from + i] - coefficients[to + i];
      sum += difference * difference;
    }
  }
  return Math.sqrt(sum);
}

function triangleArea(p: Float32Array, a: number, b: number, c: number): number {
  const [ux, uy, uz] = [p[3 * b] - p[3 * a], p[3 * b + 1] - p[3 * a + 1], p[3 * b + 2] - p[3 * a + 2]];
  const [vx, vy, vz] = [p[3 * c] - p[3 * a], p[3 * c + 1] - p[3 * a + 1], p[3 * c + 2] - p[3 * a + 2]];
  return 0.5 * Math.hypot(uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx);
}

/// One slot of one channel at every vertex.
export function pickCoefficient(
  shape: TransferShape,
  coefficients: Float32Array,
  channel: number,
  slot: number,
): Float32Array {
  const stride = shape.channels * shape.slots;
  const out = new Float32Array(coefficients.length / stride);
  const first = (shape.channels === 1 ? 0 : channel) * shape.slots + slot;
  for (let v = 0; v < out.length; ++v) out[v] = coefficients[v * stride + first];
  return out;
}

/// The value below which the fraction `q` of `values` lies; 0 for none. Colour scales end here, so that one outlier does not
/// leave everything else one colour.
export function quantile(values: Float32Array, q: number): number {
  if (values.length === 0) return 0;
  const sorted = values.slice().sort();
  return sorted[Math.min(sorted.length - 1, Math.floor(q * sorted.length))];
}
