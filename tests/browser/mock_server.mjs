// A kilnd that holds still: serves web_viewer/dist and a few jobs from memory, with kilnd's security headers, so that the
// pages can be tested without a bake. Run it by hand to look at them: node tests/browser/mock_server.mjs [port]

import { readFile } from 'node:fs/promises';
import { createServer } from 'node:http';
import { extname, join, normalize } from 'node:path';
import { fileURLToPath } from 'node:url';

const here = fileURLToPath(new URL('.', import.meta.url));
export const kDist = join(here, '../../web_viewer/dist');
const kFixtures = join(here, 'fixtures');

// reliability.md, S7
export const kPolicy =
  "default-src 'none'; script-src 'self' 'wasm-unsafe-eval'; worker-src 'self' blob:; style-src 'self'; img-src 'self' blob: data:; " +
  "connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

const kTypes = {
  '.html': 'text/html; charset=utf-8',
  '.js': 'text/javascript; charset=utf-8',
  '.css': 'text/css; charset=utf-8',
  '.wasm': 'application/wasm',
  '.svg': 'image/svg+xml',
  '.json': 'application/json',
  '.glb': 'model/gltf-binary',
  '.png': 'image/png',
};

export const kHostileLabel = '<img src=x onerror="window.hacked=1"><script>window.hacked=1</script>';

const time = (minutesAgo) => new Date(Date.now() - 60000 * minutesAgo).toISOString();

function makeJob(number, label, status, more = {}) {
  const running = status === 'running';
  const done = status === 'succeeded';
  const id = `01J9Z0000000000000000000${String(number).padStart(2, '0')}`;
  const file = (name, bytes, media_type) => ({
    name,
    bytes,
    sha256: 'ab'.repeat(32),
    media_type,
    url: `/v1/jobs/${id}/artifacts/${name}`,
  });
  return {
    id,
    label,
    status,
    created_at: time(40 - 2 * number),
    started_at: status === 'queued' ? null : time(39 - 2 * number),
    finished_at: running || status === 'queued' ? null : time(38.6 - 2 * number),
    attempt: 1,
    cached: false,
    recipe: { steps: [{ do: 'prt', order: 4, bounces: 1 }], quality: 'standard', seed: 0 },
    progress: running ? { stage: 'transfer', done: 25, total: 100, fraction: 0.25, eta_s: 12 } : null,
    error: null,
    artifacts: done
      ? [
          file('scene.glb', 102104, 'model/gltf-binary'),
          file('preview.png', 20000, 'image/png'),
          file('report.json', 1596, 'application/json'),
        ]
      : [],
    links: {},
    ...more,
  };
}

export const kJobIds = { hostile: 1, failed: 2, canceled: 3, done: 4, queued: 5, running: 6 };
export const jobId = (name) => makeJob(kJobIds[name], '', 'queued').id;

function firstJobs() {
  const jobs = [
    makeJob(1, kHostileLabel, 'succeeded', { artifacts: [] }),
    makeJob(2, 'broken.glb', 'failed', {
      error: {
        title: 'Input refused',
        status: 422,
        detail: 'index 70001 is not below the vertex count 65536',
        where: 'broken.glb: /meshes/3/primitives/0/indices element 812',
      },
    }),
    makeJob(3, 'too large', 'canceled', { attempt: 2 }),
    makeJob(4, 'knot over floor', 'succeeded'),
    makeJob(5, 'dungeon', 'queued'),
    makeJob(6, 'hotel room', 'running'),
  ];
  return new Map(jobs.map((job) => [job.id, job]));
}

/// A job that ran twice, and why; every other one has only begun.
const history = (job) => {
  const event = (status, message, kind = 'state') => ({ kind, status, message });
  const ran =
    job.attempt < 2
      ? []
      : [
          event('running', 'attempt 1'),
          event('queued', `its lease ended without a word of its server ${kHostileLabel}`),
          event('running', 'attempt 2'),
          event('running', 'cancellation requested', 'log'),
          event(job.status, ''),
          event(job.status, '', 'done'),
        ];
  return [event('queued', ''), ...ran].map((e, id) => ({ id, at: job.created_at, ...e }));
};

const kOpenApi = {
  openapi: '3.1.0',
  info: { title: 'Kiln', version: '0.1.0', description: 'Bakes light.' },
  paths: {
    '/v1/jobs': {
      get: {
        summary: 'List jobs',
        parameters: [
          { name: 'status', in: 'query', schema: { enum: ['queued', 'running'] }, description: 'only these' },
        ],
        responses: {
          200: {
            description: 'A page of jobs',
            content: { 'application/json': { schema: { $ref: '#/components/schemas/Page' } } },
          },
        },
      },
      post: {
        summary: 'Start a job',
        requestBody: { content: { 'model/gltf-binary': {} } },
        responses: { 202: { description: 'Accepted' } },
      },
    },
  },
  components: {
    schemas: {
      Page: {
        type: 'object',
        required: ['jobs'],
        properties: { jobs: { type: 'array', items: { type: 'object' }, description: 'newest first' } },
      },
    },
  },
};

