// A lit mesh at every level of detail, from the bytes of KILN_progressive_mesh (core/lightfield/README.md).
// Level k is the base and k splits. Nothing is added up: each level has the bits of core/lightfield/progressive_mesh.h.

import { kMostLamps } from '../asset/field_lamps';
import { kVisibilityCount } from '../asset/mirrored_sky';

/// Numbers of each vertex (or row): an array and how many of its elements a vertex has.
interface Column {
  values: Float32Array;
  width: number;
}

interface Header {
  degree: number;
  has: number;
  baseVertices: number;
  baseTriangles: number;
  vertices: number;
  triangles: number;
  splits: number;
  turned: number;
  moved: number;
  rank: number; // of light, 0: floats
  wide: number; // so many weights have 16 bits, the others 8
}

const kName = 'KILN_progressive_mesh';
const kMagic = 0x4d504b32;
const kHeader = 48; // bytes
const kSplit = 5; // words: counts, turned corners, two parents, error
const kParents = 2;
const kError = 4;
const kMostNew = 6; // vertices of a split
const kMostDegree = 8;
const kPart = 16; // of `has`
const kALamp = 64; // times the number of lamps, below kDiffuse
const kDiffuse = 1024;
const kOptional = [
  { bit: 1, name: 'uv0', width: 2 },
  { bit: 2, name: 'uv1', width: 2 },
  { bit: 4, name: 'color', width: 4 },
  { bit: 8, name: 'tangent', width: 4 },
  { bit: 32, name: 'visibility', width: kVisibilityCount },
] as const;

const lampsOf = (has: number): number => Math.floor((has % kDiffuse) / kALamp);

function fail(what: string): never {
  throw new Error(`${kName}: ${what}`);
}

function readHeader(buffer: ArrayBuffer): Header {
  if (buffer.byteLength < kHeader || buffer.byteLength % 4 !== 0) fail('the header is not whole');
  const [magic, degree, has, baseVertices, baseTriangles, vertices, triangles, splits, turned, moved, rank, wide] = new Uint32Array(
    buffer,
    0,
    kHeader / 4,
  );
  if (magic !== kMagic || degree > kMostDegree || lampsOf(has) > kMostLamps || has >= 2 * kDiffuse || rank > 3 * (degree + 1) ** 2 || wide > rank)
    fail('the version is not known');
  return { degree, has, baseVertices, baseTriangles, vertices, triangles, splits, turned, moved, rank, wide };
}

/// Columns of vertices in the order of the file.
function columnsOf(h: Header): { name: string; width: number }[] {
  const lamps = lampsOf(h.has);
  return [
    { name: 'position', width: 3 },
    { name: 'normal', width: 3 },
    ...kOptional.filter(({ bit }) => h.has & bit),
    ...(lamps > 0 ? [{ name: 'lamps', width: lamps }] : []),
    ...(h.has & kDiffuse ? [{ name: 'diffuse', width: 3 }] : []),
    { name: 'coefficients', width: 3 * (h.degree + 1) ** 2 },
  ];
}

/// Codes of vertices: of the first weights, then of the others.
interface Codes {
  wide: Uint16Array;
  narrow: Uint8Array;
}

/// How light comes from codes: weight k is offset[k] + scale[k] code, and light the mean and the rows by their weights.
interface LightForm {
  scale: Float32Array;
  offset: Float32Array;
  rows: Float32Array; // the mean, then one for each weight
}

/// Sums in the order of core/lightfield/progressive_bytes.cpp, in double, rounded once: the same bits.
function decodeLight({ rank, wide }: Header, form: LightForm, codes: Codes, vertices: number): Float32Array {
  const { scale, offset } = form;
  const rows = Float64Array.from(form.rows);
  const width = rows.length / (rank + 1);
  const out = new Float32Array(width * vertices);
  const sum = new Float64Array(width);
  for (let v = 0; v < vertices; ++v) {
    sum.set(rows.subarray(0, width));
    for (let k = 0; k < rank; ++k) {
      const code = k < wide ? codes.wide[wide * v + k] : codes.narrow[(rank - wide) * v + k - wide];
      const weight = offset[k] + scale[k] * code;
      const first = (k + 1) * width;
      for (let s = 0; s < width; ++s) sum[s] += weight * rows[first + s];
    }
    out.set(sum, width * v);
  }
  return out;
}

