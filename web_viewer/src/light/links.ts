// Reflected light of a lamp that moves, from the links of KILN_meshless_light (core/artifact/README.md). Stands alone.
//   e = mean over a sender's samples of intensity cos / (pi d^2), seen ones only
//   x = e + T x, `sweeps` times, then the tail;  a receiver has sum of value (1 + n . aside) x[node]
// Lengths of the unit cube, values irradiance / pi. core/meshless/light_links.h is the same in C++.

/// The arrays of the extension, as they lie in the file.
export interface LightLinks {
  senders: number;
  sweeps: number;
  tail: number;
  sampleBegin: Uint32Array;
  samples: Float32Array; // x, y, z of each; the fourth is the normal's bytes
  sampleNormals: Int8Array; // 16 bytes a sample: x, y, z at 12, 13, 14
  childBegin: Uint32Array;
  children: Uint16Array; // node, share
  scale: Float32Array; // of each row
  linkBegin: Uint32Array;
  linkNodes: Uint16Array; // 8 bytes a link: node at 0
  linkBytes: Uint8Array; // value at 2, 3, 4; aside at 5, 6, 7
  linkAsides: Int8Array;
  termBegin: Uint32Array;
  termRows: Uint32Array;
  termWeights: Uint8Array;
}

export interface LinksExtension {
  version: number;
  senders: number;
  nodes: number;
  rows: number;
  vertices: number;
  sweeps: number;
  tail: number;
  bufferViews: Record<string, number>;
}

/// A point lamp.
export interface PointLamp {
  place: readonly [number, number, number];
  intensity: readonly [number, number, number];
}

const kName = 'KILN_meshless_light';
const kMostNodes = 65536;

/// `bytesOf` gives the bytes of a buffer view. Throws, in words, on what does not fit together.
export function readLinks(e: LinksExtension, bytesOf: (view: number) => Uint8Array): LightLinks {
  if (e.version !== 1) throw new Error(`${kName}: version ${e.version} is not known`);
  const bytes = (name: string) => (e.bufferViews?.[name] === undefined ? new Uint8Array(0) : bytesOf(e.bufferViews[name]).slice());
  const whole = <T>(name: string, make: (buffer: ArrayBuffer) => T): T => make(bytes(name).buffer as ArrayBuffer);
  const words = (name: string) => whole(name, (b) => new Uint32Array(b));
  const links = bytes('links').buffer as ArrayBuffer;
  const samples = bytes('samples').buffer as ArrayBuffer;
  const out: LightLinks = {
    senders: e.senders,
    sweeps: e.sweeps,
    tail: e.tail,
    sampleBegin: words('sampleBegin'),
    samples: new Float32Array(samples),
    sampleNormals: new Int8Array(samples),
    childBegin: words('childBegin'),
    children: whole('children', (b) => new Uint16Array(b)),
    scale: whole('scale', (b) => new Float32Array(b)),
    linkBegin: words('linkBegin'),
    linkNodes: new Uint16Array(links),
    linkBytes: new Uint8Array(links),
    linkAsides: new Int8Array(links),
    termBegin: words('termBegin'),
    termRows: words('termRows'),
    termWeights: bytes('termWeights'),
  };
  check(e, out);
  return out;
}

