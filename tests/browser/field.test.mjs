// Light fields: the reader against kiln, the picture against the reader.
//
// fixtures/field.glb is a ball of metal over a floor, degree 4; lod1.glb and lod2.glb are the same with fewer vertices.
// field.csv is what kiln eval says that eyes see of it; sky.glb and sky.csv are alike, and keep the sky apart
// (fixtures/make_field.sh); so are lamps.glb and lamps.csv, with three lamps kept apart besides.

import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { after, before, test } from 'node:test';
import { openPage, ready, startBrowser, until, withReady } from './browser.mjs';
import { jobId, startMock } from './mock_server.mjs';
import { glbJson } from './read_glb.mjs';
import { fromViewer, load } from './sources.mjs';

const { evaluateSh } = await load('light/sh.ts');
const { harmonicsCode } = await load('shaders/harmonics_code.ts');
const { unpack, readPacked } = await load('asset/unpack.ts');
const reader = await load('asset/light_field.ts');
const { MirroredSky, colourOf } = await load('asset/mirrored_sky.ts');
const { fieldCount, halfAt, halfOf, numberOfHalf, readLightField, seenRadiance, texelsOf } = reader;
const fixture = (name) => readFileSync(new URL(`fixtures/${name}`, import.meta.url));
const [file, skyFile, lampFile] = ['field.glb', 'sky.glb', 'lamps.glb'].map(fixture);
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
    assert.equal(texelsOf({ degree, sky: false, lamps: 0, diffuse: false }), Math.ceil(places.size / 8));
  }
});

/// The largest error that rounding of coefficients can bring to (8).
function rounding(field, corners, weights, normal, view) {
  const y = harmonics(field.degree, reader.reflectedView(normal, view));
  const width = 8 * texelsOf(field);
  const number = (v, i, c) => numberOfHalf(field.halves[width * v + halfAt(field.degree, i, c)]);
  return [0, 1, 2].map((c) => {
    let sum = 0;
    corners.forEach((v, k) => y.forEach((yi, i) => (sum += weights[k] * Math.abs(yi * number(v, i, c)))));
    return kHalfStep * field.unit * sum;
  });
}

const dot = (a, b) => a.reduce((sum, x, i) => sum + x * b[i], 0);
const minus = (a, b) => a.map((x, i) => x - b[i]);
const cross = (a, b) => [0, 1, 2].map((i) => a[(i + 1) % 3] * b[(i + 2) % 3] - a[(i + 2) % 3] * b[(i + 1) % 3]);
const unit = (a) => a.map((x) => x / Math.hypot(...a));
const mean = (values, corners, weights) =>
  [0, 1, 2].map((axis) => corners.reduce((sum, v, k) => sum + weights[k] * values[3 * v + axis], 0));

/// The triangle on which a place lies: corners and barycentric weights.
function triangleAt(parts, place) {
  for (const part of parts)
    for (let t = 0; t < part.indices.length; t += 3) {
      const corners = [...part.indices.subarray(t, t + 3)];
      const [a, b, c] = corners.map((v) => [...part.positions.subarray(3 * v, 3 * v + 3)]);
      const [ab, ac, at] = [minus(b, a), minus(c, a), minus(place, a)];
      const normal = cross(ab, ac);
      const area = dot(normal, normal);
      if (Math.abs(dot(at, normal)) > 1e-6 * Math.sqrt(area)) continue; // beside its plane
      const [u, v] = [dot(cross(at, ac), normal) / area, dot(cross(ab, at), normal) / area];
      if (Math.min(u, v, 1 - u - v) > 0) return { part, corners, weights: [1 - u - v, u, v] };
    }
  throw new Error(`no triangle at ${place}`);
}

/// Base colour and finish of a part of the fixtures, whose textures are white.
function mirrorOf(json, part, { sky, lamps, lobes }) {
  if (!sky && lamps.length === 0) return undefined;
  const { baseColorFactor, metallicFactor, roughnessFactor } = json.materials[part].pbrMetallicRoughness;
  const f0 = baseColorFactor.slice(0, 3).map((c) => 0.04 * (1 - metallicFactor) + c * metallicFactor);
  const color = baseColorFactor.slice(0, 3).map((c) => c * (1 - metallicFactor));
  return { sky: sky && new MirroredSky(sky), lamps, f0, roughness: roughnessFactor, color, lobes };
}

