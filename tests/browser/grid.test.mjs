// An irradiance vector grid in the viewer: what is drawn is what the file's numbers give.

import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { after, before, test } from 'node:test';
import { startBrowser, until, withReady } from './browser.mjs';
import { jobId, startMock } from './mock_server.mjs';
import { load } from './sources.mjs';

const bytes = readFileSync(new URL('fixtures/grid.exr', import.meta.url)); // the demo's room at 6 x 5 x 4, with corners
const { readGrid, irradianceAt } = await load('asset/grid_file.ts');
const grid = readGrid(bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.length));
const lines = readFileSync(new URL('fixtures/grid.csv', import.meta.url), 'utf8').trim().split('\n').slice(1);
const surface = lines.map((line) => line.split(',').map(Number)); // place, normal, irradiance by `kiln eval`
const kView = `/view/${jobId('done')}`;

let browser, mock;
before(async () => {
  [browser, mock] = [await startBrowser(), await startMock({ files: { 'grid.exr': bytes } })];
  mock.jobs.get(jobId('done')).artifacts.push({ name: 'grid.exr', bytes: bytes.length, media_type: 'image/x-exr' });
});
after(async () => {
  await browser.close();
  await mock.close();
});

const withViewer = (hash, act) => withReady(browser, `${mock.url}${kView}#${hash}`, act);

test('the file is read as it was written', () => {
  assert.deepEqual(grid.size, [6, 5, 4]);
  assert.equal(grid.blend, 'exact');
  assert.equal(grid.parts.length, 9);
  assert.equal(grid.corners.length, 48 * 5 * 4 * 3);
  assert.ok(grid.corners.some((b) => b !== 255 && b !== 0));
});

test('light of a constant grid is the same everywhere and along all normals', () => {
  // A = 2 pi, all else 0: E = pi (equation 2 of core/grid/irradiance_vectors.h). 0x4648 is 6.28125 as a half.
  const parts = grid.parts.map((part, k) => part.map(() => (k >= 3 && k < 6 ? 0x4648 : 0)));
  const even = { ...grid, parts, scale: 1 };
  for (const n of [
    [1, 0, 0],
    [0, -1, 0],
    [0.6, 0, 0.8],
  ])
    assert.ok(Math.abs(irradianceAt(even, [0.1, 0.2, 0.3], n, 'room')[0] - 3.140625) < 1e-5);
});

test('a surface reads what the engine reads of the same file', () => {
  assert.equal(surface.length, 100);
  for (const [x, y, z, nx, ny, nz, ...truth] of surface) {
    const light = irradianceAt(grid, [x, y, z], [nx, ny, nz], 'surface');
    for (let c = 0; c < 3; ++c) assert.ok(Math.abs(light[c] - truth[c]) < 1e-4, `${light} for ${truth}`); // floats
  }
});

const encode = (linear) => (linear <= 0.0031308 ? 12.92 * linear : 1.055 * linear ** (1 / 2.4) - 0.055);
const clamp = (value) => Math.min(1, Math.max(0, value));

/// What is drawn where the ball faces the camera, the place there, and the exposure in force.
const readBall = (page) =>
  page.evaluate(() => {
    const { stage, model } = window.kilnViewer;
    const { ball } = window.kilnGrid;
    model.root.visible = false; // whatever stands in front of it
    stage.camera.updateMatrixWorld();
    ball.updateMatrixWorld();
    const towards = stage.camera.position.clone().sub(ball.position).normalize();
    const place = ball.position.clone().addScaledVector(towards, ball.geometry.parameters.radius);
    const screen = place.clone().project(stage.camera);
    stage.drawNow();
    const gl = stage.renderer.getContext();
    const pixel = new Uint8Array(4);
    const at = (v, size) => Math.floor(((v + 1) / 2) * size);
    const [x, y] = [at(screen.x, gl.drawingBufferWidth), at(screen.y, gl.drawingBufferHeight)];
    gl.readPixels(x, y, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, pixel);
    return {
      colour: [...pixel.slice(0, 3)].map((value) => value / 255),
      place: place.toArray(),
      normal: towards.toArray(),
      exposure: stage.renderer.toneMappingExposure,
    };
  });

for (const place of ['room', 'surface'])
  for (const at of ['0,0,0', '0.5,-0.6,0.3', '-0.9,0.9,-0.9', '0.2,-0.95,-0.4'])
    test(`the ball at ${at} of the grid is as bright as the file says of a ${place}`, () =>
      withViewer(`tone=none&ev=1&background=off&ballAt=${at}`, async (page) => {
        await page.evaluate((on) => (window.kilnGrid.ball.material.uniforms.surface.value = on), place === 'surface');
        const { colour, place: p, normal, exposure } = await readBall(page);
        const light = irradianceAt(grid, p, normal, place);
        const expected = light.map((e) => encode(clamp((exposure * 0.8 * e) / Math.PI)));
        assert.ok(Math.max(...expected) > 0.05);
        // A step of 8 bits, half a step of dithering, and what the normal turns within a pixel.
        for (let c = 0; c < 3; ++c) assert.ok(Math.abs(colour[c] - expected[c]) < 3 / 255, `${colour} for ${expected}`);
      }));

test('a drag moves the ball and not the camera, and the address keeps its place', () =>
  withViewer('background=off', async (page) => {
    const { x, y } = await page.evaluate(() => {
      const { stage, model } = window.kilnViewer;
      for (const { mesh } of model.parts) mesh.raycast = () => {}; // nothing in its way
      const screen = window.kilnGrid.ball.position.clone().project(stage.camera);
      const { left, top, width, height } = stage.canvas.getBoundingClientRect();
      return { x: left + ((screen.x + 1) / 2) * width, y: top + ((1 - screen.y) / 2) * height };
    });
    const look = () =>
      page.evaluate(() => [window.kilnViewer.stage.camera.position.toArray(), window.kilnGrid.ball.position.toArray()]);
    const [cameraBefore, ballBefore] = await look();
    await page.mouse.move(x, y);
    await page.mouse.down();
    await page.mouse.move(x + 60, y - 20, { steps: 4 });
    await page.mouse.up();
    const [cameraAfter, ballAfter] = await look();
    assert.deepEqual(cameraAfter, cameraBefore);
    assert.notDeepEqual(ballAfter, ballBefore);
    await until(page, () => location.hash.includes('ballAt='));
  }));

test('surfaces, cells and arrows come and go and leave nothing behind', () =>
  withViewer('background=off', async (page) => {
    const counts = () => page.evaluate(() => ({ ...window.kilnViewer.stage.renderer.info.memory }));
    const show = (change) =>
      page.evaluate((change) => {
        window.kilnViewer.state.set(change);
        window.kilnViewer.stage.drawNow();
      }, change);
    await show({ mode: 'grid', cells: true, arrows: true });
    await show({ mode: 'shaded', cells: false, arrows: false });
    const before = await counts();
    await show({ mode: 'grid', cells: true, arrows: true });
    assert.ok((await counts()).geometries > before.geometries);
    await show({ mode: 'shaded', cells: false, arrows: false });
    assert.deepEqual(await counts(), before);
    await page.evaluate(() => window.kilnDispose());
    assert.equal((await counts()).textures, 0);
  }));
