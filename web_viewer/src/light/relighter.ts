// The page's side of the light worker. Owns the worker: dispose() ends it.

import type { RadianceTransferExtension } from '../asset/kiln_reader';
import type { OpenReply, ProgressReply, ProjectReply, Reply, Request, ValuesReply } from './messages';

type Header = RadianceTransferExtension;
type News = { progress?(news: ProgressReply): void; header?(header: Header): void };
type Answer = { resolve(reply: Reply): void; reject(error: Error): void; news: News };

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
  open(url: string, progress: (news: ProgressReply) => void): { header: Promise<Header>; opened: Promise<OpenReply> } {
    let tell: (header: Header) => void = () => {};
    const opened = this.opened(url, { progress, header: (header) => tell(header) });
    const header = new Promise<Header>((resolve, reject) => {
      tell = resolve;
      opened.catch(reject);
    });
    return { header, opened };
  }

  private async opened(url: string, news: News): Promise<OpenReply> {
    const reply = await this.ask({ kind: 'open', url }, [], news);
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

  private ask(request: Request, give: Float32Array[], news: News = {}): Promise<Reply> {
    const serial = ++this.serial;
    const transfer = [...new Set(give.map((array) => array.buffer))];
    return new Promise((resolve, reject) => {
      if (this.failure) return reject(this.failure);
      this.waiting.set(serial, { resolve, reject, news });
      this.worker.postMessage({ ...request, serial }, { transfer });
    });
  }

  private settle(reply: Reply): void {
    const answer = this.waiting.get(reply.serial);
    if ('progress' in reply) return answer?.news.progress?.(reply.progress);
    if ('header' in reply) return answer?.news.header?.(reply.header);
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