export class ProgressiveMesh {
  readonly degree: number;
  /// Of all vertices, by name; those of the current level stand first. Absent attributes are absent.
  readonly columns: ReadonlyMap<string, Column>;
  /// Corners of all triangles; those of the current level stand first.
  readonly triangles: Uint32Array;
  readonly part: Uint32Array;
  readonly levels: number;
  vertexCount: number;
  triangleCount: number;
  level = 0;
  /// Vertices whose numbers have changed since somebody emptied this.
  readonly touched = new Set<number>();

  private readonly splits: Uint32Array;
  private readonly errors: Float32Array;
  private readonly turned: Uint32Array;
  private readonly movedVertex: Uint32Array;
  private readonly moved: Column[]; // rows that change places with those of vertices as splits come and go
  private nextTurned = 0;
  private nextMoved = 0;

  /// Copies what it needs. Throws, in words, on what does not fit together.
  constructor(bytes: Uint8Array) {
    const buffer = bytes.slice().buffer as ArrayBuffer;
    const h = readHeader(buffer);
    const columns = columnsOf(h);
    const light = columns[columns.length - 1].width;
    const width = columns.reduce((sum, c) => sum + c.width, 0) - (h.rank > 0 ? light : 0);
    const wideWords = (count: number) => Math.ceil((h.wide * count) / 2);
    const narrowWords = (count: number) => Math.ceil(((h.rank - h.wide) * count) / 4);
    const codeWords = (count: number) => wideWords(count) + narrowWords(count);
    const words =
      kHeader / 4 +
      (h.rank > 0 ? 2 * h.rank + (h.rank + 1) * light : 0) +
      width * (h.vertices + h.moved) +
      codeWords(h.vertices) +
      codeWords(h.moved) +
      h.triangles * (h.has & kPart ? 4 : 3) +
      kSplit * h.splits +
      h.turned +
      h.moved;
    if (4 * words !== buffer.byteLength) fail(`there are ${buffer.byteLength} bytes and not ${4 * words}`);
    let at = kHeader;
    const floats = (count: number) => new Float32Array(buffer, (at += 4 * count) - 4 * count, count);
    const integers = (count: number) => new Uint32Array(buffer, (at += 4 * count) - 4 * count, count);
    const codes = (count: number): Codes => ({
      wide: new Uint16Array(buffer, (at += 4 * wideWords(count)) - 4 * wideWords(count), h.wide * count),
      narrow: new Uint8Array(buffer, (at += 4 * narrowWords(count)) - 4 * narrowWords(count), (h.rank - h.wide) * count),
    });
    const form = { scale: floats(h.rank), offset: floats(h.rank), rows: floats(h.rank > 0 ? (h.rank + 1) * light : 0) };
    const column = (c: { name: string; width: number }, count: number): Column => ({
      values: h.rank > 0 && c.name === 'coefficients' ? decodeLight(h, form, codes(count), count) : floats(c.width * count),
      width: c.width,
    });
    this.degree = h.degree;
    this.columns = new Map(columns.map((c) => [c.name, column(c, h.vertices)]));
    this.triangles = integers(3 * h.triangles);
    this.part = integers(h.has & kPart ? h.triangles : 0);
    this.splits = integers(kSplit * h.splits);
    this.errors = new Float32Array(buffer, this.splits.byteOffset, this.splits.length);
    this.turned = integers(h.turned);
    this.movedVertex = integers(h.moved);
    this.moved = columns.map((c) => column(c, h.moved));
    this.levels = h.splits + 1;
    this.vertexCount = h.baseVertices;
    this.triangleCount = h.baseTriangles;
    this.check(h);
  }

  /// Of a level: an estimate of the relative RMS error against the finest one.
  error(level: number): number {
    return level + 1 < this.levels ? this.errors[kSplit * level + kError] : 0;
  }

  /// The largest magnitude that a column has at any level.
  largest(name: string): number {
    const at = [...this.columns.keys()].indexOf(name);
    let most = 0;
    for (const { values } of [this.columns.get(name)!, this.moved[at]])
      for (const value of values) most = Math.max(most, Math.abs(value));
    return most;
  }

  /// Takes as many steps as lie between the current level and this one.
  goTo(level: number): void {
    const wanted = Math.max(0, Math.min(this.levels - 1, Math.round(level)));
    while (this.level < wanted) this.split();
    while (this.level > wanted) this.collapse();
  }

  private counts(split: number) {
    const [counts, turned] = [this.splits[kSplit * split], this.splits[kSplit * split + 1]];
    return { vertices: counts & 7, triangles: (counts >>> 3) & 3, pairs: (counts >>> 5) & 3, moved: counts >>> 7, turned };
  }
  private parent(split: number, i: number): number {
    return this.splits[kSplit * split + kParents + i];
  }

