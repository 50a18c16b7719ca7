// A dropped .hdr or .exr becomes a map. Runs in the worker; the readers are fetched only when a file is dropped.

import { FloatType } from 'three';
import type { EquirectMap } from './equirect';

export async function readEnvironment(name: string, file: ArrayBuffer): Promise<EquirectMap> {
  const bytes = new Uint8Array(file, 0, Math.min(4, file.byteLength));
  const isExr = bytes.length === 4 && bytes[0] === 0x76 && bytes[1] === 0x2f && bytes[2] === 0x31 && bytes[3] === 0x01;
  const isHdr = bytes[0] === 0x23 && bytes[1] === 0x3f;
  if (!isExr && !isHdr) throw new Error(`${name} is neither a Radiance .hdr nor an OpenEXR file`);
  const map = isExr ? await readExr(file) : await readHdr(file);
  if (map.width !== 2 * map.height && map.width * map.height !== 1) {
    throw new Error(`${name} is ${map.width} x ${map.height}: an equirectangular map is twice as wide as high`);
  }
  dropUnusable(map.data);
  return map;
}

async function readHdr(file: ArrayBuffer): Promise<EquirectMap> {
  const { HDRLoader } = await import('three/addons/loaders/HDRLoader.js');
  const { width = 0, height = 0, data } = new HDRLoader().setDataType(FloatType).parse(file);
  return { width, height, stride: 4, data: data as Float32Array };
}

/// EXRLoader gives rows bottom-up, and one number per texel for a grey file.
async function readExr(file: ArrayBuffer): Promise<EquirectMap> {
  const { EXRLoader } = await import('three/addons/loaders/EXRLoader.js');
  const { width = 0, height = 0, data } = new EXRLoader().setDataType(FloatType).parse(file);
  const from = data as Float32Array;
  const channels = from.length / (width * height);
  const out = new Float32Array(4 * width * height);
  for (let row = 0; row < height; ++row) {
    for (let column = 0; column < width; ++column) {
      const source = channels * ((height - 1 - row) * width + column);
      for (let c = 0; c < 3; ++c) out[4 * (row * width + column) + c] = from[source + (channels >= 3 ? c : 0)];
    }
  }
  return { width, height, stride: 4, data: out };
}

/// Not-a-number and infinite texels would poison every coefficient.
function dropUnusable(data: Float32Array): void {
  for (let i = 0; i < data.length; ++i) if (!Number.isFinite(data[i])) data[i] = 0;
}
