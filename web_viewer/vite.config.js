import { dirname, resolve } from 'node:path';
import { fileURLToPath } from 'node:url';
import { defineConfig } from 'vite';

const root = dirname(fileURLToPath(import.meta.url));
const kilnd = process.env.KILN_SERVER ?? 'http://127.0.0.1:8080';

// Draco's decoder is a script that exports to whoever is there, but not to ES modules.
const kDraco = 'three/examples/jsm/libs/draco/gltf/draco_wasm_wrapper.js';
const dracoAsModule = {
  name: 'draco-as-module',
  transform: (code, id) => (id.includes(kDraco) ? { code: `${code}\nexport default DracoDecoderModule;`, map: null } : null),
};

// The dev server answers as kilnd does: /view/{id} is view.html, /docs is docs.html, /trade is trade.html.
const pagesOfKilnd = {
  name: 'pages-of-kilnd',
  configureServer(server) {
    server.middlewares.use((request, _response, next) => {
      if (/^\/view\/[^./]+([?#]|$)/.test(request.url)) request.url = '/view.html';
      if (/^\/docs([?#]|$)/.test(request.url)) request.url = '/docs.html';
      if (/^\/trade([?#]|$)/.test(request.url)) request.url = '/trade.html';
      next();
    });
  },
};

export default defineConfig({
  root,
  base: '/',
  plugins: [dracoAsModule, pagesOfKilnd],
  worker: { format: 'es', plugins: () => [dracoAsModule] },
  optimizeDeps: { exclude: [kDraco] },
  server: { proxy: { '/v1': kilnd, '/openapi.json': kilnd } },
  build: {
    target: 'es2022',
    modulePreload: { polyfill: false },
    assetsInlineLimit: 0,
    chunkSizeWarningLimit: 900,
    rollupOptions: { input: ['index.html', 'view.html', 'docs.html', 'trade.html'].map((page) => resolve(root, page)) },
  },
});
