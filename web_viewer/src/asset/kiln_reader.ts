// A reader of KILN_radiance_transfer for any three.js application. It stands alone: copy this one file.
//
//   import { GLTFLoader } from 'three/addons/loaders/GLTFLoader.js';
//   import { DRACOLoader } from 'three/addons/loaders/DRACOLoader.js';
//   import { readRadianceTransfer, lightValues } from './kiln_reader';
//
//   const gltf = await new GLTFLoader().setDRACOLoader(new DRACOLoader()).loadAsync('scene.glb');
//   const baked = await readRadianceTransfer(gltf);              // undefined: not one of ours
//   const light = new Float32Array(3 * baked.order ** 2);        // SH radiance, light[3 * i + channel]; here:
//   light.set([0, 1, 2].map(() => Math.sqrt(4 * Math.PI)));      // a constant sky of radiance 1
//   for (const part of baked.parts) {
//     const values = lightValues(baked, part.geometry, light);   // RGB of a white surface, one per vertex
//     part.geometry.setAttribute('color', new BufferAttribute(values, 3));
//     part.mesh.material = new MeshBasicMaterial({ vertexColors: true, map: part.mesh.material.map });
//     part.mesh.material.color.setRGB(...part.albedo);
//   }
//
// What leaves the surface is  albedo * value + emission.  Basis: real spherical harmonics without the Condon-Shortley
// phase in world axes (+Y up), index i = l(l+1)+m: three's own LightProbe convention. core/artifact/README.md specifies
// the format. Parts with `glossy` have transfer matrices too: arrivingLight() gives the light that their lobes reflect,
// and "Specular parts" there says how.

import type { BufferAttribute, BufferGeometry, Mesh, Object3D } from 'three';

/// The root extension, as written.
export interface RadianceTransferExtension {
  version: number;
  order: number;
  channels: 1 | 3;
  fixed: boolean;
  slots: number;
  form: 'raw' | 'components';
  components?: { rank: number; bufferView: number };
  attributes: string[];
  scale: number[];
  offset: number[];
  glossy?: GlossyExtension;
  light?: { name?: string; coefficients?: number[][]; bright?: number[][] };
  look?: { exposure?: number; toneMap?: string };
  units?: string;
}

/// Transfer matrices of specular parts: what arrives at a vertex, order^2 coefficients of it.
export interface GlossyExtension {
  order: number;
  channels: 1 | 3;
  fixed: boolean;
  components: { rank: number; bufferView: number };
  attributes: string[];
  scale: number[];
  offset: number[];
  lobes: { rows: number; views: number; bufferView: number };
}

export interface TransferPart {
  mesh: Mesh;
  geometry: BufferGeometry;
  albedo: [number, number, number]; // base colour factor; the map multiplies it; `_albedo`, if there, replaces it per vertex
  emission: [number, number, number]; // where it has no texture; a textured one is the original material's
  material: number; // index of the original material, -1 if none
  glossy: boolean; // it has `_GLOSSY_k`
}

/// What the stored numbers of a vertex mean.
export interface StoredTransfer extends RadianceTransferExtension {
  rows: Float32Array; // of the components, after their mean: (rank + 1) x channels x slots; empty: raw
}

export interface RadianceTransfer extends StoredTransfer {
  parts: TransferPart[];
  bakedLight: Float32Array; // see bakedLight()
  arriving: StoredTransfer[]; // see arrivingTransfers(); none: nothing is specular
  lobes: Float32Array; // (rows x views) x (3 + 5 (order - 1)) numbers
}

/// The part of GLTFLoader's result that is read here.
export interface LoadedGltf {
  scene: Object3D;
  parser: { json: unknown; getDependency(type: 'bufferView', index: number): Promise<ArrayBuffer> };
}

const kName = 'KILN_radiance_transfer';
/// The root extension of a glTF; undefined: not one of ours. Throws on a version or shape it does not know.
export function readExtension(json: unknown): RadianceTransferExtension | undefined {
  const extension = (json as { extensions?: Record<string, unknown> }).extensions?.[kName] as RadianceTransferExtension | undefined;
  if (extension) checkShape(extension);
  return extension;
}

/// Reads the extension and finds its primitives in the default scene. Throws on a version or shape it does not know.
export async function readRadianceTransfer(gltf: LoadedGltf): Promise<RadianceTransfer | undefined> {
  const extension = readExtension(gltf.parser.json);
  if (!extension) return undefined;
  const view = (index: number) => gltf.parser.getDependency('bufferView', index);
  const { components, glossy } = extension;
  const rows = components ? componentRows(extension, await view(components.bufferView)) : new Float32Array(0);
  const arriving = glossy ? arrivingTransfers(glossy, await view(glossy.components.bufferView)) : [];
  const lobes = glossy ? lobeTable(glossy, await view(glossy.lobes.bufferView)) : new Float32Array(0);
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
      glossy: own.glossy ?? false,
    });
  });
  return { ...extension, parts, rows, arriving, lobes, bakedLight: bakedLight(extension) };
}