  private split(): void {
    const { vertices, triangles, moved, turned } = this.counts(this.level);
    for (let k = 0; k < moved; ++k) this.swap(this.nextMoved++);
    for (let k = 0; k < turned; ++k) {
      const which = this.turned[this.nextTurned++];
      this.turn(which >>> 1, this.parent(this.level, which & 1), this.vertexCount + (which & 1));
    }
    this.vertexCount += vertices;
    this.triangleCount += triangles;
    ++this.level;
  }

  /// Undoes the last split, step by step the other way.
  private collapse(): void {
    --this.level;
    const { vertices, triangles, moved, turned } = this.counts(this.level);
    this.vertexCount -= vertices;
    this.triangleCount -= triangles;
    for (let k = 0; k < turned; ++k) {
      const which = this.turned[--this.nextTurned];
      this.turn(which >>> 1, this.vertexCount + (which & 1), this.parent(this.level, which & 1));
    }
    for (let k = 0; k < moved; ++k) this.swap(--this.nextMoved);
  }

  private turn(triangle: number, from: number, to: number): void {
    for (let c = 3 * triangle; c < 3 * triangle + 3; ++c) if (this.triangles[c] === from) this.triangles[c] = to;
  }

  private swap(row: number): void {
    const vertex = this.movedVertex[row];
    this.touched.add(vertex);
    let column = 0;
    for (const { values, width } of this.columns.values()) {
      const other = this.moved[column++].values;
      for (let i = 0; i < width; ++i) {
        const kept = values[width * vertex + i];
        values[width * vertex + i] = other[width * row + i];
        other[width * row + i] = kept;
      }
    }
  }

  private checkTriangles(first: number, end: number, vertices: number, where: string): void {
    for (let t = first; t < end; ++t) {
      const [a, b, c] = this.triangles.subarray(3 * t, 3 * t + 3);
      if (Math.max(a, b, c) >= vertices || a === b || b === c || c === a)
        fail(`${where}: triangle ${t} has no three corners among the vertices of its level`);
    }
  }

  /// Follows all splits once, then goes back to the base.
  private check(h: Header): void {
    const finite = (values: Float32Array) => values.every(Number.isFinite);
    if (![...this.columns.values(), ...this.moved].every((c) => finite(c.values))) fail('a number is not finite');
    if (h.baseVertices > h.vertices || h.baseTriangles > h.triangles) fail('the base is larger than the whole');
    this.checkTriangles(0, h.baseTriangles, h.baseVertices, 'base');
    let before = Infinity;
    for (let s = 0; s < h.splits; ++s) {
      const { vertices, triangles, pairs, moved, turned } = this.counts(s);
      const where = `split ${s}`;
      const error = this.error(s);
      if (pairs < 1 || pairs > 2 || vertices < pairs || vertices > kMostNew || triangles < 1 || triangles > 2)
        fail(`${where}: it brings too few or many`);
      if (!(error >= 0 && error <= before)) fail(`${where}: errors do not fall`);
      before = error;
      for (let i = 0; i < pairs; ++i)
        if (this.parent(s, i) >= this.vertexCount + vertices) fail(`${where}: a parent is not there yet`);
      if (
        this.vertexCount + vertices > h.vertices ||
        this.triangleCount + triangles > h.triangles ||
        this.nextTurned + turned > h.turned ||
        this.nextMoved + moved > h.moved
      )
        fail(`${where}: there are fewer vertices, triangles, corners or rows than splits need`);
      for (let k = this.nextMoved; k < this.nextMoved + moved; ++k)
        if (this.movedVertex[k] >= this.vertexCount + vertices) fail(`${where}: a moved vertex is not there yet`);
      for (let k = this.nextTurned; k < this.nextTurned + turned; ++k) {
        const [triangle, i] = [this.turned[k] >>> 1, this.turned[k] & 1];
        const at = this.triangles.subarray(3 * triangle, 3 * triangle + 3);
        if (triangle >= this.triangleCount || i >= pairs || !at.includes(this.parent(s, i)))
          fail(`${where}: a turned corner is not there`);
      }
      const first = this.triangleCount;
      this.split();
      this.checkTriangles(first, this.triangleCount, this.vertexCount, where);
    }
    if (
      this.vertexCount !== h.vertices ||
      this.triangleCount !== h.triangles ||
      this.nextTurned !== h.turned ||
      this.nextMoved !== h.moved
    )
      fail('there are more vertices, triangles, corners or rows than splits use');
    this.goTo(0);
  }
}
