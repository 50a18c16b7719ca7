// The contract's HTTP part against the real program: what a person with curl, a browser or a script would do.

import assert from 'node:assert/strict';
import {execFileSync, spawnSync} from 'node:child_process';
import {createHash} from 'node:crypto';
import {existsSync, readdirSync, readFileSync, writeFileSync} from 'node:fs';
import {join} from 'node:path';
import {after, before, test} from 'node:test';

import {cubeGlb, cubeGltf, gridGlb} from './scenes.mjs';
import {finished, startServer} from './server.mjs';

let server;
before(async () => { server = await startServer('--workers', '1'); });
after(async () => { await server.stop(); });

const at = (path) => server.url + path;
const sha = (bytes) => createHash('sha256').update(bytes).digest('hex');
const put = (path, body, headers = {}) => fetch(at(path), {method: 'PUT', body, headers});
const post = (path, body, headers = {}) => fetch(at(path), {method: 'POST', body, headers});
const postJob = (document, headers = {}) =>
  post('/v1/jobs', JSON.stringify(document), {'content-type': 'application/json', ...headers});

const hasCurl = spawnSync('curl', ['--version']).status === 0;

test('curl -T bakes a scene and fetches what came of it', {skip: hasCurl ? false : 'curl is not installed'}, async () => {
  const file = join(server.data, 'cube.glb');
  writeFileSync(file, cubeGlb());
  const job = JSON.parse(execFileSync('curl', ['-sS', '-T', file, at('/v1/jobs?preset=prt&quality=draft&environment=overcast')]));
  assert.equal(job.status, 'queued');
  const done = await finished(server.url, job.id);
  assert.equal(done.status, 'succeeded', JSON.stringify(done.error));
  assert.deepEqual(done.artifacts.map((a) => a.name).sort(), ['log.txt', 'preview.png', 'report.json', 'scene.glb']);
  for (const artifact of done.artifacts) {
    const reply = await fetch(at(artifact.url));
    const bytes = Buffer.from(await reply.arrayBuffer());
    assert.equal(sha(bytes), artifact.sha256);
    assert.equal(bytes.length, artifact.bytes);
    assert.equal(reply.headers.get('etag'), `"${artifact.sha256}"`);
    const part = await fetch(at(artifact.url), {headers: {range: 'bytes=2-5'}});
    assert.equal(part.status, 206);
    assert.deepEqual(Buffer.from(await part.arrayBuffer()), bytes.subarray(2, 6));
    assert.equal((await fetch(at(artifact.url), {headers: {'if-none-match': `"${artifact.sha256}"`}})).status, 304);
  }
  const tar = join(server.data, 'bundle.tar');
  writeFileSync(tar, Buffer.from(await (await fetch(at(done.links.bundle))).arrayBuffer()));
  assert.deepEqual(execFileSync('tar', ['-tf', tar]).toString().trim().split('\n').sort(), done.artifacts.map((a) => a.name).sort());
});

test('the same scene and recipe are baked once, unless forced', async () => {
  const body = cubeGlb(2);
  const path = '/v1/jobs?preset=prt&quality=draft&environment=overcast';
  const first = await finished(server.url, (await (await put(path, body)).json()).id);
  const second = await (await put(path, body)).json();
  assert.equal(second.status, 'succeeded');
  assert.equal(second.cached, true);
  const forced = await finished(server.url, (await (await put(path + '&force=true', body)).json()).id);
  assert.equal(forced.cached, false);
  const hashes = (job) => Object.fromEntries(job.artifacts.filter((a) => a.name === 'scene.glb').map((a) => [a.name, a.sha256]));
  assert.deepEqual(hashes(forced), hashes(first));
});

test('a form brings a .gltf with the file that it names', async () => {
  const {gltf, bytes} = cubeGltf('parts/cube one.bin', 3);
  const form = new FormData();
  form.set('job', JSON.stringify({preset: 'prt', quality: 'draft', environment: {builtin: 'overcast'}, label: 'form'}));
  form.set('scene', new Blob([gltf]), 'cube.gltf');
  form.set('resource', new Blob([bytes]), 'parts/cube one.bin');
  const reply = await post('/v1/jobs', form);
  assert.equal(reply.status, 202);
  const done = await finished(server.url, (await reply.json()).id);
  assert.equal(done.status, 'succeeded', JSON.stringify(done.error));
  assert.equal(done.label, 'form');
});

