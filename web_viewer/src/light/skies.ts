// Built-in lights from formulas, each a function on the sphere plus directional suns, projected here to SH.
// "overcast" and "clear" are those of core/scene/skies.cpp (CIE S 011 distributions, zenith luminance 1).

import { functionToEquirect, type EquirectMap } from './equirect';
import { evaluateSh, projectFunction, shCount } from './sh';

type Rgb = readonly [number, number, number];

/// A light too small to resolve: what it sends on a plane that faces it.
export interface Sun {
  direction: Rgb;
  irradiance: Rgb;
}

export interface Sky {
  id: string;
  label: string;
  radiance(x: number, y: number, z: number, rgb: Float64Array): void;
  suns: readonly Sun[];
}

const kGroundReflectance = 0.2;
const kSunIrradiance: Rgb = [33, 29.7, 24.3]; // 30 W m^-2 facing, tinted
const kSkyTint: Rgb = [0.8, 0.99, 1.69];
const kSunDirection: Rgb = [0.5, Math.SQRT1_2, 0.5]; // 45 degrees up, between +X and +Z

const scaled = (rgb: Float64Array, tint: Rgb, by: number): void => {
  for (let c = 0; c < 3; ++c) rgb[c] = tint[c] * by;
};

const added = (rgb: Float64Array, tint: Rgb, by: number): void => {
  for (let c = 0; c < 3; ++c) rgb[c] += tint[c] * by;
};

/// A soft lamp: peak radiance in the middle, falling off as a von Mises-Fisher lobe; `sharpness` 20 is about 25 degrees wide.
const lobe = (x: number, y: number, z: number, [dx, dy, dz]: Rgb, sharpness: number): number =>
  Math.exp(sharpness * ((x * dx + y * dy + z * dz) / Math.sqrt(dx * dx + dy * dy + dz * dz) - 1));

const indicatrix = (angle: number): number => 0.91 + 10 * Math.exp(-3 * angle) + 0.45 * Math.cos(angle) ** 2;
const gradation = (sine: number): number => 1 - Math.exp(-0.32 / Math.max(sine, 1e-6));
const kClearZenith = indicatrix(Math.PI / 4) * gradation(1);

/// CIE clear sky, relative to the zenith; `sine` of the elevation, `chi` the angle from the sun.
const clearSky = (sine: number, chi: number): number => (indicatrix(chi) * gradation(sine)) / kClearZenith;

export const kSkies: readonly Sky[] = [
  {
    id: 'constant',
    label: 'Constant white',
    radiance: (_x, _y, _z, rgb) => rgb.fill(1),
    suns: [],
  },
  {
    id: 'overcast',
    label: 'Overcast sky',
    radiance: (_x, y, _z, rgb) => rgb.fill(y >= 0 ? (1 + 2 * y) / 3 : kGroundReflectance / 3),
    suns: [],
  },
  {
    id: 'clear',
    label: 'Clear sky with sun',
    radiance: (x, y, z, rgb) => {
      const sine = Math.max(y, 0);
      const [sx, sy, sz] = kSunDirection;
      const cosine = (x * sx + sine * sy + z * sz) / Math.sqrt(x * x + sine * sine + z * z);
      const chi = Math.acos(Math.min(1, Math.max(-1, cosine)));
      scaled(rgb, kSkyTint, (y >= 0 ? 1 : kGroundReflectance) * clearSky(sine, chi));
    },
    suns: [{ direction: kSunDirection, irradiance: kSunIrradiance }],
  },
  {
    id: 'sunset',
    label: 'Sunset',
    radiance: (x, y, z, rgb) => {
      const height = Math.max(y, 0);
      scaled(rgb, [0.16, 0.24, 0.5], y >= 0 ? 0.6 : 0.15);
      added(
        rgb,
        [1.6, 0.62, 0.28],
        (y >= 0 ? 1 : 0.25) * Math.exp(-5 * height) * (0.35 + 0.65 * lobe(x, 0, z, [-1, 0, 0.3], 1.5)),
      );
    },
    suns: [{ direction: [-0.94, 0.2, 0.28], irradiance: [7, 3.1, 1.2] }],
  },
  {
    id: 'studio',
    label: 'Studio, three soft lamps',
    radiance: (x, y, z, rgb) => {
      scaled(rgb, [1, 1, 1], 0.12);
      added(rgb, [1, 0.94, 0.86], 9 * lobe(x, y, z, [0.6, 0.6, 0.55], 14));
      added(rgb, [0.82, 0.9, 1], 3 * lobe(x, y, z, [-0.8, 0.25, 0.5], 8));
      added(rgb, [1, 1, 1], 5 * lobe(x, y, z, [-0.1, 0.5, -0.9], 18));
    },
    suns: [],
  },
  {
    id: 'lamp',
    label: 'One hard lamp',
    radiance: (_x, _y, _z, rgb) => rgb.fill(0.02),
    suns: [{ direction: [0.4, 0.75, 0.53], irradiance: [6, 6, 6] }],
  },
];

/// The sky as the eye would see it, each sun as a small glow of its own irradiance.
export function skyPicture(sky: Sky, width: number): EquirectMap {
  const sharpness = 900; // a glow of about 4 degrees, a few texels wide
  return functionToEquirect((x, y, z, rgb) => {
    sky.radiance(x, y, z, rgb);
    for (const { direction, irradiance } of sky.suns)
      added(rgb, irradiance, (sharpness / (2 * Math.PI)) * lobe(x, y, z, direction, sharpness));
  }, width);
}

/// SH coefficients of a sky, flat RGB. A sun counts as a point of its irradiance.
export function projectSky(sky: Sky, order: number): Float32Array {
  const light = projectFunction(order, sky.radiance);
  const suns = projectSuns(sky, order);
  for (let i = 0; i < suns.length; ++i) light[i] += suns[i];
  return light;
}

/// Of the suns alone, the bright part of the sky; empty without any.
export function projectSuns(sky: Sky, order: number): Float32Array {
  const light = new Float32Array(sky.suns.length > 0 ? 3 * shCount(order) : 0);
  const basis = new Float64Array(shCount(order));
  for (const { direction, irradiance } of sky.suns) {
    const length = Math.hypot(...direction);
    evaluateSh(order, direction[0] / length, direction[1] / length, direction[2] / length, basis);
    for (let i = 0; i < light.length; ++i) light[i] += basis[Math.floor(i / 3)] * irradiance[i % 3];
  }
  return light;
}
