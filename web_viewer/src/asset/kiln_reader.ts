// A reader of KILN_radiance_transfer for any three.js application. It stands alone: copy this one file.
//
//   import { GLTFLoader } from 'three/addons/loaders/GLTFLoader.js';
//   import { DRACOLoader } from 'three/addons/loaders/DRACOLoader.js';
//   import { readRadianceTransfer, lightValues } from './kiln_reader';
//
//   const gltf = await new GLTFLoader().setDRACOLoader(new DRACOLoader()).loadAsync('scene.glb');
//   const baked = readRadianceTransfer(gltf);                    // undefined: not one of ours
//   const light = new Float32Array(3 * baked.order ** 2);        // SH radiance, light[3 * i + channel]; here:
//   light.set([0, 1, 2].map(() => Math.sqrt(4 * Math.PI)));      // a constant sky of radiance 1
//   for (const part of baked.parts) {
//     const values = lightValues(baked, part.geometry, light);   // RGB of a white surface, one per vertex
//     part.geometry.setAttribute('color', new BufferAttribute(values, 3));
//     part.mesh.material = new MeshBasicMaterial({ vertexColors: true, map: part.mesh.material.map });
//     part.mesh.material.color.setRGB(...part.albedo);
//   }
//
// What leaves the surface is  albedo * value + emission.  Basis: real spherical harmonics without the Condon-Shortley phase in
// world axes (+Y up), index i = l(l+1)+m: three's own LightProbe convention. core/artifact/README.md specifies the format.

import type { BufferAttribute, BufferGeometry, Mesh, Object3D } from 'three';

/// The root extension, as written.
export interface RadianceTransferExtension {
  version: number;
  order: number;
  channels: 1 | 3;
  fixed: boolean;
  slots: number;
  attributes: string[];
  scale: number[];
  offset: number[];
  light?: { name?: string; coefficients?: number[][] };
  look?: { exposure?: number; toneMap?: string };
  units?: string;
}

export interface TransferPart {
  mesh: Mesh;
  geometry: BufferGeometry;
  albedo: [number, number, number]; // base colour factor; the map multiplies it; `_albedo`, if there, replaces it per vertex
  emission: [number, number, number]; // where it has no texture; a textured one is the original material's
  material: number; // index of the original material, -1 if none
}

export interface RadianceTransfer extends RadianceTransferExtension {
  parts: TransferPart[];
  bakedLight: Float32Array; // light[3 * i + channel]; empty when the bake had no environment
}

/// The part of GLTFLoader's result that is read here.
export interface LoadedGltf {
  scene: Object3D;
  parser: { json: unknown };
}

const kName = 'KILN_radiance_transfer';
/// The root extension of a glTF; undefined: not one of ours. Throws on a version or shape it does not know.
export function readExtension(json: unknown): RadianceTransferExtension | undefined {
  const extension = (json as { extensions?: Record<string, unknown> }).extensions?.[kName] as RadianceTransferExtension | undefined;
  if (extension) checkShape(extension);
  return extension;
}

/// Reads the extension and finds its primitives in the default scene. Throws on a version or shape it does not know.
export function readRadianceTransfer(gltf: LoadedGltf): RadianceTransfer | undefined {
  const extension = readExtension(gltf.parser.json);
  if (!extension) return undefined;
  const parts: TransferPart[] = [];
  gltf.scene.traverse((object) => {
    const mesh = object as Mesh;
    // Not by parser.associations: of a file with two scenes they hold the one that happened to load last.
    const own = (mesh.userData.gltfExtensions as Record<string, Partial<TransferPart>> | undefined)?.[kName];
    if (!mesh.isMesh || !own) return;
    parts.push({
      mesh,
      geometry: mesh.geometry,
      albedo: own.albedo ?? [1, 1, 1],
      emission: own.emission ?? [0, 0, 0],
      material: own.material ?? -1,
    });
  });
  return { ...extension, parts, bakedLight: Float32Array.from((extension.light?.coefficients ?? []).flat()) };
}

function checkShape(e: RadianceTransferExtension): void {
  const slots = e.order * e.order + (e.fixed ? 1 : 0);
  const flat = e.channels * slots;
  const good =
    Number.isInteger(e.order) &&
    e.order >= 1 &&
    (e.channels === 1 || e.channels === 3) &&
    e.slots === slots &&
    e.scale?.length >= flat &&
    e.offset?.length >= flat &&
    e.attributes?.length === Math.ceil(flat / 4);
  if (e.version !== 1) throw new Error(`${kName} version ${e.version} is newer than this reader`);
  if (!good) throw new Error(`${kName} does not describe its own attributes`);
}

/// The `_PRT_k` arrays of a geometry, four flat slots each. GLTFLoader lower-cases attribute names.
export function transferAttributes(e: RadianceTransferExtension, geometry: BufferGeometry): Float32Array[] {
  return e.attributes.map((name) => {
    const attribute = geometry.getAttribute(name.toLowerCase()) as BufferAttribute | undefined;
    if (!attribute || attribute.itemSize !== 4) throw new Error(`${kName}: a primitive lacks ${name}`);
    return attribute.array as Float32Array;
  });
}

/// RGB that leaves a white surface at every vertex under SH `light` (light[3 * i + channel], order^2 entries or more).
/// `lamps`: add the light of the scene's own lamps where it was baked. 50 000 vertices of order 6 in RGB take about 30 ms;
/// decode once and keep the numbers (as this viewer's worker does) if the light changes often.
export function lightValues(
  e: RadianceTransferExtension,
  geometry: BufferGeometry,
  light: ArrayLike<number>,
  lamps = true,
): Float32Array {
  const attributes = transferAttributes(e, geometry);
  const vertices = attributes[0].length / 4;
  const out = new Float32Array(3 * vertices);
  const count = e.order * e.order;
  for (let slot = 0; slot < e.channels * e.slots; ++slot) {
    const [i, channel] = [slot % e.slots, Math.floor(slot / e.slots)];
    for (const c of e.channels === 3 ? [channel] : [0, 1, 2]) {
      const weight = i < count ? light[3 * i + c] : lamps ? 1 : 0;
      const [factor, shift] = [e.scale[slot] * weight, e.offset[slot] * weight];
      const stored = attributes[slot >> 2];
      for (let v = 0; v < vertices; ++v) out[3 * v + c] += shift + factor * stored[4 * v + (slot & 3)];
    }
  }
  return out;
}
