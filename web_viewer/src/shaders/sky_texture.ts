// An equirectangular map as a texture: for the background, and for three's image-based light on original materials.

import {
  ClampToEdgeWrapping,
  DataTexture,
  DataUtils,
  EquirectangularReflectionMapping,
  HalfFloatType,
  LinearFilter,
  LinearSRGBColorSpace,
  RepeatWrapping,
  RGBAFormat,
} from 'three';
import type { EquirectMap } from '../light/equirect';

const kLargestHalf = 65504;
const kHalfOfOne = 0x3c00;

/// Data row 0 is the top of the map. three looks equirectangular maps up with v from the bottom, so `forReflection`
/// turns the rows round.
export function skyTexture(map: EquirectMap, forReflection: boolean): DataTexture {
  const texels = map.width * map.height;
  const least = forReflection ? 0 : -kLargestHalf; // a background is cut off at zero after interpolation
  const data = new Uint16Array(4 * texels);
  for (let row = 0; row < map.height; ++row) {
    const source = forReflection ? map.height - 1 - row : row;
    for (let column = 0; column < map.width; ++column) {
      const from = map.stride * (source * map.width + column);
      const to = 4 * (row * map.width + column);
      for (let c = 0; c < 3; ++c)
        data[to + c] = DataUtils.toHalfFloat(Math.min(Math.max(map.data[from + c], least), kLargestHalf));
      data[to + 3] = kHalfOfOne;
    }
  }
  const texture = new DataTexture(data, map.width, map.height, RGBAFormat, HalfFloatType);
  texture.colorSpace = LinearSRGBColorSpace;
  texture.magFilter = texture.minFilter = LinearFilter;
  texture.wrapS = RepeatWrapping;
  texture.wrapT = ClampToEdgeWrapping;
  if (forReflection) texture.mapping = EquirectangularReflectionMapping;
  texture.needsUpdate = true;
  return texture;
}
