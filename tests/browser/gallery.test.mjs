// The gallery in Chromium against the mock server.

import assert from 'node:assert/strict';
import { after, before, test } from 'node:test';
import { openPage, startBrowser, until } from './browser.mjs';
import { jobId, kHostileLabel, startMock } from './mock_server.mjs';

let browser, mock;
before(async () => {
  browser = await startBrowser();
});
after(() => browser.close());

/// Each test has a server of its own: they change jobs.
async function withGallery(act, options) {
  mock = await startMock();
  const page = await openPage(browser, mock.url, options);
  try {
    await until(
      page,
      () =>
        document.querySelectorAll('.card').length >= 6 && document.querySelector('.connection').dataset.live === 'true',
    );
    await act(page);
    assert.deepEqual(page.faults, []);
    assert.deepEqual(await page.evaluate(() => window.violations), []);
  } finally {
    await page.context().close();
    await mock.close();
  }
}

const card = (page, name) => page.locator(`[data-job="${jobId(name)}"]`);

test('all jobs are shown, newest first, with status, time, error and picture', () =>
  withGallery(async (page) => {
    const order = await page.$$eval('.card', (cards) => cards.map((c) => c.dataset.job));
    assert.deepEqual(order, [...mock.jobs.keys()].reverse());
    assert.match(await card(page, 'failed').innerText(), /Failed[^]*element 812: index 70001 is not below/);
    const said = (i) =>
      /Done[^]*took 24 s · 102 kB · error 1\.2\s%/.test(document.querySelector(`[data-job="${i}"]`).innerText);
    await until(page, said, jobId('done')); // the error is read from the job's report
    await until(page, (id) => document.querySelector(`[data-job="${id}"] img`)?.naturalWidth > 0, jobId('done'));
  }));

test('progress and the end of a job arrive without a reload', () =>
  withGallery(async (page) => {
    const id = jobId('running');
    mock.emit('progress', { job: id, stage: 'subdivide', done: 3, total: 4, fraction: 0.75, eta_s: 3, error: 0.034 });
    await until(page, (i) => document.querySelector(`[data-job="${i}"] progress`).value === 0.75, id);
    assert.match(await card(page, 'running').innerText(), /75 %, 3\.0 s left, error 3\.4\s% so far/);
    assert.match(await card(page, 'running').innerText(), /subdivide · 75 %, 3.0 s left/);
    mock.change(id, { status: 'succeeded', progress: null, artifacts: mock.jobs.get(jobId('done')).artifacts });
    await until(page, (i) => document.querySelector(`[data-job="${i}"]`).dataset.status === 'succeeded', id);
    assert.equal(await card(page, 'running').locator('a.primary').getAttribute('href'), `/view/${id}`);
    assert.match(await page.locator('#live').innerText(), /hotel room: succeeded/);
  }));

test('a list that was asked for before an event does not undo it', () =>
  withGallery(async (page) => {
    const id = jobId('running');
    let release;
    const held = new Promise((resolve) => (release = resolve));
    await page.route('**/v1/jobs?*', async (route) => {
      const answer = await route.fetch();
      await held;
      await route.fulfill({ response: answer });
    });
    await page.selectOption('#status', 'running'); // asks for the list
    mock.emit('progress', { job: id, stage: 'subdivide', done: 3, total: 4, fraction: 0.75, eta_s: 3 });
    const value = () => page.evaluate((i) => document.querySelector(`[data-job="${i}"] progress`).value, id);
    await until(page, (i) => document.querySelector(`[data-job="${i}"] progress`).value === 0.75, id);
    const arrived = page.waitForResponse((response) => response.url().includes('/v1/jobs?'));
    release();
    await (await arrived).finished();
    await page.evaluate(() => new Promise((resolve) => setTimeout(resolve, 100)));
    assert.equal(await value(), 0.75);
  }));

test('a job’s name is text, whatever it contains', () =>
  withGallery(async (page) => {
    assert.equal(await card(page, 'hostile').locator('h3').innerText(), kHostileLabel);
    assert.equal(await page.evaluate(() => window.hacked), undefined);
    assert.equal(await page.evaluate(() => document.querySelectorAll('.card h3 *').length), 0);
  }));

