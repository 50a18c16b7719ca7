// scene.glb in a stock three.js GLTFLoader (which loads both scenes), read with the reader we give to strangers.

import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { createServer } from 'node:http';
import { test } from 'node:test';
import { fileURLToPath } from 'node:url';
import { startBrowser, until } from './browser.mjs';
import { decodeBaked, valueAt } from './read_glb.mjs';
import { bundle, pathInViewer } from './sources.mjs';

async function serve(file) {
  const script = await bundle(fileURLToPath(new URL('stock_page/main.ts', import.meta.url)));
  const server = createServer((request, response) => {
    const name = request.url.split('/').pop();
    if (request.url === '/')
      response
        .setHeader('Content-Type', 'text/html')
        .end('<!doctype html><script type="module" src="/main.js"></script>');
    else if (name === 'main.js') response.setHeader('Content-Type', 'text/javascript').end(script);
    else if (name === 'scene.glb') response.end(file);
    else if (request.url.startsWith('/draco/'))
      response.end(readFileSync(pathInViewer(`node_modules/three/examples/jsm/libs/draco/gltf/${name}`)));
    else response.writeHead(404).end();
  });
  await new Promise((resolve) => server.listen(0, '127.0.0.1', resolve));
  return server;
}

async function check(name) {
  const file = readFileSync(new URL(`fixtures/${name}`, import.meta.url));
  const [browser, server] = [await startBrowser(), await serve(file)];
  try {
    const page = await browser.newPage();
    await page.goto(`http://127.0.0.1:${server.address().port}/`);
    const result = await until(page, () => window.result);
    assert.equal(result.error, undefined);
    assert.equal(result.scenes, 2);
    const { extension, parts } = await decodeBaked(file);
    assert.equal(result.order, extension.order);
    const light = extension.light.coefficients.flat();
    let largest = 0;
    for (const [index, part] of parts.entries()) {
      assert.equal(result.parts[index].values.length, 3 * part.vertices);
      for (let v = 0; v < part.vertices; v += 7) {
        valueAt(extension, part, v, light).forEach(
          (value, c) => (largest = Math.max(largest, Math.abs(value - result.parts[index].values[3 * v + c]))),
        );
      }
    }
    // The same decoder and numbers; sums of some 20 float32 terms below 4 against double.
    assert.ok(largest < 5e-6, `largest difference ${largest}`);
  } finally {
    await browser.close();
    server.closeAllConnections();
    server.close();
  }
}

for (const name of ['scene.glb', 'components.glb', 'glossy.glb'])
  test(`${name}: a stock GLTFLoader reads both scenes, and our reader gives the light that the file defines`, () => check(name));
