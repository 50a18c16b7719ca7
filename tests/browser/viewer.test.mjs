// The viewer page in Chromium: what it shows is compared with an evaluation of the same file in Node.

import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { after, before, test } from 'node:test';
import { openPage, ready, startBrowser, until, withReady } from './browser.mjs';
import { jobId, startMock } from './mock_server.mjs';
import { decodeBaked, valueAt } from './read_glb.mjs';
import { load } from './sources.mjs';

const file = readFileSync(new URL('fixtures/scene.glb', import.meta.url));
const baked = await decodeBaked(file);
const { kSkies, projectSky } = await load('light/skies.ts');
const { rotateAboutY } = await load('light/sh.ts');
const kView = `/view/${jobId('done')}`;

let browser, mock;
before(async () => {
  [browser, mock] = [await startBrowser(), await startMock()];
});
after(async () => {
  await browser.close();
  await mock.close();
});

const withViewer = (hash, act, options) =>
  withReady(browser, `${mock.url}${kView}${hash ? `#${hash}` : ''}`, act, options);

test('the page of a job has its history, also where there is nothing to show', async () => {
  for (const [name, lines] of [
    ['done', 1],
    ['canceled', 6],
  ]) {
    const page = await openPage(browser, `${mock.url}/view/${jobId(name)}`);
    await page.locator('summary', { hasText: 'History' }).click();
    await until(page, (n) => document.querySelectorAll('.history li').length === n, lines);
    await page.context().close();
  }
});

/// The untextured part, and its vertex that faces the camera most squarely.
const kPart = baked.parts.findIndex(
  (_part, i) =>
    !baked.json.materials[baked.json.meshes[0].primitives[i].material]?.pbrMetallicRoughness?.baseColorTexture,
);

const pickVertex = (page) =>
  page.evaluate((partIndex) => {
    const { stage, model } = window.kilnViewer;
    const { mesh } = model.parts[partIndex];
    const [position, normal] = [mesh.geometry.getAttribute('position'), mesh.geometry.getAttribute('normal')];
    stage.camera.updateMatrixWorld();
    const eye = stage.camera.position;
    let best = { facing: -1 };
    for (let v = 0; v < position.count; ++v) {
      const at = eye.clone().fromBufferAttribute(position, v).applyMatrix4(mesh.matrixWorld);
      const facing = eye.clone().sub(at).normalize().dot(eye.clone().fromBufferAttribute(normal, v));
      if (facing <= best.facing) continue;
      const screen = at.project(stage.camera);
      best = { facing, v, x: (screen.x + 1) / 2, y: (screen.y + 1) / 2 };
    }
    return best;
  }, kPart);

/// The display colour (0 to 1) that is drawn at a place of the canvas, and the factor of exposure in force.
const readPixel = (page, { x, y }) =>
  page.evaluate(
    ([x, y]) => {
      const { stage } = window.kilnViewer;
      stage.drawNow();
      const gl = stage.renderer.getContext();
      const pixel = new Uint8Array(4);
      gl.readPixels(
        Math.floor(x * gl.drawingBufferWidth),
        Math.floor(y * gl.drawingBufferHeight),
        1,
        1,
        gl.RGBA,
        gl.UNSIGNED_BYTE,
        pixel,
      );
      return {
        colour: [...pixel.slice(0, 3)].map((value) => value / 255),
        exposure: stage.renderer.toneMappingExposure,
      };
    },
    [x, y],
  );

const settled = (page) => until(page, () => !window.kilnViewer.relighting);
const encode = (linear) => (linear <= 0.0031308 ? 12.92 * linear : 1.055 * linear ** (1 / 2.4) - 0.055);
const clamp = (value) => Math.min(1, Math.max(0, value));

const lights = {
  'the light of the bake': { hash: '', light: Float32Array.from(baked.extension.light.coefficients.flat()) },
  'a constant sky': { hash: 'light=constant', sky: 'constant' },
  'a clear sky with sun, turned': { hash: 'light=clear&rotation=75', sky: 'clear', rotation: 75 },
  'studio lamps at half intensity': { hash: 'light=studio&intensity=0.5', sky: 'studio', intensity: 0.5 },
  'an overcast sky without the scene’s lamps': { hash: 'light=overcast&lamps=false', sky: 'overcast', lamps: false },
};

for (const [name, { hash, light, sky, rotation = 0, intensity = 1, lamps = true }] of Object.entries(lights)) {
  test(`a pixel under ${name} is what the file’s numbers give`, () =>
    withViewer(`${hash}&tone=none&ev=-1`, async (page) => {
      await settled(page);
      const { order } = baked.extension;
      const own =
        light ??
        rotateAboutY(
          order,
          projectSky(
            kSkies.find(({ id }) => id === sky),
            order,
          ),
          rotation,
        ).map((value) => intensity * value);
      const vertex = await pickVertex(page);
      const part = baked.parts[kPart];
      const value = valueAt(baked.extension, part, vertex.v, own, lamps);
      const { colour, exposure } = await readPixel(page, vertex);
      const expected = value.map((v, c) =>
        encode(clamp(exposure * (part.albedoAt(vertex.v)[c] * Math.max(0, v) + part.emission[c]))),
      );
      // 8-bit display steps, and the pixel's centre lies up to a pixel beside the vertex on a curved surface.
      colour.forEach((shown, c) =>
        assert.ok(
          Math.abs(shown - expected[c]) < 0.02,
          `${name}: shown ${colour}, expected ${expected} at ${JSON.stringify(vertex)}`,
        ),
      );
      assert.ok(Math.max(...expected) > 0.1, 'too dark to mean anything');
    }));
}

test('a click on the model tells the light there', () =>
  withViewer('light=constant', async (page) => {
    await settled(page);
    const vertex = await pickVertex(page);
    const box = await page.locator('.stage').boundingBox();
    await page.mouse.click(box.x + vertex.x * box.width, box.y + (1 - vertex.y) * box.height);
    const shown = (await page.locator('.probe').innerText()).match(/[-\d.]+(?=[, ])/g).map(Number);
    const { order } = baked.extension;
    const light = projectSky(
      kSkies.find(({ id }) => id === 'constant'),
      order,
    );
    const value = valueAt(baked.extension, baked.parts[kPart], vertex.v, light);
    // Three digits are shown, and the click is rounded to a pixel.
    value.forEach((v, c) => assert.ok(Math.abs(shown[c] - v) < 0.02, `${shown} for ${value}`));
  }));

test('turning the light changes pixels; turning it back restores them', () =>
  withViewer('light=studio&tone=none', async (page) => {
    const vertex = await pickVertex(page);
    const first = (await readPixel(page, vertex)).colour;
    await page.locator('#c-rotation').fill('140');
    await settled(page);
    const turned = (await readPixel(page, vertex)).colour;
    assert.ok(Math.hypot(...first.map((value, c) => value - turned[c])) > 0.05, `${first} and ${turned}`);
    await page.locator('#c-rotation').fill('0');
    await settled(page);
    assert.deepEqual((await readPixel(page, vertex)).colour, first);
  }));

test('idle means idle: orbiting asks nothing of the worker, and a still page draws nothing', () =>
  withViewer('', async (page) => {
    await settled(page);
    await page.evaluate(() => {
      window.draws = 0;
      window.posts = 0;
      const { stage, relighter } = window.kilnViewer;
      stage.onDrawn = () => ++window.draws;
      const post = relighter.worker.postMessage.bind(relighter.worker);
      relighter.worker.postMessage = (...message) => (++window.posts, post(...message));
    });
    await page.focus('.stage');
    await page.keyboard.press('ArrowLeft');
    await until(page, () => window.draws >= 1);
    assert.equal(await page.evaluate(() => window.posts), 0);
    await new Promise((resolve) => setTimeout(resolve, 400));
    const before = await page.evaluate(() => window.draws);
    await new Promise((resolve) => setTimeout(resolve, 500));
    assert.equal(await page.evaluate(() => window.draws), before);
  }));

test('the address carries the whole view, there and back', () =>
  withViewer('', async (page) => {
    await page.selectOption('#c-light', 'sunset');
    await page.locator('#c-ev').fill('1.5');
    await page.locator('#c-wire').check();
    await page.selectOption('#c-mode', 'coefficient');
    await page.locator('#c-slot').fill('5');
    await page.focus('.stage');
    await page.keyboard.press('ArrowRight');
    await until(page, () => {
      const wanted = window.kilnViewer.stage.pose.map((value) => Number(value.toFixed(3))).join(',');
      return location.hash.includes(`pose=${wanted}`) && /slot=5/.test(location.hash);
    });
    const [address, pose] = await page.evaluate(() => [location.href, window.kilnViewer.stage.pose]);
    await page.goto('about:blank');
    await page.goto(address);
    await ready(page);
    const [state, poseAgain] = await page.evaluate(() => [window.kilnViewer.state.get(), window.kilnViewer.stage.pose]);
    assert.deepEqual(
      [state.light, state.ev, state.wire, state.mode, state.slot],
      ['sunset', 1.5, true, 'coefficient', 5],
    );
    pose.forEach((value, i) => assert.ok(Math.abs(value - poseAgain[i]) < 1e-3)); // three decimals travel
    assert.equal(await page.locator('#c-light').inputValue(), 'sunset');
  }));

test('the keys do what the help says', () =>
  withViewer('', async (page) => {
    const state = () => page.evaluate(() => window.kilnViewer.state.get());
    const pose = () => page.evaluate(() => window.kilnViewer.stage.pose);
    const start = await pose();
    await page.keyboard.press('w');
    await page.keyboard.press('b');
    await page.keyboard.press(']');
    await page.keyboard.press('+');
    await page.keyboard.press('2');
    const now = await state();
    assert.deepEqual([now.wire, now.background, now.rotation, now.ev, now.mode], [true, 'off', 5, 0.5, 'light']);
    await page.keyboard.press('ArrowUp');
    await page.keyboard.press('PageUp');
    assert.notDeepEqual(await pose(), start);
    await page.keyboard.press('r');
    (await pose()).forEach((value, i) => assert.ok(Math.abs(value - start[i]) < 1e-6));
    await page.keyboard.press('h');
    assert.ok(await page.locator('dialog.help').isVisible());
    await page.keyboard.press('Escape');
    await page.keyboard.press('c');
    await until(page, () => window.kilnViewer.comparison !== null);
    const download = page.waitForEvent('download');
    await page.keyboard.press('s');
    assert.match((await download).suggestedFilename(), /^kiln-.*\.png$/);
  }));

test('the divider shows the original on its left and moves with the arrow keys', () =>
  withViewer('compare=0.5&light=constant&background=off', async (page) => {
    await until(page, () => window.kilnViewer.comparison !== null);
    const vertex = await pickVertex(page);
    const at = async (compare) => {
      await page.evaluate((compare) => window.kilnViewer.state.set({ compare }), compare);
      return (await readPixel(page, vertex)).colour;
    };
    const [original, baked] = [await at(1), await at(0)];
    assert.ok(Math.max(...original) > 0.2, `the original is black: ${original}`);
    assert.notDeepEqual(original, baked);
    await page.evaluate(() => window.kilnViewer.state.set({ compare: 0.5 }));
    await page.focus('.divider');
    await page.keyboard.press('ArrowRight');
    assert.equal(await page.evaluate(() => window.kilnViewer.state.get().compare), 0.52);
  }));

test('a comparison that would be plain white is exposed less, and says so', () =>
  withViewer('compare=0.5&light=baked&intensity=1', async (page) => {
    await until(page, () => window.kilnViewer.comparison !== null);
    const label = () => page.locator('.side-before').innerText();
    assert.equal(await label(), 'Before: unshadowed light');
    // As in a closed room: exposed for little light.
    await page.evaluate(() => {
      const { model, state } = window.kilnViewer;
      model.transfer.look.exposure *= 16;
      state.set({ mode: 'measure', ev: 1 });
    });
    assert.match(await label(), /exposed \d\.\d EV less/);
    const exposure = await page.evaluate(() => window.kilnViewer.comparison.exposure);
    assert.ok(exposure < 1 / 3 && exposure > 1 / 64, `${exposure}`);
  }));

test('the default tone map is that of the bake', () =>
  withViewer('ev=-1', async (page) => {
    const vertex = await pickVertex(page);
    const part = baked.parts[kPart];
    const light = Float32Array.from(baked.extension.light.coefficients.flat());
    const value = valueAt(baked.extension, part, vertex.v, light);
    const shoulder = (x) => (x <= 0.6 ? x : 1 - 0.4 * Math.exp((0.6 - x) / 0.4));
    for (const ev of [-1, 1]) {
      await page.evaluate((ev) => window.kilnViewer.state.set({ ev }), ev);
      const { colour, exposure } = await readPixel(page, vertex);
      const expected = value.map((v, c) =>
        encode(shoulder(exposure * (part.albedoAt(vertex.v)[c] * Math.max(0, v) + part.emission[c]))),
      );
      colour.forEach((shown, c) =>
        assert.ok(Math.abs(shown - expected[c]) < 0.02, `shown ${colour}, expected ${expected}`),
      );
    }
  }));

test('where to refine: the legend fits and the flat floor’s far corner is cold', () =>
  withViewer('mode=weighted', async (page) => {
    await until(page, () => !document.querySelector('.legend').hidden);
    assert.match(await page.locator('.legend').innerText(), /× √area[^]*0[^]*and above/);
  }));

test('a dropped .hdr of one colour lights like a constant sky of it', () =>
  withViewer('tone=none&ev=-1', async (page) => {
    const header = Buffer.from('#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 4 +X 8\n');
    const texels = Buffer.concat(Array.from({ length: 32 }, () => Buffer.from([128, 64, 32, 129]))); // (1, 0.5, 0.25)
    await page.setInputFiles('#environment-file', {
      name: 'plain.hdr',
      mimeType: 'image/vnd.radiance',
      buffer: Buffer.concat([header, texels]),
    });
    await until(page, () => window.kilnViewer.state.get().light === 'file' && !window.kilnViewer.relighting);
    const coefficients = await page.evaluate(() => [...window.kilnViewer.lights.coefficients('file').slice(0, 6)]);
    // sqrt(4 pi) times the colour; three reads RGBE mantissas as value / 255
    [1, 0.5, 0.25].forEach((value, c) =>
      assert.ok(Math.abs(coefficients[c] / (Math.sqrt(4 * Math.PI) * value) - 1) < 0.01, `${coefficients}`),
    );
    for (const odd of coefficients.slice(3)) assert.ok(Math.abs(odd) < 1e-3);
    assert.equal(await page.locator('#c-light').inputValue(), 'file');
  }));

test('a dropped file that is no environment is refused in words', () =>
  withViewer('', async (page) => {
    await page.setInputFiles('#environment-file', {
      name: 'cat.hdr',
      mimeType: 'image/png',
      buffer: Buffer.from('nothing of the kind'),
    });
    await until(page, () =>
      /neither a Radiance .hdr nor an OpenEXR/.test(document.querySelector('.toast')?.textContent ?? ''),
    );
  }));

test('statistics show counts, certificate with interval, plan and warnings', () =>
  withViewer('', async (page) => {
    await page.locator('summary', { hasText: 'Statistics' }).click();
    const text = await page.locator('.statistics').innerText();
    const vertices = baked.parts.reduce((sum, part) => sum + part.vertices, 0).toLocaleString('en');
    assert.ok(text.includes(vertices), text);
    assert.match(text, /1\.2\s% relative error \(95\s%: 1\.0\s% to 1\.5\s%\)/);
    assert.match(text, /Own light, in full detail\s+3\.4\s% \(95\s%: 2\.9\s% to 4\.1\s%\)/);
    assert.match(text, /order: 4 sample made in code/);
    assert.match(text, /metal_as_diffuse A metal is modelled/);
  }));

test('a job that is still baked is followed until it can be shown', async () => {
  const id = jobId('running');
  const page = await openPage(browser, `${mock.url}/view/${id}`);
  await until(page, () => /The job is running/.test(document.querySelector('.overlay').textContent));
  await until(
    page,
    () => performance.getEntriesByType('resource').some((entry) => entry.name.includes('/events')) || true,
  );
  while (mock.streams.size === 0) await new Promise((resolve) => setTimeout(resolve, 20));
  mock.emit('progress', { stage: 'transfer', done: 1, total: 2, fraction: 0.5, eta_s: 1 });
  await until(page, () => /Baking: transfer, 50 %/.test(document.querySelector('.overlay').textContent));
  mock.change(id, { status: 'succeeded', artifacts: mock.jobs.get(jobId('done')).artifacts });
  await ready(page);
  await page.context().close();
});

test('the bake’s own picture is shown until the live one is, unless another view is asked for', async () => {
  for (const [hash, shown] of [
    ['', true],
    ['#light=constant', false],
  ]) {
    const page = await openPage(browser, 'about:blank');
    let go = () => {};
    const gate = new Promise((resolve) => (go = resolve));
    await page.route('**/scene.glb', async (route) => {
      await gate;
      await route.continue();
    });
    await page.goto(`${mock.url}${kView}${hash}`);
    await until(page, () => document.title.endsWith('– Kiln')); // the job is known
    if (shown) await until(page, () => document.querySelector('img.preview')?.naturalWidth > 0);
    assert.equal(await page.locator('img.preview').isVisible(), shown);
    go();
    await ready(page);
    assert.equal(await page.locator('img.preview').count(), 0);
    await page.context().close();
  }
});

test('the first view holds the whole model in the 3:2 picture of preview.png, whatever the canvas', async () => {
  for (const viewport of [
    { width: 1280, height: 700 },
    { width: 700, height: 1100 },
  ])
    await withViewer(
      '',
      async (page) => {
        const { across, along } = await page.evaluate(() => {
          const { stage, model } = window.kilnViewer;
          const { aspect } = stage.camera; // the picture fills the canvas along one side, and a share of the other:
          const [wide, high] = [Math.min(1, 1.5 / aspect), Math.min(1, aspect / 1.5)];
          const corners = [0, 1, 2, 3, 4, 5, 6, 7].map((bits) => {
            const { min, max } = model.bounds;
            const pick = (bit, axis) => (bits & bit ? max[axis] : min[axis]);
            return stage.camera.position.clone().set(pick(1, 'x'), pick(2, 'y'), pick(4, 'z')).project(stage.camera);
          });
          return {
            across: Math.max(...corners.map(({ x }) => Math.abs(x))) / wide,
            along: Math.max(...corners.map(({ y }) => Math.abs(y))) / high,
          };
        });
        assert.ok(across < 1 && along < 1, `${across} x ${along}`);
        assert.ok(Math.max(across, along) > 0.7, `${across} x ${along}: too far away`); // margin 1.06, corners in depth
      },
      { viewport },
    );
});

test('a failed job and an unknown one say why', async () => {
  for (const [id, words] of [
    [jobId('failed'), /element 812: index 70001/],
    ['none', /there is no such thing here/],
  ]) {
    const page = await openPage(browser, `${mock.url}/view/${id}`);
    await until(page, () => document.querySelector('.overlay .problem') !== null);
    assert.match(await page.locator('.overlay').innerText(), words);
    await page.context().close();
  }
});

test('after dispose no GPU memory, no worker and no listener is left', () =>
  withViewer('mode=weighted&wire=true&compare=0.5&light=clear', async (page) => {
    await until(
      page,
      () =>
        window.kilnViewer.comparison !== null &&
        window.kilnViewer.surfaces.heatMap !== null &&
        window.kilnViewer.surfaces.wireframe !== null,
    );
    const before = await page.evaluate(() => {
      const { stage } = window.kilnViewer;
      stage.drawNow();
      return { ...stage.renderer.info.memory };
    });
    assert.ok(before.geometries > 4 && before.textures > 2, JSON.stringify(before));
    assert.ok(page.workers().length >= 1);
    await page.evaluate(() => window.kilnDispose());
    const after = await page.evaluate(() => {
      const { info } = window.kilnViewer.stage.renderer;
      const lost = window.kilnViewer.stage.renderer.getContext().isContextLost();
      // three 0.187 forgets to count down the programs of its own PMREM filter; they go with the context.
      const programs = info.programs.map(({ name }) => name).filter((name) => !name.startsWith('PMREM'));
      return { geometries: info.memory.geometries, textures: info.memory.textures, programs, lost };
    });
    assert.deepEqual(after, { geometries: 0, textures: 0, programs: [], lost: true });
    for (let i = 0; page.workers().length > 0 && i < 100; ++i) await new Promise((resolve) => setTimeout(resolve, 20));
    assert.equal(page.workers().length, 0);
    const wire = await page.evaluate(() => window.kilnViewer.state.get().wire);
    await page.keyboard.press('w');
    assert.equal(await page.evaluate(() => window.kilnViewer.state.get().wire), wire);
  }));

test('each false-colour picture, wireframe and comparison gives back what it took', () =>
  withViewer('', async (page) => {
    await settled(page);
    const memory = () =>
      page.evaluate(() => {
        window.kilnViewer.stage.drawNow();
        const { geometries, textures } = window.kilnViewer.stage.renderer.info.memory;
        return { geometries, textures };
      });
    const before = await memory();
    const set = (change) => page.evaluate((change) => window.kilnViewer.state.set(change), change);
    for (const mode of ['weighted', 'coefficient', 'measure']) {
      await set({ mode, wire: true });
      await until(page, () => window.kilnViewer.surfaces.heatMap !== null);
      assert.ok((await memory()).geometries > before.geometries);
      await set({ mode: 'shaded', wire: false });
      await until(page, () => window.kilnViewer.surfaces.heatMap === null);
      assert.deepEqual(await memory(), before);
    }
  }));

test('at the width of a phone the model and the settings share the screen', () =>
  withViewer(
    '',
    async (page) => {
      assert.ok((await page.evaluate(() => document.documentElement.scrollWidth)) <= 390);
      const { height } = await page.locator('.stage').boundingBox();
      assert.ok(height > 300, `${height}`);
    },
    { viewport: { width: 390, height: 844 } },
  ));