/// `files`: bytes of artefacts that replace the fixtures, by name.
export async function startMock({ port = 0, files = {} } = {}) {
  const jobs = firstJobs();
  const streams = new Set();
  const seen = [];

  const emit = (event, data) => {
    for (const stream of streams) stream.write(`event: ${event}\ndata: ${JSON.stringify(data)}\n\n`);
  };
  const change = (id, fields) => {
    const job = Object.assign(jobs.get(id), fields);
    emit('state', job);
    return job;
  };

  const json = (response, status, value) =>
    response
      .writeHead(status, { 'Content-Type': status < 400 ? 'application/json' : 'application/problem+json' })
      .end(JSON.stringify(value));
  const missing = (response) =>
    json(response, 404, { title: 'Not found', status: 404, detail: 'there is no such thing here' });
  const file = async (response, path) => {
    try {
      const bytes = await readFile(path);
      response
        .writeHead(200, {
          'Content-Type': kTypes[extname(path)] ?? 'application/octet-stream',
          'Content-Length': bytes.length,
        })
        .end(bytes);
    } catch {
      missing(response);
    }
  };

  const upload = async (request, response, query) => {
    let bytes = 0;
    for await (const chunk of request) bytes += chunk.length;
    if (bytes < 12)
      return json(response, 422, {
        title: 'Input refused',
        status: 422,
        detail: 'the file is shorter than a GLB header',
      });
    const job = makeJob(10 + jobs.size, query.get('label') ?? 'upload', 'queued', {
      recipe: { preset: query.get('preset') },
    });
    jobs.set(job.id, job);
    json(response, 202, job);
    emit('state', job);
  };

  const api = async (request, response, url) => {
    const [, id, rest, name] = /^\/v1\/jobs\/([^/]+)(?:\/([a-z]+)(?:\/(.+))?)?$/.exec(url.pathname) ?? [];
    if (url.pathname === '/v1/events' || rest === 'events') {
      response.writeHead(200, { 'Content-Type': 'text/event-stream' }).write(': hello\n\n');
      streams.add(response);
      response.on('close', () => streams.delete(response));
    } else if (url.pathname === '/v1/presets') {
      json(response, 200, {
        presets: [
          { name: 'prt', description: 'Radiance transfer, order 6, with bounces.', recipe: {} },
          { name: 'draft', description: 'The same, quick and rough.', recipe: {} },
        ],
      });
    } else if (url.pathname === '/v1/jobs' && request.method === 'POST') {
      await upload(request, response, url.searchParams);
    } else if (url.pathname === '/v1/jobs') {
      const status = url.searchParams.get('status');
      json(response, 200, {
        jobs: [...jobs.values()].filter((job) => !status || job.status === status).reverse(),
        next_cursor: null,
      });
    } else if (!id || !jobs.has(id)) {
      missing(response);
    } else if (request.method === 'DELETE') {
      jobs.delete(id);
      response.writeHead(204).end();
    } else if (rest === 'history') {
      json(response, 200, { job: id, events: history(jobs.get(id)) });
    } else if (rest === 'cancel') {
      json(response, 202, change(id, { status: 'canceled', progress: null }));
    } else if (rest === 'artifacts' && files[name]) {
      response
        .writeHead(200, { 'Content-Length': files[name].length, 'Content-Disposition': 'attachment' })
        .end(files[name]);
    } else if (rest === 'artifacts') {
      await file(response, join(kFixtures, normalize(`/${name}`)));
    } else {
      json(response, 200, jobs.get(id));
    }
  };

  const server = createServer((request, response) => {
    const url = new URL(request.url, 'http://mock');
    seen.push(`${request.method} ${url.pathname}`);
    response.setHeader('Content-Security-Policy', kPolicy);
    response.setHeader('X-Content-Type-Options', 'nosniff');
    response.setHeader('Referrer-Policy', 'no-referrer');
    if (url.pathname.startsWith('/v1/')) return void api(request, response, url);
    if (url.pathname === '/openapi.json') return json(response, 200, kOpenApi);
    const page =
      url.pathname === '/'
        ? 'index.html'
        : /^\/view\/[^/]+$/.test(url.pathname)
          ? 'view.html'
          : ['/docs', '/trade'].includes(url.pathname)
            ? `${url.pathname}.html`
            : url.pathname;
    void file(response, join(kDist, normalize(`/${page}`)));
  });
  await new Promise((resolve) => server.listen(port, '127.0.0.1', resolve));
  return {
    url: `http://127.0.0.1:${server.address().port}`,
    jobs,
    seen,
    emit,
    change,
    streams,
    close: () => {
      for (const stream of streams) stream.end();
      server.closeAllConnections();
      return new Promise((resolve) => server.close(resolve));
    },
  };
}

if (process.argv[1] === fileURLToPath(import.meta.url)) {
  const mock = await startMock({ port: Number(process.argv[2] ?? 18400) });
  console.log(mock.url);
}
