// An irradiance vector grid as 3D textures, and the GLSL that reads them: the same look-up as asset/grid_file.ts.
// Where all corners of a cell count the hardware interpolates; elsewhere eight texels are fetched by hand.
// Each texture holds the base from texel 0 on, and above its last z the bricks of all finer lattices, layer upon layer.

import {
  ClampToEdgeWrapping,
  Data3DTexture,
  HalfFloatType,
  IntType,
  LinearFilter,
  NearestFilter,
  RedIntegerFormat,
  RGBAFormat,
  RGBAIntegerFormat,
  UnsignedIntType,
  Vector2,
  Vector3,
} from 'three';
import {
  type GridFile,
  type GridLattice,
  kBrickCells,
  kBrickSide,
  kBrickVertices,
  kCellBytes,
  kNeighbourBytes,
  kOwnCell,
  kRoomBytes,
  kUnseen,
} from '../asset/grid_file';

type Size = readonly [number, number, number];
const kMostFiner = 8; // lattices that a file may hold beyond its base
const kMostDeep = 2048; // texels: what WebGL 2 has nearly everywhere

export class GridTextures {
  readonly uniforms: Record<string, { value: unknown }>;
  readonly defines: Record<string, string>;
  private readonly textures: Data3DTexture[];

  constructor(grid: GridFile) {
    const vertices = stackOf(grid, grid.size, kBrickSide + 1);
    const parts = grid.names.map((_, part) => {
      const data = fillStack(grid, vertices, 4, (lattice) => new Uint16Array(lattice.parts[part]));
      const texture = new Data3DTexture(data as Uint16Array<ArrayBuffer>, ...vertices.texels);
      texture.format = RGBAFormat;
      texture.type = HalfFloatType;
      texture.minFilter = texture.magFilter = LinearFilter;
      return texture;
    });
    const cells = stackOf(grid, grid.cells, kBrickSide);
    const bytes = fillStack(grid, cells, kCellBytes, (lattice) => cornerBytes(lattice));
    // Three texels of sixteen bytes a cell.
    const corners = new Data3DTexture(new Uint32Array(bytes.buffer), 3 * cells.texels[0], cells.texels[1], cells.texels[2]);
    corners.format = RGBAIntegerFormat;
    corners.type = UnsignedIntType;
    corners.internalFormat = 'RGBA32UI';
    corners.minFilter = corners.magFilter = NearestFilter;
    const bricks = brickNumbers(grid);
    this.textures = [...parts, corners, bricks.texture];
    for (const texture of this.textures) {
      texture.wrapS = texture.wrapT = texture.wrapR = ClampToEdgeWrapping;
      texture.unpackAlignment = 4;
      texture.needsUpdate = true;
    }
    this.uniforms = {
      gridCorners: { value: corners },
      gridBricks: { value: bricks.texture },
      gridBricksAt: { value: bricks.at },
      gridFiner: { value: grid.finer.length },
      gridLayer: { value: new Vector2(...vertices.layers) },
      gridTexels: { value: new Vector3(...vertices.texels) },
      gridOrigin: { value: new Vector3(...grid.origin) },
      gridSpacing: { value: new Vector3(...grid.spacing) },
      gridSize: { value: new Vector3(...grid.size) },
      gridScale: { value: grid.scale },
    };
    parts.forEach((texture, i) => (this.uniforms[`gridPart${i}`] = { value: texture }));
    this.defines = { GRID_PARTS: String(parts.length) };
    if (grid.blend === 'paper') this.defines.GRID_PAPER = '';
  }

  dispose(): void {
    for (const texture of this.textures) texture.dispose();
  }
}

const brickCount = (lattice: GridLattice): number => lattice.parts[0].length / 4 / kBrickVertices;
const allBricks = (grid: GridFile): number => grid.finer.reduce((sum, lattice) => sum + brickCount(lattice), 0);

/// Bricks along x and y of a layer: about as wide as the base, and wider where they would pile too high.
function brickLayers(grid: GridFile): [number, number] {
  const side = kBrickSide + 1;
  const out: [number, number] = [Math.ceil(grid.size[0] / side), Math.ceil(grid.size[1] / side)];
  const high = () => grid.size[2] + side * Math.ceil(allBricks(grid) / (out[0] * out[1]));
  while (high() > kMostDeep) out[out[0] > out[1] ? 1 : 0] *= 2;
  return out;
}

