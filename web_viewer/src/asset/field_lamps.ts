// Punctual lamps of a light field that keeps them apart: what surfaces mirror of them for an eye. The same as
// core/lightfield/lamp_highlights.h; core/artifact/README.md specifies the members.

import { kLeastAlpha } from './mirrored_sky';

type Vector = readonly [number, number, number];

/// One of `lights` of `lamps`, as written: lengths and places of the unit cube.
export interface FieldLamp {
  type: 'directional' | 'point' | 'spot';
  intensity: Vector;
  direction?: Vector; // the way the light goes, unit; none: a point
  position?: Vector; // none: directional
  range?: number; // 0: without end
  innerConeAngle?: number; // of a spot
  outerConeAngle?: number;
}

/// `lamps` of KILN_light_field, as written.
export interface LampExtension {
  form: string;
  attributes: string[];
  scale: number[];
  offset: number[];
  lights: FieldLamp[];
}

export const kMostLamps = 8;

/// Throws with a JSON pointer on what is not as specified.
export function checkLamps(lamps: LampExtension, place: string): void {
  const must = (good: boolean, member: string, what: string) => {
    if (!good) throw new Error(`${place}/${member}: ${what}`);
  };
  const count = lamps.lights?.length;
  must(count >= 1 && count <= kMostLamps, 'lights', `must be 1 to ${kMostLamps}`);
  must(lamps.form === 'raw', 'form', 'must be raw');
  const names = Array.from({ length: Math.ceil(count / 4) }, (_, k) => `_SLF_LAMP_${k}`);
  must(`${lamps.attributes}` === `${names}`, 'attributes', `must be _SLF_LAMP_0 and on, ${names.length} of them`);
  for (const list of ['scale', 'offset'] as const)
    must(lamps[list]?.length === count && lamps[list].every(Number.isFinite), list, `must be ${count} numbers`);
  lamps.lights.forEach((lamp, k) => checkLamp(lamp, (member, good, what) => must(good, `lights/${k}/${member}`, what)));
}

function checkLamp(lamp: FieldLamp, must: (member: string, good: boolean, what: string) => void): void {
  const { type, intensity, direction, position, range, innerConeAngle: inner, outerConeAngle: outer } = lamp;
  const vector = (x: Vector | undefined) => Array.isArray(x) && x.length === 3 && x.every(Number.isFinite);
  must('type', ['directional', 'point', 'spot'].includes(type), 'must be directional, point or spot');
  must('intensity', vector(intensity) && intensity.every((x) => x >= 0), 'must be three numbers from 0');
  if (type !== 'point') {
    const unit = vector(direction) && Math.abs(Math.hypot(...direction!) - 1) < 1e-3;
    must('direction', unit, 'must have length 1');
  }
  if (type !== 'directional') {
    must('position', vector(position), 'must be three numbers');
    must('range', Number.isFinite(range) && range! >= 0, 'must be a number from 0');
  }
  if (type === 'spot') {
    must('outerConeAngle', outer! >= 0 && outer! <= Math.PI / 2 + 1e-6, 'must be 0 to pi / 2');
    must('innerConeAngle', inner! >= 0 && inner! <= outer!, 'must be 0 to the outer one');
  }
}

/// What a lamp is to a shader: `at` is a place or the direction to the lamp (then `distant`). Light within the angle
/// whose cosine is `inner` is whole, and none is beyond that of `outer`.
export interface LampForm {
  at: Vector;
  distant: boolean;
  axis: Vector;
  intensity: Vector;
  range: number;
  outer: number;
  ramp: number; // cosines from outer to inner, at least 1e-9
}

/// Without a cone: outer is -2, which no cosine is below, and the ramp is over at once.
export function formOf(lamp: FieldLamp): LampForm {
  const axis = lamp.direction ?? [0, 0, -1];
  const distant = lamp.type === 'directional';
  const spot = lamp.type === 'spot';
  const outer = spot ? Math.cos(lamp.outerConeAngle!) : -2;
  return {
    at: distant ? [-axis[0], -axis[1], -axis[2]] : lamp.position!,
    distant,
    axis,
    intensity: lamp.intensity,
    range: distant ? 0 : lamp.range!,
    outer,
    ramp: spot ? Math.max(Math.cos(lamp.innerConeAngle!) - outer, 1e-9) : 1e-9,
  };
}

const dot = (a: Vector, b: Vector): number => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];

/// The way to a lamp, and its irradiance of a plane that faces it.
function arrival(lamp: LampForm, place: Vector): { way: Vector; irradiance: number[] } {
  if (lamp.distant) return { way: lamp.at, irradiance: [...lamp.intensity] };
  const to = lamp.at.map((x, c) => x - place[c]) as unknown as Vector;
  const squared = dot(to, to);
  if (squared === 0) return { way: [0, 1, 0], irradiance: [0, 0, 0] };
  const way = to.map((x) => x / Math.sqrt(squared)) as unknown as Vector;
  const cosine = -dot(way, lamp.axis);
  const ramp = cosine <= lamp.outer ? 0 : Math.min(1, (cosine - lamp.outer) / lamp.ramp);
  const ratio = lamp.range > 0 ? squared / lamp.range ** 2 : 0;
  const share = (ramp * ramp * Math.min(1, Math.max(0, 1 - ratio * ratio))) / squared;
  return { way, irradiance: lamp.intensity.map((x) => x * share) };
}

export interface LampEye {
  place: Vector; // unit cube
  normal: Vector;
  view: Vector; // unit, to the eye; not below the horizon
  f0: Vector;
  roughness: number;
}

/// Radiance that the lamps add. `seen`: the share of each that the place sees.
export function lampHighlights(lamps: readonly FieldLamp[], seen: readonly number[], eye: LampEye): number[] {
  const { normal, view, f0, roughness } = eye;
  const above = dot(normal, view);
  const z = Math.min(1, Math.max(1e-3, above));
  const alpha = Math.min(1, Math.max(kLeastAlpha, roughness * roughness));
  const along = view.map((v, c) => v - normal[c] * above);
  const size = Math.hypot(...along);
  const sine = Math.sqrt(1 - z * z);
  const v = normal.map((n, c) => n * z + (size > 0 ? (along[c] / size) * sine : 0)) as unknown as Vector;
  const masked = (cosine: number) =>
    (Math.sqrt(1 + (alpha * alpha * Math.max(0, 1 - cosine * cosine)) / (cosine * cosine)) - 1) / 2;
  const sum = [0, 0, 0];
  lamps.forEach((lamp, k) => {
    const { way, irradiance } = arrival(formOf(lamp), eye.place);
    const l = dot(way, normal);
    if (!(seen[k] > 0) || !(l > 0)) return;
    const between = way.map((x, c) => x + v[c]);
    const half = between.map((x) => x / Math.hypot(...between)) as unknown as Vector;
    const d = dot(half, normal) ** 2 * (alpha * alpha - 1) + 1;
    const lobe = (alpha * alpha) / (Math.PI * d * d) / (1 + masked(z) + masked(l)) / (4 * z);
    const schlick = Math.min(1, Math.max(0, 1 - dot(v, half))) ** 5;
    for (let c = 0; c < 3; ++c) sum[c] += (f0[c] + (1 - f0[c]) * schlick) * irradiance[c] * lobe * seen[k];
  });
  return sum;
}
