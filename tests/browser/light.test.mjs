// The viewer's arithmetic, without a browser.

import assert from 'node:assert/strict';
import { test } from 'node:test';
import { load } from './sources.mjs';

const { evaluateSh, rotateAboutY, projectFunction, clampedCosineTransfer, shCount } = await load('light/sh.ts');
const { sphereQuadrature } = await load('light/quadrature.ts');
const { brightOf, directionAt, lightToEquirect, projectEquirect, shrinkEquirect, softened } = await load('light/equirect.ts');
const { coefficientsOf, triangleMeasure, pickCoefficient, quantile } = await load('light/transfer.ts');
const { addParts, lightOfStored, readExtension } = await load('asset/kiln_reader.ts');
const { kSkies, projectSky, projectSuns } = await load('light/skies.ts');
const { encodeState, decodeState, kDefaultState } = await load('main/view_state.ts');
const { edgesOf } = await load('main/wireframe.ts');

const near = (actual, expected, tolerance, what) =>
  assert.ok(Math.abs(actual - expected) <= tolerance, `${what ?? ''} ${actual} is not ${expected} within ${tolerance}`);
const kFloat = 1e-6; // results are float32; sums of a few hundred terms near 1
const shAt = (order, x, y, z) => {
  const out = new Float64Array(order * order);
  evaluateSh(order, x, y, z, out);
  return out;
};
/// The `_PRT_k` of `coefficients`, stored as they are, and what a file would say of them.
function stored(shape, coefficients) {
  const count = shape.channels * shape.slots;
  const each = (value) => new Array(count).fill(value);
  const attributes = Array.from({ length: Math.ceil(count / 4) }, (_, k) =>
    Float32Array.from({ length: (4 * coefficients.length) / count }, (_, at) => {
      const j = 4 * k + (at & 3);
      return j < count ? coefficients[(at >> 2) * count + j] : 9; // padding
    }),
  );
  return { transfer: { ...shape, form: 'raw', rows: new Float32Array(0), scale: each(1), offset: each(0) }, attributes };
}
function relight(shape, coefficients, light, lamps) {
  const { transfer, attributes } = stored(shape, coefficients);
  return lightOfStored(transfer, attributes, light, lamps);
}
const unit = (x, y, z) => [x, y, z].map((v) => v / Math.hypot(x, y, z));

test('the first four harmonics have the constants and signs of core/sphere/sh.h', () => {
  const [x, y, z] = unit(0.3, -0.8, 0.52);
  const sh = shAt(2, x, y, z);
  [0.2820947918, 0.4886025119 * y, 0.4886025119 * z, 0.4886025119 * x].forEach((value, i) => near(sh[i], value, 1e-9));
});

test('second-band harmonics are xy, yz, 3z^2-1, xz, x^2-y^2 without Condon-Shortley signs', () => {
  const [x, y, z] = unit(0.5, 0.7, -0.2);
  const a = Math.sqrt(15 / Math.PI) / 2;
  const expected = [
    a * x * y,
    a * y * z,
    (Math.sqrt(5 / Math.PI) / 4) * (3 * z * z - 1),
    a * x * z,
    (a / 2) * (x * x - y * y),
  ];
  const sh = shAt(3, x, y, z);
  expected.forEach((value, i) => near(sh[4 + i], value, 1e-12));
});

test('harmonics of order 10 are orthonormal', () => {
  const sums = new Float64Array(100 * 100);
  for (const { x, y, z, weight } of sphereQuadrature(10)) {
    const sh = shAt(10, x, y, z);
    for (let i = 0; i < 100; ++i) for (let j = 0; j < 100; ++j) sums[100 * i + j] += weight * sh[i] * sh[j];
  }
  // The quadrature is exact for degree 19; what is left is rounding of some 200 terms.
  sums.forEach((value, k) => near(value, Math.floor(k / 100) === k % 100 ? 1 : 0, 1e-12));
});

