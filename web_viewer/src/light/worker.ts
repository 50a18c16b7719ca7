// The light worker: opens one asset, holds its transfer vectors and answers messages.ts.

import { download } from '../asset/download';
import { loadDraco } from '../asset/draco_module';
import { readPacked, unpack, type BakedPrimitive } from '../asset/unpack';
import { projectEquirect, shrinkEquirect } from './equirect';
import type { OpenRequest, ProjectReply, ProjectRequest, Reply, Request, ValuesReply } from './messages';
import {
  coefficientsOf,
  pickCoefficient,
  quantile,
  relight,
  triangleMeasure,
  type TransferForm,
} from './transfer';

const kProjectedWidth = 512; // maps are shrunk to this before projection: far above what order 10 resolves
const kShownWidth = 1024;
const kNewsEvery = 100; // ms between two pieces of news of the download: each is a repaint

const decoder = loadDraco(); // begun before there is anything to decode
decoder.catch(() => undefined); // is awaited by open()

let form: TransferForm = { order: 0, channels: 1, fixed: false, slots: 0 };
let parts: BakedPrimitive[] = [];
let coefficients: Float32Array[] | null = null; // made when a false colour first asks for them

async function open({ url }: OpenRequest, serial: number): Promise<void> {
  let next = 0;
  const downloaded = await download(url, (loaded, total) => {
    if (performance.now() < next) return;
    next = performance.now() + kNewsEvery;
    send({ serial, progress: { loaded, total } });
  });
  const packed = readPacked(downloaded);
  send({ serial, header: packed.extension });
  const unpacked = unpack(await decoder, packed);
  const { file } = unpacked;
  [form, parts] = [unpacked.form, unpacked.baked];
  send({ serial, opened: { file, bytes: downloaded.byteLength } }, [file]);
}

/// Lamps count: they are there whatever the sky.
function level(light: Float32Array): number {
  const brightest = parts.map((p) => {
    const values = relight(form, p.numbers, light, true);
    return Float32Array.from({ length: values.length / 3 }, (_, v) =>
      Math.max(values[3 * v], values[3 * v + 1], values[3 * v + 2]),
    );
  });
  return rangeOf(brightest, 0.9);
}

const allCoefficients = (): Float32Array[] => (coefficients ??= parts.map((p) => coefficientsOf(form, p.numbers)));

function measure(weighted: boolean): Float32Array[] {
  return allCoefficients().map((t, i) => triangleMeasure(form, t, parts[i].positions, parts[i].indices, weighted));
}

function coefficient(channel: number, slot: number): Float32Array[] {
  return allCoefficients().map((t) => pickCoefficient(form, t, channel, slot));
}

async function project(request: ProjectRequest): Promise<ProjectReply> {
  const { readEnvironment } = await import('./read_environment');
  const map = await readEnvironment(request.name, request.file);
  const light = projectEquirect(shrinkEquirect(map, kProjectedWidth), request.order);
  return { light, map: shrinkEquirect(map, kShownWidth) };
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
  return { values, range: ranged ? rangeOf(values) : 0, milliseconds };
}

function compute(request: Exclude<Request, OpenRequest | ProjectRequest>): ValuesReply {
  switch (request.kind) {
    case 'relight':
      return timed(
        () => parts.map((p, i) => relight(form, p.numbers, request.light, request.lamps, request.reuse[i])),
        false,
      );
    case 'level':
      return { values: [], range: level(request.light), milliseconds: 0 };
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
      await open(data, serial);
    } else if (data.kind === 'project') {
      const projected = await project(data);
      send({ serial, projected }, [projected.light.buffer, projected.map.data.buffer]);
    } else {
      const values = compute(data);
      send({ serial, values }, values.values.map((array) => array.buffer));
    }
  } catch (error) {
    send({ serial, failure: error instanceof Error ? error.message : String(error) });
  }
});
