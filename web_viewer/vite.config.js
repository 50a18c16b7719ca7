import { dirname, resolve } from 'node:path';
import { fileURLToPath } from 'node:url';
import { defineConfig } from 'vite';

const root = dirname(fileURLToPath(import.meta.url));
const kilnd = process.env.KILN_SERVER ?? 'http://127.0.0.1:8080';

// DRACOLoader names its default decoders by URL, so that they would be emitted although load_gltf.ts gives it others.
const withoutUnusedDecoders = {
  name: 'without-unused-decoders',
  transform(code, id) {
    if (!id.includes('DRACOLoader.js')) return null;
    return { code: code.replace(/new URL\( '[^']*draco[^']*', import\.meta\.url \)\.toString\(\)/g, "''"), map: null };
  },
};

// The dev server answers as kilnd does: /view/{id} is view.html, /docs is docs.html.
const pagesOfKilnd = {
  name: 'pages-of-kilnd',
  configureServer(server) {
    server.middlewares.use((request, _response, next) => {
      if (/^\/view\/[^./]+([?#]|$)/.test(request.url)) request.url = '/view.html';
      if (/^\/docs([?#]|$)/.test(request.url)) request.url = '/docs.html';
      next();
    });
  },
};

export default defineConfig({
  root,
  base: '/',
  plugins: [withoutUnusedDecoders, pagesOfKilnd],
  worker: { format: 'es' },
  server: { proxy: { '/v1': kilnd, '/openapi.json': kilnd } },
  build: {
    target: 'es2022',
    modulePreload: { polyfill: false },
    assetsInlineLimit: 0,
    chunkSizeWarningLimit: 900,
    rollupOptions: { input: ['index.html', 'view.html', 'docs.html'].map((page) => resolve(root, page)) },
  },
});