/// light[3 * i + channel] of the bake; empty when it had no environment.
export const bakedLight = ({ light }: Pick<RadianceTransferExtension, 'light'>): Float32Array =>
  Float32Array.from((light?.coefficients ?? []).flat());

/// Of that light the part that few bands cannot hold, in the same shape; empty: there is none.
export const brightLight = ({ light }: Pick<RadianceTransferExtension, 'light'>): Float32Array =>
  Float32Array.from((light?.bright ?? []).flat());

/// Adds up light in two parts, each at least 0: values[i] of all of it becomes max(0, all - bright) + max(0, bright).
export function addParts(values: Float32Array, bright: Float32Array): void {
  for (let i = 0; i < values.length; ++i) values[i] = Math.max(0, values[i] - bright[i]) + Math.max(0, bright[i]);
}

/// The mean and the rows of the components, from the bytes of their buffer view (little endian). Throws on another size.
export const componentRows = (e: RadianceTransferExtension, bytes: ArrayBuffer): Float32Array =>
  floatsOf(bytes, ((e.components?.rank ?? 0) + 1) * e.channels * e.slots);

function floatsOf(bytes: ArrayBuffer, count: number): Float32Array {
  if (bytes.byteLength !== 4 * count) throw new Error(`${kName}: a buffer view does not hold its numbers`);
  const view = new DataView(bytes);
  return Float32Array.from({ length: count }, (_, i) => view.getFloat32(4 * i, true));
}

/// The matrices as order^2 transfer vectors that share their stored numbers: the o-th gives coefficient o of what
/// arrives. `bytes`: of the view of their components. Throws on another size.
export function arrivingTransfers(e: GlossyExtension, bytes: ArrayBuffer): StoredTransfer[] {
  const outputs = e.order * e.order;
  const inputs = outputs + (e.fixed ? 1 : 0);
  const matrix = e.channels * outputs * inputs;
  const all = floatsOf(bytes, (e.components.rank + 1) * matrix);
  const stride = e.channels * inputs;
  return Array.from({ length: outputs }, (_, o) => {
    const rows = new Float32Array((e.components.rank + 1) * stride);
    for (let to = 0; to < rows.length; to += inputs) {
      const [row, c] = [Math.floor(to / stride), (to % stride) / inputs];
      const from = row * matrix + (c * outputs + o) * inputs;
      rows.set(all.subarray(from, from + inputs), to);
    }
    return { ...e, version: 2, slots: inputs, form: 'components', rows };
  });
}

/// How a GGX surface reflects. `bytes`: of their view.
export const lobeTable = ({ order, lobes }: GlossyExtension, bytes: ArrayBuffer): Float32Array =>
  floatsOf(bytes, lobes.rows * lobes.views * lobeWidth(order));

/// Numbers of an entry: a, b, the constant gain, and five for each band above.
export const lobeWidth = (order: number): number => 3 + 5 * (order - 1);

function checkShape(e: RadianceTransferExtension): void {
  const slots = e.order * e.order + (e.fixed ? 1 : 0);
  const rank = e.components?.rank ?? 0;
  const numbers = e.form === 'raw' ? e.channels * slots : rank + (e.fixed ? e.channels : 0);
  const good =
    (e.form === 'raw' || (e.form === 'components' && Number.isInteger(rank) && rank >= 1)) &&
    Number.isInteger(e.order) &&
    e.order >= (e.fixed ? 0 : 1) && // 0: radiosity, light that cannot be changed
    (e.channels === 1 || e.channels === 3) &&
    e.slots === slots &&
    e.scale?.length === numbers &&
    e.offset?.length === numbers &&
    e.attributes?.length === Math.ceil(numbers / 4);
  if (e.version !== 2) throw new Error(`${kName} version ${e.version} is not the one this reader knows`);
  if (!good || (e.glossy && !isSound(e.glossy, e.order)))
    throw new Error(`${kName} does not describe its own attributes`);
}

function isSound(g: GlossyExtension, most: number): boolean {
  const rank = g.components?.rank;
  return (
    Number.isInteger(g.order) &&
    g.order >= 1 &&
    g.order <= Math.min(most, 5) &&
    (g.channels === 1 || g.channels === 3) &&
    Number.isInteger(rank) &&
    rank >= 1 &&
    g.scale?.length === rank &&
    g.offset?.length === rank &&
    g.attributes?.length === Math.ceil(rank / 4) &&
    g.lobes?.rows === 16 &&
    g.lobes.views === 32
  );
}

