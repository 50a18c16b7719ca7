// The light worker: opens one asset, holds its transfer vectors and answers messages.ts.

import { loadDraco } from '../asset/draco_module';
import type { FieldTexels } from '../asset/light_field';
import { addParts, arrivingLight, lightOfStored, type StoredTransfer } from '../asset/kiln_reader';
import { readPacked, unpack, type BakedPrimitive, type Unpacked } from '../asset/unpack';
import { gatherRows, type LightLinks, lightSenders, readVertices, solveNodes } from './links';
import { brightOf, projectEquirect, shrinkEquirect } from './equirect';
import type {
  LampRequest,
  LevelRequest,
  OpenRequest,
  ProjectReply,
  ProjectRequest,
  RelightRequest,
  Reply,
  Request,
  ValuesReply,
} from './messages';
import { coefficientsOf, pickCoefficient, quantile, triangleMeasure } from './transfer';

const kProjectedWidth = 512; // maps are shrunk to this before projection: far above what order 10 resolves
const kShownWidth = 1024;

const kDark = new Float32Array(0);

const decoder = loadDraco(); // begun before there is anything to decode
decoder.catch(() => undefined); // is awaited by open()

let transfer: StoredTransfer; // of the open file
let arriving: StoredTransfer[] = []; // of its matrices
let parts: BakedPrimitive[] = [];
let links: LightLinks | null = null;
let coefficients: Float32Array[] | null = null; // made when a false colour first asks for them

async function open({ file }: OpenRequest): Promise<Pick<Unpacked, 'file' | 'points' | 'progressive' | 'sky' | 'lamps' | 'lobes'>> {
  const unpacked = unpack(await decoder, readPacked(file));
  [transfer, arriving, parts] = [unpacked.transfer, unpacked.arriving, unpacked.baked];
  links = unpacked.links;
  return unpacked;
}

/// It is the page's: nothing here asks for it again.
function takeField(): FieldTexels[] | null {
  const field = parts.flatMap((part) => part.field ?? []);
  for (const part of parts) part.field = null;
  return field.length > 0 ? field : null;
}

/// Place and unit normal of each sample of the senders.
function samplesOf({ samples, sampleNormals }: LightLinks): Float32Array<ArrayBuffer> {
  const out = new Float32Array(1.5 * samples.length);
  for (let k = 0; k < samples.length / 4; ++k) {
    const n = [0, 1, 2].map((c) => sampleNormals[16 * k + 12 + c]);
    const size = Math.hypot(...n) || 1;
    for (let c = 0; c < 3; ++c) [out[6 * k + c], out[6 * k + 3 + c]] = [samples[4 * k + c], n[c] / size];
  }
  return out;
}

function lampLight({ lamp, seen, baked, reuse }: LampRequest): Float32Array[] {
  if (!links) throw new Error('this file has no links for lamps that move');
  const own = baked ? relight({ light: kDark, bright: kDark, lamps: true, reuse: [] }) : [];
  const rows = gatherRows(links, solveNodes(links, lightSenders(links, lamp, seen)));
  let first = 0;
  return parts.map(({ normals }, i) => {
    const to = reuse[i]?.length === normals.length ? reuse[i] : new Float32Array(normals.length);
    readVertices(links!, rows, normals, { first, to });
    first += normals.length / 3;
    if (baked) for (let k = 0; k < to.length; ++k) to[k] += own[i][k];
    return to;
  });
}

function relight({ light, bright, lamps, reuse }: Omit<RelightRequest, 'kind'>): Float32Array[] {
  return parts.map(({ stored }, i) => {
    const values = lightOfStored(transfer, stored, light, lamps, reuse[i]);
    if (bright.length > 0) addParts(values, lightOfStored(transfer, stored, bright, false));
    return values;
  });
}

/// What arrives at the parts that have matrices; nothing for others.
const arrive = (light: Float32Array, lamps: boolean): Float32Array[] =>
  parts.map(({ weights }) =>
    weights.length > 0 ? arrivingLight(arriving, weights, light, lamps) : new Float32Array(0),
  );

