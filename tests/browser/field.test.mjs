// Light fields: the reader against kiln.
//
// fixtures/field.glb is a ball of metal over a floor, degree 4; lod1.glb and lod2.glb are the same with fewer vertices.
// field.csv is what core/lightfield/seen.cpp says that eyes see of it (fixtures/make_field.sh, print_seen.cpp).

import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { test } from 'node:test';
import { glbJson } from './read_glb.mjs';
import { fromViewer, load } from './sources.mjs';

const { evaluateSh } = await load('light/sh.ts');
const { harmonicsCode } = await load('shaders/harmonics_code.ts');
const { unpack, readPacked } = await load('asset/unpack.ts');
const reader = await load('asset/light_field.ts');
const { fieldCount, halfAt, halfOf, numberOfHalf, readLightField, seenRadiance, texelsOf } = reader;
const fixture = (name) => readFileSync(new URL(`fixtures/${name}`, import.meta.url));
const file = fixture('field.glb');
const draco = await fromViewer('draco3dgltf').createDecoderModule({});
const bytesOf = (buffer) => buffer.buffer.slice(buffer.byteOffset, buffer.byteOffset + buffer.byteLength);
const kHalfStep = 2 ** -11; // rounding to half floats, relative

const directions = Array.from({ length: 50 }, (_, i) => {
  const [z, angle] = [(2 * i + 1) / 50 - 1, 2.4 * i];
  return [Math.sqrt(1 - z * z) * Math.cos(angle), Math.sqrt(1 - z * z) * Math.sin(angle), z];
});
const harmonics = (degree, [x, y, z]) => {
  const out = new Float64Array(fieldCount(degree));
  evaluateSh(degree + 1, x, y, z, out);
  return out;
};

test('harmonics written out for a shader are the harmonics, to degree 8', () => {
  for (let degree = 0; degree <= 8; ++degree) {
    const names = Array.from({ length: fieldCount(degree) }, (_, i) => `y${i}`);
    const code = `${harmonicsCode(degree).replaceAll('float ', 'const ')} return [${names}];`;
    const evaluate = new Function('x', 'y', 'z', code);
    for (const w of directions) {
      const expected = harmonics(degree, w);
      // both are sums of fewer than 100 doubles below 20
      evaluate(...w).forEach((value, i) => assert.ok(Math.abs(value - expected[i]) < 1e-12, `degree ${degree}, y${i}`));
    }
  }
});

test('a half is the nearest one', () => {
  for (let half = 0; half < 0x7c00; ++half) {
    const value = numberOfHalf(half);
    assert.equal(halfOf(value), half);
    assert.equal(halfOf(-value), half === 0 ? 0x8000 : half | 0x8000);
    if (half + 1 === 0x7c00) continue;
    const next = numberOfHalf(half + 1);
    assert.equal(halfOf(value + 0.49 * (next - value)), half);
    assert.equal(halfOf(value + 0.51 * (next - value)), half + 1);
  }
  assert.equal(halfOf(1e9), 0x7bff, 'what is too large is the largest');
  for (const bad of [NaN, Infinity]) assert.throws(() => halfOf(bad), /not finite/);
});

test('every coefficient has a half of its own, and no texel is left over', () => {
  for (let degree = 0; degree <= 8; ++degree) {
    const places = new Set();
    for (let c = 0; c < 3; ++c) for (let i = 0; i < fieldCount(degree); ++i) places.add(halfAt(degree, i, c));
    assert.equal(places.size, 3 * fieldCount(degree));
    assert.equal(Math.max(...places), places.size - 1);
    assert.equal(texelsOf(degree), Math.ceil(places.size / 8));
  }
});

/// The largest error that rounding of coefficients can bring to (8).
function rounding(field, corners, weights, normal, view) {
  const y = harmonics(field.degree, reader.reflectedView(normal, view));
  const width = 8 * texelsOf(field.degree);
  const number = (v, i, c) => numberOfHalf(field.halves[width * v + halfAt(field.degree, i, c)]);
  return [0, 1, 2].map((c) => {
    let sum = 0;
    corners.forEach((v, k) => y.forEach((yi, i) => (sum += weights[k] * Math.abs(yi * number(v, i, c)))));
    return kHalfStep * field.unit * sum;
  });
}

