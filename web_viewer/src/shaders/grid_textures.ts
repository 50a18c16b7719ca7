// An irradiance vector grid as 3D textures, and the GLSL that reads them: the same look-up as asset/grid_file.ts.
// Where all corners of a cell count the hardware interpolates; elsewhere eight texels are fetched by hand.

import {
  ClampToEdgeWrapping,
  Data3DTexture,
  HalfFloatType,
  LinearFilter,
  NearestFilter,
  RGBAFormat,
  RGBAIntegerFormat,
  UnsignedIntType,
  Vector3,
} from 'three';
import { type GridFile, kCellBytes, kNeighbourBytes, kOwnCell, kRoomBytes } from '../asset/grid_file';

export class GridTextures {
  readonly uniforms: Record<string, { value: unknown }>;
  readonly defines: Record<string, string>;
  private readonly textures: Data3DTexture[];

  constructor(grid: GridFile) {
    const parts = grid.parts.map((data) => {
      const texture = new Data3DTexture(data, ...grid.size);
      texture.format = RGBAFormat;
      texture.type = HalfFloatType;
      texture.minFilter = texture.magFilter = LinearFilter;
      return texture;
    });
    const corners = new Data3DTexture(
      new Uint32Array(cornerBytes(grid).buffer),
      3 * grid.cells[0], // three texels of sixteen bytes a cell
      grid.cells[1],
      grid.cells[2],
    );
    corners.format = RGBAIntegerFormat;
    corners.type = UnsignedIntType;
    corners.internalFormat = 'RGBA32UI';
    corners.minFilter = corners.magFilter = NearestFilter;
    this.textures = [...parts, corners];
    for (const texture of this.textures) {
      texture.wrapS = texture.wrapT = texture.wrapR = ClampToEdgeWrapping;
      texture.unpackAlignment = 4;
      texture.needsUpdate = true;
    }
    this.uniforms = {
      gridCorners: { value: corners },
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

function cornerBytes(grid: GridFile): Uint8Array {
  if (grid.corners) return grid.corners;
  const open = Uint8Array.from({ length: kCellBytes }, (_, i) =>
    i < kNeighbourBytes ? (i % 4 < 2 ? 0 : 255) : i < kRoomBytes ? kOwnCell : 255,
  );
  const out = new Uint8Array(kCellBytes * grid.cells[0] * grid.cells[1] * grid.cells[2]);
  for (let at = 0; at < out.length; at += kCellBytes) out.set(open, at);
  return out;
}

const kNumbers = (n: number) => Array.from({ length: n }, (_, i) => i);
const declare = (n: number) => kNumbers(n).map((i) => `uniform sampler3D gridPart${i};`).join('\n');
const readAll = (n: number) => kNumbers(n).map((i) => `  part[${i}] = gridRead(gridPart${i}, place);`).join('\n');

/// vec3 gridIrradiance(vec3 p, vec3 n, bool surface): W m^-2, at least 0. `n` is unit; p is in the world.
export const gridLookup = (parts: number): string => /* glsl */ `
uniform highp usampler3D gridCorners;
uniform vec3 gridOrigin, gridSpacing, gridSize;
uniform float gridScale;
${declare(parts)}

struct GridPlace {
  ivec3 cell;
  vec3 at;       // in the textures, 0 to 1
  float weight[8];
  bool whole;    // every corner counts
};

uint gridByte(uvec4 words[3], int i) {
  return (words[i >> 4][(i >> 2) & 3] >> uint(8 * (i & 3))) & 255u;
}

float gridHeight(uint direction, vec3 f) {
  int axis = int(direction) / 81;
  vec3 m = vec3(1.0, float(int(direction) / 9 % 9) / 4.0 - 1.0, float(int(direction) % 9) / 4.0 - 1.0);
  m = axis == 0 ? m : axis == 1 ? m.zxy : m.yzx;
  return 80.0 * dot(m, f - 0.5) + 128.0;
}

/// Which corners count. Moves cell and f into the cell that they are of.
uint gridBits(inout ivec3 cell, inout vec3 f, vec3 n, bool surface) {
  uvec4 words[3];
  for (int i = 0; i < 3; ++i) words[i] = texelFetch(gridCorners, cell * ivec3(3, 1, 1) + ivec3(i, 0, 0), 0);
  if (surface) {
    vec3 size = abs(n);
    int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
    int side = 2 * axis + (n[axis] < 0.0 ? 1 : 0);
    uint offset = gridByte(words, 4 * side + 1);
    int above = offset != 0u && gridHeight(gridByte(words, 4 * side), f) >= float(offset) ? 1 : 0;
    uint bits = gridByte(words, 4 * side + 2 + above);
    int c = int(gridByte(words, ${kNeighbourBytes} + 2 * side + above));
    ivec3 steps = ivec3(c % 3, c / 3 % 3, c / 9) - 1;
    ivec3 to = cell + steps;
    bool within = all(greaterThanEqual(to, ivec3(0))) && all(lessThan(to, max(ivec3(1), ivec3(gridSize) - 1)));
    if (bits != 0u && within) {
      cell = to;
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
  vec3 t = clamp((p - gridOrigin) / gridSpacing, vec3(0.0), gridSize - 1.0);
  place.cell = clamp(ivec3(floor(t)), ivec3(0), max(ivec3(0), ivec3(gridSize) - 2));
  vec3 f = t - vec3(place.cell);
  uint bits = gridBits(place.cell, f, n, surface);
  place.at = (vec3(place.cell) + f + 0.5) / gridSize;
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
    ivec3 corner = min(place.cell + ivec3(b & 1, (b >> 1) & 1, (b >> 2) & 1), ivec3(gridSize) - 1);
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
  return gridScale * max(e, vec3(0.0));
}`;
