// KILN_light_field: radiance towards every eye, as reflected radiance functions (r-RFs) at the vertices.
//   radiance[c] = max(0, sum_k weight[k] sum_i r-RF_k[c][i] Y_i(r)),   r = 2 (n.w) n - w    (Vanhoey et al. 2015, eq. 8)
// k: the corners of a triangle, n: the interpolated normal, w: the way to the eye, raised to the horizon of n where it
// is below. core/artifact/README.md specifies the format, core/lightfield/seen.h is the same in C++.
//
// Where the file keeps the sky apart (mirrored_sky.ts) or lamps (field_lamps.ts), what they add belongs to the sum. What a
// vertex sees of them is interpolated too. Emission that is kept apart is the material's, and whoever shows it adds it. Where
// diffuse light is apart it is interpolated, and multiplied by the colour of the place.
//
// A shader reads r-RFs as texels of eight halves: texel 3 g + c of a vertex holds coefficients 8 g .. 8 g + 7 of channel
// c; what is left over follows, all of red first; then texels of what is seen of the sky, and of lamps, and of diffuse light. 16 bytes a texel: 160 a vertex at
// degree 4, 304 at 6, 496 at 8.

import { coefficientsOf } from '../light/transfer';
import { evaluateSh } from '../light/sh';
import { componentRows, type StoredTransfer } from './kiln_reader';
import { checkLamps, type FieldLamp, type LampExtension, lampHighlights } from './field_lamps';
import { checkLobes, checkSky, kVisibilityCount, lobeAt, type LobesExtension, type MirroredSky, type SkyExtension } from './mirrored_sky';

/// The root extension, as written.
export interface LightFieldExtension {
  version: number;
  basis: string;
  condonShortley: boolean;
  reflected: boolean;
  degree: number;
  form: 'raw' | 'components';
  components?: { rank: number; bufferView: number };
  attributes: string[];
  scale: number[];
  offset: number[];
  sky?: SkyExtension;
  lamps?: LampExtension; // of version 2
  emissionApart?: boolean; // of version 3
  diffuse?: DiffuseExtension; // of version 4
}

/// `diffuse` of KILN_light_field, as written: the light is that of the transfer vectors.
export interface DiffuseExtension {
  mean: number[];
  lobes: LobesExtension;
}

/// r-RFs of the vertices of one primitive.
export interface FieldTexels {
  degree: number;
  sky: boolean; // the sky is kept apart
  lamps: number; // so many lamps are
  emission: boolean; // what the material emits is, too
  diffuse: boolean; // and base colour from diffuse light
  halves: Uint16Array<ArrayBuffer>; // 8 * texelsOf(this) of each vertex
  unit: number; // a coefficient is unit * half; a power of two
}

/// What a field holds for each vertex.
export type FieldShape = Pick<FieldTexels, 'degree' | 'sky' | 'lamps' | 'emission' | 'diffuse'>;

/// That part of a shape which says how many numbers a vertex has.
type Numbers = Pick<FieldShape, 'degree' | 'sky' | 'lamps' | 'diffuse'>;

const kName = 'KILN_light_field';
const kMostDegree = 8;
const kBatch = 4096; // vertices that are decoded together
const kLargestHalf = 65504;

export const fieldCount = (degree: number): number => (degree + 1) ** 2;

const seriesTexels = (degree: number): number => Math.ceil((3 * fieldCount(degree)) / 8);

/// Texels of a vertex.
export const texelsOf = (shape: Numbers): number => diffuseTexel(shape) + Number(shape.diffuse);

const diffuseTexel = (shape: Numbers): number => firstLampTexel(shape) + Math.ceil(shape.lamps / 8);

const firstLampTexel = ({ degree, sky }: Pick<Numbers, 'degree' | 'sky'>): number =>
  seriesTexels(degree) + (sky ? Math.ceil(kVisibilityCount / 8) : 0);

/// Which half of a vertex is coefficient `i` of what it sees of the sky. Those are not in units.
export const skyHalfAt = (degree: number, i: number): number => 8 * seriesTexels(degree) + i;

/// Which one is how much it sees of lamp `k`.
export const lampHalfAt = (shape: Numbers, k: number): number => 8 * firstLampTexel(shape) + k;

