// How fast the viewer is in headless Chromium. Prints one JSON line per case; asserts nothing.
//   node bench.mjs [SCENE.glb]   a baked scene; without one a made-up field of 50 000 vertices with raw coefficients
//   first_picture_ms   from the request of /view/{id} in an open window, nothing cached, to the first lit picture drawn
//   relight_ms         in the worker, for a new light (median); frame_ms: one orbit step, drawn and read back (median)

import { readFileSync } from 'node:fs';
import { loadavg } from 'node:os';
import { openPage, ready, startBrowser, until, whatIsMissing } from './browser.mjs';
import { makeLarge } from './make_large.mjs';
import { jobId, startMock } from './mock_server.mjs';

const kRuns = 5;
const kSettled = 3000; // ms: a new window's own pages (tool bar, panels) take both cores for a second or two
const median = (values) => [...values].sort((a, b) => a - b)[Math.floor(values.length / 2)];
const round = (value) => Math.round(10 * value) / 10;

async function firstPicture(browser, url) {
  const page = await openPage(browser, 'about:blank');
  await page.waitForTimeout(kSettled);
  await page.goto(url);
  await ready(page);
  const at = await page.evaluate(() => performance.getEntriesByName('kiln:first-picture')[0].startTime);
  return { page, at };
}

async function relights(page) {
  const out = [];
  for (let turn = 5; turn <= 60; turn += 5) {
    await page.evaluate((rotation) => window.kilnViewer.state.set({ rotation }), turn);
    await until(page, () => !window.kilnViewer.relighting);
    out.push(await page.evaluate(() => window.kilnViewer.relitMilliseconds));
  }
  return median(out);
}

const frames = (page) =>
  page.evaluate(() => {
    const { stage } = window.kilnViewer;
    const gl = stage.renderer.getContext();
    const times = [];
    for (let i = 0; i < 12; ++i) {
      const start = performance.now();
      stage.camera.rotation.y += 0.01;
      stage.drawNow();
      gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, new Uint8Array(4));
      times.push(performance.now() - start);
    }
    return times;
  });

const missing = whatIsMissing();
if (missing) {
  console.log(JSON.stringify({ bench: 'viewer', skipped: missing }));
  process.exit(0);
}
const scene = process.argv[2] ? readFileSync(process.argv[2]) : await makeLarge(224, 6);
const [browser, mock] = [await startBrowser(), await startMock({ files: { 'scene.glb': scene } })];
const pictures = [];
for (let run = 0; run < kRuns; ++run) {
  const { page, at } = await firstPicture(browser, `${mock.url}/view/${jobId('done')}`);
  pictures.push(at);
  if (run + 1 < kRuns) {
    await page.context().close();
    continue;
  }
  const [relight_ms, times] = [await relights(page), await frames(page)];
  console.log(
    JSON.stringify({
      bench: 'viewer',
      vertices: await page.evaluate(() => window.kilnViewer.model.vertices),
      triangles: await page.evaluate(() => window.kilnViewer.model.triangles),
      numbers: await page.evaluate(() => window.kilnViewer.model.transfer.scale.length), // of a vertex
      bytes: scene.length,
      first_picture_ms: round(median(pictures)),
      first_picture_best_ms: round(Math.min(...pictures)),
      relight_ms: round(relight_ms),
      frame_ms: round(median(times)),
      load: round(loadavg()[0]),
    }),
  );
}
await browser.close();
await mock.close();
