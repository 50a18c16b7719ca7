// scene.glb as the server has it -> a plain GLB that any glTF loader reads by itself, and the transfer vectors apart.
//
// KHR_draco_mesh_compression becomes ordinary accessors, in both scenes; these share their compressed bytes, and each mesh is
// decoded once. The transfer vectors, light fields, and the COLOR_0 that stands for them in other viewers, stay out of
// the GLB.

import { DracoMesh, type DracoModule } from './draco_mesh';
import { joinGlb, padded, splitGlb } from './glb';
import { type FieldTexels, fieldTexels, readLightField, storedField } from './light_field';
import type { FieldLamp, LampExtension } from './field_lamps';
import { readLobes, readSky, type SkyData, type SkyExtension } from './mirrored_sky';
import { coefficientsOf } from '../light/transfer';
import { type LightLinks, type LinksExtension, readLinks } from '../light/links';
import { type PointField, type PointsExtension, readPoints } from './point_field';
import {
  arrivingTransfers,
  componentRows,
  readExtension,
  type RadianceTransferExtension,
  type StoredTransfer,
} from './kiln_reader';

/// One baked primitive. Its vertices are in the order of the GLB's.
export interface BakedPrimitive {
  stored: Float32Array[]; // its `_PRT_k`, four numbers of each vertex
  weights: Float32Array[]; // its `_GLOSSY_k` alike; none: it has no matrices
  field: FieldTexels | null; // its `_SLF_k`, if the file has a light field
  positions: Float32Array;
  normals: Float32Array;
  indices: Uint32Array;
}

export interface Unpacked {
  file: ArrayBuffer;
  transfer: StoredTransfer;
  arriving: StoredTransfer[]; // of the matrices, if there are any
  baked: BakedPrimitive[]; // in the order of the file
  links: LightLinks | null; // for lamps that move
  points: PointField | null; // the light of the bake on its points
  progressive: Uint8Array<ArrayBuffer> | null; // the bytes of KILN_progressive_mesh
  sky: SkyData | null; // that the light field keeps apart
  lamps: FieldLamp[]; // that it keeps apart too
  lobes: Float32Array<ArrayBuffer> | null; // where it keeps the sky or diffuse light apart
}

/// A light field on its way out of the file.
interface StoredField {
  series: StoredTransfer;
  apart: { sky?: SkyExtension; lamps?: LampExtension; emission?: boolean; diffuse: boolean };
  sky: SkyData | null;
  lobes: Float32Array<ArrayBuffer> | null;
}

interface Json {
  meshes?: { primitives: Primitive[] }[];
  accessors?: Accessor[];
  bufferViews?: BufferView[];
  buffers?: { byteLength: number }[];
  images?: { bufferView?: number }[];
  extensionsUsed?: string[];
  extensionsRequired?: string[];
  extensions?: Record<string, unknown>;
}

interface Primitive {
  attributes: Record<string, number>;
  indices: number;
  extensions?: { [kDraco]?: Compressed; KILN_radiance_transfer?: unknown };
}

interface Compressed {
  bufferView: number;
  attributes: Record<string, number>; // Draco's ids
}

interface Accessor {
  bufferView?: number;
  byteOffset?: number;
  componentType: number;
  count: number;
  type: string;
}

interface BufferView {
  buffer: number;
  byteOffset?: number;
  byteLength: number;
}

const kDraco = 'KHR_draco_mesh_compression';
const [kUnsignedInt, kFloat] = [5125, 5126];
const kComponents: Record<string, number> = { VEC2: 2, VEC3: 3, VEC4: 4 };

/// Before anything is decoded.
export interface Packed {
  json: Json;
  binary: Uint8Array<ArrayBuffer>;
  extension: RadianceTransferExtension;
}

/// Whether a GLB is one of ours that can be relit. Throws, in words, on what is no GLB.
export const carriesTransfer = (file: ArrayBuffer): boolean => readExtension(splitGlb(file).json) !== undefined;

/// Throws, in words, on a file that is not as core/artifact/README.md says.
export function readPacked(file: ArrayBuffer): Packed {
  const { json, binary } = splitGlb(file);
  const extension = readExtension(json);
  if (!extension) throw new Error('this glTF carries no KILN_radiance_transfer');
  return { json: json as Json, binary, extension };
}

