// The page of what accuracy costs: its reading of trade.csv in Node, and the page in Chromium.

import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { after, before, test } from 'node:test';
import { openPage, startBrowser, until } from './browser.mjs';
import { startMock } from './mock_server.mjs';
import { load, pathInViewer } from './sources.mjs';

const csv = readFileSync(pathInViewer('src/trade/trade.csv'), 'utf8');
const presets = JSON.parse(readFileSync(pathInViewer('src/trade/presets.json'), 'utf8'));

let browser, mock;
before(async () => {
  [browser, mock] = [await startBrowser(), await startMock()];
});
after(async () => {
  await browser.close();
  await mock.close();
});

async function withPage(act, options) {
  const page = await openPage(browser, `${mock.url}/trade`, options);
  try {
    await until(page, () => document.querySelectorAll('.trade-point').length > 0);
    await act(page);
    assert.deepEqual(page.faults, []);
    assert.deepEqual(await page.evaluate(() => window.violations), []);
  } finally {
    await page.context().close();
  }
}

const title = (page) => page.locator('.trade-details h2').innerText();
const points = (page) => page.locator('.trade-plot').first().locator('.trade-point').count();

test('the committed rows are rows of kiln-trade, and quoted fields survive', async () => {
  const { parseCsv, parseRuns } = await load('trade/runs.ts');
  assert.deepEqual(parseCsv('a,"b,""c""\nd"\r\ne,\nf'), [
    ['a', 'b,"c"\nd'],
    ['e', ''],
  ]);
  const runs = parseRuns(csv);
  assert.equal(runs.length, csv.trimEnd().split('\n').length - 1);
  for (const run of runs) {
    assert.ok(run.bytes > 0 && run.seconds.cpu > 0 && run.order > 0, run.setting);
    assert.ok(Object.values(run.errors).every(({ low, value, high }) => low <= value * 1.001 && value <= high * 1.001));
    assert.doesNotThrow(() => JSON.parse(run.fields.recipe));
  }
});

test('a point of the front is beaten by none, and every other by one of the front', async () => {
  const { paretoFront } = await load('trade/front.ts');
  const all = Array.from({ length: 60 }, (_, i) => ({ cost: (i * 37) % 11, error: (i * 53) % 13 }));
  const front = paretoFront(all).map((i) => all[i]);
  const beats = (a, b) => a.cost <= b.cost && a.error <= b.error && (a.cost < b.cost || a.error < b.error);
  assert.ok(front.every((p) => !all.some((q) => beats(q, p))));
  assert.ok(all.every((p) => front.some((q) => beats(q, p) || (q.cost === p.cost && q.error === p.error))));
});

test('means of the page are those that the presets were chosen by', async () => {
  const { meansOverScenes, parseRuns } = await load('trade/runs.ts');
  const means = new Map(meansOverScenes(parseRuns(csv)).map((run) => [run.setting, run]));
  const near = (a, b) => assert.ok(Math.abs(a / b - 1) < 1e-4, `${a} and ${b}`);
  for (const one of presets.front) {
    const mean = means.get(one.setting);
    near(mean.seconds.cpu, one.cpu_seconds);
    near(mean.bytes, one.artifact_bytes);
    near(mean.errors.both.value, one.error);
  }
});

test('both plots show every run, and the standard preset is selected', () =>
  withPage(async (page) => {
    const rows = csv.trimEnd().split('\n').length - 1;
    assert.equal(await page.locator('.trade-point').count(), 2 * rows);
    assert.match(await title(page), /standard$/);
    assert.equal(await page.locator('.trade-plot .front').count(), 2 * (presets.scenes.length + 1));
    assert.equal(await page.locator('.trade-presets tbody tr').count(), 6);
  }));

test('arrow keys walk from the cheapest run to the dearest and show each in full', () =>
  withPage(async (page) => {
    await page.locator('.trade-point[tabindex="0"]').first().focus();
    await page.keyboard.press('Home');
    const first = await title(page);
    assert.ok(await page.locator('.trade-tip').first().isVisible());
    await page.keyboard.press('ArrowRight');
    assert.notEqual(await title(page), first);
    await page.keyboard.press('End');
    await page.keyboard.press('ArrowRight');
    const last = await page.evaluate(() => {
      const all = [...document.querySelector('.trade-plot').querySelectorAll('.trade-point')];
      return all.indexOf(document.activeElement) === all.length - 1;
    });
    assert.ok(last);
    assert.equal(await page.locator('.trade-point[aria-selected="true"]').count(), 2);
  }));

test('the pointer over a point shows its run and the prediction beside it', () =>
  withPage(async (page) => {
    const point = page.locator('.trade-plot').nth(1).locator('.trade-point').last();
    const label = await point.getAttribute('aria-label');
    const box = await point.locator('path').boundingBox();
    await page.mouse.move(box.x + box.width / 2, box.y + box.height / 2);
    await until(page, () => !document.querySelectorAll('.trade-tip')[1].hidden);
    assert.equal(await page.locator('.trade-tip').nth(1).innerText(), label);
    assert.match(await page.locator('.trade-details').innerText(), /the plan said/);
  }));

test('scenes can be left out, means shown, and the error chosen', () =>
  withPage(async (page) => {
    const before = await points(page);
    await page.getByRole('checkbox', { name: presets.scenes[0] }).uncheck();
    assert.ok((await points(page)) < before);
    for (const scene of presets.scenes.slice(1)) await page.getByRole('checkbox', { name: scene }).uncheck();
    assert.equal(await points(page), 0);
    await page.getByRole('checkbox', { name: 'mean of all scenes' }).check();
    const means = await points(page);
    assert.ok(means >= 3);
    assert.ok((await page.locator('.trade-point path.hollow').count()) > 0, 'draft holds fewer bands');
    await page.selectOption('#error', 'both');
    assert.equal(await page.locator('.trade-point path.hollow').count(), 0);
    assert.equal(await points(page), means);
  }));

test('a narrow page has no sideways scroll', () =>
  withPage(async (page) => assert.ok(await page.evaluate(() => document.documentElement.scrollWidth <= innerWidth)), {
    viewport: { width: 390, height: 800 },
  }));
