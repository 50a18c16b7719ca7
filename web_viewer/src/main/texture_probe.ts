// The material under a place of the model, for whoever asks about one: what shaders read for every fragment.

import { type BufferAttribute, Color, type Texture, Vector2 } from 'three';
import { transformOf, uvOf } from '../shaders/baked_material';
import type { BakedPart } from './baked_model';

type Three = readonly number[];

/// Linear base colour.
export function colourAt({ geometry, unlit, albedo }: BakedPart, corners: Three, weights: Three): number[] {
  const own = geometry.hasAttribute('_albedo') ? mixed(geometry.getAttribute('_albedo'), corners, weights) : albedo;
  if (!unlit.map) return [own[0], own[1], own[2]];
  const [r, g, b] = texelAt(unlit.map, geometry, corners, weights);
  const linear = new Color(r, g, b).convertSRGBToLinear();
  return [own[0] * linear.r, own[1] * linear.g, own[2] * linear.b];
}

/// Roughness and metalness.
export function finishAt({ geometry, finish }: BakedPart, corners: Three, weights: Three): [number, number] {
  if (!finish) return [1, 0];
  const { roughness, metallic, map } = finish;
  if (!map) return [roughness, metallic];
  const [, g, b] = texelAt(map, geometry, corners, weights);
  return [roughness * g, metallic * b];
}

export function emissionAt({ geometry, glow, emission }: BakedPart, corners: Three, weights: Three): number[] {
  if (!glow) return [...emission];
  const [r, g, b] = texelAt(glow.map, geometry, corners, weights);
  return new Color(r, g, b).convertSRGBToLinear().multiply(glow.factor).toArray();
}

const mixed = (attribute: { getComponent: BufferAttribute['getComponent']; itemSize: number }, corners: Three, weights: Three) =>
  Array.from({ length: attribute.itemSize }, (_, c) =>
    corners.reduce((sum, corner, k) => sum + weights[k] * attribute.getComponent(corner, c), 0),
  );

/// The nearest texel, 0 to 1, as stored.
function texelAt(map: Texture, geometry: BakedPart['geometry'], corners: Three, weights: Three): number[] {
  const [u, v] = mixed(geometry.getAttribute(uvOf(map)), corners, weights);
  const place = new Vector2(u, v).applyMatrix3(transformOf(map));
  const image = map.image as CanvasImageSource & { width: number; height: number };
  const texel = (x: number, size: number) => Math.min(size - 1, Math.floor((x - Math.floor(x)) * size));
  const context = new OffscreenCanvas(1, 1).getContext('2d', { willReadFrequently: true })!;
  context.drawImage(image, texel(place.x, image.width), texel(place.y, image.height), 1, 1, 0, 0, 1, 1);
  return [...context.getImageData(0, 0, 1, 1).data].map((byte) => byte / 255);
}
