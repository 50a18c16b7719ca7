// scene.glb unpacked as the light worker does it, against an independent decode of the same file.

import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { test } from 'node:test';
import { decodeBaked, glbJson, valueAt } from './read_glb.mjs';
import { fromViewer, load } from './sources.mjs';

const { splitGlb, joinGlb } = await load('asset/glb.ts');
const { readPacked, unpack: unpackRead } = await load('asset/unpack.ts');
const unpack = (decoder, bytes) => unpackRead(decoder, readPacked(bytes));
const { lightOfStored } = await load('asset/kiln_reader.ts');
const { coefficientsOf } = await load('light/transfer.ts');
const draco = await fromViewer('draco3dgltf').createDecoderModule({});

const file = readFileSync(new URL('fixtures/scene.glb', import.meta.url));
const bufferOf = (bytes) => bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.byteLength);
const baked = await decodeBaked(file);
const unpacked = unpack(draco, bufferOf(file));
const plain = glbJson(Buffer.from(unpacked.file));

/// The fixture with its JSON changed by `edit`, or its binary chunk by what `edit` returns.
function altered(edit) {
  const { json, binary } = splitGlb(bufferOf(file));
  return joinGlb(json, [edit(json) ?? binary]);
}

function numbersOf(index) {
  const { bufferView, byteOffset = 0, componentType, count, type } = plain.json.accessors[index];
  const view = plain.json.bufferViews[bufferView];
  const length = count * { SCALAR: 1, VEC2: 2, VEC3: 3, VEC4: 4 }[type];
  assert.ok(4 * length <= view.byteLength, `accessor ${index} ends inside its view`);
  const bytes = bufferOf(plain.binary.subarray(view.byteOffset + byteOffset, view.byteOffset + byteOffset + 4 * length));
  return { 5126: () => new Float32Array(bytes), 5125: () => new Uint32Array(bytes) }[componentType]();
}

test('a GLB that is joined splits into what it was made of, in pieces at multiples of four', () => {
  const { json, binary } = splitGlb(joinGlb({ name: 'é' }, [Uint8Array.of(1, 2, 3), Uint8Array.of(4)]));
  assert.deepEqual(json, { name: 'é' });
  assert.deepEqual([...binary], [1, 2, 3, 0, 4, 0, 0, 0]);
});

test('the plain file asks for no Draco and keeps every other word of the JSON', () => {
  const before = baked.json;
  for (const names of [plain.json.extensionsUsed, plain.json.extensionsRequired])
    assert.ok(!names.includes('KHR_draco_mesh_compression'));
  assert.ok(!JSON.stringify(plain.json.meshes).includes('KHR_draco_mesh_compression'));
  for (const key of ['asset', 'extensions', 'materials', 'nodes', 'samplers', 'scene', 'scenes', 'textures'])
    assert.deepEqual(plain.json[key], before[key], key);
  assert.equal(plain.json.buffers[0].byteLength, plain.binary.length);
});

test('both scenes have the positions and normals of the compressed ones, in the same order', () => {
  assert.equal(plain.json.meshes.length, 2);
  for (const { primitives } of plain.json.meshes) {
    primitives.forEach(({ attributes }, i) => {
      assert.deepEqual(numbersOf(attributes.POSITION), baked.parts[i].position);
      assert.deepEqual(numbersOf(attributes.NORMAL), baked.parts[i].normal);
    });
  }
});

test('indices are below the number of vertices, three for each triangle, and the same for both scenes', () => {
  plain.json.meshes[0].primitives.forEach((primitive, i) => {
    const indices = numbersOf(primitive.indices);
    assert.equal(indices.length, baked.json.accessors[baked.json.meshes[0].primitives[i].indices].count);
    assert.ok(indices.every((v) => v < baked.parts[i].vertices));
    assert.deepEqual(numbersOf(plain.json.meshes[1].primitives[i].indices), indices);
  });
});

test('the two scenes share their numbers, and no accessor: each may be disposed of by itself', () => {
  const [here, there] = plain.json.meshes.map(({ primitives }) => primitives);
  const own = [...here, ...there].flatMap(({ attributes, indices }) => [...Object.values(attributes), indices]);
  assert.equal(new Set(own).size, own.length);
  const viewOf = (index) => plain.json.accessors[index].bufferView;
  here.forEach(({ attributes, indices }, i) => {
    assert.equal(viewOf(attributes.POSITION), viewOf(there[i].attributes.POSITION));
    assert.equal(viewOf(indices), viewOf(there[i].indices));
  });
});

test('points of a bake stay out of the plain file, and are read', () => {
  const points = readFileSync(new URL('fixtures/points.glb', import.meta.url)); // of fixtures/make_points.sh
  assert.equal(glbJson(points).json.extensions.KILN_meshless_light.version, 2);
  const { file: plainly, links, points: field } = unpack(draco, bufferOf(points));
  assert.equal(links, null);
  assert.deepEqual(field.levelEnd, glbJson(points).json.extensions.KILN_meshless_light.levels);
  assert.equal(field.sites.length, 4 * field.levelEnd.at(-1));
  assert.equal(field.coefficients.length, 3 * field.levelEnd.at(-1));
  const { json } = glbJson(Buffer.from(plainly));
  assert.equal(json.extensions.KILN_meshless_light, undefined);
  assert.equal(json.extensions.KILN_lightmap.version, 1);
});

