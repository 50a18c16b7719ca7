// How fast the viewer is in headless Chromium. Prints one JSON line per case; asserts nothing.
//   node bench.mjs [SCENE.glb]   a baked scene; without one a made-up field of 50 000 vertices with raw coefficients
//   preview_ms         from the request of /view/{id}, nothing cached, to the bake's own picture shown in place of the model
//   first_picture_ms   to the first lit picture of the model itself; both in an open window
//   launched_*         the same right after Chromium has been started: its own pages (tool bar, panels) take both cores then
//   relight_ms         in the worker, for a new light (median); frame_ms: one orbit step, drawn and read back (median)
//   of a light field   its degree, and frame_ms by what is drawn: the field at each pixel, at the vertices, and diffuse
//                      light alone, which tells what triangles and pixels cost without it

import { readFileSync } from 'node:fs';
import { loadavg } from 'node:os';
import { openPage, ready, startBrowser, until, whatIsMissing } from './browser.mjs';
import { makeLarge } from './make_large.mjs';
import { jobId, startMock } from './mock_server.mjs';

const kRuns = 5;
const kSettled = 3000; // ms
const median = (values) => [...values].sort((a, b) => a - b)[Math.floor(values.length / 2)];
const round = (value) => Math.round(10 * value) / 10;
const startOf = (page, mark) => page.evaluate((name) => performance.getEntriesByName(name)[0]?.startTime ?? NaN, mark);

async function firstPicture(browser, url, wait) {
  const page = await openPage(browser, wait > 0 ? 'about:blank' : url);
  await page.waitForTimeout(wait);
  if (wait > 0) await page.goto(url);
  await ready(page);
  return { page, preview: await startOf(page, 'kiln:preview'), picture: await startOf(page, 'kiln:first-picture') };
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

const frames = (page, mode) =>
  page.evaluate((mode) => {
    const { stage, state } = window.kilnViewer;
    state.set({ mode });
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
  }, mode);

const missing = whatIsMissing();
if (missing) {
  console.log(JSON.stringify({ bench: 'viewer', skipped: missing }));
  process.exit(0);
}
const scene = process.argv[2] ? readFileSync(process.argv[2]) : await makeLarge(224, 6);
const mock = await startMock({ files: { 'scene.glb': scene } });
const url = `${mock.url}/view/${jobId('done')}`;
const [launched, open] = [[], []];
for (let run = 0; run < kRuns; ++run) {
  const browser = await startBrowser();
  launched.push(await firstPicture(browser, url, 0));
  await launched[run].page.context().close();
  open.push(await firstPicture(browser, url, kSettled));
  if (run + 1 < kRuns) await browser.close();
}
const { page } = open[kRuns - 1];
const of = (runs, what) => round(median(runs.map((run) => run[what])));
const relight_ms = await relights(page);
const degree = await page.evaluate(() => window.kilnViewer.level.field?.degree);
const frame_ms = {};
for (const mode of degree === undefined ? ['shaded'] : ['shaded', 'vertices', 'light'])
  frame_ms[mode] = round(median(await frames(page, mode)));
console.log(
  JSON.stringify({
    bench: 'viewer',
    vertices: await page.evaluate(() => window.kilnViewer.model.vertices),
    triangles: await page.evaluate(() => window.kilnViewer.model.triangles),
    numbers: await page.evaluate(() => window.kilnViewer.model.transfer.scale.length), // of a vertex
    bytes: scene.length,
    preview_ms: of(open, 'preview'),
    first_picture_ms: of(open, 'picture'),
    launched_preview_ms: of(launched, 'preview'),
    launched_first_picture_ms: of(launched, 'picture'),
    relight_ms: round(relight_ms),
    frame_ms: degree === undefined ? frame_ms.shaded : frame_ms,
    degree,
    load: round(loadavg()[0]),
  }),
);
await page.context().browser().close();
await mock.close();
