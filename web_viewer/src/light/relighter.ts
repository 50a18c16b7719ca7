// The page's side of the light worker. Owns the worker: dispose() ends it.

import type { OpenReply, ProgressReply, ProjectReply, Reply, Request, ValuesReply } from './messages';

type Progress = (news: ProgressReply) => void;
type Answer = { resolve(reply: Reply): void; reject(error: Error): void; progress?: Progress };

export class Relighter {
  private readonly worker = new Worker(new URL('./worker.ts', import.meta.url), { type: 'module' });
  private readonly waiting = new Map<number, Answer>();
  private serial = 0;
  private failure: Error | null = null; // a worker that has stopped answers nothing any more

  constructor() {
    this.worker.addEventListener('message', ({ data }: MessageEvent<Reply>) => this.settle(data));
    this.worker.addEventListener('error', (event) =>
      this.failAll(new Error(event.message || 'the light worker stopped')),
    );
  }

  /// The worker fetches the scene.glb at `url`: everything below is about that file then.
  async open(url: string, progress: Progress): Promise<OpenReply> {
    const reply = await this.ask({ kind: 'open', url }, [], progress);
    if (!('opened' in reply)) throw new Error('the light worker answered another question');
    return reply.opened;
  }

  /// Light at every vertex of every part. `reuse`: arrays of an earlier reply that are no longer needed.
  relight(light: Float32Array, lamps: boolean, reuse: Float32Array[]): Promise<ValuesReply> {
    return this.values({ kind: 'relight', light, lamps, reuse }, reuse);
  }

  async level(light: Float32Array): Promise<number> {
    return (await this.values({ kind: 'level', light })).range;
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

  private async values(request: Request, give: Float32Array[] = []): Promise<ValuesReply> {
    const reply = await this.ask(request, give);
    if (!('values' in reply)) throw new Error('the light worker answered another question');
    return reply.values;
  }

  private ask(request: Request, give: Float32Array[], progress?: Progress): Promise<Reply> {
    const serial = ++this.serial;
    const transfer = [...new Set(give.map((array) => array.buffer))];
    return new Promise((resolve, reject) => {
      if (this.failure) return reject(this.failure);
      this.waiting.set(serial, { resolve, reject, progress });
      this.worker.postMessage({ ...request, serial }, { transfer });
    });
  }

  private settle(reply: Reply): void {
    const answer = this.waiting.get(reply.serial);
    if ('progress' in reply) return answer?.progress?.(reply.progress);
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