function check(e: LinksExtension, l: LightLinks): void {
  const fail = (what: string) => {
    throw new Error(`${kName}: ${what}`);
  };
  const ascends = (begin: Uint32Array, count: number, end: number) =>
    begin.length === count + 1 && begin[0] === 0 && begin[count] === end && begin.every((b, i) => i === 0 || b >= begin[i - 1]);
  if (!(e.nodes <= kMostNodes && e.senders <= e.nodes && e.sweeps <= 1000 && e.tail >= 0 && e.tail <= 1e4))
    fail('senders, nodes, sweeps or tail are out of range');
  if (!ascends(l.sampleBegin, e.senders, l.samples.length / 4)) fail('the samples do not fit the senders');
  if (!ascends(l.childBegin, e.nodes - e.senders, l.children.length / 2)) fail('the children do not fit the nodes');
  if (l.scale.length !== e.rows || e.rows < e.senders || !ascends(l.linkBegin, e.rows, l.linkBytes.length / 8))
    fail('the links do not fit the rows');
  if (!ascends(l.termBegin, e.vertices, l.termRows.length) || l.termRows.length !== l.termWeights.length)
    fail('the readings do not fit the vertices');
  for (let i = 0; i < e.nodes - e.senders; ++i)
    for (let k = l.childBegin[i]; k < l.childBegin[i + 1]; ++k)
      if (l.children[2 * k] >= e.senders + i || l.children[2 * k + 1] === 0) fail('a node is not above its children');
  for (let k = 0; k < l.linkNodes.length; k += 4) if (l.linkNodes[k] >= e.nodes) fail('a link ends past the nodes');
  for (const row of l.termRows) if (row >= e.rows) fail('a vertex reads past the rows');
}

const nodesOf = (l: LightLinks): number => l.senders + Math.max(0, l.childBegin.length - 1);

/// Equation 1. `seen`: a byte for each sample, 0 where the lamp does not reach it.
export function lightSenders(l: LightLinks, { place, intensity }: PointLamp, seen: Uint8Array): Float32Array {
  const out = new Float32Array(3 * nodesOf(l));
  for (let s = 0; s < l.senders; ++s) {
    const [first, last] = [l.sampleBegin[s], l.sampleBegin[s + 1]];
    let sum = 0;
    for (let k = first; k < last; ++k) {
      if (seen[k] === 0) continue;
      const [x, y, z] = [place[0] - l.samples[4 * k], place[1] - l.samples[4 * k + 1], place[2] - l.samples[4 * k + 2]];
      const n = 16 * k + 12;
      const [a, b, c] = [l.sampleNormals[n], l.sampleNormals[n + 1], l.sampleNormals[n + 2]];
      const along = x * a + y * b + z * c;
      const d2 = x * x + y * y + z * z;
      if (along > 0) sum += along / (Math.sqrt(a * a + b * b + c * c) * d2 * Math.sqrt(d2));
    }
    const share = last > first ? sum / ((last - first) * Math.PI) : 0;
    for (let c = 0; c < 3; ++c) out[3 * s + c] = intensity[c] * share;
  }
  return out;
}

// The loops below run over a million links for each place of a lamp: no destructuring, nothing is allocated in them.

/// Nodes above the senders: the shares of their children.
function climb(l: LightLinks, x: Float32Array): void {
  const { childBegin, children } = l;
  for (let i = 0; i + 1 < childBegin.length; ++i) {
    let r = 0;
    let g = 0;
    let b = 0;
    let all = 0;
    for (let k = childBegin[i]; k < childBegin[i + 1]; ++k) {
      const node = 3 * children[2 * k];
      const share = children[2 * k + 1];
      r += share * x[node];
      g += share * x[node + 1];
      b += share * x[node + 2];
      all += share;
    }
    const at = 3 * (l.senders + i);
    x[at] = r / all;
    x[at + 1] = g / all;
    x[at + 2] = b / all;
  }
}

/// One more reflection among the senders: next = direct + T x.
function sweepOnce(l: LightLinks, direct: Float32Array, x: Float32Array, next: Float32Array): void {
  const { linkBegin, linkNodes, linkBytes, scale } = l;
  for (let s = 0; s < l.senders; ++s) {
    let r = 0;
    let g = 0;
    let b = 0;
    const end = linkBegin[s + 1];
    for (let k = linkBegin[s]; k < end; ++k) {
      const node = 3 * linkNodes[4 * k];
      const at = 8 * k;
      r += linkBytes[at + 2] * x[node];
      g += linkBytes[at + 3] * x[node + 1];
      b += linkBytes[at + 4] * x[node + 2];
    }
    const by = scale[s] / 255;
    next[3 * s] = direct[3 * s] + by * r;
    next[3 * s + 1] = direct[3 * s + 1] + by * g;
    next[3 * s + 2] = direct[3 * s + 2] + by * b;
  }
}