test('the history of a job tells why it ran twice, as text', () =>
  withGallery(async (page) => {
    await card(page, 'canceled').locator('summary', { hasText: 'History' }).click();
    await until(page, (id) => document.querySelectorAll(`[data-job="${id}"] .history li`).length === 6, jobId('canceled'));
    const lines = await card(page, 'canceled').locator('.history li').allInnerTexts();
    const said = lines.map((text) => text.replace(/^\S+( [AP]M)? /, ''));
    assert.equal(said[1], 'Running: attempt 1');
    assert.ok(said[2].startsWith('Back in the queue: its lease ended without a word of its server <img'), said[2]);
    assert.equal(said[3], 'Running: attempt 2');
    assert.equal(said[4], 'cancellation requested');
    assert.equal(said[5], 'Canceled');
    assert.equal(await page.evaluate(() => window.hacked), undefined);
  }));

test('filters by status and label hide the others and say when none is left', () =>
  withGallery(async (page) => {
    const shown = () => page.$$eval('.card:not([hidden])', (cards) => cards.length);
    await page.selectOption('#status', 'succeeded');
    assert.equal(await shown(), 2);
    await page.fill('#label', 'KNOT');
    assert.equal(await shown(), 1);
    await page.fill('#label', 'no such job');
    assert.equal(await shown(), 0);
    assert.equal(await page.locator('.empty').innerText(), 'No job matches the filter.');
  }));

test('cancel and delete do what they say', () =>
  withGallery(async (page) => {
    await card(page, 'running').getByRole('button', { name: 'Cancel' }).click();
    await until(
      page,
      (id) => document.querySelector(`[data-job="${id}"]`).dataset.status === 'canceled',
      jobId('running'),
    );
    await card(page, 'failed').getByRole('button', { name: 'Delete' }).click();
    await until(page, (id) => !document.querySelector(`[data-job="${id}"]`), jobId('failed'));
    assert.ok(!mock.jobs.has(jobId('failed')));
  }));

test('a chosen model is uploaded with the chosen preset', () =>
  withGallery(async (page) => {
    await page.selectOption('#preset', 'draft');
    await page.setInputFiles('#model', { name: 'teapot.glb', mimeType: 'model/gltf-binary', buffer: Buffer.alloc(64) });
    await until(page, () =>
      [...document.querySelectorAll('.card h3')].some((title) => title.textContent === 'teapot.glb'),
    );
    assert.equal([...mock.jobs.values()].at(-1).recipe.preset, 'draft');
  }));

test('a dropped model starts a job; a refusal is shown in the server’s words', () =>
  withGallery(async (page) => {
    const drop = (name, bytes) =>
      page.evaluate(
        ([name, bytes]) => {
          const dataTransfer = new DataTransfer();
          dataTransfer.items.add(new File([new Uint8Array(bytes)], name));
          document.body.dispatchEvent(new DragEvent('dragenter', { dataTransfer, bubbles: true }));
          document.body.dispatchEvent(new DragEvent('drop', { dataTransfer, bubbles: true, cancelable: true }));
        },
        [name, bytes],
      );
    await drop('dropped.glb', 64);
    await until(page, () =>
      [...document.querySelectorAll('.card h3')].some((title) => title.textContent === 'dropped.glb'),
    );
    await drop('short.glb', 3);
    await until(page, () => /shorter than a GLB header/.test(document.querySelector('.uploads').textContent));
    page.faults.length = 0; // the browser logs the 422 itself
    await drop('notes.txt', 3);
    await until(page, () => /notes.txt is not a model/.test(document.querySelector('.toast').textContent));
  }));

test('the connection mends itself and catches up with what happened meanwhile', () =>
  withGallery(async (page) => {
    mock.jobs.get(jobId('queued')).status = 'canceled'; // said to nobody
    for (const stream of mock.streams) stream.end();
    await until(
      page,
      (id) => document.querySelector(`[data-job="${id}"]`).dataset.status === 'canceled',
      jobId('queued'),
    );
    await until(page, () => document.querySelector('.connection').textContent === 'live');
    page.faults.length = 0; // the browser may log the lost stream
  }));

test('at the width of a phone nothing is cut off', () =>
  withGallery(
    async (page) => {
      assert.ok((await page.evaluate(() => document.documentElement.scrollWidth)) <= 390);
    },
    { viewport: { width: 390, height: 844 } },
  ));