test('what an eye sees between three vertices is what kiln says', () => {
  const { baked } = unpack(draco, readPacked(bytesOf(file)));
  const [names, ...lines] = fixture('field.csv').toString().trim().split('\n');
  assert.equal(names, 'part,triangle,u,v,nx,ny,nz,vx,vy,vz,r,g,b');
  const rows = lines.map((line) => line.split(',').map(Number));
  let below = 0;
  for (const [part, triangle, u, v, ...rest] of rows) {
    const { field, indices } = baked[part];
    const corners = [0, 1, 2].map((k) => indices[3 * triangle + k]);
    const [normal, view, expected] = [rest.slice(0, 3), rest.slice(3, 6), rest.slice(6)];
    if (normal[0] * view[0] + normal[1] * view[1] + normal[2] * view[2] < 0) ++below;
    const weights = [1 - u - v, u, v];
    const bound = rounding(field, corners, weights, normal, view);
    seenRadiance(field, corners, weights, normal, view).forEach((x, c) =>
      // and 1e-6 for dequantisation in floats by two decoders
      assert.ok(Math.abs(x - expected[c]) <= bound[c] + 1e-6, `${x} is not ${expected[c]} within ${bound[c]}`),
    );
  }
  assert.ok(rows.length >= 80 && below >= 20, 'too few rows, or no eye below a horizon');
});

test('the numbers of a field leave the plain file', () => {
  const { file: written } = unpack(draco, readPacked(bytesOf(file)));
  assert.match(file.toString('latin1'), /_SLF_0/);
  assert.doesNotMatch(Buffer.from(written).toString('latin1'), /_SLF_\d|KILN_light_field/);
});

const extension = () => structuredClone(glbJson(file).json.extensions.KILN_light_field);

test('of components mean and weighted rows are added', () => {
  const [degree, rank, slots] = [2, 5, 27];
  const rows = Float32Array.from({ length: (rank + 1) * slots }, (_, i) => Math.sin(1 + 7 * i));
  const e = { ...extension(), degree, form: 'components', components: { rank, bufferView: 3 } };
  e.attributes = ['_SLF_0', '_SLF_1'];
  [e.scale, e.offset] = [[1, 2, 3, 4, 5], [0.5, 0, -0.5, 0, 1]];
  const field = reader.storedField(readLightField({ extensions: { KILN_light_field: e } }), (view) => {
    assert.equal(view, 3);
    return new Uint8Array(rows.buffer);
  });
  const vertices = 5000; // more than are decoded together
  const stored = [0, 1].map((k) => Float32Array.from({ length: 4 * vertices }, (_, i) => Math.cos(i + k)));
  const { halves, unit } = reader.fieldTexels(field, stored);
  for (const v of [0, 1, 4095, 4096, vertices - 1])
    for (let s = 0; s < slots; ++s) {
      let [sum, size] = [rows[s], Math.abs(rows[s])];
      for (let k = 0; k < rank; ++k) {
        const term = (e.offset[k] + e.scale[k] * stored[k >> 2][4 * v + (k & 3)]) * rows[(k + 1) * slots + s];
        [sum, size] = [sum + term, size + Math.abs(term)];
      }
      const found = unit * numberOfHalf(halves[8 * texelsOf(degree) * v + halfAt(degree, s % 9, Math.floor(s / 9))]);
      assert.ok(Math.abs(found - sum) <= kHalfStep * Math.abs(sum) + 1e-6 * size, `${found} is not ${sum}`);
    }
});

const kFaults = {
  version: (e) => (e.version = 2),
  basis: (e) => (e.condonShortley = true),
  reflected: (e) => delete e.reflected,
  degree: (e) => (e.degree = 9),
  form: (e) => (e.form = 'sparse'),
  components: (e) => Object.assign(e, { form: 'components', components: { rank: 0, bufferView: 0 } }),
  attributes: (e) => e.attributes.reverse(),
  scale: (e) => e.scale.pop(),
  offset: (e) => (e.offset[7] = 'much'),
};

for (const [member, spoil] of Object.entries(kFaults))
  test(`a wrong ${member} is refused by its JSON pointer`, () => {
    const e = extension();
    spoil(e);
    const place = new RegExp(`^Error: /extensions/KILN_light_field/${member}: `);
    assert.throws(() => readLightField({ extensions: { KILN_light_field: e } }), place);
  });

test('a file without the extension has no field', () => assert.equal(readLightField({ extensions: {} }), undefined));

test('a primitive without its numbers is refused by their name', () => {
  const packed = readPacked(bytesOf(file));
  delete packed.json.meshes[0].primitives[1].extensions.KHR_draco_mesh_compression.attributes._SLF_3;
  assert.throws(() => unpack(draco, packed), /lacks _SLF_3/);
});
