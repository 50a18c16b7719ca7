// The real kilnd with its embedded viewer: a model goes in through the page and its light comes out on the screen.
// KILND names the program (ctest sets it).

import assert from 'node:assert/strict';
import { spawn } from 'node:child_process';
import { mkdtempSync, rmSync } from 'node:fs';
import { createServer } from 'node:net';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { after, before, test } from 'node:test';
import { openPage, ready, startBrowser, until } from './browser.mjs';

let browser, server, url, folder;

const freePort = () =>
  new Promise((resolve) => {
    const probe = createServer().listen(0, '127.0.0.1', () => {
      const { port } = probe.address();
      probe.close(() => resolve(port));
    });
  });

before(async () => {
  folder = mkdtempSync(join(tmpdir(), 'kiln-browser-'));
  const port = await freePort();
  url = `http://127.0.0.1:${port}`;
  server = spawn(process.env.KILND, ['--data', join(folder, 'data'), '--port', String(port), '--quiet'], {
    stdio: 'ignore',
  });
  for (let i = 0; ; ++i) {
    const answer = await fetch(`${url}/healthz`).catch(() => null);
    if (answer?.ok) break;
    if (i === 200) throw new Error('kilnd does not answer');
    await new Promise((resolve) => setTimeout(resolve, 50));
  }
  browser = await startBrowser();
});

after(async () => {
  await browser?.close();
  const gone = new Promise((resolve) => server.once('exit', resolve));
  server.kill('SIGTERM');
  await gone;
  rmSync(folder, { recursive: true, force: true });
});

/// A plate with a smaller one hovering over it, as a plain GLB: a shadow to see in 4 triangles.
function plates() {
  const square = (y, half) => [-half, y, -half, half, y, -half, half, y, half, -half, y, half];
  const positions = Float32Array.from([...square(0, 1), ...square(0.4, 0.5)]);
  const indices = Uint16Array.from([0, 2, 1, 0, 3, 2, 4, 6, 5, 4, 7, 6]);
  const binary = Buffer.concat([Buffer.from(positions.buffer), Buffer.from(indices.buffer)]);
  const json = {
    asset: { version: '2.0' },
    scene: 0,
    scenes: [{ nodes: [0] }],
    nodes: [{ mesh: 0 }],
    materials: [{ pbrMetallicRoughness: { baseColorFactor: [0.8, 0.6, 0.4, 1], metallicFactor: 0 } }],
    meshes: [{ primitives: [{ attributes: { POSITION: 0 }, indices: 1, material: 0 }] }],
    accessors: [
      { bufferView: 0, componentType: 5126, count: 8, type: 'VEC3', min: [-1, 0, -1], max: [1, 0.4, 1] },
      { bufferView: 1, componentType: 5123, count: 12, type: 'SCALAR' },
    ],
    bufferViews: [
      { buffer: 0, byteLength: positions.byteLength },
      { buffer: 0, byteOffset: positions.byteLength, byteLength: indices.byteLength },
    ],
    buffers: [{ byteLength: binary.length }],
  };
  const text = Buffer.from(JSON.stringify(json).padEnd(Math.ceil(JSON.stringify(json).length / 4) * 4));
  const words = (...values) => Buffer.from(Uint32Array.from(values).buffer);
  const total = 12 + 8 + text.length + 8 + binary.length;
  return Buffer.concat([
    words(0x46546c67, 2, total, text.length, 0x4e4f534a),
    text,
    words(binary.length, 0x004e4942),
    binary,
  ]);
}

test('a model uploaded in the gallery is baked, listed live with its preview, and shown relit in the viewer', async () => {
  const gallery = await openPage(browser, url);
  await until(
    gallery,
    () =>
      document.querySelector('.connection').dataset.live === 'true' &&
      document.querySelector('#preset').options.length > 0,
  );
  await gallery.selectOption('#preset', 'prt-draft');
  await gallery.setInputFiles('#model', { name: 'plates.glb', mimeType: 'model/gltf-binary', buffer: plates() });
  await until(
    gallery,
    () => document.querySelector('.card[data-status="succeeded"] img')?.naturalWidth > 0,
    null,
    120000,
  );
  assert.deepEqual(gallery.faults, []);
  assert.deepEqual(await gallery.evaluate(() => window.violations), []);

  const page = await openPage(browser, url + (await gallery.locator('.card a.primary').getAttribute('href')));
  await ready(page);
  assert.equal(await page.locator('h1').innerText(), 'plates.glb');
  await page.locator('summary', { hasText: 'Statistics' }).click();
  assert.match(await page.locator('.statistics').innerText(), /relative error/);
  // Under a constant sky the open rim of the lower plate has value close to 1 and the middle, covered, clearly less.
  const [rim, middle] = await page.evaluate(async () => {
    const { state, model } = window.kilnViewer;
    state.set({ light: 'constant' });
    while (window.kilnViewer.relighting) await new Promise((resolve) => setTimeout(resolve, 10));
    const { mesh, light } = model.parts[0];
    const position = mesh.geometry.getAttribute('position');
    const lowest = Math.min(...Array.from({ length: position.count }, (_, v) => position.getY(v)));
    const nearest = (radius) => {
      let best = 0;
      const off = (v) =>
        Math.abs(Math.hypot(position.getX(v), position.getZ(v)) - radius) + 10 * (position.getY(v) - lowest);
      for (let v = 1; v < position.count; ++v) if (off(v) < off(best)) best = v;
      return light.getX(best);
    };
    return [nearest(Math.SQRT1_2), nearest(0)]; // unit cube: a corner, the middle
  });
  // The corner sees the small plate under a few per cent of the cosine-weighted sky; half of it is hidden in the middle.
  assert.ok(rim > 0.9 && rim < 1.02, `rim ${rim}`);
  assert.ok(middle < 0.75 * rim, `middle ${middle}, rim ${rim}`);
  assert.deepEqual(page.faults, []);
  assert.deepEqual(await page.evaluate(() => window.violations), []);
});

test('the docs page shows every operation of the real interface', async () => {
  const page = await openPage(browser, `${url}/docs`);
  await until(page, () => document.querySelectorAll('.operation').length > 0);
  const { paths } = await (await fetch(`${url}/openapi.json`)).json();
  const operations = Object.values(paths).reduce(
    (sum, item) => sum + Object.keys(item).filter((key) => key !== 'parameters').length,
    0,
  );
  assert.equal(await page.locator('.operation').count(), operations);
  assert.deepEqual(page.faults, []);
});

test('the trade page is served, with its rows built in', async () => {
  const page = await openPage(browser, `${url}/trade`);
  await until(page, () => document.querySelectorAll('.trade-point').length > 0);
  assert.deepEqual(page.faults, []);
  assert.deepEqual(await page.evaluate(() => window.violations), []);
});

test('a file that is no model is refused, or fails with a reason that the card shows', async () => {
  const page = await openPage(browser, url);
  await until(page, () => document.querySelector('#preset').options.length > 0);
  await page.setInputFiles('#model', {
    name: 'noise.glb',
    mimeType: 'model/gltf-binary',
    buffer: Buffer.from('this is not a model at all, whatever its name says'),
  });
  await until(
    page,
    () =>
      /\w{4}/.test(
        [...document.querySelectorAll('.refused, .card[data-status="failed"] .problem')]
          .map((e) => e.textContent.replace('noise.glb', ''))
          .join(''),
      ),
    null,
    60000,
  );
});
