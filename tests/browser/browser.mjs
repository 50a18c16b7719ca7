// Chromium for the tests: found, started, watched. Playwright comes from web_viewer/node_modules.

import assert from 'node:assert/strict';
import { existsSync } from 'node:fs';
import { createRequire } from 'node:module';
import { kDist } from './mock_server.mjs';

const require = createRequire(new URL('../../web_viewer/package.json', import.meta.url));
export const kChromium = process.env.KILN_CHROMIUM ?? '/usr/bin/chromium';
const kWebGl = process.env.KILN_WEBGL ?? 'gl-egl'; // Mesa's llvmpipe: 2 to 6 times faster than SwiftShader without a GPU

/// Why browser tests cannot run here, or nothing.
export function whatIsMissing() {
  if (Number(process.versions.node.split('.')[0]) < 20) return `Playwright needs Node 20, this is ${process.version}`;
  if (!existsSync(kChromium)) return `no Chromium at ${kChromium}`;
  if (!existsSync(`${kDist}/index.html`)) return 'web_viewer/dist is not built: cd web_viewer && npx vite build';
  try {
    require.resolve('playwright-core');
    require.resolve('axe-core');
  } catch {
    return 'web_viewer/node_modules is missing: cd web_viewer && npm ci';
  }
  return null;
}

export const axeSource = () => require.resolve('axe-core/axe.min.js');

export async function startBrowser() {
  const { chromium } = require('playwright-core');
  return chromium.launch({
    executablePath: kChromium,
    args: [
      '--no-sandbox',
      `--use-angle=${kWebGl}`,
      '--ignore-gpu-blocklist',
      '--disable-background-networking',
      '--disable-component-update',
      '--no-first-run',
    ],
  });
}

/// A page that collects what must not happen: policy violations, script errors, console errors.
export async function openPage(browser, url, options = {}) {
  const context = await browser.newContext({ viewport: { width: 1280, height: 800 }, ...options });
  const page = await context.newPage();
  const faults = [];
  page.on('pageerror', (error) => faults.push(`page error: ${error.message}`));
  page.on('console', (message) => {
    if (message.type() === 'error' || /Content Security Policy/i.test(message.text()))
      faults.push(`console: ${message.text()}`);
  });
  page.on('request', (request) => {
    const { origin, protocol } = new URL(request.url());
    if (protocol.startsWith('http') && origin !== new URL(url).origin) faults.push(`foreign request: ${request.url()}`);
  });
  await page.addInitScript(() => {
    window.violations = [];
    document.addEventListener('securitypolicyviolation', (e) =>
      window.violations.push(`${e.violatedDirective} ${e.blockedURI}`),
    );
  });
  page.faults = faults;
  await page.goto(url);
  return page;
}

/// Polls instead of page.waitForFunction, which needs the unsafe-eval that our policy forbids.
export async function until(page, predicate, argument, milliseconds = 20000) {
  const end = Date.now() + milliseconds;
  for (;;) {
    const value = await page.evaluate(predicate, argument);
    if (value) return value;
    if (Date.now() > end) throw new Error(`waited ${milliseconds} ms in vain for ${predicate}`);
    await new Promise((resolve) => setTimeout(resolve, 25));
  }
}

export const ready = (page) => until(page, () => document.documentElement.dataset.ready === 'true');

/// Opens a viewer page, waits until it shows its light, acts, and expects no fault and no violation of its policy.
export async function withReady(browser, url, act, options) {
  const page = await openPage(browser, url, options);
  try {
    await ready(page);
    await act(page);
    assert.deepEqual(page.faults, []);
    assert.deepEqual(await page.evaluate(() => window.violations), []);
  } finally {
    await page.context().close();
  }
}