for (const name of ['field', 'sky', 'lamps', 'textured'])
  test(`what an eye sees between three vertices is what kiln says: ${name}`, () => {
    const { baked, sky, lamps, lobes } = unpack(draco, readPacked(bytesOf(fixture(`${name}.glb`))));
    assert.equal(sky !== null, name !== 'field');
    assert.equal(baked[0].field.diffuse, name === 'textured');
    assert.deepEqual(lamps.map(({ type }) => type), name === 'lamps' ? ['point', 'spot', 'directional'] : []);
    const [names, ...lines] = fixture(`${name}.csv`).toString().trim().split('\n');
    assert.match(names, /^x,y,z,nx,ny,nz,vx,vy,vz,.*,radiance_r,radiance_g,radiance_b,distance$/);
    const rows = lines.map((line) => line.split(',').map(Number));
    const { json } = glbJson(fixture(`${name}.glb`));
    const mirrors = baked.map((_, i) => mirrorOf(json, json.meshes[1].primitives[i].material, { sky, lamps, lobes }));
    const { scale, translation } = json.nodes[json.scenes[0].nodes[0]];
    let [below, mirrored, highlights, coloured] = [0, 0, 0, 0];
    for (const row of rows) {
      const [place, view, expected] = [row.slice(0, 3), row.slice(6, 9), row.slice(12, 15)];
      const inCube = place.map((x, a) => (x - translation[a]) / scale[a]);
      const { part, corners, weights } = triangleAt(baked, inCube);
      const mirror = mirrors[baked.indexOf(part)] && { ...mirrors[baked.indexOf(part)], place: inCube };
      const normal = unit(mean(part.normals, corners, weights));
      if (dot(normal, view) < 0) ++below;
      const bound = rounding(part.field, corners, weights, normal, view);
      const alone = seenRadiance(part.field, corners, weights, normal, view);
      const dark = mirror && seenRadiance(part.field, corners, weights, normal, view, { ...mirror, lamps: [] });
      const black = mirror && seenRadiance(part.field, corners, weights, normal, view, { ...mirror, color: [0, 0, 0] });
      seenRadiance(part.field, corners, weights, normal, view, mirror).forEach((x, c) => {
        if (mirror && x > 1.1 * black[c]) ++coloured;
        if (mirror && x > 1.1 * dark[c]) ++highlights;
        // and kiln looks the place up in floats: 2^-24 of the cube beside it, 1e-5 of a triangle; visibility is in halves
        const most = bound[c] + 1e-5 * (1 + x) + (mirror ? 8 * kHalfStep * x : 0);
        assert.ok(Math.abs(x - expected[c]) <= most, `${x} is not ${expected[c]} within ${most}`);
        if (x > 1.5 * alone[c]) ++mirrored;
      });
    }
    assert.ok(rows.length >= 80 && below >= 20, 'too few rows, or no eye below a horizon');
    assert.equal(mirrored > 20, name !== 'field', 'the sky is not in what is seen');
    assert.equal(highlights > 20, name === 'lamps', 'no lamp is in what is seen');
    assert.equal(coloured > 20, name === 'textured', 'no diffuse light is in what is seen');
  });

test('shared exponents are what they stand for', () => {
  assert.deepEqual(colourOf(0), [0, 0, 0]);
  assert.deepEqual(colourOf(((16 << 27) | (64 << 18) | (128 << 9) | 256) >>> 0), [1, 0.5, 0.25]);
  assert.deepEqual(colourOf(0xffffffff).map((x) => x), [65408, 65408, 65408]);
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
      const found = unit * numberOfHalf(halves[8 * texelsOf({ degree, sky: false, lamps: 0, diffuse: false }) * v + halfAt(degree, s % 9, Math.floor(s / 9))]);
      assert.ok(Math.abs(found - sum) <= kHalfStep * Math.abs(sum) + 1e-6 * size, `${found} is not ${sum}`);
    }
});

const kFaults = {
  version: (e) => (e.version = 5),
  basis: (e) => (e.condonShortley = true),
  reflected: (e) => delete e.reflected,
  degree: (e) => (e.degree = 9),
  form: (e) => (e.form = 'sparse'),
  components: (e) => Object.assign(e, { form: 'components', components: { rank: 0, bufferView: 0 } }),
  attributes: (e) => e.attributes.reverse(),
  scale: (e) => e.scale.pop(),
  offset: (e) => (e.offset[7] = 'much'),
};

const skyExtension = () => structuredClone(glbJson(skyFile).json.extensions.KILN_light_field);
const kSkyFaults = {
  form: (sky) => (sky.form = 'components'),
  attributes: (sky) => sky.attributes.pop(),
  scale: (sky) => sky.scale.pop(),
  offset: (sky) => (sky.offset[2] = null),
  'levels/heights': (sky) => (sky.levels.heights = [64]),
  'levels/unit': (sky) => (sky.levels.unit = 0),
  lobes: (sky) => (sky.lobes.rows = 17),
};

