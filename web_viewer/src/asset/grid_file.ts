// grid.exr: an irradiance vector grid (core/artifact/README.md specifies it), and what it says of a receiver.

import { DataUtils, HalfFloatType } from 'three';
import { EXRLoader } from 'three/addons/loaders/EXRLoader.js';

type Triple = readonly [number, number, number];

/// A lattice stored whole, or in bricks of kBrickSide^3 cells with the vertices at their corners.
export interface GridLattice {
  size: Triple; // vertices
  origin: Triple; // world
  spacing: Triple;
  parts: Uint16Array[]; // RGBA halves, vertex (k * size.y + j) * size.x + i; of bricks one after the other, each likewise
  cells: Triple; // max(1, size - 1)
  blocks: Triple; // of cells that a brick may store
  bricks: Int32Array | null; // [block] the brick's number or -1; null: stored whole
  /// kCellBytes a cell: direction, offset, bits below, bits above for +x -x +y -y +z -z, cells below and above of each,
  /// bits of eighths 0 to 7, four unused. Null: every corner counts.
  corners: Uint8Array | null;
}

export interface GridFile extends GridLattice {
  blend: 'exact' | 'paper';
  content: 'indirect' | 'all';
  scale: number;
  names: readonly string[]; // of the parts
  finer: GridLattice[]; // each of twice as many vertices along each axis as the one before; in bricks
}

export const kBrickSide = 4; // cells
export const kBrickVertices = (kBrickSide + 1) ** 3;
export const kBrickCells = kBrickSide ** 3;
export const kUnseen = 27; // in place of a neighbour: bits / 255 of the room's light arrives

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
  byte < kNeighbourBytes ? (byte % 4 ? 256 : 243) : byte < kRoomBytes ? kUnseen + 1 : 256;

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
  if (!['2', '3'].includes(text('kiln.grid'))) throw new Error('grid.exr: kiln.grid is neither 2 nor 3');
  const blend = text('kiln.blend') === 'paper' ? 'paper' : 'exact';
  const size = triple('kiln.size');
  const names = blend === 'exact' ? kExact : kPaper;
  const find = (name: string, width: number, height: number): Uint16Array => {
    const found = parts.find((part) => part.name === name);
    if (!found || found.width !== width || found.height !== height)
      throw new Error(`grid.exr: part ${name} is missing or has another size`);
    return found.pixels;
  };
  const hasCorners = parts.some(({ name }) => name.startsWith('corners.'));
  const read = (prefix: string, { size, origin, spacing }: Placed): GridLattice => {
    const cells = size.map((n) => Math.max(1, n - 1)) as unknown as Triple;
    const blocks = cells.map((n) => Math.ceil(n / kBrickSide)) as unknown as Triple;
    const bricks = prefix ? readBricks(find(`${prefix}bricks`, blocks[0], blocks[1] * blocks[2])) : null;
    const count = bricks?.reduce((n, brick) => Math.max(n, brick + 1), 0) ?? 0;
    const vertexRows = bricks ? [kBrickVertices, count] : [size[0], size[1] * size[2]];
    const cellRows = bricks ? [kBrickCells, count] : [cells[0], cells[1] * cells[2]];
    return {
      ...{ size, origin, spacing, cells, blocks, bricks },
      parts: names.map((name) => find(prefix + name, vertexRows[0], vertexRows[1])),
      corners: hasCorners
        ? readCorners((name) => find(prefix + name, cellRows[0], cellRows[1]), cellRows[0] * cellRows[1])
        : null,
    };
  };
  const base: Placed = { size, origin: triple('kiln.origin'), spacing: triple('kiln.spacing') };
  const finer = Array.from({ length: Number(text('kiln.finer') || 0) }, (_, k) =>
    read(`finer.${k + 1}.`, finerPlaced(base, k)),
  );
  return {
    ...read('', base),
    blend,
    content: text('kiln.content') === 'all' ? 'all' : 'indirect',
    scale: Number(text('kiln.scale')),
    names,
    finer,
  };
}

interface Placed {
  size: Triple;
  origin: Triple;
  spacing: Triple;
}

/// Lattice k beyond the base: over the same box, 2^(k + 1) times as fine.
export function finerPlaced({ size, origin, spacing }: Placed, k: number): Placed {
  const parts = 2 ** (k + 1);
  const each = (f: (axis: number) => number) => [0, 1, 2].map(f) as unknown as Triple;
  return {
    size: each((a) => size[a] * parts),
    spacing: each((a) => spacing[a] / parts),
    origin: each((a) => origin[a] - (spacing[a] - spacing[a] / parts) / 2),
  };
}

