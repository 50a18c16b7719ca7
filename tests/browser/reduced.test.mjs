// A reduced model that was not lit opens as a plain lit model: what baked light alone can do is disabled with a reason.
//
// fixtures/reduced.glb and reduced.json are of make_ball.mjs: 19,200 triangles in 1200, maps of 256 texels.

import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { after, before, test } from 'node:test';
import { axeSource, openPage, startBrowser, until, withReady } from './browser.mjs';
import { jobId, startMock } from './mock_server.mjs';
import { load } from './sources.mjs';

const fixture = (name) => readFileSync(new URL(`fixtures/${name}`, import.meta.url));
const report = JSON.parse(fixture('reduced.json'));
const files = { 'scene.glb': fixture('reduced.glb'), 'report.json': fixture('reduced.json') };
const kView = `/view/${jobId('done')}`;

let browser, mock;
before(async () => {
  [browser, mock] = [await startBrowser(), await startMock({ files })];
});
after(async () => {
  await browser.close();
  await mock.close();
});

const withViewer = (hash, act) => withReady(browser, `${mock.url}${kView}#${hash}`, act);

/// The picture as numbers: 64 x 64 means of the canvas, and how far they spread.
const look = (page) =>
  page.evaluate(() => {
    const { stage } = window.kilnViewer;
    stage.drawNow();
    const gl = stage.renderer.getContext();
    const [width, height] = [gl.drawingBufferWidth, gl.drawingBufferHeight];
    const pixels = new Uint8Array(4 * width * height);
    gl.readPixels(0, 0, width, height, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
    const at = (x, y) => pixels[4 * (Math.floor(y * height) * width + Math.floor(x * width)) + 1];
    const inside = Array.from({ length: 400 }, (_, i) => at(0.42 + 0.008 * (i % 20), 0.4 + 0.01 * Math.floor(i / 20)));
    const mean = inside.reduce((sum, v) => sum + v, 0) / inside.length;
    // Between neighbours: what the normal map brings, and flat shading would not.
    let rough = 0;
    for (let i = 0; i + 1 < inside.length; ++i) if (i % 20 !== 19) rough += Math.abs(inside[i] - inside[i + 1]);
    return { mean, rough: rough / 380 };
  });

test('it is lit, and its normal map shows', () =>
  withViewer('background=off', async (page) => {
    const shown = await look(page);
    assert.ok(shown.mean > 40 && shown.mean < 245, `${shown.mean}`);
    await page.evaluate(() => window.kilnViewer.model.parts.forEach(({ mesh }) => mesh.material.normalScale.set(0, 0)));
    const flat = await look(page);
    assert.ok(shown.rough > 1.3 * flat.rough, `${shown.rough} against ${flat.rough}`);
  }));

test('light, exposure and wireframe change the picture', () =>
  withViewer('background=off', async (page) => {
    const set = (change) => page.evaluate((change) => window.kilnViewer.state.set(change), change);
    const first = await look(page);
    await set({ ev: -2 });
    assert.ok((await look(page)).mean < 0.7 * first.mean);
    await set({ ev: 0, intensity: 0 });
    assert.equal((await look(page)).mean, 0);
    await set({ intensity: 1, light: 'lamp', rotation: 120 });
    const turned = await look(page);
    await set({ rotation: 0 });
    assert.ok(Math.abs((await look(page)).mean - turned.mean) > 5);
    await set({ wire: true });
    assert.ok((await look(page)).rough > turned.rough);
  }));

test('what only baked light has is disabled, with a reason', () =>
  withViewer('', async (page) => {
    for (const id of ['c-mode', 'c-compare']) {
      assert.ok(await page.locator(`#${id}`).isDisabled());
      const why = await page.locator(`#${id}`).getAttribute('aria-describedby');
      assert.match(await page.locator(`#${why}`).innerText(), /prt, radiosity or grid/);
    }
    for (const id of ['c-light', 'c-rotation', 'c-intensity', 'c-ev', 'c-wire'])
      assert.ok(await page.locator(`#${id}`).isEnabled(), id);
    await page.keyboard.press('c');
    await page.keyboard.press('3');
    assert.ok(await page.evaluate(() => window.kilnViewer.state.get().compare === null));
  }));

test('the statistics are those of the report', () =>
  withViewer('', async (page) => {
    await page.locator('summary', { hasText: 'Statistics' }).click();
    const text = await page.locator('.statistics').innerText();
    assert.match(text, /Triangles in\s+19,200/);
    assert.match(text, new RegExp(`Triangles out\\s+${report.result.triangles.toLocaleString('en')}`));
    assert.ok(text.includes(`${(100 * report.reduce.error.rms).toPrecision(2)}\u00a0%`), text);
    assert.ok(text.includes(`${(100 * report.reduce.error.rms_back).toPrecision(2)}\u00a0%`), text);
    assert.ok(text.includes(`${report.reduce.normal_degrees_rms.toPrecision(2)}° RMS`), text);
  }));

test('a picture can be saved', () =>
  withViewer('', async (page) => {
    const [saved] = await Promise.all([
      page.waitForEvent('download'),
      page.getByRole('button', { name: 'Save picture' }).click(),
    ]);
    assert.match(saved.suggestedFilename(), /^kiln-.*\.png$/);
  }));

test('closing gives everything back', () =>
  withViewer('wire=true', async (page) => {
    const left = await page.evaluate(() => {
      const { renderer } = window.kilnViewer.stage;
      window.kilnDispose();
      return { ...renderer.info.memory };
    });
    assert.deepEqual(left, { geometries: 0, textures: 0 });
  }));

for (const colorScheme of ['dark', 'light'])
  test(`axe finds nothing, ${colorScheme}`, () =>
    withReady(
      browser,
      `${mock.url}${kView}`,
      async (page) => {
        await page.locator('summary', { hasText: 'Statistics' }).click();
        await page.evaluate(readFileSync(axeSource(), 'utf8'));
        const { violations } = await page.evaluate(() => window.axe.run(document, { resultTypes: ['violations'] }));
        assert.deepEqual(violations, []);
      },
      { colorScheme },
    ));

/// What the page says instead of a picture.
async function refusal(files) {
  const other = await startMock({ files });
  try {
    const page = await openPage(browser, other.url + kView);
    await until(page, () => document.querySelector('.overlay .problem') !== null);
    const text = await page.locator('.overlay .problem').innerText();
    assert.deepEqual(page.faults, []);
    await page.context().close();
    return text;
  } finally {
    await other.close();
  }
}

test('another glTF without transfer vectors is refused as ever', async () =>
  assert.match(await refusal({ 'scene.glb': files['scene.glb'] }), /no KILN_radiance_transfer/));

test('a model that came back compressed is refused in words', async () => {
  const { splitGlb, joinGlb } = await load('asset/glb.ts');
  const bytes = fixture('scene.glb');
  const { json, binary } = splitGlb(bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.length));
  delete json.extensions;
  const compressed = Buffer.from(joinGlb(json, [binary]));
  assert.match(await refusal({ ...files, 'scene.glb': compressed }), /compressed with KHR_draco_mesh_compression/);
});
