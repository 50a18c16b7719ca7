// Colour scales that stay readable for colour-blind eyes: viridis for sizes, blue-white-red for signed numbers.

import { ClampToEdgeWrapping, DataTexture, LinearFilter, RGBAFormat, SRGBColorSpace } from 'three';

export type ColourMapName = 'viridis' | 'diverging';

const kStops: Record<ColourMapName, readonly string[]> = {
  viridis: [
    '#440154',
    '#482878',
    '#3e4989',
    '#31688e',
    '#26828e',
    '#1f9e89',
    '#35b779',
    '#6ece58',
    '#b5de2b',
    '#fde725',
  ],
  diverging: ['#053061', '#2166ac', '#67a9cf', '#d1e5f0', '#f7f7f7', '#fddbc7', '#ef8a62', '#b2182b', '#67001f'],
};

const channels = (hex: string): number[] => [1, 3, 5].map((at) => parseInt(hex.slice(at, at + 2), 16));

/// sRGB bytes at `t` from 0 to 1, linear between the stops.
export function colourAt(map: ColourMapName, t: number): number[] {
  const stops = kStops[map];
  const at = Math.min(1, Math.max(0, t)) * (stops.length - 1);
  const first = Math.min(Math.floor(at), stops.length - 2);
  const [from, to] = [channels(stops[first]), channels(stops[first + 1])];
  return from.map((value, c) => Math.round(value + (to[c] - value) * (at - first)));
}

/// The scale as a texture of 256 texels, for the shader.
export function colourMapTexture(map: ColourMapName): DataTexture {
  const data = new Uint8Array(4 * 256);
  for (let i = 0; i < 256; ++i) data.set([...colourAt(map, i / 255), 255], 4 * i);
  const texture = new DataTexture(data, 256, 1, RGBAFormat);
  texture.colorSpace = SRGBColorSpace;
  texture.magFilter = texture.minFilter = LinearFilter;
  texture.wrapS = ClampToEdgeWrapping;
  texture.needsUpdate = true;
  return texture;
}

/// Paints the same scale for the legend, left to right.
export function paintScale(canvas: HTMLCanvasElement, map: ColourMapName): void {
  const context = canvas.getContext('2d');
  if (!context) return;
  for (let x = 0; x < canvas.width; ++x) {
    context.fillStyle = `rgb(${colourAt(map, x / (canvas.width - 1)).join(',')})`;
    context.fillRect(x, 0, 1, canvas.height);
  }
}
