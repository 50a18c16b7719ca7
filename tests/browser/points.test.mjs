// Light on points in the viewer: what is splatted is equation 9 of core/meshless/basis.h at the place of each pixel.

import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { after, before, test } from 'node:test';
import { startBrowser, until, withReady } from './browser.mjs';
import { jobId, startMock } from './mock_server.mjs';

const scene = readFileSync(new URL('fixtures/points.glb', import.meta.url)); // of fixtures/make_points.sh
const kView = `/view/${jobId('done')}`;

let browser, mock;
before(async () => {
  browser = await startBrowser();
  mock = await startMock({ files: { 'scene.glb': scene } });
});
after(async () => {
  await browser.close();
  await mock.close();
});

const withViewer = (hash, act) => withReady(browser, `${mock.url}${kView}#${hash}`, act);

/// Place, normal and light of some pixels, and the field, which is summed here by hand over `levels`.
const readPixels = (page) =>
  page.evaluate(() => {
    const { kilnPoints: view, kilnViewer: viewer } = window;
    const { renderer } = viewer.stage;
    viewer.stage.drawNow();
    const { width, height } = view.light;
    const read = (target, x, y, texture) => {
      const out = new Float32Array(4);
      renderer.readRenderTargetPixels(target, x, y, 1, 1, out, undefined, texture);
      return [...out];
    };
    const pixels = [];
    for (let i = 1; i < 12; ++i) {
      for (let k = 1; k < 12; ++k) {
        const [x, y] = [Math.floor((i * width) / 12), Math.floor((k * height) / 12)];
        const [place, normal, light] = [read(view.surface, x, y, 0), read(view.surface, x, y, 1), read(view.light, x, y, 0)];
        if (normal[3] > 0) pixels.push({ place, normal, light });
      }
    }
    const { levelEnd, sites, normals, coefficients } = view.field;
    return { pixels, field: { levelEnd, sites: [...sites], normals: [...normals], coefficients: [...coefficients] } };
  });

function valueAt({ levelEnd, sites, normals, coefficients }, { place, normal }, levels) {
  const value = [0, 0, 0];
  for (let level = 0, j = 0; level < levels; ++level) {
    const sum = [0, 0, 0];
    let all = 0;
    for (; j < levelEnd[level]; ++j) {
      const d = Math.hypot(...[0, 1, 2].map((c) => place[c] - sites[4 * j + c])) / sites[4 * j + 3];
      const facing = [0, 1, 2].reduce((total, c) => total + normal[c] * normals[3 * j + c], 0);
      if (d >= 1 || facing <= 0) continue;
      const w = (2 * d ** 3 - 3 * d * d + 1) * facing;
      all += w;
      for (let c = 0; c < 3; ++c) sum[c] += w * coefficients[3 * j + c];
    }
    for (let c = 0; c < 3 && all > 1e-12; ++c) value[c] += sum[c] / all;
  }
  return value;
}

for (const levels of [1, 3]) {
  test(`each pixel has the sum of ${levels} of the levels`, () =>
    withViewer(`points=true&pointLevels=${levels}&background=off`, async (page) => {
      const { pixels, field } = await readPixels(page);
      assert.ok(pixels.length > 20, `${pixels.length} pixels of the room`);
      for (const pixel of pixels) {
        const expected = valueAt(field, pixel, levels);
        // Floats added up in another order.
        for (let c = 0; c < 3; ++c)
          assert.ok(Math.abs(pixel.light[c] - expected[c]) < 1e-4 * (1 + Math.abs(expected[c])), `${pixel.light} for ${expected}`);
      }
    }));
}

test('the switches change the picture, travel in the address, and leave nothing behind', () =>
  withViewer('background=off', async (page) => {
    const shot = () => page.evaluate(() => (window.kilnViewer.stage.drawNow(), window.kilnViewer.stage.canvas.toDataURL()));
    const vertices = await shot();
    await page.click('text=Light from the points');
    await until(page, () => location.hash.includes('points=true'));
    const points = await shot();
    assert.notEqual(points, vertices);
    await page.click('text=Points whose coefficients matter');
    await until(page, () => document.getElementById('dots-text').textContent.includes(' of 1007 points'));
    assert.notEqual(await shot(), points);
    await page.click('text=Points whose coefficients matter');
    await page.click('text=Light from the points');
    assert.equal(await shot(), vertices);
    await page.evaluate(() => window.kilnDispose());
    const { textures, geometries } = await page.evaluate(() => window.kilnViewer.stage.renderer.info.memory);
    assert.deepEqual({ textures, geometries }, { textures: 0, geometries: 0 });
  }));