/// Which one is channel `c` of its diffuse light, in units.
export const diffuseHalfAt = (shape: Numbers, c: number): number => 8 * diffuseTexel(shape) + c;

/// Which half of a vertex is coefficient `i` of channel `c`.
export function halfAt(degree: number, i: number, c: number): number {
  const rest = fieldCount(degree) % 8;
  const grouped = fieldCount(degree) - rest;
  return i < grouped ? 24 * (i >> 3) + 8 * c + (i & 7) : 3 * grouped + c * rest + i - grouped;
}

/// The extension of a glTF; undefined: it has no light field. Throws, with the JSON pointer, on what it does not know.
export function readLightField(json: unknown): LightFieldExtension | undefined {
  const e = (json as { extensions?: Record<string, unknown> }).extensions?.[kName] as LightFieldExtension | undefined;
  if (e) checkField(e);
  return e;
}

function checkField(e: LightFieldExtension): void {
  const must = (good: boolean, member: keyof LightFieldExtension, what: string) => {
    if (!good) throw new Error(`/extensions/${kName}/${member}: ${what}`);
  };
  must([1, 2, 3, 4].includes(e.version), 'version', `only versions 1 to 4 are read, this is ${e.version}`);
  const basis = e.basis === 'real-sh' && e.condonShortley === false;
  must(basis, 'basis', 'must be real-sh without the Condon-Shortley phase');
  must(e.reflected === true, 'reflected', 'radiance functions must be reflected');
  must(Number.isInteger(e.degree) && e.degree >= 0 && e.degree <= kMostDegree, 'degree', 'must be 0 to 8');
  must(e.form === 'raw' || e.form === 'components', 'form', 'must be raw or components');
  const slots = 3 * fieldCount(e.degree);
  const rank = e.form === 'raw' ? slots : (e.components?.rank ?? 0);
  must(Number.isInteger(rank) && rank >= 1 && rank <= slots, 'components', `the rank must be 1 to ${slots}`);
  const names = Array.from({ length: Math.ceil(rank / 4) }, (_, k) => `_SLF_${k}`);
  must(`${e.attributes}` === `${names}`, 'attributes', `must be _SLF_0 and on, ${names.length} of them`);
  for (const list of ['scale', 'offset'] as const)
    must(e[list]?.length === rank && e[list].every(Number.isFinite), list, `must be ${rank} numbers`);
  if (e.sky) checkSky(e.sky, `/extensions/${kName}/sky`);
  const flag = e.emissionApart === undefined || typeof e.emissionApart === 'boolean';
  must(flag, 'emissionApart', 'must be true or false');
  if (e.diffuse) {
    const { mean, lobes } = e.diffuse;
    const colour = Array.isArray(mean) && mean.length === 3 && mean.every((x) => x >= 0 && Number.isFinite(x));
    must(colour, 'diffuse', 'mean must be three numbers, none below zero');
    checkLobes(lobes, `/extensions/${kName}/diffuse`);
  }
  if (e.lamps) checkLamps(e.lamps, `/extensions/${kName}/lamps`);
}

/// What the stored numbers mean, as if they were transfer vectors. `bytesIn`: of a buffer view.
export function storedField(
  e: LightFieldExtension,
  bytesIn: (view: number) => Uint8Array<ArrayBuffer>,
): StoredTransfer {
  const order = e.degree + 1;
  const shape = { ...e, version: 2, order, channels: 3 as const, fixed: false, slots: order * order };
  if (e.form === 'raw') return { ...shape, components: undefined, rows: new Float32Array(0) };
  return { ...shape, rows: componentRows(shape, bytesIn(e.components!.bufferView).slice().buffer) };
}

/// What a vertex sees, and how it is written.
interface SeenNumbers {
  extension: { scale: number[]; offset: number[] };
  attributes: readonly Float32Array[];
}