/// Uses up `packed`. Throws as readPacked does.
export function unpack(draco: DracoModule, { json, binary, extension }: Packed): Unpacked {
  const transfer = { ...extension, rows: rowsOf(extension, json, binary) };
  const { components, glossy } = extension;
  const bytesIn = (index: number) => bytesOf(json, binary, index);
  const arriving = glossy ? arrivingTransfers(glossy, bytesIn(glossy.components.bufferView).slice().buffer) : [];
  const primitives = (json.meshes ?? []).flatMap((mesh) => mesh.primitives);
  const baked = new Map<Primitive, BakedPrimitive>();
  const { links, points } = takeMeshless(json, bytesIn);
  const field = takeField(json, bytesIn);
  if (field?.apart.diffuse && (transfer.order !== 0 || transfer.channels !== 3))
    throw new Error(`/extensions/${kField}/diffuse: stands beside a transfer of order 0 with three channels`);
  const progressive = takeProgressive(json, bytesIn);
  const out = new Binary();
  moveImages(json, binary, out);
  for (const moved of [components, glossy?.components, glossy?.lobes])
    if (moved) moved.bufferView = out.add(bytesIn(moved.bufferView));
  const accessors: Accessor[] = [];
  for (const [bytes, sharing] of byCompressedBytes(primitives, json, binary)) {
    const mesh = new DracoMesh(draco, bytes);
    try {
      for (const primitive of sharing) {
        if (isBaked(primitive)) baked.set(primitive, takeBaked(primitive, mesh, transfer, field));
        makePlain(primitive, json, mesh, { accessors, out });
      }
    } finally {
      mesh.dispose();
    }
  }
  json.accessors = accessors;
  json.bufferViews = out.views;
  json.buffers = [{ byteLength: out.length }];
  json.extensionsUsed = json.extensionsUsed?.filter((name) => name !== kDraco);
  json.extensionsRequired = json.extensionsRequired?.filter((name) => name !== kDraco);
  return {
    file: joinGlb(json, out.pieces),
    transfer,
    arriving,
    baked: primitives.filter(isBaked).map((primitive) => baked.get(primitive)!),
    links,
    points,
    progressive,
    sky: field?.sky ?? null,
    lamps: field?.apart.lamps?.lights ?? [],
    lobes: field?.lobes ?? null,
  };
}

const [kLinks, kField, kProgressive] = ['KILN_meshless_light', 'KILN_light_field', 'KILN_progressive_mesh'];

const kPointsVersion = 2; // of KILN_meshless_light: the light of the bake on its points

/// Links or points stay out of the GLB: its buffer views are others.
function takeMeshless(json: Json, bytesIn: (view: number) => Uint8Array): Pick<Unpacked, 'links' | 'points'> {
  const extension = json.extensions?.[kLinks] as LinksExtension | PointsExtension | undefined;
  if (!extension) return { links: null, points: null };
  const taken = takeExtension(json, kLinks, extension);
  if (taken.version === kPointsVersion) return { links: null, points: readPoints(taken as PointsExtension, bytesIn) };
  return { links: readLinks(taken as LinksExtension, bytesIn), points: null };
}

/// Light fields stay out of the GLB too.
function takeField(json: Json, bytesIn: (view: number) => Uint8Array<ArrayBuffer>): StoredField | null {
  const extension = readLightField(json);
  if (!extension) return null;
  const { sky, lamps, emissionApart: emission, diffuse } = takeExtension(json, kField, extension);
  const series = storedField(extension, bytesIn);
  const seen = sky ? readSky(sky, bytesIn) : null;
  const lobes = seen?.lobes ?? (diffuse ? readLobes(diffuse.lobes, bytesIn) : null);
  return { series, apart: { sky, lamps, emission, diffuse: diffuse !== undefined }, sky: seen, lobes };
}

/// A copy: light/progressive_mesh.ts reads it when it is asked for.
function takeProgressive(json: Json, bytesIn: (view: number) => Uint8Array<ArrayBuffer>) {
  const extension = json.extensions?.[kProgressive] as { version: number; bufferView: number } | undefined;
  if (!extension) return null;
  if (extension.version !== 2) throw new Error(`/extensions/${kProgressive}/version: only version 2 is read`);
  return bytesIn(takeExtension(json, kProgressive, extension).bufferView).slice();
}

function takeExtension<T>(json: Json, name: string, extension: T): T {
  delete json.extensions![name];
  json.extensionsUsed = json.extensionsUsed?.filter((one) => one !== name);
  return extension;
}

const isBaked = ({ extensions }: Primitive): boolean => extensions?.KILN_radiance_transfer !== undefined;

/// The binary chunk that is written.
class Binary {
  readonly views: BufferView[] = [];
  readonly pieces: Uint8Array[] = [];
  length = 0;
  private readonly known = new Map<ArrayBufferView<ArrayBuffer>, number>();

  /// The buffer view of these numbers. The same array again is the same view.
  add(array: ArrayBufferView<ArrayBuffer>): number {
    const known = this.known.get(array);
    if (known !== undefined) return known;
    const { buffer, byteOffset, byteLength } = array;
    this.pieces.push(new Uint8Array(buffer, byteOffset, byteLength));
    this.known.set(array, this.views.length);
    this.views.push({ buffer: 0, byteOffset: this.length, byteLength });
    this.length += padded(byteLength);
    return this.views.length - 1;
  }
}