function readBricks(pixels: Uint16Array): Int32Array {
  return Int32Array.from({ length: pixels.length / 4 }, (_, i) => {
    const [low, high, stored] = [0, 1, 2].map((c) => DataUtils.fromHalfFloat(pixels[4 * i + c]));
    return stored ? 1024 * high + low : -1;
  });
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
  file: GridFile,
  p: Triple,
  n: Triple,
  place: 'surface' | 'room',
): [number, number, number] {
  const stored = file.finer.filter((lattice) => cellIndex(lattice, cellOf(lattice, p)) >= 0);
  const grid: GridLattice = stored.at(-1) ?? file;
  const t = [0, 1, 2].map((a) => clamp((p[a] - grid.origin[a]) / grid.spacing[a], 0, grid.size[a] - 1));
  const cell = cellOf(grid, p);
  const f = [0, 1, 2].map((a) => t[a] - cell[a]);
  const { bits, share } = cornersRead(grid, cell, f, n, place); // may move cell and f
  const weights = Array.from({ length: 8 }, (_, b) =>
    ((bits >> b) & 1) === 0
      ? 0
      : [0, 1, 2].reduce((w, a) => w * (((b >> a) & 1 ? f[a] : 1 - f[a]) + (bits === 255 ? 0 : 1e-3)), 1),
  );
  const sum = weights.reduce((a, b) => a + b, 0);
  const read = (part: number, c: number): number =>
    weights.reduce((value, w, b) => {
      return value + (w / sum) * DataUtils.fromHalfFloat(grid.parts[part][4 * cornerIndex(grid, cell, b) + c]);
    }, 0);
  return [0, 1, 2].map((c) => file.scale * share * Math.max(0, blend(file, n, c, read))) as [number, number, number];
}

function cellOf(grid: GridLattice, p: Triple): number[] {
  return [0, 1, 2].map((a) =>
    clamp(Math.floor((p[a] - grid.origin[a]) / grid.spacing[a]), 0, Math.max(0, grid.size[a] - 2)),
  );
}

const flat = (at: number[], [x, y]: readonly number[]): number => (at[2] * y + at[1]) * x + at[0];

function brickOf({ blocks, bricks }: GridLattice, cell: number[]): number {
  return bricks
    ? bricks[
        flat(
          cell.map((x) => Math.floor(x / kBrickSide)),
          blocks,
        )
      ]
    : -1;
}

/// Where the bytes of a cell are, in cells; -1: it is not stored.
function cellIndex(grid: GridLattice, cell: number[]): number {
  if (!grid.bricks) return flat(cell, grid.cells);
  const brick = brickOf(grid, cell);
  const local = cell.map((x) => x % kBrickSide);
  return brick < 0 ? -1 : brick * kBrickCells + flat(local, [kBrickSide, kBrickSide]);
}

/// Where the values of a cell's corner are, in vertices.
function cornerIndex(grid: GridLattice, cell: number[], b: number): number {
  if (!grid.bricks) {
    const at = [0, 1, 2].map((a) => Math.min(cell[a] + ((b >> a) & 1), grid.size[a] - 1));
    return flat(at, grid.size);
  }
  const local = cell.map((x, a) => (x % kBrickSide) + ((b >> a) & 1));
  return brickOf(grid, cell) * kBrickVertices + flat(local, [kBrickSide + 1, kBrickSide + 1]);
}

/// Which corners count, and the share of what they say. Moves `cell` and `f` into the cell that they are of.
function cornersRead(
  grid: GridLattice,
  cell: number[],
  f: number[],
  n: Triple,
  place: 'surface' | 'room',
): { bits: number; share: number } {
  if (!grid.corners) return { bits: 255, share: 1 };
  let share = 1;
  const at = kCellBytes * cellIndex(grid, cell);
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
    if (c === kUnseen) {
      share = bits / 255;
    } else if (bits !== 0 && to.every((x, a) => x >= 0 && x < grid.cells[a]) && cellIndex(grid, to) >= 0) {
      for (let a = 0; a < 3; ++a) [cell[a], f[a]] = [to[a], clamp(f[a] - step[a], 0, 1)];
      return { bits, share };
    }
  }
  const eighth = f.reduce((sum, x, a) => sum + (x >= 0.5 ? 1 << a : 0), 0);
  return { bits: grid.corners[at + kRoomBytes + eighth] || 255, share };
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