test('an unoccluded plane under a constant map of radiance 1 has value exactly 1', () => {
  const light = projectEquirect({ width: 8, height: 4, stride: 3, data: new Float32Array(8 * 4 * 3).fill(1) }, 6);
  const transfer = clampedCosineTransfer(6, ...unit(0.2, 0.9, -0.3));
  const coefficients = transfer;
  const value = relight({ order: 6, channels: 1, fixed: false, slots: 36 }, coefficients, light, true);
  // Midpoint samples of a 512 x 256 grid: the odd bands vanish, band 2 is off by its step squared, 4e-5 of 1 at most.
  for (const v of value) near(v, 1, 5e-5);
});

test('a constant sky by formula gives exactly sqrt(4 pi) in band 0 and nothing else', () => {
  const light = projectSky(
    kSkies.find(({ id }) => id === 'constant'),
    5,
  );
  for (let i = 0; i < light.length; ++i) near(light[i], i < 3 ? Math.sqrt(4 * Math.PI) : 0, kFloat);
});

for (const [axis, index, direction] of [
  ['x', 3, [1, 0, 0]],
  ['y', 1, [0, 1, 0]],
  ['z', 2, [0, 0, 1]],
]) {
  test(`light from +${axis} has a positive coefficient ${index}, and lights planes that face it`, () => {
    const [u, v] = [
      0.5 + Math.atan2(direction[2], direction[0]) / (2 * Math.PI),
      0.5 - Math.asin(direction[1]) / Math.PI,
    ];
    const back = directionAt(u, v);
    near(back.x * direction[0] + back.y * direction[1] + back.z * direction[2], 1, 1e-12);
    const [width, height] = [64, 32];
    const data = new Float32Array(3 * width * height);
    for (let texel = 0; texel < width * height; ++texel) {
      const d = directionAt(((texel % width) + 0.5) / width, (Math.floor(texel / width) + 0.5) / height);
      if (d.x * direction[0] + d.y * direction[1] + d.z * direction[2] > 0.9) data.fill(10, 3 * texel, 3 * texel + 3);
    }
    const light = projectEquirect({ width, height, stride: 3, data }, 4);
    assert.ok(light[3 * index] > 0.5, `coefficient ${index} is ${light[3 * index]}`);
    for (const other of [1, 2, 3].filter((i) => i !== index)) near(light[3 * other], 0, 0.02 * light[3 * index]); // texel steps
    const facing = relight(
      { order: 4, channels: 1, fixed: false, slots: 16 },
      clampedCosineTransfer(4, ...direction),
      light,
      true,
    )[0];
    const averted = relight(
      { order: 4, channels: 1, fixed: false, slots: 16 },
      clampedCosineTransfer(4, ...direction.map((d) => -d)),
      light,
      true,
    )[0];
    assert.ok(facing > 10 * Math.abs(averted), `${facing} against ${averted}`);
  });
}

test('turning the light by 90 degrees takes +Z to +X', () => {
  const lobe = (dx, dy, dz) => projectFunction(6, (x, y, z, rgb) => rgb.fill(Math.exp(3 * (x * dx + y * dy + z * dz))));
  const turned = rotateAboutY(6, lobe(0, 0, 1), 90);
  lobe(1, 0, 0).forEach((value, i) => near(turned[i], value, 2e-5 * 20, `coefficient ${i}`)); // float32 of values up to 20
});

test('turning by any angle keeps each band’s power, and full circles change nothing', () => {
  const light = projectSky(
    kSkies.find(({ id }) => id === 'studio'),
    7,
  );
  const power = (l, of) => of.slice(3 * l * l, 3 * (l + 1) ** 2).reduce((sum, v) => sum + v * v, 0);
  const turned = rotateAboutY(7, light, 73);
  for (let l = 0; l < 7; ++l) near(power(l, turned), power(l, light), 1e-5 * (1 + power(l, light)));
  rotateAboutY(7, light, 360).forEach((value, i) => near(value, light[i], 1e-5));
});