test('an asset is uploaded once and baked by its hash, with an idempotency key', async () => {
  const body = cubeGlb(4);
  assert.equal((await put(`/v1/assets/${sha(body)}`, body)).status, 201);
  assert.equal((await put(`/v1/assets/${sha(body)}`, body)).status, 200);
  assert.equal((await put(`/v1/assets/${sha('x')}`, body)).status, 422);
  const document = {preset: 'prt', quality: 'draft', scene: {asset: sha(body)}, environment: {constant: [1, 1, 1]}};
  const first = await postJob(document, {'idempotency-key': 'abc'});
  const again = await postJob(document, {'idempotency-key': 'abc'});
  assert.equal(first.status, 202);
  assert.equal(again.status, 200);
  const id = (await first.json()).id;
  assert.equal((await again.json()).id, id);
  assert.equal((await postJob({...document, seed: 5}, {'idempotency-key': 'abc'})).status, 422);
  assert.equal((await finished(server.url, id)).status, 'succeeded');
});

test('events tell a job from its start to its end, and again from any id on', async () => {
  const {id} = await (await put('/v1/jobs?preset=prt&quality=draft&environment=overcast', cubeGlb(5))).json();
  const text = await (await fetch(at(`/v1/jobs/${id}/events`))).text();
  const kinds = [...text.matchAll(/^event: (\w+)$/gm)].map((m) => m[1]);
  assert.equal(kinds[0], 'state');
  assert.equal(kinds.at(-1), 'done');
  assert.ok(kinds.includes('progress') || kinds.includes('artifact'), kinds.join());
  const ids = [...text.matchAll(/^id: (\d+)$/gm)].map((m) => Number(m[1]));
  assert.deepEqual(ids, [...ids].sort((a, b) => a - b));
  const rest = await (await fetch(at(`/v1/jobs/${id}/events`), {headers: {'last-event-id': String(ids[0])}})).text();
  assert.deepEqual([...rest.matchAll(/^id: (\d+)$/gm)].map((m) => Number(m[1])), ids.slice(1));
  assert.equal((await fetch(at(`/v1/jobs/${id}/events`), {headers: {'last-event-id': String(ids.at(-1))}})).status, 204);
});

test('a running job is canceled within a second', async () => {
  const long = {preset: 'prt', environment: {builtin: 'clear'}, steps: [{do: 'prt', order: 10, samples: 65536}]};
  const form = new FormData();
  form.set('job', JSON.stringify(long));
  form.set('scene', new Blob([gridGlb(120)]), 'grid.glb');
  const {id} = await (await post('/v1/jobs', form)).json();
  for (let i = 0; i < 600; ++i) {
    if ((await (await fetch(at(`/v1/jobs/${id}`))).json()).status === 'running') break;
    await new Promise((resolve) => setTimeout(resolve, 50));
  }
  const begin = Date.now();
  assert.equal((await post(`/v1/jobs/${id}/cancel`)).status, 200);
  const job = await finished(server.url, id);
  const milliseconds = Date.now() - begin;
  console.log(JSON.stringify({measure: 'cancel of a running job', milliseconds}));
  assert.equal(job.status, 'canceled');
  assert.ok(milliseconds < 5000, `${milliseconds} ms`);  // the contract's second, and room for a busy machine
  assert.equal((await post(`/v1/jobs/${id}/cancel`)).status, 200);
});

test('the plan tells what a bake would do, and bakes nothing', async () => {
  const reply = await post('/v1/plan?preset=prt&environment=overcast', cubeGlb(6));
  assert.equal(reply.status, 200);
  assert.ok((await reply.json()).plan.length > 0);
});

test('bytes that are no scene fail with a typed problem and no innards', async () => {
  const job = await (await put('/v1/jobs?preset=prt', Buffer.from('this is no scene'))).json();
  const done = await finished(server.url, job.id);
  assert.equal(done.status, 'failed');
  assert.equal(done.error.status, 422);
  assert.match(done.error.type, /^https:\/\/kiln\.invalid\/problems\/[a-z_]+$/);
  assert.doesNotMatch(JSON.stringify(done.error), /std::|\/tmp|tinygltf|kiln-http-test/);
});

test('every hostile file of the shared models is refused or baked, and the server lives', {
  skip: existsSync(join(process.env.KILN_SHARED ?? '', 'models/hostile')) ? false : 'no shared models here',
}, async () => {
  const folder = join(process.env.KILN_SHARED, 'models/hostile');
  const files = readdirSync(folder, {recursive: true}).filter((name) => /\.(glb|gltf|ply)$/.test(name));
  assert.ok(files.length > 0);
  for (const name of files) {
    const reply = await put(`/v1/jobs?preset=prt&quality=draft&environment=overcast&name=${encodeURIComponent(name)}`, readFileSync(join(folder, name)));
    const job = await reply.json();
    if (reply.status === 422) continue;  // refused at the door already: an empty file
    assert.equal(reply.status, 202, name);
    const done = await finished(server.url, job.id);
    assert.ok(['failed', 'succeeded'].includes(done.status), `${name}: ${done.status}`);
    if (done.status === 'failed') {
      assert.equal(done.error.status, 422, `${name}: ${JSON.stringify(done.error)}`);
      assert.doesNotMatch(JSON.stringify(done.error), /std::|\/tmp|kiln-http-test/, name);
    }
  }
  assert.equal((await fetch(at('/healthz'))).status, 200);
});

