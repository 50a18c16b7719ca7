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

const kBlock = 64; // vertices whose coefficients stay in the cache while every attribute adds its four: 3 times as fast

/// Decodes `_PRT_k` attributes (4 flat slots each, in [-1, 1]) once: value = offset + scale * stored.
export function decodeAttributes(
  shape: TransferShape,
  attributes: readonly Float32Array[],
  scale: ArrayLike<number>,
  offset: ArrayLike<number>,
): Float32Array {
  const stride = shape.channels * shape.slots;
  const vertices = attributes.length > 0 ? attributes[0].length / 4 : 0;
  const out = new Float32Array(vertices * stride);
  const [factors, shifts] = [Float64Array.from(scale), Float64Array.from(offset)];
  for (let begin = 0; begin < vertices; begin += kBlock) {
    const end = Math.min(vertices, begin + kBlock);
    for (let k = 0; k < attributes.length; ++k) {
      const stored = attributes[k];
      const first = 4 * k;
      const width = Math.min(4, stride - first); // the last attribute may be padded
      for (let v = begin; v < end; ++v) {
        for (let i = 0; i < width; ++i)
          out[v * stride + first + i] = shifts[first + i] + factors[first + i] * stored[4 * v + i];
      }
    }
  }
  return out;
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