test('softened light of a sun is nowhere negative, and keeps its sum', () => {
  const sun = Float32Array.from({ length: 3 * 36 }, (_, i) => shAt(6, 0.6, 0.64, 0.48)[Math.floor(i / 3)]);
  const least = (light) => Math.min(...lightToEquirect(6, light, 64).data);
  assert.ok(least(sun) < -0.1, 'without softening it rings');
  assert.ok(least(softened(6, sun)) > -1e-6);
  near(softened(6, sun)[0], sun[0], 0);
});

test('halving a map keeps its integral', () => {
  const [width, height] = [32, 16];
  const data = Float32Array.from({ length: 3 * width * height }, (_, i) => ((i * 7919) % 101) / 100);
  const map = { width, height, stride: 3, data };
  const [fine, coarse] = [projectEquirect(map, 1), projectEquirect(shrinkEquirect(map, 8), 1)];
  fine.forEach((value, i) => near(coarse[i], value, 1e-5 * value));
});

test('attributes decode to offset + scale * stored, four flat slots each, padding ignored', () => {
  const shape = { order: 1, channels: 3, fixed: true, slots: 2 }; // 6 flat slots in two VEC4
  const numbers = [0.1, 0.2, 0.3, 0.4, 0.5, 0.6];
  const { transfer, attributes } = stored(shape, [...numbers, ...numbers.map((s) => -s)]);
  const [scale, offset] = [
    [1, 2, 3, 4, 5, 6],
    [10, 20, 30, 40, 50, 60],
  ];
  const out = coefficientsOf({ ...transfer, scale, offset }, attributes);
  const light = lightOfStored({ ...transfer, scale, offset }, attributes, [1, 2, 4], true);
  for (const [v, sign] of [1, -1].entries()) {
    const expected = numbers.map((s, slot) => offset[slot] + scale[slot] * sign * s);
    expected.forEach((value, slot) => near(out[6 * v + slot], value, 1e-5));
    [1, 2, 4].forEach((l, c) => near(light[3 * v + c], l * expected[2 * c] + expected[2 * c + 1], 1e-4));
  }
});

test('grey transfer lights each channel by its own light; lamps can be put out', () => {
  const shape = { order: 1, channels: 1, fixed: true, slots: 2 };
  const coefficients = Float32Array.of(2, 0.25); // one SH slot, one lamp slot
  const light = Float32Array.of(1, 10, 100);
  assert.deepEqual([...relight(shape, coefficients, light, true)], [2.25, 20.25, 200.25]);
  assert.deepEqual([...relight(shape, coefficients, light, false)], [2, 20, 200]);
});

test('radiosity is read as the lamps’ light of order 0', () => {
  const shape = { order: 0, channels: 3, fixed: true, slots: 1 };
  assert.deepEqual([...relight(shape, Float32Array.of(1, 0.5, 0.25), new Float32Array(0), true)], [1, 0.5, 0.25]);
  const { scale, offset } = stored(shape, [1, 1, 1]).transfer;
  const extension = { ...shape, version: 2, form: 'raw', attributes: ['_RADIOSITY'], scale, offset };
  const read = (changes) => readExtension({ extensions: { KILN_radiance_transfer: { ...extension, ...changes } } });
  assert.equal(read({}).order, 0);
  assert.throws(() => read({ fixed: false, slots: 0, scale: [], offset: [], attributes: [] }), /does not describe/);
});

test('RGB transfer takes each channel’s own slots', () => {
  const shape = { order: 1, channels: 3, fixed: true, slots: 2 };
  const coefficients = Float32Array.of(1, 0.5, 2, 0.25, 3, 0.125);
  assert.deepEqual([...relight(shape, coefficients, Float32Array.of(1, 10, 100), true)], [1.5, 20.25, 300.125]);
  assert.deepEqual([...pickCoefficient(shape, coefficients, 2, 0)], [3]);
});

test('the measure of a triangle is the sum of its edges’ transfer distances; lamps do not count', () => {
  const shape = { order: 1, channels: 1, fixed: true, slots: 2 };
  const coefficients = Float32Array.of(0, 50, 3, -50, 7, 0);
  const positions = Float32Array.of(0, 0, 0, 2, 0, 0, 0, 4, 0); // area 4
  assert.deepEqual([...triangleMeasure(shape, coefficients, positions, [0, 1, 2], false)], [3 + 4 + 7]);
  assert.deepEqual([...triangleMeasure(shape, coefficients, positions, [0, 1, 2], true)], [2 * 14]);
});

