// Everything a viewer page shows, as plain data, and the same as the part of its address after '#'.
// Defaults are left out, so that a fresh page has a clean address.

import type { CameraPose } from './stage';

export type ToneMap = 'baked' | 'neutral' | 'aces' | 'none';
export const kModes = [
  'shaded',
  'light',
  'measure',
  'weighted',
  'coefficient',
  'grid',
  'vertices', // a light field evaluated at the vertices
  'vertexError', // how far that is from evaluating it at each pixel
  'levelError', // how far a level of detail is from the finest
] as const;
export type Mode = (typeof kModes)[number];
export type Background = 'off' | 'sky' | 'harmonics';

export interface ViewState {
  light: string; // 'baked', the id of a sky, or 'file' for a dropped map
  rotation: number; // degrees about +Y
  intensity: number;
  lamps: boolean;
  ev: number;
  tone: ToneMap;
  background: Background;
  wire: boolean;
  mode: Mode;
  channel: number;
  slot: number;
  level: number; // of detail; 0: the finest
  levelBySize: boolean; // see level_by_size.ts
  detail: number; // share of a progressive mesh, see progressive_view.ts; 1: the file's own triangles
  ball: boolean; // of a grid: see grid_view.ts
  ballAt: readonly [number, number, number] | null; // from the middle of the grid, in its half extents
  cells: boolean;
  arrows: boolean;
  lamp: boolean; // that moves: see lamp_view.ts
  lampAt: readonly [number, number, number] | null; // from the middle of the model, in its half extents
  lampPower: number; // stops
  lampBaked: boolean; // the light of the bake is added
  lampIndirect: boolean; // reflected light alone
  lightmap: boolean; // shown in place of the light at the vertices, where there is one
  points: boolean; // light from the points, splatted: see points_view.ts
  pointLevels: number; // of them that are added up
  dots: boolean; // points whose coefficients matter
  compare: number | null; // where the divider stands, 0 to 1; null: off
  pose: CameraPose | null; // null: the default view
}

export const kDefaultState: ViewState = {
  light: 'baked',
  rotation: 0,
  intensity: 1,
  lamps: true,
  ev: 0,
  tone: 'baked',
  background: 'sky',
  wire: false,
  mode: 'shaded',
  channel: 0,
  slot: 0,
  level: 0,
  levelBySize: false,
  detail: 1,
  ball: true,
  ballAt: null,
  cells: false,
  arrows: false,
  lamp: true,
  lampAt: null,
  lampPower: 0,
  lampBaked: false,
  lampIndirect: false,
  lightmap: true,
  points: false,
  pointLevels: 17,
  dots: false,
  compare: null,
  pose: null,
};

const short = (value: number): string => String(Number(value.toFixed(3)));

export function encodeState(state: ViewState): string {
  const out = new URLSearchParams();
  for (const key of Object.keys(kDefaultState) as (keyof ViewState)[]) {
    const value = state[key];
    if (value === kDefaultState[key] || value === null) continue;
    if (key === 'light' && value === 'file') continue; // a dropped file cannot travel in an address
    out.set(
      key,
      Array.isArray(value) ? value.map(short).join(',') : typeof value === 'number' ? short(value) : String(value),
    );
  }
  return out.toString().replaceAll('%2C', ',');
}

const inside = (at: number[]): boolean => at.length === 3 && at.every((x) => Math.abs(x) <= 1);
const placeIn = (text: string | null): readonly [number, number, number] | null => {
  const at = (text ?? '').split(',').map(Number);
  return inside(at) ? (at as unknown as readonly [number, number, number]) : null;
};

/// Reads what encodeState wrote. Whatever it does not understand keeps its default: an address is anyone's text.
export function decodeState(text: string, lights: readonly string[]): ViewState {
  const from = new URLSearchParams(text);
  const number = (key: keyof ViewState, low: number, high: number): number => {
    const value = Number(from.get(key) ?? NaN);
    return Number.isFinite(value) ? Math.min(high, Math.max(low, value)) : (kDefaultState[key] as number);
  };
  const one = <T extends string>(key: keyof ViewState, allowed: readonly T[]): T =>
    allowed.includes(from.get(key) as T) ? (from.get(key) as T) : (kDefaultState[key] as T);
  const flag = (key: keyof ViewState): boolean =>
    from.has(key) ? from.get(key) === 'true' : (kDefaultState[key] as boolean);
  const pose = (from.get('pose') ?? '').split(',').map(Number);
  return {
    light: one('light', lights),
    rotation: number('rotation', -180, 180),
    intensity: number('intensity', 0, 100),
    lamps: flag('lamps'),
    ev: number('ev', -8, 8),
    tone: one<ToneMap>('tone', ['baked', 'neutral', 'aces', 'none']),
    background: one<Background>('background', ['off', 'sky', 'harmonics']),
    wire: flag('wire'),
    mode: one<Mode>('mode', kModes),
    channel: Math.round(number('channel', 0, 2)),
    slot: Math.round(number('slot', 0, 100)),
    level: Math.round(number('level', 0, 99)),
    levelBySize: flag('levelBySize'),
    detail: number('detail', 0, 1),
    ball: flag('ball'),
    ballAt: placeIn(from.get('ballAt')),
    cells: flag('cells'),
    arrows: flag('arrows'),
    lamp: flag('lamp'),
    lampAt: placeIn(from.get('lampAt')),
    lampPower: number('lampPower', -6, 6),
    lampBaked: flag('lampBaked'),
    lampIndirect: flag('lampIndirect'),
    lightmap: flag('lightmap'),
    points: flag('points'),
    pointLevels: Math.round(number('pointLevels', 1, 17)),
    dots: flag('dots'),
    compare: from.has('compare') ? number('compare', 0, 1) : null,
    pose: pose.length === 6 && pose.every(Number.isFinite) ? (pose as unknown as CameraPose) : null,
  };
}
