// Transfer vectors and what is computed from them. Pure functions: the worker calls them, tests call them.
//
//   coefficients[(v * channels + c) * slots + i]; slots = order^2, one more when `fixed` (light of the scene's own lamps)
//   value_c(v) = sum_i light[3 i + c] * t[c][i] + (lamps ? t[c][order^2] : 0)                              (1)

export interface TransferShape {
  order: number;
  channels: 1 | 3;
  fixed: boolean;
  slots: number;
}

/// How `_PRT_k` attributes hold them: coefficient = offset + scale * stored, for each flat slot.
export interface PackedTransfer extends TransferShape {
  scale: ArrayLike<number>;
  offset: ArrayLike<number>;
}

/// Decodes `_PRT_k` (4 flat slots for each vertex, in [-1, 1]) to its places in the coefficients `out`.
export function decodeAttribute(packed: PackedTransfer, k: number, stored: Float32Array, out: Float32Array): void {
  const stride = packed.channels * packed.slots;
  const first = 4 * k;
  const width = Math.min(4, stride - first); // the last attribute may be padded
  const factors = Float64Array.from({ length: width }, (_, i) => packed.scale[first + i]);
  const shifts = Float64Array.from({ length: width }, (_, i) => packed.offset[first + i]);
  for (let from = 0, to = first; from < stored.length; from += 4, to += stride)
    for (let i = 0; i < width; ++i) out[to + i] = shifts[i] + factors[i] * stored[from + i];
}

/// Equation (1) for every vertex, RGB. `out` may be given for reuse. Cost: vertices * channels' multiply-adds.
export function relight(
  shape: TransferShape,
  coefficients: Float32Array,
  light: Float32Array,
  lamps: boolean,
  out: Float32Array = new Float32Array((3 * coefficients.length) / (shape.channels * shape.slots)),
): Float32Array {
  const count = shape.order * shape.order;
  const fixedWeight = shape.fixed && lamps ? 1 : 0;
  const red = new Float64Array(shape.slots);
  const green = new Float64Array(shape.slots);
  const blue = new Float64Array(shape.slots);
  for (let i = 0; i < count; ++i) [red[i], green[i], blue[i]] = [light[3 * i], light[3 * i + 1], light[3 * i + 2]];
  if (shape.fixed) red[count] = green[count] = blue[count] = fixedWeight;
  const step = shape.channels === 1 ? 0 : shape.slots;
  const stride = shape.channels * shape.slots;
  for (let v = 0, from = 0; v < out.length; v += 3, from += stride) {
    let [r, g, b] = [0, 0, 0];
    for (let i = 0; i < shape.slots; ++i) {
      r += coefficients[from + i] * red[i];
      g += coefficients[from + step + i] * green[i];
      b += coefficients[from + 2 * step + i] * blue[i];
    }
    out[v] = r;
    out[v + 1] = g;
    out[v + 2] = b;
  }
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