function bytesOf(json: Json, binary: Uint8Array<ArrayBuffer>, index: number): Uint8Array<ArrayBuffer> {
  const { byteOffset = 0, byteLength } = entry(json.bufferViews, index, 'buffer view');
  if (!(byteOffset >= 0 && byteLength >= 0 && byteOffset + byteLength <= binary.byteLength))
    throw new Error(`buffer view ${index} reaches beyond the end of the file`);
  return binary.subarray(byteOffset, byteOffset + byteLength);
}

function entry<T>(list: T[] | undefined, index: number, what: string): T {
  const found = list?.[index];
  if (found === undefined) throw new Error(`the file has no ${what} ${index}, which it refers to`);
  return found;
}

function rowsOf(extension: RadianceTransferExtension, json: Json, binary: Uint8Array<ArrayBuffer>): Float32Array {
  if (!extension.components) return new Float32Array(0);
  return componentRows(extension, bytesOf(json, binary, extension.components.bufferView).slice().buffer);
}

function moveImages(json: Json, binary: Uint8Array<ArrayBuffer>, out: Binary): void {
  for (const image of json.images ?? [])
    if (image.bufferView !== undefined) image.bufferView = out.add(bytesOf(json, binary, image.bufferView));
}

/// The primitives of both scenes, those together that are decoded from the same bytes.
function byCompressedBytes(
  primitives: readonly Primitive[],
  json: Json,
  binary: Uint8Array<ArrayBuffer>,
): [Uint8Array<ArrayBuffer>, Primitive[]][] {
  const groups = new Map<string, [Uint8Array<ArrayBuffer>, Primitive[]]>();
  for (const primitive of primitives) {
    const compressed = primitive.extensions?.[kDraco];
    if (!compressed) throw new Error(`a primitive is not compressed with ${kDraco}`);
    const bytes = bytesOf(json, binary, compressed.bufferView);
    const key = `${bytes.byteOffset} ${bytes.byteLength}`;
    const group = groups.get(key);
    if (group) group[1].push(primitive);
    else groups.set(key, [bytes, [primitive]]);
  }
  return [...groups.values()];
}

/// Takes the transfer vectors and matrices, and what stands for them, out of the primitive.
function takeBaked(
  primitive: Primitive,
  mesh: DracoMesh,
  transfer: StoredTransfer,
  light: StoredField | null,
): BakedPrimitive {
  const ids = primitive.extensions![kDraco]!.attributes;
  const floatsOf = (name: string, components: number) => {
    if (ids[name] === undefined) throw new Error(`a baked primitive lacks ${name}`);
    return mesh.floats(ids[name], components);
  };
  const own = primitive.extensions!.KILN_radiance_transfer as { glossy?: boolean };
  const [names, matrices] = [transfer.attributes, own.glossy ? (transfer.glossy?.attributes ?? []) : []];
  const [stored, weights] = [names, matrices].map((list) => list.map((name) => floatsOf(name, 4)));
  const all = (list: readonly string[]) => list.map((name) => floatsOf(name, 4));
  const { sky, lamps, emission, diffuse } = light?.apart ?? {};
  const seen = <T extends { attributes: string[] }>(extension: T | undefined) =>
    extension && { extension, attributes: all(extension.attributes) };
  const ownLight = diffuse ? coefficientsOf(transfer, stored) : undefined;
  const numbers = { sky: seen(sky), lamps: seen(lamps), emission, diffuse: ownLight };
  const field = light && fieldTexels(light.series, all(light.series.attributes), numbers);
  const apart = [light?.series, sky, lamps].flatMap((one) => one?.attributes ?? []);
  const taken = [...names, ...matrices, ...apart, 'COLOR_0'];
  for (const name of taken) delete primitive.attributes[name];
  const [positions, normals] = [floatsOf('POSITION', 3), floatsOf('NORMAL', 3)];
  return { stored, weights, field, positions, normals, indices: mesh.indices() };
}

/// Gives the primitive accessors of its own. (three.js shares what shares an accessor; disposing of one user would pull it from
/// under the other.)
function makePlain(
  primitive: Primitive,
  json: Json,
  mesh: DracoMesh,
  { accessors, out }: { accessors: Accessor[]; out: Binary },
): void {
  const ids = primitive.extensions![kDraco]!.attributes;
  for (const [name, index] of Object.entries(primitive.attributes)) {
    const accessor = entry(json.accessors, index, 'accessor');
    if (accessor.componentType !== kFloat || !kComponents[accessor.type] || ids[name] === undefined)
      throw new Error(`attribute ${name} is not one of compressed floats`);
    const bufferView = out.add(mesh.floats(ids[name], kComponents[accessor.type]));
    primitive.attributes[name] = accessors.push({ ...accessor, bufferView, byteOffset: 0, count: mesh.points }) - 1;
  }
  const indices = mesh.indices();
  primitive.indices =
    accessors.push({
      bufferView: out.add(indices),
      componentType: kUnsignedInt,
      count: indices.length,
      type: 'SCALAR',
    }) - 1;
  delete primitive.extensions![kDraco];
}