/// A texture of a base with bricks above it.
interface Stack {
  base: Size;
  side: number; // texels of a brick along each axis
  layers: readonly [number, number];
  texels: [number, number, number];
}

function stackOf(grid: GridFile, base: Size, side: number): Stack {
  const layers = brickLayers(grid);
  const high = side * Math.ceil(allBricks(grid) / (layers[0] * layers[1]));
  const wide = (axis: 0 | 1) => (high > 0 ? Math.max(base[axis], side * layers[axis]) : base[axis]);
  return { base, side, layers, texels: [wide(0), wide(1), base[2] + high] };
}

/// What each lattice has, `width` numbers a texel, put into its place.
function fillStack(
  grid: GridFile,
  stack: Stack,
  width: number,
  of: (lattice: GridLattice) => Uint16Array | Uint8Array,
): Uint16Array | Uint8Array {
  const { base, side, layers } = stack;
  if (grid.finer.length === 0) return of(grid);
  const [x, y, z] = stack.texels;
  const whole = of(grid);
  const out = whole instanceof Uint8Array ? new Uint8Array(width * x * y * z) : new Uint16Array(width * x * y * z);
  const copyRow = (from: Uint16Array | Uint8Array, at: number, texels: number, to: Size) =>
    out.set(from.subarray(width * at, width * (at + texels)), width * ((to[2] * y + to[1]) * x + to[0]));
  for (let k = 0; k < base[2]; ++k)
    for (let j = 0; j < base[1]; ++j) copyRow(whole, (k * base[1] + j) * base[0], base[0], [0, j, k]);
  let brick = 0;
  for (const lattice of grid.finer) {
    const own = of(lattice);
    for (let n = 0; n < brickCount(lattice); ++n, ++brick) {
      const [bx, by] = [brick % layers[0], Math.floor(brick / layers[0]) % layers[1]];
      const bz = Math.floor(brick / (layers[0] * layers[1]));
      for (let row = 0; row < side * side; ++row)
        copyRow(own, n * side ** 3 + row * side, side, [
          side * bx,
          side * by + (row % side),
          base[2] + side * bz + Math.floor(row / side),
        ]);
    }
  }
  return out;
}

/// The brick of each block of each finer lattice, numbered through, or -1: lattice k begins at z = at[k].
function brickNumbers(grid: GridFile): { texture: Data3DTexture; at: number[] } {
  const most = (axis: number) => Math.max(1, ...grid.finer.map(({ blocks }) => blocks[axis]));
  const [x, y] = [most(0), most(1)];
  const depth = Math.max(
    1,
    grid.finer.reduce((sum, { blocks }) => sum + blocks[2], 0),
  );
  const data = new Int32Array(x * y * depth).fill(-1);
  const at: number[] = [];
  let [z, first] = [0, 0];
  for (const lattice of grid.finer) {
    const [bx, by, bz] = lattice.blocks;
    lattice.bricks?.forEach((n, i) => {
      const to = ((z + Math.floor(i / (bx * by))) * y + (Math.floor(i / bx) % by)) * x + (i % bx);
      if (n >= 0) data[to] = first + n;
    });
    at.push(z);
    z += bz;
    first += brickCount(lattice);
  }
  while (at.length < kMostFiner) at.push(0);
  const texture = new Data3DTexture(data, x, y, depth);
  texture.format = RedIntegerFormat;
  texture.type = IntType;
  texture.internalFormat = 'R32I';
  texture.minFilter = texture.magFilter = NearestFilter;
  return { texture, at };
}

function cornerBytes(grid: GridLattice): Uint8Array {
  if (grid.corners) return new Uint8Array(grid.corners);
  const open = Uint8Array.from({ length: kCellBytes }, (_, i) =>
    i < kNeighbourBytes ? (i % 4 < 2 ? 0 : 255) : i < kRoomBytes ? kOwnCell : 255,
  );
  const cells = grid.bricks ? brickCount(grid) * kBrickCells : grid.cells[0] * grid.cells[1] * grid.cells[2];
  const out = new Uint8Array(kCellBytes * cells);
  for (let at = 0; at < out.length; at += kCellBytes) out.set(open, at);
  return out;
}

