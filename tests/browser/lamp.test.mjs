// A lamp that moves: its reflected light is what the file's links give, its direct light has shadows.

import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { after, before, test } from 'node:test';
import { startBrowser, withReady } from './browser.mjs';
import { jobId, startMock } from './mock_server.mjs';
import { load } from './sources.mjs';

const bytes = readFileSync(new URL('fixtures/links.glb', import.meta.url)); // the demo's room, few points: make_links.sh
const { lightSenders, readLinks, solveNodes, gatherRows, readVertices } = await load('light/links.ts');
const { splitGlb } = await load('asset/glb.ts');
const whole = bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.length);
const kView = `/view/${jobId('done')}`;

let browser, mock;
before(async () => ([browser, mock] = [await startBrowser(), await startMock({ files: { 'scene.glb': bytes } })]));
after(async () => {
  await browser.close();
  await mock.close();
});

function linksOf(change = () => {}) {
  const { json, binary } = splitGlb(whole);
  const extension = structuredClone(json.extensions.KILN_meshless_light);
  change(extension);
  const links = readLinks(extension, (i) => {
    const { byteOffset = 0, byteLength } = json.bufferViews[i];
    return binary.subarray(byteOffset, byteOffset + byteLength);
  });
  return { links, extension };
}

test('the file is read as it was written, and a strange one is refused in words', () => {
  const { links, extension } = linksOf();
  assert.equal(links.scale.length, extension.rows);
  assert.equal(links.linkNodes.length / 4, extension.links);
  assert.throws(() => linksOf((e) => (e.version = 2)), /version 2/);
  assert.throws(() => linksOf((e) => (e.vertices += 1)), /vertices/);
  assert.throws(() => linksOf((e) => (e.nodes = 1e6)), /out of range/);
  assert.throws(() => linksOf((e) => (e.bufferViews.links = e.bufferViews.sites)), /KILN_meshless_light/);
});

test('reflected light is linear in the lamp and dark where nothing is seen', () => {
  const { links, extension } = linksOf();
  const light = (power, seen) => {
    const direct = lightSenders(links, { place: [0.05, 0.1, 0.02], intensity: [power, power, power] }, seen);
    const to = new Float32Array(3 * extension.vertices);
    const normals = new Float32Array(to.length).map((_, i) => (i % 3 === 1 ? 1 : 0));
    readVertices(links, gatherRows(links, solveNodes(links, direct)), normals, { first: 0, to });
    return to;
  };
  const all = new Uint8Array(links.samples.length / 4).fill(1);
  const [one, four] = [light(1, all), light(4, all)];
  assert.ok(Math.max(...one) > 0);
  one.forEach((value, i) => assert.ok(Math.abs(4 * value - four[i]) <= 1e-5 * four[i] + 1e-12));
  assert.ok(light(1, all.map(() => 0)).every((value) => value === 0));
});

const withViewer = (hash, act) => withReady(browser, `${mock.url}${kView}#background=off&${hash}`, act);

test('what the vertices show is what the links give for the samples that the lamp reaches', () =>
  withViewer('lampAt=0.2,0.3,0.1', async (page) => {
    const shown = await page.evaluate(async () => {
      const { model, relighter } = window.kilnViewer;
      const lamp = window.kilnLamp;
      await lamp.settled();
      const seen = await lamp.shadow.seen();
      const { matrixWorld } = model.parts[0].mesh;
      return {
        seen: [...seen],
        place: lamp.place.clone().applyMatrix4(matrixWorld.clone().invert()).toArray(),
        watts: lamp.uniforms.lampIntensity.value.x / matrixWorld.elements[0] ** 2,
        light: model.parts.map(({ light }) => [...light.array]),
        normals: model.normals.map((n) => [...n]),
        samples: relighter.samples.length / 6,
      };
    });
    const { links } = linksOf();
    assert.equal(shown.samples, links.samples.length / 4);
    const reached = shown.seen.filter((s) => s !== 0).length / shown.seen.length;
    assert.ok(reached > 0.2 && reached < 1, `${reached} of the samples are reached`);
    const lamp = { place: shown.place, intensity: [shown.watts, shown.watts, shown.watts] };
    const rows = gatherRows(links, solveNodes(links, lightSenders(links, lamp, Uint8Array.from(shown.seen))));
    let first = 0;
    shown.normals.forEach((n, part) => {
      const to = new Float32Array(n.length);
      readVertices(links, rows, Float32Array.from(n), { first, to });
      first += n.length / 3;
      const most = Math.max(...to, 1e-6);
      to.forEach((value, i) => assert.ok(Math.abs(value - shown.light[part][i]) < 1e-4 * most));
    });
  }));

/// Mean of the picture's pixels, 0 to 255.
const brightness = (page) =>
  page.evaluate(() => {
    const { stage } = window.kilnViewer;
    if (window.kilnLamp?.ball) window.kilnLamp.ball.visible = false;
    stage.drawNow();
    const gl = stage.renderer.getContext();
    const pixels = new Uint8Array(4 * gl.drawingBufferWidth * gl.drawingBufferHeight);
    gl.readPixels(0, 0, gl.drawingBufferWidth, gl.drawingBufferHeight, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
    return pixels.reduce((sum, value, i) => (i % 4 === 3 ? sum : sum + value), 0) / (0.75 * pixels.length);
  });

test('direct light can be left out, and the light of the bake added', () =>
  withViewer('lampAt=0.2,0.3,0.1', async (page) => {
    const set = (change) => page.evaluate((c) => (window.kilnViewer.state.set(c), window.kilnLamp.settled()), change);
    const both = await brightness(page);
    await set({ lampIndirect: true });
    const indirect = await brightness(page);
    assert.ok(indirect < both - 2, `${indirect} is hardly darker than ${both}`);
    await set({ lampIndirect: false, lampBaked: true });
    assert.ok((await brightness(page)) > both + 1);
  }));

test('the lamp is dragged with the mouse and moved by keys', () =>
  withViewer('lampAt=0,0.2,0', async (page) => {
    const at = () => page.evaluate(() => window.kilnViewer.state.get().lampAt);
    const screen = await page.evaluate(() => {
      const { stage } = window.kilnViewer;
      const p = window.kilnLamp.ball.position.clone().project(stage.camera);
      const { left, top, width, height } = stage.canvas.getBoundingClientRect();
      window.kilnViewer.model.root.visible = true;
      return [left + ((p.x + 1) / 2) * width, top + ((1 - p.y) / 2) * height];
    });
    await page.evaluate(() => {
      for (const { mesh } of window.kilnViewer.model.parts) mesh.raycast = () => {}; // walls in front of the lamp
    });
    await page.mouse.move(...screen);
    await page.mouse.down();
    await page.mouse.move(screen[0] + 40, screen[1], { steps: 4 });
    await page.mouse.up();
    const dragged = await at();
    assert.notDeepEqual(dragged, [0, 0.2, 0]);
    await page.keyboard.press('o');
    assert.ok((await at())[1] > dragged[1]);
  }));
