// Transfer vectors and what is computed from them. Pure functions: the worker calls them, tests call them.
//
//   value_c(v) = sum_i light[3 i + c] * t[c][i] + (lamps ? t[c][order^2] : 0)                              (1)
//   t[c][i] of vertex v is coefficients[(v * channels + c) * slots + i]; slots = order^2, one more when `fixed` (light of the
//   scene's own lamps). A file holds `numbers` from which they follow: the coefficients themselves, or the weights of
//   components and, of a scene with lamps, the lamps' light of each channel after them:
//   coefficient[s] = mean[s] + sum_k number[k] row_k[s],  s = c * slots + i                               (2)

export interface TransferShape {
  order: number;
  channels: 1 | 3;
  fixed: boolean;
  slots: number;
}

/// Equation 2's: the mean and then the rows, (rank + 1) x channels x slots.
export interface Components {
  rank: number;
  rows: Float32Array;
}

/// What the numbers of a vertex mean; without components they are its coefficients.
export interface TransferForm extends TransferShape {
  components?: Components;
}

/// How `_PRT_k` attributes hold the numbers: number = offset + scale * stored, for each.
export interface PackedTransfer {
  scale: ArrayLike<number>;
  offset: ArrayLike<number>;
}

export const numbersOf = ({ channels, slots, fixed, components }: TransferForm): number =>
  components ? components.rank + (fixed ? channels : 0) : channels * slots;

/// Decodes `_PRT_k` (4 numbers for each vertex, in [-1, 1]) to its places in `out`, `stride` numbers for each vertex.
export function decodeAttribute(packed: PackedTransfer, k: number, stored: Float32Array, out: Float32Array): void {
  const stride = packed.scale.length;
  const first = 4 * k;
  const width = Math.min(4, stride - first); // the last attribute may be padded
  const factors = Float64Array.from({ length: width }, (_, i) => packed.scale[first + i]);
  const shifts = Float64Array.from({ length: width }, (_, i) => packed.offset[first + i]);
  for (let from = 0, to = first; from < stored.length; from += 4, to += stride)
    for (let i = 0; i < width; ++i) out[to + i] = shifts[i] + factors[i] * stored[from + i];
}

/// Equation (1) for every vertex, RGB. `out` may be given for reuse. Cost: three multiply-adds for each slot or component.
export function relight(
  form: TransferForm,
  numbers: Float32Array,
  light: Float32Array,
  lamps: boolean,
  out: Float32Array = new Float32Array((3 * numbers.length) / numbersOf(form)),
): Float32Array {
  return form.components
    ? relightComponents({ ...form, components: form.components }, numbers, light, lamps, out)
    : relightRaw(form, numbers, light, lamps, out);
}

/// Equation (1) of the mean and of each row: what is then left for a vertex is a sum over its weights.
function relightComponents(
  form: Required<TransferForm>,
  weights: Float32Array,
  light: Float32Array,
  lamps: boolean,
  out: Float32Array,
): Float32Array {
  const { channels, fixed, components } = form;
  const lit = relightRaw(form, components.rows, light, false, new Float32Array(3 * (components.rank + 1)));
  const count = numbersOf(form);
  const gains = new Float64Array(3 * count);
  gains.set(lit.subarray(3));
  if (fixed && lamps) for (let c = 0; c < 3; ++c) gains[3 * (components.rank + (channels === 1 ? 0 : c)) + c] = 1;
  for (let v = 0, from = 0; v < out.length; v += 3, from += count) {
    let [r, g, b] = lit;
    for (let k = 0; k < count; ++k) {
      const weight = weights[from + k];
      r += weight * gains[3 * k];
      g += weight * gains[3 * k + 1];
      b += weight * gains[3 * k + 2];
    }
    out[v] = r;
    out[v + 1] = g;
    out[v + 2] = b;
  }
  return out;
}

/// Equation (2) for every vertex.
export function coefficientsOf(form: TransferForm, numbers: Float32Array): Float32Array {
  const { channels, slots, fixed, components } = form;
  if (!components) return numbers;
  const [stride, count] = [channels * slots, numbersOf(form)];
  const out = new Float32Array((numbers.length / count) * stride);
  for (let to = 0, from = 0; to < out.length; to += stride, from += count) {
    for (let s = 0; s < stride; ++s) {
      let sum = components.rows[s];
      for (let k = 0; k < components.rank; ++k) sum += numbers[from + k] * components.rows[(k + 1) * stride + s];
      out[to + s] = sum;
    }
    if (fixed) for (let c = 0; c < channels; ++c) out[to + (c + 1) * slots - 1] = numbers[from + components.rank + c];
  }
  return out;
}

function relightRaw(
  shape: TransferShape,
  coefficients: Float32Array,
  light: Float32Array,
  lamps: boolean,
  out: Float32Array,
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
