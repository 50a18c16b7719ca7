// The light worker: holds the transfer vectors of one asset and answers messages.ts.

import { projectEquirect, shrinkEquirect } from './equirect';
import type { LoadRequest, ProjectReply, ProjectRequest, Reply, Request, ValuesReply } from './messages';
import { decodeAttributes, pickCoefficient, quantile, relight, triangleMeasure, type TransferShape } from './transfer';

interface Part {
  coefficients: Float32Array;
  positions: Float32Array;
  indices: Uint32Array;
}

const kProjectedWidth = 512; // maps are shrunk to this before projection: far above what order 10 resolves
const kShownWidth = 1024;

let shape: TransferShape = { order: 0, channels: 1, fixed: false, slots: 0 };
let parts: Part[] = [];

function load(request: LoadRequest): Float32Array[] {
  shape = request.shape;
  parts = request.parts.map(({ attributes, positions, indices }) => ({
    coefficients: decodeAttributes(shape, attributes, request.scale, request.offset),
    positions,
    indices,
  }));
  return [];
}

/// Lamps count: they are there whatever the sky.
function level(light: Float32Array): number {
  const brightest = parts.map((p) => {
    const values = relight(shape, p.coefficients, light, true);
    return Float32Array.from({ length: values.length / 3 }, (_, v) =>
      Math.max(values[3 * v], values[3 * v + 1], values[3 * v + 2]),
    );
  });
  return rangeOf(brightest, 0.9);
}

function measure(weighted: boolean): Float32Array[] {
  return parts.map((p) => triangleMeasure(shape, p.coefficients, p.positions, p.indices, weighted));
}

function coefficient(channel: number, slot: number): Float32Array[] {
  return parts.map((p) => pickCoefficient(shape, p.coefficients, channel, slot));
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

function compute(request: Exclude<Request, ProjectRequest>): ValuesReply {
  switch (request.kind) {
    case 'load':
      return timed(() => load(request), false);
    case 'relight':
      return timed(
        () => parts.map((p, i) => relight(shape, p.coefficients, request.light, request.lamps, request.reuse[i])),
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

function send(reply: Reply, buffers: Float32Array[]): void {
  postMessage(reply, { transfer: buffers.map((array) => array.buffer) });
}

addEventListener('message', async ({ data }: MessageEvent<Request & { serial: number }>) => {
  const { serial } = data;
  try {
    if (data.kind === 'project') {
      const projected = await project(data);
      send({ serial, projected }, [projected.light, projected.map.data]);
    } else {
      const values = compute(data);
      send({ serial, values }, values.values);
    }
  } catch (error) {
    send({ serial, failure: error instanceof Error ? error.message : String(error) }, []);
  }
});
