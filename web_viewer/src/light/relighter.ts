// The page's side of the light worker. Owns the worker: dispose() ends it.

import type { FieldTexels } from '../asset/light_field';
import type { FieldLamp } from '../asset/field_lamps';
import type { PointField } from '../asset/point_field';
import type { SkyData } from '../asset/mirrored_sky';
import type { PointLamp } from './links';
import type { ProjectReply, Reply, Request, ValuesReply } from './messages';

/// Coefficients of a light, and of its bright part (empty: none), which is added up apart.
export type LightParts = { light: Float32Array; bright: Float32Array };

type Answer = { resolve(reply: Reply): void; reject(error: Error): void };

export class Relighter {
  private readonly worker = new Worker(new URL('./worker.ts', import.meta.url), { type: 'module' });
  private readonly waiting = new Map<number, Answer>();
  private serial = 0;
  private failure: Error | null = null; // a worker that has stopped answers nothing any more
  /// The worker runs by itself from then on; until then it needs this thread.
  readonly begun: Promise<void>;
  private begin: () => void = () => {};
  /// Of the open file: where lamps that move must be seen from, place and normal (unit cube); null: it has no links.
  samples: Float32Array | null = null;
  /// Its light field, for each part; null: it has none.
  field: FieldTexels[] | null = null;
  /// What that keeps apart; null: nothing.
  sky: SkyData | null = null;
  lamps: FieldLamp[] = [];
  lobes: Float32Array | null = null;
  /// Its light on points; null: it has none.
  points: PointField | null = null;
  /// The bytes of its progressive mesh; null: it has none.
  progressive: Uint8Array<ArrayBuffer> | null = null;

  constructor() {
    this.begun = new Promise((resolve) => (this.begin = resolve));
    this.worker.addEventListener('message', ({ data }: MessageEvent<Reply>) => this.settle(data));
    this.worker.addEventListener('error', (event) =>
      this.failAll(new Error(event.message || 'the light worker stopped')),
    );
  }

  /// Takes the bytes of a scene.glb, and resolves with a GLB without its compression and transfer vectors. Everything below is
  /// about that file then.
  async open(file: ArrayBuffer): Promise<ArrayBuffer> {
    const reply = await this.ask({ kind: 'open', file }, [file]);
    if (!('opened' in reply)) throw new Error('the light worker answered another question');
    ({ samples: this.samples, field: this.field, progressive: this.progressive } = reply);
    ({ sky: this.sky, lamps: this.lamps, lobes: this.lobes, points: this.points } = reply);
    return reply.opened;
  }

  /// Light at every vertex of every part. `reuse`: arrays of an earlier reply that are no longer needed.
  relight(light: LightParts, lamps: boolean, reuse: Float32Array[]): Promise<ValuesReply> {
    return this.values({ kind: 'relight', ...light, lamps, reuse }, buffersOf(reuse));
  }

  /// What a lamp reflects to every vertex of every part. `seen`: a byte for each of the samples; is given away.
  lamp(lamp: PointLamp, seen: Uint8Array<ArrayBuffer>, baked: boolean, reuse: Float32Array[]): Promise<ValuesReply> {
    return this.values({ kind: 'lamp', lamp, seen, baked, reuse }, [seen.buffer, ...buffersOf(reuse)]);
  }

  async level(light: LightParts): Promise<number> {
    return (await this.values({ kind: 'level', ...light })).range;
  }

  measure(weighted: boolean): Promise<ValuesReply> {
    return this.values({ kind: 'measure', weighted });
  }

  coefficient(channel: number, slot: number): Promise<ValuesReply> {
    return this.values({ kind: 'coefficient', channel, slot });
  }

  async project(name: string, file: ArrayBuffer, order: number): Promise<ProjectReply> {
    const reply = await this.ask({ kind: 'project', name, file, order }, []);
    if (!('projected' in reply)) throw new Error('the light worker answered another question');
    return reply.projected;
  }

  dispose(): void {
    this.worker.terminate();
    this.failAll(new DOMException('the viewer was closed', 'AbortError'));
  }

  private async values(request: Request, give: ArrayBuffer[] = []): Promise<ValuesReply> {
    const reply = await this.ask(request, give);
    if (!('values' in reply)) throw new Error('the light worker answered another question');
    return reply.values;
  }

  private ask(request: Request, transfer: ArrayBuffer[]): Promise<Reply> {
    const serial = ++this.serial;
    return new Promise((resolve, reject) => {
      if (this.failure) return reject(this.failure);
      this.waiting.set(serial, { resolve, reject });
      this.worker.postMessage({ ...request, serial }, { transfer });
    });
  }

  private settle(reply: Reply): void {
    if ('begun' in reply) return this.begin();
    const answer = this.waiting.get(reply.serial);
    this.waiting.delete(reply.serial);
    if ('failure' in reply) answer?.reject(new Error(reply.failure));
    else answer?.resolve(reply);
  }

  private failAll(error: Error): void {
    this.failure = error;
    for (const answer of this.waiting.values()) answer.reject(error);
    this.waiting.clear();
  }
}

const buffersOf = (arrays: Float32Array[]): ArrayBuffer[] => [
  ...new Set(arrays.map((array) => array.buffer as ArrayBuffer)),
];
