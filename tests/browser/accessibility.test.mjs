// axe-core on every page and theme, and what it cannot see.

import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { after, before, test } from 'node:test';
import { axeSource, openPage, ready, startBrowser, until } from './browser.mjs';
import { jobId, startMock } from './mock_server.mjs';

let browser, mock, fieldMock;
before(async () => {
  [browser, mock] = [await startBrowser(), await startMock()];
  const file = readFileSync(new URL('fixtures/progressive.glb', import.meta.url));
  fieldMock = await startMock({ files: { 'scene.glb': file } });
  const { artifacts } = fieldMock.jobs.get(jobId('done'));
  artifacts.push({ ...artifacts[0], name: 'lod1.glb' });
});
after(async () => {
  await browser.close();
  await mock.close();
  await fieldMock.close();
});

const view = `/view/${jobId('done')}`;
const kPages = {
  gallery: { path: '/', wait: () => document.querySelectorAll('.card').length >= 6 },
  viewer: { path: view, wait: () => document.documentElement.dataset.ready === 'true' },
  'viewer with everything open': {
    path: `${view}#mode=coefficient&slot=3&compare=0.5`,
    wait: () => document.documentElement.dataset.ready === 'true',
    act: async (page) => {
      await page.locator('summary', { hasText: 'Statistics' }).click();
      await until(page, () => !document.querySelector('.legend').hidden);
    },
  },
  'a light field with levels and a progressive mesh': {
    path: `${view}#detail=0.5`,
    field: true,
    wait: () => document.documentElement.dataset.ready === 'true',
  },
  'help dialog': {
    path: view,
    wait: () => document.documentElement.dataset.ready === 'true',
    act: (page) => page.keyboard.press('h'),
  },
  'a job that is not there': { path: '/view/none', wait: () => document.querySelector('.overlay .problem') !== null },
  docs: {
    path: '/docs',
    wait: () => document.querySelectorAll('.operation').length > 0,
    act: (page) => page.locator('summary').first().click(),
  },
  trade: {
    path: '/trade',
    wait: () => document.querySelectorAll('.trade-point').length > 0,
    act: async (page) => {
      await page.locator('summary').first().click();
      await page.locator('.trade-point[tabindex="0"]').first().focus();
    },
  },
};

/// axe itself may not be injected as a script: the policy forbids it. Playwright evaluates it outside the policy.
async function violations(page) {
  await page.evaluate(readFileSync(axeSource(), 'utf8'));
  const { violations } = await page.evaluate(() => window.axe.run(document, { resultTypes: ['violations'] }));
  return violations.map(({ id, help, nodes }) => `${id}: ${help}: ${nodes.map((node) => node.html).join(' ')}`);
}

for (const [name, { path, wait, act, field }] of Object.entries(kPages)) {
  for (const colorScheme of ['dark', 'light']) {
    test(`axe finds nothing on: ${name}, ${colorScheme}`, async () => {
      const page = await openPage(browser, (field ? fieldMock : mock).url + path, { colorScheme });
      await until(page, wait);
      if (act) await act(page);
      assert.deepEqual(await violations(page), []);
      await page.context().close();
    });
  }
}

test('every page has one main landmark, one h1 and a title', async () => {
  for (const { path, wait } of Object.values(kPages)) {
    const page = await openPage(browser, mock.url + path);
    await until(page, wait);
    assert.deepEqual(
      await page.evaluate(() => [
        document.querySelectorAll('main').length,
        document.querySelectorAll('h1').length,
        document.title !== '',
      ]),
      [1, 1, true],
    );
    await page.context().close();
  }
});

test('with reduced motion nothing is animated', async () => {
  const page = await openPage(browser, mock.url, { reducedMotion: 'reduce' });
  await until(page, kPages.gallery.wait);
  assert.equal(await page.evaluate(() => document.getAnimations().length), 0);
  await page.context().close();
});

test('the theme is the system’s until it is changed, and the change is remembered', async () => {
  const page = await openPage(browser, mock.url, { colorScheme: 'light' });
  const ground = () => page.evaluate(() => getComputedStyle(document.body).backgroundColor);
  const light = await ground();
  await page.getByRole('button', { name: 'Switch to dark theme' }).click();
  const dark = await ground();
  assert.notEqual(dark, light);
  await page.reload();
  assert.equal(await ground(), dark);
  await page.context().close();
});

test('keyboard alone reaches the model, the settings and the help', async () => {
  const page = await openPage(browser, mock.url + view);
  await ready(page);
  const reached = new Set();
  for (let i = 0; i < 40; ++i) {
    await page.keyboard.press('Tab');
    reached.add(
      await page.evaluate(
        () => document.activeElement.id || document.activeElement.className || document.activeElement.textContent,
      ),
    );
  }
  for (const id of ['stage', 'Help', 'c-light', 'c-rotation', 'c-ev', 'c-mode', 'c-wire'])
    assert.ok(reached.has(id), `${id} in ${[...reached].join(', ')}`);
  await page.context().close();
});
