// lightmap.exr: irradiance over the second texture coordinates (core/artifact/README.md specifies it), as a texture.

import { ClampToEdgeWrapping, DataTexture, HalfFloatType, LinearFilter, RGBAFormat } from 'three';
import { EXRLoader } from 'three/addons/loaders/EXRLoader.js';

/// Bilinear, top row first as glTF's v runs; the caller disposes of it. Throws on a file that is no square of RGB.
export function readLightmap(file: ArrayBuffer): DataTexture {
  const { width = 0, height = 0, data } = new EXRLoader().setDataType(HalfFloatType).parse(file);
  const rows = data as Uint16Array;
  if (width < 1 || width !== height || rows.length !== 4 * width * height)
    throw new Error('lightmap.exr: it is no square of red, green and blue');
  const row = 4 * width;
  const pixels = new Uint16Array(rows.length); // EXRLoader gives the bottom row first
  for (let y = 0; y < height; ++y) pixels.set(rows.subarray((height - 1 - y) * row, (height - y) * row), y * row);
  const texture = new DataTexture(pixels, width, height, RGBAFormat, HalfFloatType);
  texture.minFilter = texture.magFilter = LinearFilter;
  texture.wrapS = texture.wrapT = ClampToEdgeWrapping;
  texture.needsUpdate = true;
  return texture;
}

/// Which primitives of the baked scene a glTF's KILN_lightmap says are lit by it.
export function lightmapPrimitives(json: unknown): readonly number[] {
  const { extensions } = json as { extensions?: { KILN_lightmap?: { primitives?: number[] } } };
  return extensions?.KILN_lightmap?.primitives ?? [];
}
