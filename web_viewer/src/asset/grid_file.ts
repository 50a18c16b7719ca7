// grid.exr: an irradiance vector grid (core/artifact/README.md specifies it), and what it says of a receiver.

import { DataUtils, HalfFloatType } from 'three';
import { EXRLoader } from 'three/addons/loaders/EXRLoader.js';

type Triple = readonly [number, number, number];

export interface GridFile {
  blend: 'exact' | 'paper';
  content: 'indirect' | 'all';
  size: Triple; // vertices
  origin: Triple; // world
  spacing: Triple;
  scale: number;
  names: readonly string[]; // of the parts
  parts: Uint16Array[]; // RGBA halves, vertex (k * size.y + j) * size.x + i
  cells: Triple; // max(1, size - 1)
  /// kCellBytes a cell: direction, offset, bits below, bits above for +x -x +y -y +z -z, cells below and above of each,
  /// bits of eighths 0 to 7, four unused. Null: every corner counts.
  corners: Uint8Array | null;
}

const kExact = ['phi.x', 'phi.y', 'phi.z', 'a.x', 'a.y', 'a.z', 'b.xy', 'b.xz', 'b.yz'];
const kPaper = ['px', 'nx', 'py', 'ny', 'pz', 'nz'].flatMap((d) => [`${d}.color`, `${d}.direction`]);
export const kCellBytes = 48;
export const kNeighbourBytes = 24; // where the cells begin
export const kRoomBytes = 36; // and the bits of eighths
export const kOwnCell = 13;
/// Four bytes of a cell each, in order.
const kCorners = ['px', 'nx', 'py', 'ny', 'pz', 'nz', 'cells.x', 'cells.y', 'cells.z', 'room.0', 'room.1'].map(
  (name) => `corners.${name}`,
);
const limitOf = (byte: number): number =>
  byte < kNeighbourBytes ? (byte % 4 ? 256 : 243) : byte < kRoomBytes ? 27 : 256;

interface Part {
  name: string;
  width: number;
  height: number;
  pixels: Uint16Array; // RGBA, top row first
  header: Record<string, unknown>;
}

/// Fails with a sentence when the file is something else.
export function readGrid(file: ArrayBuffer): GridFile {
  const parts = readParts(file);
  const header = parts[0].header;
  const text = (name: string) => String(header[name] ?? '');
  const triple = (name: string): Triple => {
    const numbers = text(name).split(' ').map(Number);
    if (numbers.length !== 3 || !numbers.every(Number.isFinite))
      throw new Error(`grid.exr: ${name} is not three numbers`);
    return numbers as unknown as Triple;
  };
  if (text('kiln.grid') !== '2') throw new Error('grid.exr: kiln.grid is not 2');
  const blend = text('kiln.blend') === 'paper' ? 'paper' : 'exact';
  const size = triple('kiln.size');
  const names = blend === 'exact' ? kExact : kPaper;
  const find = (name: string, width: number, height: number): Uint16Array => {
    const found = parts.find((part) => part.name === name);
    if (!found || found.width !== width || found.height !== height)
      throw new Error(`grid.exr: part ${name} is missing or has another size`);
    return found.pixels;
  };
  const cells: Triple = [Math.max(1, size[0] - 1), Math.max(1, size[1] - 1), Math.max(1, size[2] - 1)];
  return {
    blend,
    content: text('kiln.content') === 'all' ? 'all' : 'indirect',
    size,
    origin: triple('kiln.origin'),
    spacing: triple('kiln.spacing'),
    scale: Number(text('kiln.scale')),
    names,
    parts: names.map((name) => find(name, size[0], size[1] * size[2])),
    cells,
    corners: parts.some(({ name }) => name.startsWith('corners.'))
      ? readCorners((name) => find(name, cells[0], cells[1] * cells[2]), cells[0] * cells[1] * cells[2])
      : null,
  };
}

/// EXRLoader reads one part at a time, bottom row first; beyond the last part it reads the last one again.
function readParts(file: ArrayBuffer): Part[] {
  const loader = new EXRLoader().setDataType(HalfFloatType) as EXRLoader & { part: number };
  const out: Part[] = [];
  for (;;) {
    loader.part = out.length;
    const read = loader.parse(file) as unknown as Omit<Part, 'name' | 'pixels'> & { data: Uint16Array };
    const { width, height, data, header } = read;
    const name = String(header.name ?? '');
    if (name === out.at(-1)?.name) return out;
    const row = 4 * width;
    const pixels = new Uint16Array(data.length);
    for (let y = 0; y < height; ++y) pixels.set(data.subarray((height - 1 - y) * row, (height - y) * row), y * row);
    out.push({ name, width, height, pixels, header });
  }
}