test('mistakes of a recipe come all at once with their pointers', async () => {
  const reply = await postJob({steps: [{do: 'prt', order: 99, colour: 1}], seed: -1});
  assert.equal(reply.status, 422);
  assert.equal(reply.headers.get('content-type'), 'application/problem+json');
  const pointers = (await reply.json()).errors.map((e) => e.pointer);
  for (const pointer of ['/steps/0/order', '/steps/0/colour', '/seed']) assert.ok(pointers.includes(pointer), pointers.join());
});

test('the OpenAPI document names every operation, and none answers a plain request with a 5xx', async () => {
  const document = await (await fetch(at('/openapi.json'))).json();
  assert.equal(document.openapi, '3.1.0');
  for (const [path, operations] of Object.entries(document.paths)) {
    for (const method of Object.keys(operations)) {
      if (path.endsWith('/events')) continue;  // never ends by itself
      const filled = path.replace('{id}', 'none').replace('{name}', 'none').replace('{sha256}', 'a'.repeat(64));
      const reply = await fetch(at(filled), {method: method.toUpperCase(), body: ['put', 'post'].includes(method) ? 'x' : undefined});
      assert.ok(reply.status < 500, `${method} ${path}: ${reply.status}`);
      assert.notEqual(reply.status, 405);
      if (reply.status >= 400) assert.equal(reply.headers.get('content-type'), 'application/problem+json');
      await reply.arrayBuffer();
    }
  }
});

test('a job can be deleted, and is gone', async () => {
  const job = await (await put('/v1/jobs?preset=prt&quality=draft&environment=overcast', cubeGlb(7))).json();
  assert.equal((await fetch(at(`/v1/jobs/${job.id}`), {method: 'DELETE'})).status, 204);
  assert.equal((await fetch(at(`/v1/jobs/${job.id}`))).status, 404);
});

test('a trivial job is done quickly', async () => {
  const times = [];
  const runs = Number(process.env.KILN_LATENCY_RUNS ?? 5);
  for (let i = 0; i < runs; ++i) {
    const body = cubeGlb(10 + i);
    const begin = performance.now();
    const reply = await fetch(at('/v1/jobs?preset=prt&quality=draft&environment=overcast'), {method: 'PUT', body, headers: {prefer: 'wait=60'}});
    const job = await reply.json();
    times.push(performance.now() - begin);
    assert.equal(job.status, 'succeeded', JSON.stringify(job.error));
  }
  times.sort((a, b) => a - b);
  console.log(JSON.stringify({measure: 'submit to succeeded, 12 triangles', runs, median_ms: Math.round(times[runs >> 1])}));
});

test('SIGTERM drains: the port closes, the process ends with 0, and a queued job is there after the next start', async () => {
  const first = await startServer('--workers', '0');
  const {id} = await (await fetch(`${first.url}/v1/jobs?preset=prt`, {method: 'PUT', body: cubeGlb(8)})).json();
  assert.equal(await first.stop({keep: true}), 0);
  await assert.rejects(fetch(`${first.url}/healthz`));
  const second = await startServer('--workers', '0', '--data', first.data);
  assert.equal((await (await fetch(`${second.url}/v1/jobs/${id}`)).json()).status, 'queued');
  assert.equal(await second.stop(), 0);
});

test('an open address needs tokens, and then a request needs one of them', async () => {
  const token = 'k'.repeat(43);
  const file = join(server.data, 'tokens');
  writeFileSync(file, token + '\n');
  const other = await startServer('--workers', '0', '--token-file', file);
  const status = async (headers) => (await fetch(`${other.url}/v1/jobs`, {headers})).status;
  assert.equal(await status({}), 401);
  assert.equal(await status({authorization: `Bearer ${token.slice(1)}`}), 401);
  assert.equal(await status({authorization: `Bearer ${token}`}), 200);
  assert.equal(await status({authorization: 'Basic ' + Buffer.from(`me:${token}`).toString('base64')}), 200);
  assert.equal((await fetch(`${other.url}/healthz`)).status, 200);
  assert.equal(await other.stop(), 0);
});