/// `attributes`: the `_SLF_k` of a primitive; `apart`: its `_SLF_SKY_k`, `_SLF_LAMP_k` and diffuse light. Components are expanded, once:
/// rank * 3 (degree + 1)^2 products a vertex. Throws on what is not finite.
export function fieldTexels(
  field: StoredTransfer,
  attributes: readonly Float32Array[],
  apart: { sky?: SeenNumbers; lamps?: SeenNumbers; emission?: boolean; diffuse?: Float32Array } = {},
): FieldTexels {
  const degree = field.order - 1;
  const stride = 3 * field.slots;
  const vertices = attributes[0].length / 4;
  const out = emptyTexels(
    {
      degree,
      sky: apart.sky !== undefined,
      lamps: apart.lamps?.extension.scale.length ?? 0,
      emission: apart.emission === true,
      diffuse: apart.diffuse !== undefined,
    },
    vertices,
    Math.max(largestOf(field), largestIn(apart.diffuse ?? [])),
  );
  const { series, visibility, lamps, diffuse } = texelWriter(out);
  for (let v = 0; apart.diffuse && v < vertices; ++v) diffuse(v, apart.diffuse, 3 * v);
  for (let first = 0; first < vertices; first += kBatch) {
    const numbers = coefficientsOf(field, attributes.map((all) => all.subarray(4 * first, 4 * (first + kBatch))));
    for (let from = 0, v = first; from < numbers.length; from += stride, ++v) series(v, numbers, from);
  }
  for (const [numbers, write] of [[apart.sky, visibility], [apart.lamps, lamps]] as const) {
    if (!numbers) continue;
    const { scale, offset } = numbers.extension;
    const own = new Float32Array(scale.length);
    for (let v = 0; v < vertices; ++v) {
      for (let i = 0; i < own.length; ++i) own[i] = offset[i] + scale[i] * numbers.attributes[i >> 2][4 * v + (i & 3)];
      write(v, own, 0);
    }
  }
  return out;
}

const largestIn = (numbers: ArrayLike<number>): number => {
  let largest = 0;
  for (let i = 0; i < numbers.length; ++i) largest = Math.max(largest, Math.abs(numbers[i]));
  return largest;
};

/// Zeros, for coefficients of at most `largest`.
export function emptyTexels(shape: FieldShape, vertices: number, largest: number): FieldTexels {
  const unit = 2 ** Math.ceil(Math.log2((largest || 1) / kLargestHalf));
  return { ...shape, halves: new Uint16Array(8 * texelsOf(shape) * vertices), unit };
}

/// Functions that write the coefficients of a vertex, those of red first, what it sees of the sky or of lamps, or its diffuse
/// light; they stand at `from` of `numbers`.
export function texelWriter(field: FieldTexels) {
  const { degree, halves, unit } = field;
  const [count, width] = [fieldCount(degree), 8 * texelsOf(field)];
  const places = Array.from({ length: 3 * count }, (_, s) => halfAt(degree, s % count, Math.floor(s / count)));
  return {
    series: (vertex: number, numbers: Float32Array, from: number): void => {
      for (let s = 0; s < places.length; ++s) halves[width * vertex + places[s]] = halfOf(numbers[from + s] / unit);
    },
    visibility: (vertex: number, numbers: Float32Array, from: number): void => {
      for (let i = 0; i < kVisibilityCount; ++i)
        halves[width * vertex + skyHalfAt(degree, i)] = halfOf(numbers[from + i]);
    },
    lamps: (vertex: number, numbers: Float32Array, from: number): void => {
      for (let k = 0; k < field.lamps; ++k)
        halves[width * vertex + lampHalfAt(field, k)] = halfOf(numbers[from + k]);
    },
    diffuse: (vertex: number, numbers: Float32Array, from: number): void => {
      for (let c = 0; c < 3; ++c)
        halves[width * vertex + diffuseHalfAt(field, c)] = halfOf(numbers[from + c] / unit);
    },
  };
}

/// No coefficient is larger: stored numbers lie in [-1, 1].
function largestOf({ scale, offset, rows, components }: StoredTransfer): number {
  const numbers = scale.map((s, j) => Math.abs(s) + Math.abs(offset[j]));
  if (!components) return Math.max(...numbers);
  const slots = rows.length / (components.rank + 1);
  const ofSlot = (s: number) =>
    numbers.reduce((sum, number, k) => sum + number * Math.abs(rows[(k + 1) * slots + s]), Math.abs(rows[s]));
  return Math.max(...Array.from({ length: slots }, (_, s) => ofSlot(s)));
}

const one = new Float32Array(1);
const bits = new Uint32Array(one.buffer);