for (const [member, spoil] of Object.entries(kSkyFaults))
  test(`a wrong ${member} of the sky is refused by its JSON pointer`, () => {
    const e = skyExtension();
    spoil(e.sky);
    const place = new RegExp(`^Error: /extensions/KILN_light_field/sky/${member}: `);
    assert.throws(() => readLightField({ extensions: { KILN_light_field: e } }), place);
  });

const lampExtension = () => structuredClone(glbJson(lampFile).json.extensions.KILN_light_field);
const kLampFaults = {
  form: (lamps) => (lamps.form = 'components'),
  attributes: (lamps) => (lamps.attributes = ['_SLF_LAMP_1']),
  scale: (lamps) => lamps.scale.pop(),
  offset: (lamps) => (lamps.offset[2] = null),
  lights: (lamps) => (lamps.lights = []),
  'lights/0/type': (lamps) => (lamps.lights[0].type = 'area'),
  'lights/0/intensity': (lamps) => (lamps.lights[0].intensity = [1, -1, 1]),
  'lights/0/range': (lamps) => (lamps.lights[0].range = -1),
  'lights/1/position': (lamps) => lamps.lights[1].position.pop(),
  'lights/1/outerConeAngle': (lamps) => (lamps.lights[1].outerConeAngle = 2),
  'lights/1/innerConeAngle': (lamps) => delete lamps.lights[1].innerConeAngle,
  'lights/2/direction': (lamps) => (lamps.lights[2].direction = [0, 0, 0]),
};

for (const [member, spoil] of Object.entries(kLampFaults))
  test(`a wrong ${member} of lamps is refused by its JSON pointer`, () => {
    const e = lampExtension();
    assert.equal(e.version, 2);
    spoil(e.lamps);
    const place = new RegExp(`^Error: /extensions/KILN_light_field/lamps/${member}: `);
    assert.throws(() => readLightField({ extensions: { KILN_light_field: e } }), place);
  });

const kDiffuseFaults = {
  diffuse: (diffuse) => (diffuse.mean = [0.5, -1, 0.5]),
  'diffuse/lobes': (diffuse) => (diffuse.lobes.views = 33),
};

for (const [member, spoil] of Object.entries(kDiffuseFaults))
  test(`a wrong ${member} is refused by its JSON pointer`, () => {
    const e = structuredClone(glbJson(fixture('textured.glb')).json.extensions.KILN_light_field);
    assert.equal(e.version, 4);
    spoil(e.diffuse);
    const place = new RegExp(`^Error: /extensions/KILN_light_field/${member}: `);
    assert.throws(() => readLightField({ extensions: { KILN_light_field: e } }), place);
  });

test('diffuse light needs a transfer of order 0', () => {
  const packed = readPacked(bytesOf(fixture('textured.glb')));
  packed.extension.order = 1;
  assert.throws(() => unpack(draco, packed), /diffuse: stands beside a transfer of order 0/);
});

test('a sky of the wrong size is refused', () => {
  const packed = readPacked(bytesOf(skyFile));
  packed.json.extensions.KILN_light_field.sky.levels.heights[0] = 64;
  assert.throws(() => unpack(draco, packed), /the sky of the light field needs/);
});

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

const certificate = (relrmse) => ({ relrmse, interval: [0.9 * relrmse, 1.2 * relrmse], points: 1013, samples: 64 });
const kReport = {
  lightfield: {
    degree: 4,
    certificate: certificate(0.05),
    levels: [
      { file: 'scene.glb', vertices: 1, triangles: 1, certificate: certificate(0.05) },
      { file: 'lod1.glb', vertices: 1234, triangles: 2000, screen_pixels: 400, certificate: certificate(0.1) },
      { file: 'lod2.glb', vertices: 123, triangles: 200, screen_pixels: 100, certificate: null },
    ],
  },
};

let browser, mock, skyMock, lampMock, texturedMock;
before(async () => {
  browser = await startBrowser();
  mock = await startMock({ files: { 'scene.glb': file, 'report.json': Buffer.from(JSON.stringify(kReport)) } });
  skyMock = await startMock({ files: { 'scene.glb': skyFile } });
  lampMock = await startMock({ files: { 'scene.glb': lampFile } });
  texturedMock = await startMock({ files: { 'scene.glb': fixture('textured.glb') } });
  const { artifacts } = mock.jobs.get(jobId('done'));
  for (const name of ['lod2.glb', 'lod1.glb']) artifacts.push({ ...artifacts[0], name, bytes: fixture(name).length });
});
after(async () => {
  await browser.close();
  await mock.close();
  await skyMock.close();
  await lampMock.close();
  await texturedMock.close();
});

