// The viewer's TypeScript is sound.

import assert from 'node:assert/strict';
import { spawnSync } from 'node:child_process';
import { test } from 'node:test';
import { pathInViewer } from './sources.mjs';

test('tsc finds no fault in web_viewer/src', () => {
  const { status, stdout, stderr } = spawnSync(
    pathInViewer('node_modules/.bin/tsc'),
    ['--noEmit', '-p', pathInViewer('tsconfig.json')],
    { encoding: 'utf8' },
  );
  assert.equal(status, 0, stdout + stderr);
});
