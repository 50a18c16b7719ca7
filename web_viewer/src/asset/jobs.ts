// What kilnd says about jobs, and the requests the pages make. contract.md section 3.

export type Status = 'queued' | 'running' | 'succeeded' | 'failed' | 'canceled';
export const kStatuses: readonly Status[] = ['queued', 'running', 'succeeded', 'failed', 'canceled'];

export interface Progress {
  stage: string;
  done: number;
  total: number;
  fraction: number;
  eta_s: number | null;
  error?: number; // that the last pass of a promise was certified with
}

export interface Problem {
  type?: string;
  title?: string;
  status?: number;
  detail?: string;
  where?: string;
  request_id?: string;
  errors?: { pointer: string; detail: string }[];
}

export interface Artifact {
  name: string;
  bytes: number;
  sha256: string;
  media_type: string;
  url: string;
}

export interface Job {
  id: string;
  label: string;
  status: Status;
  created_at: string;
  started_at: string | null;
  finished_at: string | null;
  attempt: number;
  cached: boolean;
  recipe: Record<string, unknown>;
  progress: Progress | null;
  error: Problem | null;
  artifacts: Artifact[];
}

/// One thing that happened to a job.
export interface JobEvent {
  id: number;
  at: string;
  kind: 'state' | 'log' | 'artifact' | 'done';
  status: Status; // after it
  message: string;
}

export interface Preset {
  name: string;
  description: string;
}

/// A refusal in the server's own words.
export class RequestFailed extends Error {}

const path = (id: string): string => `/v1/jobs/${encodeURIComponent(id)}`;

export const finished = (job: Job): boolean => job.status !== 'queued' && job.status !== 'running';
export const artifact = (job: Job, name: string): Artifact | undefined => job.artifacts?.find((a) => a.name === name);
export const artifactUrl = (job: Job, name: string): string => `${path(job.id)}/artifacts/${encodeURIComponent(name)}`;

/// Every mistake in one sentence each, for people.
export function explain(problem: Problem | null): string {
  if (!problem) return '';
  const errors = (problem.errors ?? []).map((e) => `${e.pointer || '/'}: ${e.detail}`);
  const first = problem.detail || problem.title || 'no reason was given';
  return [problem.where ? `${problem.where}: ${first}` : first, ...errors].join('\n');
}

async function request(method: string, url: string, init: RequestInit = {}): Promise<unknown> {
  const response = await fetch(url, { method, headers: { Accept: 'application/json' }, ...init });
  const text = await response.text();
  if (response.ok) return text ? JSON.parse(text) : undefined;
  throw new RequestFailed(refusal(response.status, text));
}

function refusal(status: number, text: string): string {
  try {
    return explain(JSON.parse(text) as Problem);
  } catch {
    return `the server answered ${status}`;
  }
}

export interface JobPage {
  jobs: Job[];
  next_cursor: string | null;
}

export function listJobs(query: { status?: string; label?: string; cursor?: string }): Promise<JobPage> {
  const parameters = new URLSearchParams({ limit: '48' });
  for (const [key, value] of Object.entries(query)) if (value) parameters.set(key, value);
  return request('GET', `/v1/jobs?${parameters}`) as Promise<JobPage>;
}

export const getJob = (id: string): Promise<Job> => request('GET', path(id)) as Promise<Job>;
export const getHistory = async (id: string): Promise<JobEvent[]> =>
  ((await request('GET', `${path(id)}/history`)) as { events: JobEvent[] }).events;
export const cancelJob = (id: string): Promise<unknown> => request('POST', `${path(id)}/cancel`);
export const deleteJob = (id: string): Promise<unknown> => request('DELETE', path(id));
export const getReport = (job: Job): Promise<Report> =>
  request('GET', artifactUrl(job, 'report.json')) as Promise<Report>;

export async function listPresets(): Promise<Preset[]> {
  return ((await request('GET', '/v1/presets')) as { presets: Preset[] }).presets;
}