/// Lamps count: they are there whatever the sky.
function level({ light, bright }: LevelRequest): number {
  const brightest = relight({ light, bright, lamps: true, reuse: [] }).map((values) =>
    Float32Array.from({ length: values.length / 3 }, (_, v) =>
      Math.max(values[3 * v], values[3 * v + 1], values[3 * v + 2]),
    ),
  );
  return rangeOf(brightest, 0.9);
}

const allCoefficients = (): Float32Array[] => (coefficients ??= parts.map(({ stored }) => coefficientsOf(transfer, stored)));

function measure(weighted: boolean): Float32Array[] {
  return allCoefficients().map((t, i) => triangleMeasure(transfer, t, parts[i].positions, parts[i].indices, weighted));
}

function coefficient(channel: number, slot: number): Float32Array[] {
  return allCoefficients().map((t) => pickCoefficient(transfer, t, channel, slot));
}

async function project(request: ProjectRequest): Promise<ProjectReply> {
  const { readEnvironment } = await import('./read_environment');
  const map = await readEnvironment(request.name, request.file);
  const shrunk = shrinkEquirect(map, kProjectedWidth);
  const bright = brightOf(shrunk);
  return {
    light: projectEquirect(shrunk, request.order),
    bright: bright ? projectEquirect(bright, request.order) : kDark.slice(),
    map: shrinkEquirect(map, kShownWidth),
  };
}

/// Colour scales end at the 99th percentile of the magnitudes over all parts.
function rangeOf(values: Float32Array[], q = 0.99): number {
  const all = new Float32Array(values.reduce((sum, part) => sum + part.length, 0));
  let at = 0;
  for (const part of values) for (const value of part) all[at++] = Math.abs(value);
  return quantile(all, q);
}

function timed(compute: () => Float32Array[], ranged: boolean): ValuesReply {
  const start = performance.now();
  const values = compute();
  const milliseconds = performance.now() - start;
  return { values, arriving: [], range: ranged ? rangeOf(values) : 0, milliseconds };
}

function relit(request: RelightRequest): ValuesReply {
  const start = performance.now();
  const [values, arriving] = [relight(request), arrive(request.light, request.lamps)];
  return { values, arriving, range: 0, milliseconds: performance.now() - start };
}

function compute(request: Exclude<Request, OpenRequest | ProjectRequest>): ValuesReply {
  switch (request.kind) {
    case 'relight':
      return relit(request);
    case 'lamp':
      return timed(() => lampLight(request), false);
    case 'level':
      return { values: [], arriving: [], range: level(request), milliseconds: 0 };
    case 'measure':
      return timed(() => measure(request.weighted), true);
    case 'coefficient':
      return timed(() => coefficient(request.channel, request.slot), true);
  }
}

function send(reply: Reply, give: ArrayBufferLike[] = []): void {
  postMessage(reply, { transfer: give as ArrayBuffer[] });
}

addEventListener('message', async ({ data }: MessageEvent<Request & { serial: number }>) => {
  const { serial } = data;
  try {
    if (data.kind === 'open') {
      const { file: opened, points, progressive, sky, lamps, lobes } = await open(data);
      const samples = links && samplesOf(links);
      const field = takeField();
      const numbers = points ? [points.sites, points.normals, points.coefficients] : [];
      const halves = (field ?? []).map((part) => part.halves);
      const give = [samples, progressive, ...numbers, ...halves, lobes, sky?.texels].filter((one) => one != null);
      send({ serial, opened, samples, field, sky, lamps, lobes, points, progressive }, [opened, ...give.map(({ buffer }) => buffer)]);
    } else if (data.kind === 'project') {
      const projected = await project(data);
      send({ serial, projected }, [projected.light.buffer, projected.bright.buffer, projected.map.data.buffer]);
    } else {
      const values = compute(data);
      send({ serial, values }, [...values.values, ...values.arriving].map((array) => array.buffer));
    }
  } catch (error) {
    send({ serial, failure: error instanceof Error ? error.message : String(error) });
  }
});

send({ serial: 0, begun: true });
