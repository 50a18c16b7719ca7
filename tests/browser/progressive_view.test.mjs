// A progressive mesh in the viewer. fixtures/progressive.glb is the ball of field.glb with a field of degree 2 and with
// KILN_progressive_mesh (fixtures/make_field.sh).

import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { after, before, test } from 'node:test';
import { startBrowser, until, withReady } from './browser.mjs';
import { jobId, startMock } from './mock_server.mjs';

const file = readFileSync(new URL('fixtures/progressive.glb', import.meta.url));

let browser, mock;
before(async () => {
  [browser, mock] = [await startBrowser(), await startMock({ files: { 'scene.glb': file } })];
});
after(async () => {
  await browser.close();
  await mock.close();
});

const withMesh = (hash, act) => withReady(browser, `${mock.url}/view/${jobId('done')}#background=off&${hash}`, act);
const set = (page, change) => page.evaluate((c) => window.kilnViewer.state.set(c), change);

/// The bytes of the picture, and what is shown of the mesh.
const picture = async (page) => {
  const shown = await page.evaluate(() => {
    const { stage, model } = window.kilnViewer;
    stage.drawNow();
    const gl = stage.renderer.getContext();
    const pixels = new Uint8Array(4 * gl.drawingBufferWidth * gl.drawingBufferHeight);
    gl.readPixels(0, 0, gl.drawingBufferWidth, gl.drawingBufferHeight, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
    const { shape } = window.kilnProgressive;
    let text = '';
    for (let i = 0; i < pixels.length; i += 4096) text += String.fromCharCode(...pixels.subarray(i, i + 4096));
    return { pixels: btoa(text), triangles: shape?.mesh.triangleCount, own: model.root.visible };
  });
  const text = await page.locator('#detail-text').innerText();
  return { ...shown, pixels: Buffer.from(shown.pixels, 'base64'), text };
};

/// RMS over the pixels that are not background in both, in parts of white.
function apart(a, b) {
  let [sum, count] = [0, 0];
  for (let i = 0; i < a.length; i += 4) {
    const plain = [a, b].every((p) => p[i] === 0x5b && p[i + 1] === 0x5e && p[i + 2] === 0x64);
    if (plain) continue;
    for (let c = 0; c < 3; ++c) sum += ((a[i + c] - b[i + c]) / 255) ** 2;
    count += 3;
  }
  assert.ok(count > 30000, 'there is nothing to be seen');
  return Math.sqrt(sum / count);
}

test('fine levels look as the file does, and the coarser one goes the less they do', () =>
  withMesh('', async (page) => {
    const own = await picture(page);
    assert.ok(own.own && own.text === '');
    const errors = [];
    const triangles = [];
    for (const detail of [0.9999, 0.5, 0]) {
      await set(page, { detail });
      const { pixels, text, own: visible, triangles: now } = await picture(page);
      assert.ok(!visible, text);
      assert.match(text, /^\d+ vertices, \d+ triangles, .+ of error estimated/);
      errors.push(apart(pixels, own.pixels));
      triangles.push(now);
    }
    // Stored positions, normals and light are rounded in the file's own mesh and not in the progressive one,
    // silhouettes by parts of a pixel: .0062 was measured.
    assert.ok(errors[0] < 0.01, `${errors}`);
    assert.ok(errors[0] < errors[1] && errors[1] < errors[2], `${errors}`);
    assert.ok(triangles[0] > triangles[1] && triangles[1] > triangles[2], `${triangles}`);
  }));

test('up and down again is the same picture, at each pixel and at the vertices', () =>
  withMesh('detail=0.3', async (page) => {
    const before = await picture(page);
    await set(page, { detail: 0.9, mode: 'vertices' });
    const other = await picture(page);
    await set(page, { detail: 0.1 });
    await set(page, { detail: 0.3, mode: 'shaded' });
    assert.ok((await picture(page)).pixels.equals(before.pixels));
    assert.ok(apart(before.pixels, other.pixels) > 0.01);
  }));

test('false colours and the full share show the file’s own triangles again', () =>
  withMesh('detail=0.5', async (page) => {
    assert.equal((await picture(page)).own, false);
    for (const change of [{ mode: 'vertexError' }, { mode: 'light' }, { mode: 'shaded', detail: 1 }]) {
      await set(page, change);
      const { own, text } = await picture(page);
      assert.ok(own && text === '', JSON.stringify(change));
    }
  }));

test('playing ends with all there is', () =>
  withMesh('', async (page) => {
    await page.getByRole('button', { name: 'Play from coarse to fine' }).click();
    await until(page, () => window.kilnViewer.state.get().detail < 0.5);
    await until(page, () => window.kilnViewer.state.get().detail === 1);
    assert.equal((await picture(page)).own, true);
  }));

test('a mesh that is damaged is said where its numbers would stand', () => {
  const damaged = Buffer.from(file);
  const magic = damaged.indexOf(Buffer.from([0x32, 0x4b, 0x50, 0x4d])); // little endian
  assert.ok(magic > 0);
  damaged[magic + 4] = 9; // a degree of 9
  return startMock({ files: { 'scene.glb': damaged } }).then(async (other) => {
    try {
      await withReady(browser, `${other.url}/view/${jobId('done')}#detail=0.5`, async (page) => {
        assert.match(await page.locator('#detail-text').innerText(), /KILN_progressive_mesh: /);
        assert.ok(await page.evaluate(() => window.kilnViewer.model.root.visible));
      });
    } finally {
      await other.close();
    }
  });
});
