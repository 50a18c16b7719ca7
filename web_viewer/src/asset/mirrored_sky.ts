// The sky of a light field that keeps it apart: blurred maps, and what surfaces mirror of them for an eye. The same as
// core/lightfield/mirrored_sky.h, to a half float's rounding; core/artifact/README.md specifies the bytes.

import { evaluateSh } from '../light/sh';
import { kLobeRows, kLobeViews } from '../shaders/mirror';

/// `sky` of KILN_light_field, as written.
export interface SkyExtension {
  form: string;
  attributes: string[];
  scale: number[];
  offset: number[];
  levels: { heights: number[]; unit: number; bufferView: number };
  lobes: LobesExtension;
}

/// How surfaces of each roughness mirror and keep light: 16 rows of 32 views, three numbers each.
export interface LobesExtension {
  rows: number;
  views: number;
  bufferView: number;
}

/// What the worker hands out of it.
export interface SkyData {
  heights: number[]; // of the maps of alpha 1, 2^-1/2, 1/2 and on; twice as wide
  unit: number;
  texels: Uint32Array<ArrayBuffer>; // shared exponents, map by map
  lobes: Float32Array<ArrayBuffer>;
}

export const kVisibilityOrder = 3;
export const kVisibilityCount = kVisibilityOrder ** 2;
export const kFacets = 8;
export const kNarrowest = 0.15;
export const kLeastAlpha = 1e-3;
const [kMostLevels, kMostHeight] = [32, 1024];

/// Throws with a JSON pointer on what is not as specified.
export function checkSky(sky: SkyExtension, place: string): void {
  const must = (good: boolean, member: string, what: string) => {
    if (!good) throw new Error(`${place}/${member}: ${what}`);
  };
  must(sky.form === 'raw', 'form', 'must be raw');
  const names = Array.from({ length: Math.ceil(kVisibilityCount / 4) }, (_, k) => `_SLF_SKY_${k}`);
  must(`${sky.attributes}` === `${names}`, 'attributes', `must be _SLF_SKY_0 and on, ${names.length} of them`);
  for (const list of ['scale', 'offset'] as const)
    must(sky[list]?.length === kVisibilityCount && sky[list].every(Number.isFinite), list, `must be ${kVisibilityCount} numbers`);
  const { heights, unit } = sky.levels ?? {};
  const fits = (height: number) => Number.isInteger(height) && height >= 2 && height <= kMostHeight;
  must(heights?.length >= 2 && heights.length <= kMostLevels && heights.every(fits), 'levels/heights', 'must be 2 to 32');
  must(unit > 0 && Number.isFinite(unit), 'levels/unit', 'must be above zero');
  checkLobes(sky.lobes, place);
}

export function checkLobes(lobes: LobesExtension | undefined, place: string): void {
  if (lobes?.rows !== kLobeRows || lobes.views !== kLobeViews)
    throw new Error(`${place}/lobes: must have 16 rows of 32 views`);
}

export function readLobes(lobes: LobesExtension, bytesIn: (view: number) => Uint8Array<ArrayBuffer>): Float32Array<ArrayBuffer> {
  const bytes = bytesIn(lobes.bufferView).slice();
  const count = 3 * kLobeRows * kLobeViews;
  if (bytes.byteLength !== 4 * count) throw new Error(`the lobes of the light field need ${4 * count} bytes`);
  return new Float32Array(bytes.buffer);
}

/// `bytesIn`: of a buffer view. Throws where its length is another.
export function readSky(sky: SkyExtension, bytesIn: (view: number) => Uint8Array<ArrayBuffer>): SkyData {
  const { heights, unit, bufferView } = sky.levels;
  const whole = (view: number, count: number): ArrayBuffer => {
    const bytes = bytesIn(view).slice();
    if (bytes.byteLength !== 4 * count) throw new Error(`the sky of the light field needs ${4 * count} bytes`);
    return bytes.buffer;
  };
  const texels = heights.reduce((sum, height) => sum + 2 * height * height, 0);
  const lobes = readLobes(sky.lobes, bytesIn);
  return { heights, unit, texels: new Uint32Array(whole(bufferView, texels)), lobes };
}

/// Red, green and blue of a texel, without `unit`.
export function colourOf(texel: number): [number, number, number] {
  const scale = 2 ** ((texel >>> 27) - 24);
  return [(texel & 511) * scale, ((texel >>> 9) & 511) * scale, ((texel >>> 18) & 511) * scale];
}

type Vector = readonly [number, number, number];
const dot = (a: Vector, b: Vector): number => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const clamp = (x: number, low: number, high: number): number => Math.min(high, Math.max(low, x));

export class MirroredSky {
  private readonly levels: { width: number; height: number; rgb: Float32Array }[] = [];

  constructor(private readonly data: SkyData) {
    let at = 0;
    for (const height of data.heights) {
      const rgb = new Float32Array(6 * height * height);
      for (let i = 0; i < rgb.length; i += 3, ++at) rgb.set(colourOf(data.texels[at]).map((x) => x * data.unit), i);
      this.levels.push({ width: 2 * height, height, rgb });
    }
  }