const address = (hash) => `${mock.url}/view/${jobId('done')}#${hash}`;
const withField = (hash, act) => withReady(browser, address(hash), act);
const withApart = (from, hash, act) => withReady(browser, `${from.url}/view/${jobId('done')}#${hash}`, act);

/// Pixels well inside triangles of the ball that face the eye: their colour, and what the reader says is seen there, at
/// the pixel and at the corners of its triangle.
const look = (page, pose) =>
  page.evaluate((pose) => {
    const { stage, model, level } = window.kilnViewer;
    if (pose) stage.pose = pose;
    stage.drawNow();
    stage.camera.updateMatrixWorld();
    const { mesh: object, geometry } = model.parts[0];
    const eye = stage.camera.position;
    const gl = stage.renderer.getContext();
    const [width, height] = [gl.drawingBufferWidth, gl.drawingBufferHeight];
    const { index, attributes } = geometry;
    const placeOf = (v) => eye.clone().fromBufferAttribute(attributes.position, v).applyMatrix4(object.matrixWorld);
    const cornersOf = (face) => [0, 1, 2].map((k) => placeOf(index.getX(3 * face + k)));
    const seenAt = (faceIndex, weights, [a, b, c]) => {
      const point = a.clone().multiplyScalar(weights[0]).addScaledVector(b, weights[1]).addScaledVector(c, weights[2]);
      return level.field.seenAt({ object, faceIndex, barycoord: { toArray: () => weights }, point }, eye);
    };
    const seen = [];
    for (let face = 0; face < index.count / 3; ++face) {
      const [a, b, c] = cornersOf(face);
      const [ab, ac] = [b.clone().sub(a), c.clone().sub(a)];
      const normal = ab.clone().cross(ac);
      const centre = a.clone().add(b).add(c).divideScalar(3);
      if (normal.clone().normalize().dot(eye.clone().sub(centre).normalize()) < 0.3) continue;
      const screen = centre.project(stage.camera);
      const [x, y] = [Math.floor(((screen.x + 1) / 2) * width), Math.floor(((screen.y + 1) / 2) * height)];
      // The ray through the pixel's centre, and where it meets the triangle's plane.
      const through = eye.clone().set((2 * (x + 0.5)) / width - 1, (2 * (y + 0.5)) / height - 1, 0.5);
      const ray = through.unproject(stage.camera).sub(eye);
      const at = ray.multiplyScalar(a.clone().sub(eye).dot(normal) / ray.dot(normal)).add(eye).sub(a);
      const area = normal.lengthSq();
      const [u, v] = [at.clone().cross(ac).dot(normal) / area, ab.clone().cross(at).dot(normal) / area];
      if (Math.min(u, v, 1 - u - v) < 0.15) continue; // no edge runs through the pixel
      const pixel = new Uint8Array(4);
      gl.readPixels(x, y, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, pixel);
      const one = (k) => [0, 1, 2].map((i) => (i === k ? 1 : 0));
      seen.push({
        face,
        weights: [1 - u - v, u, v],
        colour: [...pixel.slice(0, 3)].map((value) => value / 255),
        expected: seenAt(face, [1 - u - v, u, v], [a, b, c]),
        corners: [0, 1, 2].map((k) => seenAt(face, one(k), [a, b, c])),
      });
    }
    return { seen, exposure: stage.renderer.toneMappingExposure };
  }, pose);

const encode = (linear) => (linear <= 0.0031308 ? 12.92 * linear : 1.055 * linear ** (1 / 2.4) - 0.055);
const display = (radiance, exposure) => radiance.map((x) => encode(Math.min(1, exposure * x)));
const kSteps = 1.6 / 255; // rounding to bytes, and dithering by up to one of them
const near = (shown, expected, tolerance) =>
  shown.forEach((x, c) => assert.ok(Math.abs(x - expected[c]) < tolerance, `${shown} is not ${expected}`));

const kPoses = [
  [0.9, 0.84, 1.8, 0, 0.3, 0],
  [-1.8, 0.3, -0.4, 0, 0.3, 0],
  [0.3, -0.4, 1.9, 0, 0.3, 0],
];