test('a quantile bounds its share of the values', () => {
  assert.equal(
    quantile(
      Float32Array.from({ length: 100 }, (_, i) => i),
      0.99,
    ),
    99,
  );
  assert.equal(quantile(new Float32Array(0), 0.5), 0);
});

test('each edge of a quad is drawn once', () => {
  const edges = edgesOf([0, 1, 2, 2, 1, 3]);
  assert.equal(edges.length / 2, 5);
});

test('the state survives the address, and defaults leave it empty', () => {
  const state = {
    ...kDefaultState,
    light: 'clear',
    rotation: -42,
    ev: 1.5,
    wire: true,
    mode: 'coefficient',
    slot: 7,
    compare: 0.25,
    pose: [1, 2, 3.5, 0, -0.25, 0],
  };
  assert.deepEqual(decodeState(encodeState(state), ['baked', 'clear']), state);
  assert.equal(encodeState(kDefaultState), '');
});

test('an address of nonsense gives the defaults', () => {
  assert.deepEqual(decodeState('light=<script>&ev=NaN&mode=7&pose=1,2&rotation=Infinity&compare=&slot=-3', ['baked']), {
    ...kDefaultState,
    compare: 0,
    slot: 0,
  });
});

test('numbers outside their range are moved to its end', () => {
  const state = decodeState('ev=99&rotation=-1000&compare=7', ['baked']);
  assert.deepEqual([state.ev, state.rotation, state.compare], [8, -180, 1]);
});

test('a hundred coefficients exist at order 10', () => assert.equal(shCount(10), 100));

test('of a radiosity job’s own map there is no picture; of a named sky, of no sky and of harmonics there is', async () => {
  const { Lights } = await load('main/lights.ts');
  const pictured = (order, name) => new Lights({ order, light: { name, coefficients: [] } }).hasPicture('baked');
  assert.deepEqual(
    [pictured(0, 'courtyard.hdr'), pictured(0, 'clear'), pictured(0, ''), pictured(4, 'courtyard.hdr')],
    [false, true, true, true],
  );
});

test('light is added up in two parts, neither below 0', () => {
  const values = Float32Array.of(5, -1, -4, 2); // all of it
  addParts(values, Float32Array.of(2, -3, 1, 2)); // of that the bright part
  assert.deepEqual([...values], [3 + 2, 2 + 0, 0 + 1, 0 + 2]);
});

test('the bright part of a map is what is above eight times the mean of the rest, in its colour', () => {
  const map = (texels) => ({ width: 64, height: 32, stride: 4, data: Float32Array.from(texels.flat()) });
  const grey = Array.from({ length: 64 * 32 }, () => [1, 1, 1, 1]);
  assert.equal(brightOf(map(grey)), null);
  grey[700] = [3e6, 1e6, 0, 1];
  grey[1500] = [100, 200, 300, 1];
  const { data } = brightOf(map(grey));
  for (let i = 0; i < grey.length; ++i) {
    const rest = [0, 1, 2].map((c) => grey[i][c] - data[4 * i + c]);
    assert.ok((rest[0] + rest[1] + rest[2]) / 3 <= 1.03 * 8, `${i}: ${rest}`); // as bright_part_test.cpp
    if (i !== 700 && i !== 1500) assert.equal(data[4 * i], 0);
  }
  near(data[6002] / data[6000], 3, 1e-5);
});

test('suns are the bright part of a sky', () => {
  for (const sky of kSkies) {
    const [all, suns] = [projectSky(sky, 4), projectSuns(sky, 4)];
    const rest = projectFunction(4, sky.radiance);
    assert.equal(suns.length, sky.suns.length > 0 ? all.length : 0);
    for (let i = 0; i < suns.length; ++i) near(all[i], rest[i] + suns[i], 1e-5 * Math.max(1, Math.abs(all[i])), sky.id);
  }
});