  /// All maps at the resolution of the finest, RGBA without `unit`.
  stack(): { width: number; height: number; depth: number; rgba: Float32Array } {
    const height = Math.max(...this.data.heights);
    const [width, depth] = [2 * height, this.levels.length];
    const rgba = new Float32Array(4 * width * height * depth).fill(1);
    for (let level = 0, to = 0; level < depth; ++level)
      for (let y = 0; y < height; ++y)
        for (let x = 0; x < width; ++x, to += 4) {
          const rgb = this.texelAt(level, (x + 0.5) / width, (y + 0.5) / height);
          for (let c = 0; c < 3; ++c) rgba[to + c] = rgb[c] / this.data.unit;
        }
    return { width, height, depth, rgba };
  }

  /// Radiance towards an eye that is not below the horizon. `visibility`: kVisibilityCount harmonics.
  seen(normal: Vector, view: Vector, f0: Vector, roughness: number, visibility: ArrayLike<number>): number[] {
    const above = dot(normal, view);
    const z = clamp(above, 1e-3, 1);
    const alpha = clamp(roughness * roughness, kLeastAlpha, 1);
    const along = view.map((v, c) => v - normal[c] * above);
    const size = Math.hypot(...along);
    const axis = (size > 0 ? along.map((a) => a / size) : [0, 0, 0]) as unknown as Vector;
    const sine = Math.sqrt(1 - z * z);
    const most = Math.hypot(z, sine * alpha);
    const lean = Math.atan2(sine * alpha, z);
    const slopeAt = (u: number) => Math.tan(lean + Math.asin(clamp((-most + (z + most) * u) / most, -1, 1)));
    const middle = slopeAt(0.5);
    const sum = [0, 0, 0];
    let all = 0;
    for (let k = 0; k < kFacets; ++k) {
      const slope = middle + (1 - z) * (slopeAt((k + 0.5) / kFacets) - middle);
      const up = 1 / Math.hypot(1, alpha * slope);
      const facing = (sine * alpha * slope + z) * up;
      const [lx, lz] = [2 * facing * alpha * slope * up - sine, 2 * facing * up - z];
      if (!(facing > 0) || !(lz > 0)) continue;
      const masking = (Math.sqrt(1 + (alpha * alpha * Math.max(0, 1 - lz * lz)) / (lz * lz)) + 1) / 2;
      const w = [0, 1, 2].map((c) => axis[c] * lx + normal[c] * lz) as unknown as Vector;
      const width = alpha * Math.max(kNarrowest, facing) * Math.hypot(1, slope);
      const light = this.blurred(w, Math.min(1, width));
      const weight = visibleShare(visibility, w) / masking;
      for (let c = 0; c < 3; ++c) sum[c] += light[c] * weight;
      all += 1 / masking;
    }
    const [a, b] = lobeAt(this.data.lobes, z, roughness);
    return sum.map((s, c) => (all > 0 ? ((f0[c] * a + b) * s) / all : 0));
  }

  private blurred(w: Vector, alpha: number): number[] {
    const level = clamp(-2 * Math.log2(alpha), 0, this.levels.length - 1);
    const low = Math.min(Math.floor(level), this.levels.length - 2);
    const u = 0.5 + Math.atan2(w[2], w[0]) / (2 * Math.PI);
    const v = Math.acos(clamp(w[1], -1, 1)) / Math.PI;
    const [fine, coarse] = [this.texelAt(low + 1, u, v), this.texelAt(low, u, v)];
    return fine.map((x, c) => coarse[c] + (x - coarse[c]) * (level - low));
  }

  /// Bilinear; u wraps.
  private texelAt(level: number, u: number, v: number): number[] {
    const { width, height, rgb } = this.levels[level];
    const [x, y] = [u * width - 0.5, v * height - 0.5];
    const [x0, y0] = [Math.floor(x), Math.floor(y)];
    const sum = [0, 0, 0];
    for (let k = 0; k < 4; ++k) {
      const [dx, dy] = [k & 1, k >> 1];
      const weight = (dx ? x - x0 : 1 - x + x0) * (dy ? y - y0 : 1 - y + y0);
      const at = 3 * (clamp(y0 + dy, 0, height - 1) * width + ((x0 + dx + width) % width));
      for (let c = 0; c < 3; ++c) sum[c] += weight * rgb[at + c];
    }
    return sum;
  }
}

/// a and b: of the lobe's albedo F0 a + b for an eye whose cosine is z.
export function lobeAt(lobes: Float32Array, z: number, roughness: number): [number, number] {
  const [row, view] = [clamp(roughness, 0, 1) * (kLobeRows - 1), (Math.acos(clamp(z, 0, 1)) / (Math.PI / 2)) * (kLobeViews - 1)];
  const [r, v] = [Math.min(Math.floor(row), kLobeRows - 2), Math.min(Math.floor(view), kLobeViews - 2)];
  const mix = (k: number) => {
    const entry = (i: number, j: number) => lobes[3 * ((r + i) * kLobeViews + v + j) + k];
    const between = (i: number) => entry(i, 0) + (entry(i, 1) - entry(i, 0)) * (view - v);
    return between(0) + (between(1) - between(0)) * (row - r);
  };
  return [mix(0), mix(1)];
}

/// How much of the sky is seen along w.
export function visibleShare(visibility: ArrayLike<number>, w: Vector): number {
  const y = new Float64Array(kVisibilityCount);
  evaluateSh(kVisibilityOrder, ...w, y);
  return clamp(y.reduce((sum, yi, i) => sum + yi * visibility[i], 0), 0, 1);
}
