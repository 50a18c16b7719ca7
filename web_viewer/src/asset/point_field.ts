// The light of a bake on its points: KILN_meshless_light, version 2 (core/artifact/README.md). Stands alone.
//   value(p, n) = sum over levels and their points of a_j B_j(p)
// Places and radii are those of the unit cube, values irradiance / pi. core/meshless/point_field.h is the same in C++.

export interface PointField {
  levelEnd: number[]; // coarse to fine, the number of points up to the end of each
  sites: Float32Array<ArrayBuffer>; // x, y, z and r_j of each
  normals: Float32Array<ArrayBuffer>; // unit
  coefficients: Float32Array<ArrayBuffer>; // a_j, linear RGB
}

export interface PointsExtension {
  version: number;
  levels: number[];
  bufferViews?: Record<string, number>;
}

const kName = 'KILN_meshless_light';
const kMostLevels = 17;

/// `bytesOf` gives the bytes of a buffer view. Throws, in words, on what does not fit together.
export function readPoints(e: PointsExtension, bytesOf: (view: number) => Uint8Array): PointField {
  const fail = (what: string): never => {
    throw new Error(`${kName}: ${what}`);
  };
  const buffer = (name: string): ArrayBuffer =>
    e.bufferViews?.[name] === undefined ? new ArrayBuffer(0) : (bytesOf(e.bufferViews[name]).slice().buffer as ArrayBuffer);
  if (e.version !== 2) fail(`version ${e.version} is not known`);
  const levelEnd = e.levels;
  const count = levelEnd.at(-1) ?? 0;
  if (levelEnd.length > kMostLevels || levelEnd.some((end, i) => !(end >= (levelEnd[i - 1] ?? 0)))) fail('the levels fall');
  const [packed, radii] = [buffer('sites'), buffer('radii')];
  const coefficients = buffer('coefficients');
  if (packed.byteLength !== 16 * count || radii.byteLength !== 4 * count || coefficients.byteLength !== 12 * count)
    fail('sites, radii and coefficients do not fit the levels');
  const [places, directions, r] = [new Float32Array(packed), new Int8Array(packed), new Float32Array(radii)];
  const out = { levelEnd, sites: new Float32Array(4 * count), normals: new Float32Array(3 * count) };
  for (let j = 0; j < count; ++j) {
    out.sites.set([places[4 * j], places[4 * j + 1], places[4 * j + 2], r[j]], 4 * j);
    const n = [0, 1, 2].map((c) => directions[16 * j + 12 + c]);
    const size = Math.hypot(...n);
    if (!(size > 0 && r[j] > 0)) fail(`point ${j} has no normal or no radius`);
    out.normals.set(n.map((x) => x / size), 3 * j);
  }
  return { ...out, coefficients: new Float32Array(coefficients) };
}