/// Uploads a model and starts a job with a preset. XMLHttpRequest, because fetch does not tell how far an upload is.
export function submit(file: File, preset: string, progress: (fraction: number) => void): Promise<Job> {
  return new Promise((resolve, reject) => {
    const upload = new XMLHttpRequest();
    const query = new URLSearchParams({ preset, label: file.name });
    upload.open('POST', `/v1/jobs?${query}`);
    upload.setRequestHeader(
      'Content-Type',
      file.name.toLowerCase().endsWith('.gltf') ? 'model/gltf+json' : 'model/gltf-binary',
    );
    upload.upload.addEventListener('progress', (e) => e.lengthComputable && progress(e.loaded / e.total));
    upload.addEventListener('error', () => reject(new RequestFailed('the server could not be reached')));
    upload.addEventListener('load', () => {
      if (upload.status >= 200 && upload.status < 300) resolve(JSON.parse(upload.responseText) as Job);
      else reject(new RequestFailed(refusal(upload.status, upload.responseText)));
    });
    upload.send(file);
  });
}

/// Follows server-sent events of one job, or of all without `id`. EventSource reconnects by itself. Returns what ends it.
export function follow(
  id: string | undefined,
  heard: { job(job: Job): void; progress(id: string, progress: Progress): void; connected?(yes: boolean): void },
): () => void {
  const source = new EventSource(id ? `${path(id)}/events` : '/v1/events');
  const whole = (event: MessageEvent<string>) => heard.job(JSON.parse(event.data) as Job);
  source.addEventListener('state', whole);
  source.addEventListener('done', whole);
  source.addEventListener('progress', (event: MessageEvent<string>) => {
    const progress = JSON.parse(event.data) as Progress & { job?: string };
    heard.progress(progress.job ?? id ?? '', progress);
  });
  source.addEventListener('open', () => heard.connected?.(true));
  source.addEventListener('error', () => heard.connected?.(false));
  return () => source.close();
}

export interface LevelReport {
  file: string;
  vertices: number;
  triangles: number;
  screen_pixels?: number | null; // how large it may be where it takes the place of the level before
  certificate?: { relrmse: number } | null; // towards every eye, against the surface as it was baked
}

/// report.json; every part may be missing in an old one.
export interface Report {
  engine?: string;
  seconds?: number;
  rays?: number;
  peak_memory_bytes?: number;
  scene?: Record<string, unknown>;
  plan?: { decision: string; value: unknown; reason: string; saves?: unknown }[];
  parameters?: Record<string, unknown>;
  stages?: { name: string; seconds: number; rays?: number }[];
  result?: {
    triangles?: number;
    vertices?: number;
    bytes?: number;
    bytes_per_vertex?: number;
    streams?: { name: string; bytes: number }[];
  };
  warnings?: { code: string; message: string; where?: string }[];
  error_sources?: Record<string, number>; // squares that sum to the certificate's; truncation beside them
  promise?: { kept: boolean; reason: string; passes: unknown[] };
  certificate?: {
    relrmse?: number;
    interval?: [number, number];
    relrmse_without_worst_1pct?: number;
    p99?: number;
    max?: number;
    bias?: number;
    points?: number;
    samples?: number;
    lightings?: { name: string; relrmse: number }[];
    seen?: { relrmse: number; interval?: [number, number] }; // at the points that can be seen, when some cannot
    job_light?: { relrmse: number; interval?: [number, number] }; // its own light in full detail, lamps and all
  };
  links?: {
    senders: number;
    receivers: number;
    links: number;
    share_of_possible: number;
    bytes: number;
    certificate: {
      relrmse: number;
      interval?: [number, number];
      of_rms?: number;
      of_rms_interval?: [number, number];
      sources?: Record<string, number>; // squares that sum to that of of_rms
      lamps: { place: [number, number, number]; relrmse: number; mean_light: number }[];
    } | null;
  };
  grid?: {
    size: [number, number, number];
    blend: string;
    content: string;
    bytes: number;
    rays_per_vertex: number;
    certificate: { relrmse: number; interval?: [number, number]; sources?: Record<string, number> } | null;
  };
  recipe?: { environment?: { builtin?: string; rotation_deg?: number } | null };
  reduce?: {
    unchanged: boolean;
    error: { rms: number; max: number; rms_back: number; max_back: number }; // in parts of the diagonal of the model's box
    normal_degrees_rms: number;
    normal_degrees_rms_without_map: number;
    charts: number;
    input?: { triangles?: number }; // where the recipe goes on with light; else `scene` is about the model
  };
  lightfield?: {
    degree: number;
    certificate?: { relrmse: number; interval?: [number, number]; points?: number; samples?: number } | null;
    levels?: LevelReport[]; // of detail: scene.glb, then lod1.glb and on
  };
  glossy?: Partial<Record<'radiance' | 'transport' | 'truncation', { relrmse: number; interval?: [number, number] }>>;
}
