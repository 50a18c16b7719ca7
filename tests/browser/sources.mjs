// TypeScript of the viewer for tests in Node: bundled by vite's own esbuild, loaded from a data URL.

import { createRequire } from 'node:module';
import { fileURLToPath } from 'node:url';

const viewer = fileURLToPath(new URL('../../web_viewer/', import.meta.url));
const require = createRequire(`${viewer}package.json`);

export async function bundle(entry, options = {}) {
  const esbuild = createRequire(require.resolve('vite'))('esbuild');
  const { outputFiles } = await esbuild.build({
    entryPoints: [entry],
    bundle: true,
    format: 'esm',
    write: false,
    target: 'es2022',
    nodePaths: [`${viewer}node_modules`],
    ...options,
  });
  return outputFiles[0].text;
}

/// load('light/sh.ts') -> the module
export async function load(path) {
  return import(`data:text/javascript,${encodeURIComponent(await bundle(`${viewer}src/${path}`))}`);
}

export const fromViewer = (name) => require(name);
export const pathInViewer = (path) => `${viewer}${path}`;