/// The `_PRT_k` arrays of a geometry, four numbers each. GLTFLoader lower-cases attribute names.
export function transferAttributes(
  e: Pick<RadianceTransferExtension, 'attributes'>,
  geometry: BufferGeometry,
): Float32Array[] {
  return e.attributes.map((name) => {
    const attribute = geometry.getAttribute(name.toLowerCase()) as BufferAttribute | undefined;
    if (!attribute || attribute.itemSize !== 4) throw new Error(`${kName}: a primitive lacks ${name}`);
    return attribute.array as Float32Array;
  });
}

/// RGB that leaves a white surface at every vertex under SH `light` (light[3 * i + channel], order^2 entries or more).
/// `lamps`: add the light of the scene's own lamps where it was baked. 50 000 vertices of order 6 in RGB take about 10 ms.
export const lightValues = (
  e: RadianceTransfer,
  geometry: BufferGeometry,
  light: ArrayLike<number>,
  lamps = true,
): Float32Array => lightOfStored(e, transferAttributes(e, geometry), light, lamps);

/// Light that arrives at the vertices of a specular part, from the half space of their normals, as SH coefficients in
/// world axes: out[4 * (v * order^2 + o) + channel], the fourth number 0. `attributes`: its `_GLOSSY_k` arrays.
export function arrivingLight(
  arriving: readonly StoredTransfer[],
  attributes: readonly Float32Array[],
  light: ArrayLike<number>,
  lamps: boolean,
): Float32Array {
  const vertices = attributes[0].length / 4;
  const out = new Float32Array(4 * vertices * arriving.length);
  const one = new Float32Array(3 * vertices);
  arriving.forEach((transfer, o) => {
    lightOfStored(transfer, attributes, light, lamps, one);
    for (let from = 0, to = 4 * o; from < one.length; from += 3, to += 4 * arriving.length)
      [out[to], out[to + 1], out[to + 2]] = [one[from], one[from + 1], one[from + 2]];
  });
  return out;
}

/// The same as lightValues() from the `_PRT_k` arrays themselves. `out` may be given for reuse.
export function lightOfStored(
  e: StoredTransfer,
  attributes: readonly Float32Array[],
  light: ArrayLike<number>,
  lamps: boolean,
  out: Float32Array = new Float32Array((3 * attributes[0].length) / 4),
): Float32Array {
  const { none, gains } = lightOfNumbers(e, light, lamps);
  for (let v = 0; v < out.length; v += 3) [out[v], out[v + 1], out[v + 2]] = none;
  attributes.forEach((stored, k) => {
    for (let c = 0; c < 3; ++c) addLight(stored, [0, 1, 2, 3].map((i) => gains[4 * k + i]?.[c] ?? 0), out, c);
  });
  return out;
}

/// Adds what one attribute brings to channel `c`.
function addLight(stored: Float32Array, [g0, g1, g2, g3]: number[], out: Float32Array, c: number): void {
  if (g0 === 0 && g1 === 0 && g2 === 0 && g3 === 0) return;
  for (let from = 0, to = c; from < stored.length; from += 4, to += 3)
    out[to] += g0 * stored[from] + g1 * stored[from + 1] + g2 * stored[from + 2] + g3 * stored[from + 3];
}

/// The RGB light that one of each stored number brings, and what is there when all are 0.
function lightOfNumbers(e: StoredTransfer, light: ArrayLike<number>, lamps: boolean) {
  const count = e.order * e.order;
  const ofSlot = (slot: number, c: number): number => {
    const [i, channel] = [slot % e.slots, Math.floor(slot / e.slots)];
    if (e.channels === 3 && channel !== c) return 0;
    return i < count ? light[3 * i + c] : lamps ? 1 : 0;
  };
  const flat = e.channels * e.slots;
  const ofRow = (row: number) =>
    [0, 1, 2].map((c) => {
      let sum = 0;
      for (let slot = 0; slot < flat; ++slot) sum += e.rows[row * flat + slot] * ofSlot(slot, c);
      return sum;
    });
  const rank = e.components?.rank ?? 0;
  const isRaw = e.form === 'raw';
  const ofNumber = (j: number): number[] => {
    if (!isRaw && j < rank) return ofRow(j + 1);
    const slot = isRaw ? j : (j - rank + 1) * e.slots - 1; // after the components: the lamps of a channel
    return [0, 1, 2].map((c) => ofSlot(slot, c));
  };
  const none = isRaw ? [0, 0, 0] : ofRow(0);
  const gains = e.scale.map((scale, j) =>
    ofNumber(j).map((gain, c) => {
      none[c] += e.offset[j] * gain;
      return scale * gain;
    }),
  );
  return { none, gains };
}