test('a pixel is what the reader sees there, from wherever one looks, and highlights move', () =>
  withField('tone=none&ev=-2&background=off', async (page) => {
    const brightest = [];
    for (const pose of kPoses) {
      const { seen, exposure } = await look(page, pose);
      assert.ok(seen.length > 20);
      for (const { colour, expected } of seen) near(colour, display(expected, exposure), kSteps);
      const size = (one) => one.expected[1];
      brightest.push(seen.reduce((a, b) => (size(a) > size(b) ? a : b)).face);
    }
    assert.notEqual(brightest[0], brightest[1], 'the highlight stays where it was');
  }));

// Levels of the sky are brought to one resolution on the graphics card, in half floats.
const kSkySteps = 3 / 255;

for (const what of ['the sky', 'the sky and lamps', 'the sky above a texture'])
  test(`so is one that mirrors ${what}, at pixels and at vertices, and with every level in one file`, () =>
    withApart({ 'the sky': skyMock, 'the sky and lamps': lampMock }[what] ?? texturedMock, 'tone=none&ev=-2&background=off', async (page) => {
      for (const pose of kPoses) {
        const { seen, exposure } = await look(page, pose);
        assert.ok(seen.length > 20);
        for (const { colour, expected } of seen) near(colour, display(expected, exposure), kSkySteps);
      }
      await page.evaluate(() => window.kilnViewer.state.set({ mode: 'vertices' }));
      const { seen, exposure } = await look(page, kPoses[0]);
      for (const one of seen) near(one.colour, display(between(one), exposure), kSkySteps);
    }));

/// The file with the sky apart, as if its surfaces glowed and the field left that to them.
function glowing() {
  const { json, binary } = glbJson(skyFile);
  Object.assign(json.extensions.KILN_light_field, { version: 3, emissionApart: true });
  for (const { extensions } of json.meshes[0].primitives) extensions.KILN_radiance_transfer.emission = [0.4, 0.1, 0.2];
  const text = Buffer.from(JSON.stringify(json));
  const padded = Buffer.concat([text, Buffer.alloc((4 - (text.length % 4)) % 4, ' ')]);
  const chunk = (kind, bytes) => Buffer.concat([Buffer.from(Uint32Array.of(bytes.length, kind).buffer), bytes]);
  const body = Buffer.concat([chunk(0x4e4f534a, padded), chunk(0x004e4942, binary)]);
  return Buffer.concat([Buffer.from(Uint32Array.of(0x46546c67, 2, 12 + body.length).buffer), body]);
}

test('emission that the field leaves to its surfaces is added to what is seen', async () => {
  const glowMock = await startMock({ files: { 'scene.glb': glowing() } });
  try {
    const seenOf = (mock) => {
      let found;
      return withApart(mock, 'tone=none&ev=-2&background=off', async (page) => {
        found = await look(page, kPoses[0]);
        for (const { colour, expected } of found.seen) near(colour, display(expected, found.exposure), kSkySteps);
      }).then(() => found.seen);
    };
    const [dark, bright] = [await seenOf(skyMock), await seenOf(glowMock)];
    bright.forEach(({ expected }, i) =>
      expected.forEach((x, c) => assert.ok(Math.abs(x - dark[i].expected[c] - [0.4, 0.1, 0.2][c]) < 1e-9)),
    );
  } finally {
    await glowMock.close();
  }
});

