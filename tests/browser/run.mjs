// node run.mjs FILE.test.mjs: runs one test file under ctest. Says why and ends with 77 when it cannot.

import { spawnSync } from 'node:child_process';
import { existsSync } from 'node:fs';
import { fileURLToPath } from 'node:url';
import { whatIsMissing } from './browser.mjs';

const [file] = process.argv.slice(2);
const here = fileURLToPath(new URL('.', import.meta.url));
const needsBrowser = !['light.test.mjs', 'unpack.test.mjs', 'types.test.mjs', 'progressive.test.mjs', 'import.test.mjs'].includes(file);
const packages = existsSync(`${here}../../web_viewer/node_modules/vite`);
const noServer = file === 'server.test.mjs' && !existsSync(process.env.KILND ?? '') ? 'kilnd is not built' : null;
const noClient = file === 'import.test.mjs' && !existsSync(process.env.KILN ?? '') ? 'kiln is not built' : null;
const missing =
  noServer ??
  noClient ??
  (needsBrowser ? whatIsMissing() : packages ? null : 'web_viewer/node_modules is missing: cd web_viewer && npm ci');
if (missing) {
  console.log(`SKIPPED: ${missing}`);
  process.exit(77);
}
// One file at a time: two browsers on two cores measure each other.
const { status } = spawnSync(process.execPath, ['--test', '--test-concurrency=1', `${here}${file}`], {
  stdio: 'inherit',
});
process.exit(status ?? 1);
