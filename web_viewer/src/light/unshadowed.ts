// How bright a model would be if nothing of it shaded anything: the "before" of the comparison, as a number.
//   value(n) = sum over l, m of a_l L_lm Y_lm(n),   a_0 = 1, a_1 = 2/3, a_2 = 1/4 (the cosine lobe over pi; a_3 = 0, the rest small)

import { evaluateSh, lightAlong } from './sh';
import { quantile } from './transfer';

const kOrder = 3;
const kLobe = [1, 2 / 3, 1 / 4];
const kSamples = 4000;

/// The 90th percentile over the vertices, as the worker's `level` takes it. Lamps of the scene do not count.
export function unshadowedLevel(light: ArrayLike<number>, normals: readonly ArrayLike<number>[]): number {
  const lit = Float32Array.from({ length: Math.min(light.length, 3 * kOrder ** 2) }, (_, i) => {
    return light[i] * kLobe[Math.floor(Math.sqrt(Math.floor(i / 3)))];
  });
  const order = Math.sqrt(lit.length / 3);
  const basis = new Float64Array(order ** 2);
  const rgb = new Float64Array(3);
  const total = normals.reduce((sum, part) => sum + part.length / 3, 0);
  const step = Math.max(1, Math.floor(total / kSamples));
  const values: number[] = [];
  for (const part of normals) {
    for (let v = 0; v < part.length / 3; v += step) {
      evaluateSh(order, part[3 * v], part[3 * v + 1], part[3 * v + 2], basis);
      lightAlong(basis, lit, rgb);
      values.push(Math.max(...rgb));
    }
  }
  return quantile(Float32Array.from(values), 0.9);
}