test('a progressive mesh at its finest mirrors the lamps as the file itself does', () =>
  withApart(lampMock, 'tone=none&ev=-2&background=off', async (page) => {
    const picture = (detail) =>
      page.evaluate(async (detail) => {
        const { stage, state } = window.kilnViewer;
        stage.pose = [0.9, 0.84, 1.8, 0, 0.3, 0];
        state.set({ detail });
        stage.drawNow();
        const gl = stage.renderer.getContext();
        const [width, height] = [gl.drawingBufferWidth, gl.drawingBufferHeight];
        const pixels = new Uint8Array(4 * width * height);
        gl.readPixels(0, 0, width, height, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
        return [...pixels];
      }, detail);
    const [own, finest] = [await picture(1), await picture(0.999999)];
    let [off, bright] = [0, 0];
    own.forEach((x, i) => {
      off += Math.abs(x - finest[i]) / own.length;
      bright += x > 200 && i % 4 < 3 ? 1 : 0;
    });
    assert.ok(bright > 100, 'there is no highlight');
    assert.ok(off < 1, `${off} of 255 off in the mean`); // positions, normals and light are rounded in one only
  }));

const between = ({ corners, weights }) =>
  [0, 1, 2].map((c) => corners.reduce((sum, one, k) => sum + weights[k] * one[c], 0));

test('evaluated at the vertices a pixel is what the corners show', () =>
  withField('mode=vertices&tone=none&ev=-2&background=off', async (page) => {
    const { seen, exposure } = await look(page, [0.9, 0.84, 1.8, 0, 0.3, 0]);
    assert.ok(seen.length > 20);
    for (const one of seen) near(one.colour, display(between(one), exposure), kSteps);
  }));

const { colourAt } = await load('shaders/colour_maps.ts');

test('the false colours of what vertices miss are the difference of the two evaluations', () =>
  withField('mode=vertexError&ev=0', async (page) => {
    const { seen, exposure } = await look(page, [0.9, 0.84, 1.8, 0, 0.3, 0]);
    let largest = 0;
    for (const one of seen) {
      const apart = between(one).map((x, c) => exposure * Math.abs(x - one.expected[c]));
      const t = Math.min(1, Math.max(...apart) / 0.2);
      largest = Math.max(largest, t);
      // A byte of the scale, which is at most 4 bytes of a channel; half floats are 2^-11 of radiances up to 1 apart.
      near(one.colour, colourAt('viridis', t).map((byte) => byte / 255), 0.03);
    }
    assert.ok(largest > 0.1, 'nothing differs');
    assert.match(await page.locator('.legend').innerText(), /0\.200 and above/);
  }));

const vertices = (page) => page.evaluate(() => window.kilnViewer.model.vertices);
const memory = (page) =>
  page.evaluate(() => {
    window.kilnViewer.stage.drawNow();
    const { geometries, textures } = window.kilnViewer.stage.renderer.info.memory;
    return `${geometries} geometries, ${textures} textures`;
  });
const showLevel = async (page, level) => {
  await page.evaluate((at) => window.kilnViewer.state.set({ level: at }), level);
  await until(page, (at) => window.kilnViewer.shown.get().index === at, level);
};

test('levels of detail follow the slider, under the same eye, and leave nothing behind', () =>
  withField('background=off', async (page) => {
    const slider = page.locator('#c-level');
    assert.equal(await slider.getAttribute('max'), '2');
    const pose = await page.evaluate(() => window.kilnViewer.stage.pose);
    const [finest, before] = [await vertices(page), await memory(page)];
    await slider.fill('1');
    await until(page, () => window.kilnViewer.shown.get().index === 1);
    const middle = await vertices(page);
    await slider.fill('2');
    await until(page, () => window.kilnViewer.shown.get().index === 2);
    assert.ok(finest > middle && middle > (await vertices(page)));
    assert.deepEqual(await page.evaluate(() => window.kilnViewer.stage.pose), pose);
    const { seen, exposure } = await look(page);
    for (const { colour, expected } of seen.slice(0, 5))
      near(colour, display(expected.map((x) => shoulder(exposure * x)), 1), kSteps);
    assert.match(await page.locator('.levels [aria-current=true]').innerText(), /^lod2\.glb/);
    await slider.fill('0');
    await until(page, () => window.kilnViewer.shown.get().index === 0);
    assert.equal(await vertices(page), finest);
    assert.equal(await memory(page), before);
  }));

test('a level is as coarse as its size on the screen allows, and none flickers', () =>
  withField('', async (page) => {
    const back = (distance) =>
      page.evaluate((d) => {
        window.kilnViewer.stage.pose = [0, 0, d, 0, 0, 0];
        return window.kilnViewer.stage.pixelsAcross;
      }, distance);
    const shows = (index) => until(page, (wanted) => window.kilnViewer.shown.get().index === wanted, index);
    const twice = (await back(8)) * Math.sqrt(63); // focal lengths in pixels: the outline is seen at sqrt(d^2 - 1)
    const at = async (size) => assert.ok(Math.abs((await back(Math.hypot(1, twice / size))) - size) < 1e-6 * size);
    await at(390);
    await shows(0);
    await page.getByText('As coarse as its size on the screen allows').click();
    await shows(0); // above nine tenths of 400
    await at(350);
    await shows(1);
    await at(390);
    await shows(1);
    await at(410);
    await shows(0);
    await at(85);
    await shows(2);
    assert.equal(await back(0.5), Infinity);
    await shows(0);
  }));

/// Bytes of RGBA of a square in the middle of the picture; of the plain one `times` as large, if asked.
const middle = (page, side, fine, times = 1) =>
  page.evaluate(
    ({ side, fine, times }) => {
      const { stage } = window.kilnViewer;
      const gl = stage.renderer.getContext();
      const [width, height] = [gl.drawingBufferWidth, gl.drawingBufferHeight];
      const [x, y] = [width, height].map((all) => (all - side) >> 1);
      stage.fine = fine;
      if (times > 1) stage.camera.setViewOffset(times * width, times * height, times * x, times * (height - y - side), width, height);
      stage.drawNow();
      stage.camera.clearViewOffset();
      const pixels = new Uint8Array(4 * (times * side) ** 2);
      const [left, low] = times > 1 ? [0, height - times * side] : [x, y];
      gl.readPixels(left, low, times * side, times * side, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
      return [...pixels];
    },
    { side, fine, times },
  );
const decode = (byte) => (byte <= 10 ? byte / 255 / 12.92 : ((byte / 255 + 0.055) / 1.055) ** 2.4);
const rootMeanSquare = (a, b) => Math.sqrt(a.reduce((sum, x, i) => sum + (x - b[i]) ** 2, 0) / a.length);

test('a pixel of a small model is the mean of many places within it', () =>
  withApart(skyMock, 'background=off', async (page) => {
    const across = await page.evaluate(() => {
      const { stage } = window.kilnViewer;
      for (let d = 12, i = 0; i < 30; ++i, d *= stage.pixelsAcross / 50) stage.pose = [0.4 * d, 0.5 * d, 0.77 * d, 0, 0, 0];
      return stage.pixelsAcross;
    });
    assert.ok(Math.abs(across - 50) < 0.01);
    const [side, times] = [56, 8]; // 384 / 50, and no less
    const mean = new Float64Array(4 * side * side);
    (await middle(page, side, false, times)).forEach((byte, i) => {
      const [x, y] = [Math.floor(i / 4) % (times * side), Math.floor(i / (4 * times * side))];
      mean[4 * (Math.floor(y / times) * side + Math.floor(x / times)) + (i % 4)] += decode(byte) / times ** 2;
    });
    const expected = [...mean].map((x) => 255 * encode(x));
    const [off, before] = [rootMeanSquare(await middle(page, side, true), expected), rootMeanSquare(await middle(page, side, false), expected)];
    assert.ok(off < 1 && before > 3 * off, `${off} off where one sample a pixel is ${before}`);
  }));

test('the square around a small model has the same sky behind it', () =>
  withApart(skyMock, 'background=sky', async (page) => {
    await page.evaluate(() => (window.kilnViewer.stage.pose = [20, 10, 30, 0, 0, 0]));
    const [fine, once] = [await middle(page, 150, true), await middle(page, 150, false)];
    await page.evaluate(() => (window.kilnViewer.model.root.visible = false));
    const [sky, alone] = [await middle(page, 150, true), await middle(page, 150, false)];
    const all = [...Array(150 * 150).keys()];
    const [apart, model] = [rootMeanSquare(sky, alone, all), rootMeanSquare(once, alone, all)];
    assert.ok(apart < 1 && model > 5 * apart, `${apart} and ${model} of 255`);
  }));

test('a model that is large has one sample a pixel, as has what is no light field', () =>
  withField('background=off', async (page) => {
    const same = async () => {
      const [fine, plain] = [await middle(page, 64, true), await middle(page, 64, false)];
      return fine.every((byte, i) => byte === plain[i]);
    };
    assert.ok(await same());
    assert.equal(await page.evaluate(() => window.kilnViewer.surfaces.stage.fine), false); // as the last call left it
    await page.evaluate(() => window.kilnViewer.state.set({ mode: 'vertices' }));
    await until(page, () => window.kilnViewer.stage.fine);
    await page.evaluate(() => window.kilnViewer.state.set({ mode: 'light' }));
    await until(page, () => !window.kilnViewer.stage.fine);
  }));

test('the panel tells degree, bytes, and what the report certifies', () =>
  withField('', async (page) => {
    const rows = await page.locator('.levels tbody tr').allInnerTexts();
    const bytes = (name) => `${(fixture(name).length / 1000).toPrecision(3)} kB`;
    assert.deepEqual(rows.slice(1).map((row) => row.split('\t')), [
      ['lod1.glb', '1,234', bytes('lod1.glb'), '10.0\u00a0%', '400'],
      ['lod2.glb', '123', bytes('lod2.glb'), '–', '100'],
    ]);
    assert.match(rows[0], /^scene\.glb\t.*\t5\.0\u00a0%\t–$/);
    await page.getByText('Statistics').click();
    const text = await page.locator('.statistics').innerText();
    assert.match(text, /4: 25 × RGB a vertex/);
    const total = (await vertices(page)) * 16 * texelsOf({ degree: 4, sky: false, lamps: 0, diffuse: false });
    assert.match(text, new RegExp(`On the graphics card\\s+${(total / 1000).toPrecision(3)} kB`));
    assert.match(text, /towards random eyes\s+5\.0\u00a0% \(95\u00a0%: 4\.5\u00a0% to 6\.0\u00a0%\)/);
    assert.match(text, /1,013 points, 64 paths each/);
  }));

const shoulder = (x) => (x <= 0.6 ? x : 1 - 0.4 * Math.exp((0.6 - x) / 0.4));

/// How many pixels are not the lowest colour of the scale nor the background, and how many are the lowest.
const differing = (page) =>
  page.evaluate(() => {
    const { stage } = window.kilnViewer;
    stage.drawNow();
    const gl = stage.renderer.getContext();
    const pixels = new Uint8Array(4 * gl.drawingBufferWidth * gl.drawingBufferHeight);
    gl.readPixels(0, 0, gl.drawingBufferWidth, gl.drawingBufferHeight, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
    let [same, other] = [0, 0];
    for (let i = 0; i < pixels.length; i += 4) {
      const [r, g, b] = pixels.subarray(i, i + 3);
      if (r === 0x5b && g === 0x5e && b === 0x64) continue;
      if (Math.abs(r - 0x44) < 2 && Math.abs(g - 0x01) < 2 && Math.abs(b - 0x54) < 2) ++same;
      else ++other;
    }
    return { same, other };
  });

test('a level differs from the finest, and the finest from itself nowhere', () =>
  withField('mode=levelError', async (page) => {
    const alone = await differing(page);
    assert.ok(alone.same > 10000);
    // Where the silhouette covers a part of a pixel the lowest colour is mixed with the background.
    assert.ok(alone.other < 0.1 * alone.same, JSON.stringify(alone));
    await showLevel(page, 2);
    const { other } = await differing(page);
    assert.ok(other > 5 * alone.other, JSON.stringify({ other, alone }));
  }));

test('an address asks for a level; one that is not there is said, and the finest stays', async () => {
  await withField('level=2', async (page) => {
    await until(page, () => window.kilnViewer.shown.get().index === 2);
  });
  await withField('level=7', async (page) => {
    await until(page, () => /no level of detail 7/.test(document.body.innerText));
    assert.equal(await page.evaluate(() => window.kilnViewer.state.get().level), 0);
  });
});

test('wireframe, false colours and light alone follow from one look and level to another', () =>
  withField('', async (page) => {
    const set = (state) => page.evaluate((s) => window.kilnViewer.state.set(s), state);
    const round = async () => {
      for (const mode of ['vertices', 'light', 'measure', 'coefficient', 'vertexError', 'levelError', 'shaded'])
        for (const wire of [true, false]) {
          await set({ mode, wire });
          await page.evaluate(() => window.kilnViewer.stage.drawNow());
        }
      return memory(page);
    };
    const before = await round(); // has met everything that stays
    assert.equal(await round(), before);
    await set({ mode: 'light', wire: true });
    await showLevel(page, 1);
    await set({ mode: 'shaded', wire: false });
    await showLevel(page, 0);
    const { seen, exposure } = await look(page);
    near(seen[0].colour, display(seen[0].expected.map((x) => shoulder(exposure * x)), 1), kSteps);
  }));

test('a click on the model tells the radiance towards the eye', () =>
  withField('background=off', async (page) => {
    const { x, y, width, height } = await page.locator('canvas').first().boundingBox();
    await page.mouse.click(x + 0.5 * width, y + 0.5 * height);
    assert.match(await page.locator('.probe').innerText(), /^Radiance .+ towards the eye$/);
  }));

test('what does not fit a texture of the graphics card is said, and diffuse light is shown', async () => {
  const page = await openPage(browser, 'about:blank');
  await page.addInitScript(() => {
    const real = WebGL2RenderingContext.prototype.getParameter;
    WebGL2RenderingContext.prototype.getParameter = function (name) {
      return name === this.MAX_TEXTURE_SIZE ? 40 : real.call(this, name);
    };
  });
  try {
    await page.goto(address(''));
    await ready(page);
    await until(page, () => /larger than a texture may be/.test(document.body.innerText));
    assert.equal(await page.evaluate(() => window.kilnViewer.level.field), null);
  } finally {
    await page.context().close();
  }
});
