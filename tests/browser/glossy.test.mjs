// Specular parts: the reader and the picture against the format's own words, and these against kiln.
//
// fixtures/glossy.glb is a ball of metal over a floor, order 5, without subdivision. glossy.csv is what
//   kiln eval glossy.glb --points P.csv --albedo scene
// says of some of its vertices towards eyes, P.csv being its first nine columns.

import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { after, before, test } from 'node:test';
import { openPage, ready, startBrowser, until } from './browser.mjs';
import { jobId, startMock } from './mock_server.mjs';
import { decodeBaked, radianceTowards } from './read_glb.mjs';
import { fromViewer, load } from './sources.mjs';

const { evaluateSh } = await load('light/sh.ts');
const { readPacked, unpack } = await load('asset/unpack.ts');
const { arrivingLight } = await load('asset/kiln_reader.ts');
const fixture = (name) => readFileSync(new URL(`fixtures/${name}`, import.meta.url));
const file = fixture('glossy.glb');
const baked = await decodeBaked(file);
const [ball, floor] = baked.parts;
const light = Float32Array.from(baked.extension.light.coefficients.flat());
const harmonics = (order, [x, y, z]) => {
  const out = new Float64Array(order * order);
  evaluateSh(order, x, y, z, out);
  return out;
};
const radiance = (v, view) => radianceTowards(baked, ball, v, view, light, harmonics);

test('the words of the format and kiln eval agree on what a vertex sends to an eye', () => {
  const [names, ...rows] = fixture('glossy.csv').toString().trim().split('\n');
  assert.match(names, /^x,y,z,nx,ny,nz,vx,vy,vz,/);
  assert.ok(rows.length > 20);
  const { scale = [1, 1, 1], translation = [0, 0, 0] } = baked.json.nodes[baked.json.scenes[0].nodes[0]];
  for (const row of rows.map((line) => line.split(',').map(Number))) {
    const [place, view, expected] = [row.slice(0, 3), row.slice(6, 9), row.slice(12, 15)];
    let v = -1;
    for (let i = 0; i < ball.vertices && v < 0; ++i)
      if (place.every((x, k) => Math.abs(scale[k] * ball.position[3 * i + k] + translation[k] - x) < 1e-6)) v = i;
    assert.ok(v >= 0, 'a point is no vertex');
    // kiln looks the point up in floats: 1e-7 of an edge beside the vertex; and sums of 58 floats below 20.
    radiance(v, view).forEach((x, c) =>
      assert.ok(Math.abs(x - expected[c]) < 1e-3 * (1 + expected[c]), `${x} is not ${expected[c]}`),
    );
  }
});

test('matrices leave the plain file, and the worker finds in them what arrives', async () => {
  const bytes = file.buffer.slice(file.byteOffset, file.byteOffset + file.byteLength);
  const draco = await fromViewer('draco3dgltf').createDecoderModule({});
  const { file: written, arriving, baked: parts } = unpack(draco, readPacked(bytes));
  const text = Buffer.from(written).toString('latin1');
  assert.ok(!/"_(GLOSSY|PRT)_\d+":/.test(text), 'an attribute is left');
  assert.equal(parts[1].weights.length, 0);
  const found = arrivingLight(arriving, parts[0].weights, light, true);
  const count = baked.extension.glossy.order ** 2;
  for (let v = 0; v < ball.vertices; v += 5)
    ball.arrivingAt(v, light).forEach((rgb, o) =>
      // float32 sums of 58 terms, of light of size 20
      rgb.forEach((x, c) => assert.ok(Math.abs(found[4 * (v * count + o) + c] - x) < 1e-4 * (1 + Math.abs(x)))),
    );
});

let browser, mock;
before(async () => {
  [browser, mock] = [await startBrowser(), await startMock({ files: { 'scene.glb': file } })];
});
after(async () => {
  await browser.close();
  await mock.close();
});

const encode = (linear) => (linear <= 0.0031308 ? 12.92 * linear : 1.055 * linear ** (1 / 2.4) - 0.055);

/// The vertices of the ball that face the camera: the direction to the eye, and the colour that is drawn there.
const look = (page, pose) =>
  page.evaluate((pose) => {
    const { stage, model } = window.kilnViewer;
    stage.pose = pose;
    stage.drawNow();
    stage.camera.updateMatrixWorld();
    const { mesh } = model.parts[0];
    const [position, normal] = [mesh.geometry.getAttribute('position'), mesh.geometry.getAttribute('normal')];
    const eye = stage.camera.position;
    const gl = stage.renderer.getContext();
    const seen = [];
    for (let v = 0; v < position.count; ++v) {
      const at = eye.clone().fromBufferAttribute(position, v).applyMatrix4(mesh.matrixWorld);
      const view = eye.clone().sub(at).normalize();
      if (view.dot(eye.clone().fromBufferAttribute(normal, v)) < 0.6) continue;
      const screen = at.clone().project(stage.camera);
      const pixel = new Uint8Array(4);
      const [x, y] = [(screen.x + 1) / 2, (screen.y + 1) / 2];
      const [left, low] = [Math.floor(x * gl.drawingBufferWidth), Math.floor(y * gl.drawingBufferHeight)];
      gl.readPixels(left, low, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, pixel);
      seen.push({ v, view: view.toArray(), colour: [...pixel.slice(0, 3)].map((value) => value / 255) });
    }
    return { seen, exposure: stage.renderer.toneMappingExposure };
  }, pose);

test('pixels of a metal are what its matrices send to the eye, from wherever it looks', async () => {
  const page = await openPage(browser, `${mock.url}/view/${jobId('done')}#tone=none&ev=-2`);
  try {
    await ready(page);
    await until(page, () => !window.kilnViewer.relighting);
    const brightest = [];
    for (const pose of [
      [0.9, 0.84, 1.8, 0, 0.3, 0],
      [-1.8, 0.9, -0.4, 0, 0.3, 0],
    ]) {
      const { seen, exposure } = await look(page, pose);
      assert.ok(seen.length > 8);
      let bright = seen[0];
      for (const one of seen) {
        const expected = radiance(one.v, one.view).map((x) => encode(Math.min(1, Math.max(0, exposure * x))));
        // The pixel's centre lies up to a pixel beside the vertex: .01 of the ball, over which a lobe of five bands
        // changes by about .04 of its range.
        one.colour.forEach((x, c) =>
          assert.ok(Math.abs(x - expected[c]) < 0.04, `${one.colour} is not ${expected}, vertex ${one.v}`),
        );
        if (one.colour[1] > bright.colour[1]) bright = one;
      }
      brightest.push(bright.v);
    }
    assert.notEqual(brightest[0], brightest[1], 'the highlight stays where it was');
    assert.deepEqual(page.faults, []);
  } finally {
    await page.context().close();
  }
});

test('a diffuse part beside it has no matrices', () => {
  assert.equal(floor.arrivingAt, null);
});
