// Progressive meshes in the viewer: the same bits as C++ at every level.
//
// fixtures/progressive.bin and progressive_weights.bin are what core/lightfield/progressive_mesh.h wrote, light as floats
// and as weights; the .txt beside each has some of its levels: splits, vertices, triangles, and SHA-256 of the geometry
// and light. progressive_mesh_test (C++) checks the same files.

import assert from 'node:assert/strict';
import { createHash } from 'node:crypto';
import { readFileSync } from 'node:fs';
import { test } from 'node:test';
import { load } from './sources.mjs';

const { ProgressiveMesh } = await load('light/progressive_mesh.ts');
const fixture = (name) => readFileSync(new URL(`fixtures/${name}`, import.meta.url));
const bytesOf = (name) => new Uint8Array(fixture(`${name}.bin`));
const levelsOf = (name) => fixture(`${name}.txt`).toString().trim().split('\n').map((line) => line.split(' '));
const file = bytesOf('progressive');

function hash(mesh) {
  const sum = createHash('sha256');
  const put = (array, count) => sum.update(new Uint8Array(array.buffer, array.byteOffset, 4 * count));
  for (const { values, width } of mesh.columns.values()) put(values, width * mesh.vertexCount);
  put(mesh.triangles, 3 * mesh.triangleCount);
  put(mesh.part, mesh.triangleCount);
  return sum.digest('hex');
}

function expectLevel(mesh, [level, vertices, triangles, expected]) {
  mesh.goTo(Number(level));
  assert.equal(mesh.vertexCount, Number(vertices));
  assert.equal(mesh.triangleCount, Number(triangles));
  assert.equal(hash(mesh), expected, `level ${level}`);
}

test('every level has the bits of the C++ decoder, forwards, backwards and by leaps', () => {
  for (const name of ['progressive', 'progressive_weights']) {
    const [mesh, levels] = [new ProgressiveMesh(bytesOf(name)), levelsOf(name)];
    assert.ok(levels.length > 5);
    for (const line of levels) expectLevel(mesh, line);
    for (const line of [...levels].reverse()) expectLevel(mesh, line);
    for (let i = 0; i < 40; ++i) expectLevel(mesh, levels[(i * 7) % levels.length]);
  }
});

test('errors fall from level to level and end at none', () => {
  const mesh = new ProgressiveMesh(file);
  for (let k = 1; k < mesh.levels; ++k) assert.ok(mesh.error(k) <= mesh.error(k - 1));
  assert.ok(mesh.error(0) > 0);
  assert.equal(mesh.error(mesh.levels - 1), 0);
});

test('what does not fit together is said in words', () => {
  assert.throws(() => new ProgressiveMesh(file.subarray(0, 20)), /KILN_progressive_mesh: the header/);
  assert.throws(() => new ProgressiveMesh(file.subarray(0, file.length - 4)), /bytes and not/);
  const spoilt = (word, value) => {
    const copy = file.slice();
    new DataView(copy.buffer).setUint32(4 * word, value, true);
    return () => new ProgressiveMesh(copy);
  };
  assert.throws(spoilt(0, 7), /version/);
  assert.throws(spoilt(3, 1 << 30), /base is larger/);
  assert.throws(spoilt(11, 0x7fc00000), /not finite/); // the first position
  const [vertices, triangles] = new Uint32Array(file.buffer, file.byteOffset + 20, 2);
  const width = [...new ProgressiveMesh(file).columns.values()].reduce((sum, c) => sum + c.width, 0);
  const corners = 11 + width * vertices;
  assert.throws(spoilt(corners, vertices), /base: triangle 0/);
  const splits = corners + 4 * triangles;
  assert.throws(spoilt(splits, 0), /split 0: it brings/);
  assert.throws(spoilt(splits + 2, vertices), /split 0: a parent/);
  assert.throws(spoilt(splits + 4, 0x7fc00000), /split 0: errors/);
});

test('whatever bytes are changed, a file is read or refused in words', () => {
  let seed = 1;
  const random = () => (seed = (Math.imul(seed, 1664525) + 1013904223) >>> 0) / 2 ** 32;
  let refused = 0;
  for (let i = 0; i < 400; ++i) {
    const copy = bytesOf(i % 4 < 2 ? 'progressive' : 'progressive_weights');
    for (let k = 0; k < 3; ++k) copy[Math.floor(random() * (i % 2 ? 44 : copy.length))] = Math.floor(random() * 256);
    try {
      new ProgressiveMesh(copy).goTo(1e9);
    } catch (e) {
      assert.match(e.message, /^KILN_progressive_mesh: /);
      ++refused;
    }
  }
  assert.ok(refused > 150);
});