/// The nearest half float (IEEE 754 binary16); the largest one for what is beyond it.
export function halfOf(value: number): number {
  if (!Number.isFinite(value)) throw new Error(`${kName}: a number of a vertex is not finite`);
  one[0] = value;
  const sign = (bits[0] >>> 16) & 0x8000;
  const size = bits[0] & 0x7fffffff;
  if (size >= 0x477ff000) return sign | 0x7bff;
  if (size < 0x38800000) return sign | Math.round(Math.abs(one[0]) * 2 ** 24); // subnormal
  return sign | ((size - 0x38000000 + 0xfff + ((size >>> 13) & 1)) >>> 13);
}

export function numberOfHalf(half: number): number {
  const [exponent, mantissa] = [(half >> 10) & 31, half & 1023];
  const size = exponent === 0 ? mantissa * 2 ** -24 : (1024 + mantissa) * 2 ** (exponent - 25);
  return half & 0x8000 ? -size : size;
}

type Vector = readonly [number, number, number];
const dot = (a: Vector, b: Vector): number => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];

/// Where r-RFs are looked up for an eye, see above. `normal` and `view` are unit, the view points to the eye.
export function reflectedView(normal: Vector, view: Vector): Vector {
  const above = dot(normal, view);
  const raised = view.map((x, a) => x - Math.min(0, above) * normal[a]);
  const size = Math.hypot(...raised);
  return normal.map((n, a) => 2 * Math.max(0, above) * n - (size > 0 ? raised[a] / size : n)) as unknown as Vector;
}

/// What mirrors the sky and lamps at a place, and these; what colours diffuse light there.
export interface Mirror {
  sky: MirroredSky | null;
  lamps: readonly FieldLamp[];
  place: Vector; // unit cube
  f0: Vector;
  roughness: number;
  color: Vector; // (1 - metallic) base colour
  lobes: Float32Array | null; // the table, where diffuse light is apart
}

/// Where the sky is apart nothing is less than this share of the series' own mean (core/lightfield/seen.h).
export const kLeastSeen = 0.25;

/// Radiance that an eye sees between three vertices: (8). `weights` are barycentric. `mirror`: where something is kept apart.
export function seenRadiance(
  field: FieldTexels,
  corners: Vector,
  weights: Vector,
  normal: Vector,
  view: Vector,
  mirror?: Mirror,
): number[] {
  const y = new Float64Array(fieldCount(field.degree));
  const r = reflectedView(normal, view);
  evaluateSh(field.degree + 1, ...r, y);
  const width = 8 * texelsOf(field);
  const at = (vertex: number, half: number) => numberOfHalf(field.halves[width * vertex + half]);
  const mixed = (half: number) => corners.reduce((sum, vertex, k) => sum + weights[k] * at(vertex, half), 0);
  const series = [0, 1, 2].map(
    (c) => field.unit * y.reduce((sum, yi, i) => sum + yi * mixed(halfAt(field.degree, i, c)), 0),
  );
  if (!mirror) return series.map((x) => Math.max(0, x));
  const { sky, lamps, place, f0, roughness, color, lobes } = mirror;
  const above = dot(normal, r);
  const raised = normal.map((n, a) => 2 * above * n - r[a]) as unknown as Vector;
  const visibility = Array.from({ length: kVisibilityCount }, (_, i) => mixed(skyHalfAt(field.degree, i)));
  const seen = Array.from({ length: field.lamps }, (_, k) => mixed(lampHalfAt(field, k)));
  const ofSky = field.sky && sky ? sky.seen(normal, raised, f0, roughness, visibility) : [0, 0, 0];
  const ofLamps = lampHighlights(lamps.slice(0, field.lamps), seen, { place, normal, view: raised, f0, roughness });
  const [a, b] = field.diffuse && lobes ? lobeAt(lobes, Math.max(0, above), roughness) : [0, 0];
  const sent = [0, 1, 2].map((c) =>
    field.diffuse ? color[c] * (1 - 0.04 * a - b) * field.unit * mixed(diffuseHalfAt(field, c)) : 0,
  );
  const mean = (c: number): number => field.unit * y[0] * mixed(halfAt(field.degree, 0, c)) + sent[c];
  const least = [0, 1, 2].map((c) => (field.sky ? kLeastSeen * Math.max(0, mean(c)) : 0));
  return series.map((x, c) => Math.max(least[c], x + sent[c] + ofSky[c] + ofLamps[c]));
}