/// Equations 2 to 4: all light at the nodes. `direct` as lightSenders gives it.
export function solveNodes(l: LightLinks, direct: Float32Array): Float32Array {
  const x = direct.slice();
  const before = new Float32Array(3 * l.senders);
  const next = new Float32Array(3 * l.senders);
  climb(l, x);
  for (let sweep = 0; sweep < l.sweeps; ++sweep) {
    before.set(x.subarray(0, before.length));
    sweepOnce(l, direct, x, next);
    x.set(next);
    climb(l, x);
  }
  if (l.sweeps > 0 && l.tail > 0) {
    for (let i = 0; i < before.length; ++i) x[i] += l.tail * (x[i] - before[i]);
    climb(l, x);
  }
  return x;
}

const kRow = 12; // value of red, green and blue, then the turn of each

/// Equation 5 at the rows that vertices read, before the normal comes in: 12 numbers each.
export function gatherRows(l: LightLinks, x: Float32Array): Float32Array {
  const { linkBegin, linkNodes, linkBytes, linkAsides, scale } = l;
  const rows = scale.length;
  const out = new Float32Array(kRow * rows);
  for (let row = l.senders; row < rows; ++row) {
    let r = 0;
    let g = 0;
    let b = 0;
    let rx = 0;
    let ry = 0;
    let rz = 0;
    let gx = 0;
    let gy = 0;
    let gz = 0;
    let bx = 0;
    let by = 0;
    let bz = 0;
    const end = linkBegin[row + 1];
    for (let k = linkBegin[row]; k < end; ++k) {
      const node = 3 * linkNodes[4 * k];
      const at = 8 * k;
      const vr = linkBytes[at + 2] * x[node];
      const vg = linkBytes[at + 3] * x[node + 1];
      const vb = linkBytes[at + 4] * x[node + 2];
      const ax = linkAsides[at + 5];
      const ay = linkAsides[at + 6];
      const az = linkAsides[at + 7];
      r += vr;
      g += vg;
      b += vb;
      rx += vr * ax;
      ry += vr * ay;
      rz += vr * az;
      gx += vg * ax;
      gy += vg * ay;
      gz += vg * az;
      bx += vb * ax;
      by += vb * ay;
      bz += vb * az;
    }
    const value = scale[row] / 255;
    const turn = value / 16;
    const o = kRow * row;
    out[o] = value * r;
    out[o + 1] = value * g;
    out[o + 2] = value * b;
    out[o + 3] = turn * rx;
    out[o + 4] = turn * ry;
    out[o + 5] = turn * rz;
    out[o + 6] = turn * gx;
    out[o + 7] = turn * gy;
    out[o + 8] = turn * gz;
    out[o + 9] = turn * bx;
    out[o + 10] = turn * by;
    out[o + 11] = turn * bz;
  }
  return out;
}

/// What vertices `first` and on read, one for each normal: RGB of a white surface. Written to `to`.
export function readVertices(
  l: LightLinks,
  rows: Float32Array,
  normals: Float32Array,
  { first, to }: { first: number; to: Float32Array },
): void {
  const { termBegin, termRows, termWeights } = l;
  for (let v = 0; 3 * v < normals.length; ++v) {
    const x = normals[3 * v];
    const y = normals[3 * v + 1];
    const z = normals[3 * v + 2];
    let r = 0;
    let g = 0;
    let b = 0;
    const end = termBegin[first + v + 1];
    for (let k = termBegin[first + v]; k < end; ++k) {
      const o = kRow * termRows[k];
      const weight = termWeights[k] / 255;
      r += weight * Math.max(0, rows[o] + x * rows[o + 3] + y * rows[o + 4] + z * rows[o + 5]);
      g += weight * Math.max(0, rows[o + 1] + x * rows[o + 6] + y * rows[o + 7] + z * rows[o + 8]);
      b += weight * Math.max(0, rows[o + 2] + x * rows[o + 9] + y * rows[o + 10] + z * rows[o + 11]);
    }
    to[3 * v] = r;
    to[3 * v + 1] = g;
    to[3 * v + 2] = b;
  }
}