test('images are the same bytes', () => {
  const [before, after] = [glbJson(file), plain].map(({ json, binary }) =>
    json.images.map(({ bufferView }) => {
      const { byteOffset = 0, byteLength } = json.bufferViews[bufferView];
      return [...binary.subarray(byteOffset, byteOffset + byteLength)];
    }),
  );
  assert.deepEqual(after, before);
});

test('the transfer vectors are apart, those of the file, and nowhere in the plain file', () => {
  assert.equal(unpacked.baked.length, baked.parts.length);
  unpacked.baked.forEach(({ stored, positions, indices }, i) => {
    const part = baked.parts[i];
    assert.deepEqual(coefficientsOf(unpacked.transfer, stored), Float32Array.from(part.transfer)); // doubles rounded once
    assert.deepEqual(positions, part.position);
    assert.deepEqual(indices, numbersOf(plain.json.meshes[0].primitives[i].indices));
  });
  for (const { attributes } of plain.json.meshes[0].primitives)
    assert.ok(!Object.keys(attributes).some((name) => name.startsWith('_PRT') || name === 'COLOR_0'));
});

test('components give the light that the file defines, lamps and all, and the coefficients behind it', async () => {
  const bytes = readFileSync(new URL('fixtures/components.glb', import.meta.url));
  const { extension, parts } = await decodeBaked(bytes);
  const { transfer, baked: read, file: written } = unpack(draco, bufferOf(bytes));
  assert.equal(transfer.components.rank, extension.components.rank);
  const light = Float32Array.from({ length: 3 * extension.order ** 2 }, (_, i) => Math.sin(i)); // of size 1, any signs
  const kSums = 2e-5; // float32 numbers, rows and sums of 20 terms below 4, against double
  read.forEach(({ stored }, i) => {
    for (const lamps of [true, false]) {
      const values = lightOfStored(transfer, stored, light, lamps);
      for (let v = 0; v < parts[i].vertices; v += 5)
        valueAt(extension, parts[i], v, light, lamps).forEach((value, c) =>
          assert.ok(Math.abs(values[3 * v + c] - value) < kSums, `${values[3 * v + c]} is not ${value}`),
        );
    }
    coefficientsOf(transfer, stored).forEach((t, k) => assert.ok(Math.abs(t - parts[i].transfer[k]) < kSums));
  });
  const { json, binary } = glbJson(Buffer.from(written));
  const { byteOffset = 0, byteLength } = json.bufferViews[json.extensions.KILN_radiance_transfer.components.bufferView];
  const rows = new Float32Array(bufferOf(binary.subarray(byteOffset, byteOffset + byteLength)));
  assert.deepEqual(rows, transfer.rows);
});

test('what the decoder lends it gets back: a hundred files need no more memory than a few', () => {
  for (let i = 0; i < 3; ++i) unpack(draco, bufferOf(file));
  const before = draco.HEAPU32.length;
  for (let i = 0; i < 100; ++i) unpack(draco, bufferOf(file));
  assert.equal(draco.HEAPU32.length, before);
});

const kBroken = {
  'no file at all': [new ArrayBuffer(0), /no GLB/],
  'a text': [bufferOf(Buffer.from('{"asset": {"version": "2.0"}, "scenes": []}')), /no GLB/],
  'a file that is cut off': [bufferOf(file.subarray(0, file.length - 5000)), /cut off/],
  'a glTF of another kind': [altered((json) => void delete json.extensions), /no KILN_radiance_transfer/],
  'a version to come': [altered((json) => void (json.extensions.KILN_radiance_transfer.version = 3)), /knows/],
  'a view beyond the end': [altered((json) => void (json.bufferViews[0].byteLength = 1e9)), /beyond the end/],
  'a view that is not there': [
    altered((json) => void (json.meshes[0].primitives[0].extensions.KHR_draco_mesh_compression.bufferView = 99)),
    /no buffer view 99/,
  ],
  'an accessor that is not there': [
    altered((json) => void (json.meshes[0].primitives[0].attributes.POSITION = 999)),
    /no accessor 999/,
  ],
  'a primitive without compression': [
    altered((json) => void delete json.meshes[0].primitives[0].extensions.KHR_draco_mesh_compression),
    /not compressed/,
  ],
  'a primitive that lacks a transfer vector': [
    altered((json) => void delete json.meshes[0].primitives[0].extensions.KHR_draco_mesh_compression.attributes._PRT_1),
    /lacks _PRT_1/,
  ],
  'an attribute that Draco does not know': [
    altered((json) => void (json.meshes[0].primitives[0].extensions.KHR_draco_mesh_compression.attributes._PRT_1 = 77)),
    /no attribute 77/,
  ],
  'noise in place of the geometry': [
    altered(() => Uint8Array.from({ length: file.length }, (_, i) => (i * 7919) >> 3)),
    /cannot be decoded/,
  ],
};

for (const [name, [bytes, words]] of Object.entries(kBroken))
  test(`${name} is refused in words`, () => assert.throws(() => unpack(draco, bytes), words));