function readCorners(find: (name: string) => Uint16Array, cells: number): Uint8Array {
  const out = new Uint8Array(kCellBytes * cells);
  kCorners.forEach((name, part) => {
    const pixels = find(name);
    for (let i = 0; i < 4 * cells; ++i) {
      const byte = 4 * part + (i % 4);
      const value = DataUtils.fromHalfFloat(pixels[i]);
      if (!(value >= 0 && value < limitOf(byte))) throw new Error(`grid.exr: part ${name} holds ${value}`);
      out[kCellBytes * Math.floor(i / 4) + byte] = value;
    }
  });
  return out;
}

const clamp = (x: number, low: number, high: number): number => Math.min(high, Math.max(low, x));

/// Irradiance of a receiver at `p` with unit normal `n`, as the README says it: what the shader is tested against.
export function irradianceAt(
  grid: GridFile,
  p: Triple,
  n: Triple,
  place: 'surface' | 'room',
): [number, number, number] {
  const t = [0, 1, 2].map((a) => clamp((p[a] - grid.origin[a]) / grid.spacing[a], 0, grid.size[a] - 1));
  const cell = [0, 1, 2].map((a) => clamp(Math.floor(t[a]), 0, Math.max(0, grid.size[a] - 2)));
  const f = [0, 1, 2].map((a) => t[a] - cell[a]);
  const bits = cornerBits(grid, cell, f, n, place); // may move cell and f
  const weights = Array.from({ length: 8 }, (_, b) =>
    ((bits >> b) & 1) === 0
      ? 0
      : [0, 1, 2].reduce((w, a) => w * (((b >> a) & 1 ? f[a] : 1 - f[a]) + (bits === 255 ? 0 : 1e-3)), 1),
  );
  const sum = weights.reduce((a, b) => a + b, 0);
  const read = (part: number, c: number): number =>
    weights.reduce((value, w, b) => {
      const at = [0, 1, 2].map((a) => Math.min(cell[a] + ((b >> a) & 1), grid.size[a] - 1));
      const i = (at[2] * grid.size[1] + at[1]) * grid.size[0] + at[0];
      return value + (w / sum) * DataUtils.fromHalfFloat(grid.parts[part][4 * i + c]);
    }, 0);
  return [0, 1, 2].map((c) => grid.scale * Math.max(0, blend(grid, n, c, read))) as [number, number, number];
}

/// Which corners count. Moves `cell` and `f` into the cell that they are of.
function cornerBits(grid: GridFile, cell: number[], f: number[], n: Triple, place: 'surface' | 'room'): number {
  if (!grid.corners) return 255;
  const at = kCellBytes * ((cell[2] * grid.cells[1] + cell[1]) * grid.cells[0] + cell[0]);
  if (place === 'surface') {
    const size = n.map(Math.abs);
    const axis = size[0] >= size[1] && size[0] >= size[2] ? 0 : size[1] >= size[2] ? 1 : 2;
    const side = 2 * axis + (n[axis] < 0 ? 1 : 0);
    const [direction, offset] = grid.corners.subarray(at + 4 * side);
    const above = offset !== 0 && planeHeight(direction, f) >= offset ? 1 : 0;
    const bits = grid.corners[at + 4 * side + 2 + above];
    const c = grid.corners[at + kNeighbourBytes + 2 * side + above];
    const step = [(c % 3) - 1, (Math.floor(c / 3) % 3) - 1, Math.floor(c / 9) - 1];
    const to = cell.map((x, a) => x + step[a]);
    if (bits !== 0 && to.every((x, a) => x >= 0 && x < grid.cells[a])) {
      for (let a = 0; a < 3; ++a) [cell[a], f[a]] = [to[a], clamp(f[a] - step[a], 0, 1)];
      return bits;
    }
  }
  const eighth = f.reduce((sum, x, a) => sum + (x >= 0.5 ? 1 << a : 0), 0);
  return grid.corners[at + kRoomBytes + eighth] || 255;
}

function planeHeight(direction: number, f: number[]): number {
  const axis = Math.floor(direction / 81);
  const along = [1, (Math.floor(direction / 9) % 9) / 4 - 1, (direction % 9) / 4 - 1];
  return along.reduce((sum, m, k) => sum + 80 * m * (f[(axis + k) % 3] - 0.5), 128);
}

function blend(grid: GridFile, n: Triple, c: number, read: (part: number, c: number) => number): number {
  if (grid.blend === 'exact') {
    const [x, y, z] = n;
    const weights = [x / 2, y / 2, z / 2, (x * x) / 2, (y * y) / 2, (z * z) / 2, (x * y) / 4, (x * z) / 4, (y * z) / 4];
    return weights.reduce((sum, w, part) => sum + w * read(part, c), 0);
  }
  return [0, 1, 2].reduce((sum, axis) => {
    const d = 2 * axis + (n[axis] < 0 ? 1 : 0);
    const direction = [0, 1, 2].map((a) => read(2 * d + 1, a));
    const long = Math.hypot(...direction) || 1;
    const cosine = Math.max(0, direction.reduce((s, v, a) => s + (v / long) * n[a], 0));
    return sum + n[axis] * n[axis] * read(2 * d, c) * cosine;
  }, 0);
}