const kNumbers = (n: number) => Array.from({ length: n }, (_, i) => i);
const declare = (n: number) => kNumbers(n).map((i) => `uniform sampler3D gridPart${i};`).join('\n');
const readAll = (n: number) => kNumbers(n).map((i) => `  part[${i}] = gridRead(gridPart${i}, place);`).join('\n');

/// vec3 gridIrradiance(vec3 p, vec3 n, bool surface): W m^-2, at least 0. `n` is unit; p is in the world.
export const gridLookup = (parts: number): string => /* glsl */ `
uniform highp usampler3D gridCorners;
uniform highp isampler3D gridBricks;
uniform int gridBricksAt[${kMostFiner}], gridFiner;
uniform vec2 gridLayer;
uniform vec3 gridOrigin, gridSpacing, gridSize, gridTexels;
uniform float gridScale;
${declare(parts)}

struct GridPlace {
  ivec3 texel;   // of the cell's lowest corner
  ivec3 last;    // of the lattice, or of the brick
  vec3 at;       // in the textures, 0 to 1
  float weight[8];
  bool whole;    // every corner counts
  float share;   // of what they say, that arrives
};

/// The brick that stores a cell of a lattice, 1 and on beyond the base, or -1.
int gridBrick(int lattice, ivec3 cell) {
  return texelFetch(gridBricks, cell / ${kBrickSide} + ivec3(0, 0, gridBricksAt[lattice - 1]), 0).r;
}

/// Where a cell is in a stack of \`base\` and bricks of \`side\` texels: gridBrick says which brick, -1 is the base.
ivec3 gridTexel(int brick, ivec3 cell, int side, int base) {
  if (brick < 0) return cell;
  ivec2 layer = ivec2(gridLayer);
  ivec3 at = ivec3(brick % layer.x, brick / layer.x % layer.y, brick / (layer.x * layer.y));
  return at * side + cell % ${kBrickSide} + ivec3(0, 0, base);
}

uint gridByte(uvec4 words[3], int i) {
  return (words[i >> 4][(i >> 2) & 3] >> uint(8 * (i & 3))) & 255u;
}

float gridHeight(uint direction, vec3 f) {
  int axis = int(direction) / 81;
  vec3 m = vec3(1.0, float(int(direction) / 9 % 9) / 4.0 - 1.0, float(int(direction) % 9) / 4.0 - 1.0);
  m = axis == 0 ? m : axis == 1 ? m.zxy : m.yzx;
  return 80.0 * dot(m, f - 0.5) + 128.0;
}

/// Which corners count, and the share of what they say. Moves cell, its brick and f into the cell that they are of.
uint gridBits(int lattice, inout int brick, inout ivec3 cell, inout vec3 f, vec3 n, bool surface, out float share) {
  share = 1.0;
  ivec3 size = ivec3(gridSize) << lattice;
  ivec3 at = gridTexel(brick, cell, ${kBrickSide}, max(1, int(gridSize.z) - 1));
  uvec4 words[3];
  for (int i = 0; i < 3; ++i) words[i] = texelFetch(gridCorners, at * ivec3(3, 1, 1) + ivec3(i, 0, 0), 0);
  if (surface) {
    vec3 along = abs(n);
    int axis = along.x >= along.y && along.x >= along.z ? 0 : along.y >= along.z ? 1 : 2;
    int side = 2 * axis + (n[axis] < 0.0 ? 1 : 0);
    uint offset = gridByte(words, 4 * side + 1);
    int above = offset != 0u && gridHeight(gridByte(words, 4 * side), f) >= float(offset) ? 1 : 0;
    uint bits = gridByte(words, 4 * side + 2 + above);
    int c = int(gridByte(words, ${kNeighbourBytes} + 2 * side + above));
    if (c == ${kUnseen}) share = float(bits) / 255.0;
    ivec3 steps = ivec3(c % 3, c / 3 % 3, c / 9) - 1;
    ivec3 to = cell + steps;
    bool within = all(greaterThanEqual(to, ivec3(0))) && all(lessThan(to, max(ivec3(1), size - 1)));
    int next = within && lattice > 0 ? gridBrick(lattice, to) : -1;
    if (bits != 0u && c != ${kUnseen} && within && (lattice == 0 || next >= 0)) {
      cell = to;
      brick = next;
      f = clamp(f - vec3(steps), 0.0, 1.0);
      return bits;
    }
  }
  int eighth = (f.x >= 0.5 ? 1 : 0) + (f.y >= 0.5 ? 2 : 0) + (f.z >= 0.5 ? 4 : 0);
  uint room = gridByte(words, ${kRoomBytes} + eighth);
  return room == 0u ? 255u : room;
}

GridPlace gridPlace(vec3 p, vec3 n, bool surface) {
  GridPlace place;
  ivec3 cell;
  vec3 f;
  int lattice = gridFiner, brick = -1;
  for (; lattice >= 0; --lattice) {
    vec3 spacing = gridSpacing / float(1 << lattice), size = gridSize * float(1 << lattice);
    vec3 t = clamp((p - gridOrigin + 0.5 * (gridSpacing - spacing)) / spacing, vec3(0.0), size - 1.0);
    cell = clamp(ivec3(floor(t)), ivec3(0), max(ivec3(0), ivec3(size) - 2));
    f = t - vec3(cell);
    if (lattice == 0) break;
    brick = gridBrick(lattice, cell);
    if (brick >= 0) break;
  }
  uint bits = gridBits(lattice, brick, cell, f, n, surface, place.share);
  place.texel = gridTexel(brick, cell, ${kBrickSide + 1}, int(gridSize.z));
  place.last = lattice == 0 ? ivec3(gridSize) - 1 : place.texel + 1;
  place.at = (vec3(place.texel) + f + 0.5) / gridTexels;
  place.whole = bits == 255u;
  if (place.whole) return place;
  float sum = 0.0;
  for (int b = 0; b < 8; ++b) {
    vec3 up = vec3(b & 1, (b >> 1) & 1, (b >> 2) & 1);
    vec3 w = mix(1.0 - f, f, up) + 1e-3;
    place.weight[b] = ((bits >> uint(b)) & 1u) == 0u ? 0.0 : w.x * w.y * w.z;
    sum += place.weight[b];
  }
  for (int b = 0; b < 8; ++b) place.weight[b] /= sum;
  return place;
}

vec3 gridRead(sampler3D part, GridPlace place) {
  if (place.whole) return textureLod(part, place.at, 0.0).rgb;
  vec3 value = vec3(0.0);
  for (int b = 0; b < 8; ++b) {
    if (place.weight[b] == 0.0) continue;
    ivec3 corner = min(place.texel + ivec3(b & 1, (b >> 1) & 1, (b >> 2) & 1), place.last);
    value += place.weight[b] * texelFetch(part, corner, 0).rgb;
  }
  return value;
}

vec3 gridIrradiance(vec3 p, vec3 n, bool surface) {
  GridPlace place = gridPlace(p, n, surface);
  vec3 part[GRID_PARTS];
${readAll(parts)}
  vec3 e = vec3(0.0);
#ifdef GRID_PAPER
  for (int axis = 0; axis < 3; ++axis) {
    int d = 2 * axis + (n[axis] < 0.0 ? 1 : 0);
    vec3 direction = part[2 * d + 1];
    direction /= max(length(direction), 1e-20);
    e += n[axis] * n[axis] * max(0.0, dot(direction, n)) * part[2 * d];
  }
#else
  e = 0.5 * (n.x * part[0] + n.y * part[1] + n.z * part[2]) +
      0.5 * (n.x * n.x * part[3] + n.y * n.y * part[4] + n.z * n.z * part[5]) +
      0.25 * (n.x * n.y * part[6] + n.x * n.z * part[7] + n.y * n.z * part[8]);
#endif
  return gridScale * place.share * max(e, vec3(0.0));
}`;
