// A lightmap in the viewer: what is drawn is what lightmap.exr holds, filtered.

import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { after, before, test } from 'node:test';
import { startBrowser, until, withReady } from './browser.mjs';
import { jobId, startMock } from './mock_server.mjs';
import { load } from './sources.mjs';

const fixture = (name) => readFileSync(new URL(`fixtures/${name}`, import.meta.url));
const [scene, exr] = [fixture('lightmap.glb'), fixture('lightmap.exr')]; // of make_lightmap.mjs
const { readLightmap } = await load('asset/lightmap_file.ts');
const arrayBuffer = (bytes) => bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.length);
const kView = `/view/${jobId('done')}`;

let browser, mock;
before(async () => {
  browser = await startBrowser();
  mock = await startMock({ files: { 'scene.glb': scene, 'lightmap.exr': exr } });
  mock.jobs.get(jobId('done')).artifacts.push({ name: 'lightmap.exr', bytes: exr.length, media_type: 'image/x-exr' });
});
after(async () => {
  await browser.close();
  await mock.close();
});

/// Of a half float.
function fromHalf(h) {
  const [exponent, fraction] = [(h >> 10) & 31, h & 1023];
  return exponent === 0 ? fraction * 2 ** -24 : (1 + fraction / 1024) * 2 ** (exponent - 15);
}

/// Irradiance at u, v: bilinear between centres, clamped.
function irradianceAt({ image: { data, width, height } }, u, v) {
  const axis = (at, size) => Math.min(size - 1, Math.max(0, at * size - 0.5));
  const [x, y] = [axis(u, width), axis(v, height)];
  const [x0, y0] = [Math.min(Math.floor(x), width - 2), Math.min(Math.floor(y), height - 2)];
  const texel = (i, j) => fromHalf(data[4 * (j * width + i)]);
  const row = (j) => texel(x0, j) * (1 - x + x0) + texel(x0 + 1, j) * (x - x0);
  return row(y0) * (1 - y + y0) + row(y0 + 1) * (y - y0);
}

const encode = (linear) => (linear <= 0.0031308 ? 12.92 * linear : 1.055 * linear ** (1 / 2.4) - 0.055);

/// What is drawn in the middle of each triangle that faces the camera, its coordinates there, and the exposure. Nothing of a
/// closed room stands before another part of it.
const readTriangles = (page) =>
  page.evaluate(() => {
    const { stage, model } = window.kilnViewer;
    stage.camera.updateMatrixWorld();
    stage.drawNow();
    const gl = stage.renderer.getContext();
    const at = (v, size) => Math.floor(((v + 1) / 2) * size);
    return model.parts.flatMap(({ mesh, geometry }) => {
      const { position, normal, uv1 } = geometry.attributes;
      const corners = (t) => [0, 1, 2].map((k) => geometry.index.getX(3 * t + k));
      return Array.from({ length: geometry.index.count / 3 }, (_, t) => {
        const place = stage.camera.position.clone().set(0, 0, 0);
        const facing = place.clone();
        const uv = [0, 0];
        for (const v of corners(t)) {
          place.add(facing.clone().fromBufferAttribute(position, v));
          uv[0] += uv1.getX(v) / 3;
          uv[1] += uv1.getY(v) / 3;
        }
        place.multiplyScalar(1 / 3).applyMatrix4(mesh.matrixWorld);
        facing.fromBufferAttribute(normal, corners(t)[0]);
        const front = facing.dot(stage.camera.position.clone().sub(place)) > 0;
        const screen = place.clone().project(stage.camera);
        const pixel = new Uint8Array(4);
        gl.readPixels(at(screen.x, gl.drawingBufferWidth), at(screen.y, gl.drawingBufferHeight), 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, pixel);
        return { front, uv, shown: pixel[1] / 255, exposure: stage.renderer.toneMappingExposure };
      }).filter(({ front }) => front);
    });
  });

const withViewer = (hash, act) => withReady(browser, `${mock.url}${kView}#${hash}`, act);

test('every wall is as bright as the file says there', () =>
  withViewer('mode=light&tone=none&ev=-2&background=off', async (page) => {
    const texture = readLightmap(arrayBuffer(exr));
    const triangles = await readTriangles(page);
    assert.ok(triangles.length >= 6);
    for (const { uv, shown, exposure } of triangles) {
      const expected = encode(Math.min(1, (exposure * irradianceAt(texture, ...uv)) / Math.PI));
      assert.ok(expected > 0.05 && expected < 0.98);
      // A step of 8 bits, half a step of dithering, and what the light changes within a pixel.
      assert.ok(Math.abs(shown - expected) < 3 / 255, `${shown} for ${expected}`);
    }
  }));

test('the switch brings back the light of the vertices, and nothing stays behind', () =>
  withViewer('mode=light&tone=none&ev=-2&background=off', async (page) => {
    const lit = await readTriangles(page);
    await page.click('text=Light from the lightmap');
    const vertices = await readTriangles(page);
    assert.ok(lit.some(({ shown }, i) => Math.abs(shown - vertices[i].shown) > 0.1)); // four vertices a wall
    await until(page, () => location.hash.includes('lightmap=false'));
    await page.click('text=Light from the lightmap');
    assert.deepEqual(await readTriangles(page), lit);
    await page.evaluate(() => window.kilnDispose());
    assert.equal(await page.evaluate(() => window.kilnViewer.stage.renderer.info.memory.textures), 0);
  }));
