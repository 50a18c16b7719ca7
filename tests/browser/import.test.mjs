// What Kiln's importer makes of a glTF beside what three.js's loader makes of it: Kiln's own reference shares the importer, so nothing else would
// see a file misread. Without a browser: no textures.

import assert from 'node:assert/strict';
import { execFileSync } from 'node:child_process';
import { mkdtempSync, readFileSync, rmSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { after, test } from 'node:test';

const three = new URL('../../web_viewer/node_modules/three/', import.meta.url);
const THREE = await import(new URL('build/three.module.js', three));
const { GLTFLoader } = await import(new URL('examples/jsm/loaders/GLTFLoader.js', three));

const folder = mkdtempSync(join(tmpdir(), 'kiln-import-'));
after(() => rmSync(folder, { recursive: true }));

/// A GLB that grows by accessors, meshes and nodes.
class Glb {
  json = { asset: { version: '2.0' }, scene: 0, scenes: [{ nodes: [] }], nodes: [], meshes: [], materials: [], accessors: [], bufferViews: [] };
  bytes = [];
  length = 0;

  accessor(values, type, more = {}) {
    const bytes = Buffer.from(values.buffer);
    const componentType = { Float32Array: 5126, Uint16Array: 5123, Int16Array: 5122 }[values.constructor.name];
    const padding = Buffer.alloc((4 - (bytes.length % 4)) % 4);
    this.json.bufferViews.push({ buffer: 0, byteOffset: this.length, byteLength: bytes.length });
    this.bytes.push(bytes, padding);
    this.length += bytes.length + padding.length;
    const count = values.length / { SCALAR: 1, VEC3: 3, VEC4: 4 }[type];
    this.json.accessors.push({ bufferView: this.json.bufferViews.length - 1, componentType, count, type, ...more });
    return this.json.accessors.length - 1;
  }

  /// Positions [[x, y, z], ...] as a mesh at a node of the scene.
  place(positions, { material, node = {}, attributes = {}, normal = [0, 0, 1], primitive = {} } = {}) {
    const all = { POSITION: this.accessor(new Float32Array(positions.flat()), 'VEC3', bounds(positions)), ...attributes };
    all.NORMAL = this.accessor(new Float32Array(positions.flatMap(() => normal)), 'VEC3');
    const of = { attributes: all, ...primitive };
    if (material) of.material = this.json.materials.push(material) - 1;
    this.json.nodes.push({ mesh: this.json.meshes.push({ primitives: [of] }) - 1, ...node });
    this.json.scenes[0].nodes.push(this.json.nodes.length - 1);
  }

  write(name) {
    const binary = Buffer.concat(this.bytes);
    this.json.buffers = [{ byteLength: binary.length }];
    if (this.json.materials.length === 0) delete this.json.materials;
    const text = Buffer.from(JSON.stringify(this.json));
    const chunk = (type, data, fill) => {
      const head = Buffer.alloc(8), rest = Buffer.alloc((4 - (data.length % 4)) % 4, fill);
      head.writeUInt32LE(data.length + rest.length, 0);
      head.writeUInt32LE(type, 4);
      return Buffer.concat([head, data, rest]);
    };
    const body = Buffer.concat([chunk(0x4e4f534a, text, 0x20), chunk(0x004e4942, binary, 0)]);
    const head = Buffer.alloc(12);
    head.write('glTF');
    head.writeUInt32LE(2, 4);
    head.writeUInt32LE(12 + body.length, 8);
    writeFileSync(join(folder, name), Buffer.concat([head, body]));
    return join(folder, name);
  }
}

const bounds = (p) => ({ min: [0, 1, 2].map((c) => Math.min(...p.map((v) => Math.fround(v[c])))), max: [0, 1, 2].map((c) => Math.max(...p.map((v) => Math.fround(v[c])))) });
const square = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]];
const strip = { mode: 5 };

async function read(file) {
  const bytes = readFileSync(file);
  const gltf = await new GLTFLoader().parseAsync(bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.length), '');
  gltf.scene.updateMatrixWorld(true);
  return gltf.scene;
}

/// Rows of a CSV that the command line writes, without the header.
function rows(words) {
  const text = execFileSync(process.env.KILN, words, { encoding: 'utf8', stdio: ['ignore', 'pipe', 'ignore'] });
  return text.trim().split('\n').slice(1).map((line) => line.split(',').map(Number));
}

/// World triangles of three.js's scene: corners, colours with the material's, emission.
function triangles(scene) {
  const out = [];
  scene.traverse((mesh) => {
    if (!mesh.isMesh) return;
    const { geometry, material } = mesh, at = new THREE.Matrix4();
    const count = geometry.index ? geometry.index.count : geometry.attributes.position.count;
    for (let i = 0; i < (mesh.isInstancedMesh ? mesh.count : 1); ++i) {
      if (mesh.isInstancedMesh) mesh.getMatrixAt(i, at);
      const world = mesh.matrixWorld.clone().multiply(at);
      for (let k = 0; k + 2 < count; k += 3) {
        const ids = [0, 1, 2].map((c) => (geometry.index ? geometry.index.getX(k + c) : k + c));
        const corner = ids.map((v) => new THREE.Vector3().fromBufferAttribute(geometry.attributes.position, v).applyMatrix4(world));
        if (world.determinant() < 0) corner.reverse(), ids.reverse();
        const tint = ids.map((v) => (material.vertexColors ? [0, 1, 2].map((c) => geometry.attributes.color.getComponent(v, c)) : [1, 1, 1]));
        const colour = tint.map((t) => t.map((x, c) => x * material.color.toArray()[c]));
        const emission = material.emissive.toArray().map((x) => x * material.emissiveIntensity);
        out.push({ face: new THREE.Triangle(...corner), colour, emission });
      }
    }
  });
  return out;
}

const near = (a, b, tolerance, what) => a.forEach((x, i) => assert.ok(Math.abs(x - b[i]) <= tolerance, `${what}: ${a} instead of ${b}`));

test('places, fronts, colours and emission of strips, fans, mirrors and instances are those of three.js', async () => {
  const glb = new Glb();
  const turn = [0.1, 0.2, 0.3, Math.sqrt(0.86)];
  const colours = new Uint16Array([65535, 0, 30000, 50000, 0, 65535, 100, 10000, 20000, 20000, 65535, 65535, 65535, 65535, 0, 30]);
  glb.place(square, {
    primitive: strip,
    node: { scale: [-1, 2, 0.5], rotation: turn, translation: [3, 0, 0] },
    attributes: { COLOR_0: glb.accessor(colours, 'VEC4', { normalized: true }) },
    material: { pbrMetallicRoughness: { baseColorFactor: [0.5, 0.6, 0.7, 1] } },
  });
  glb.place([[0, 0, 0], [1, 0, 0], [1.2, 0.5, 0], [1, 1, 0], [0, 1, 0]], {
    primitive: { mode: 6 },
    node: { matrix: [0, 2, 0, 0, -1, 0, 0, 0, 0, 0, -1.5, 0, -3, 1, 2, 1] },
    material: { emissiveFactor: [0.5, 1, 0.25], extensions: { KHR_materials_emissive_strength: { emissiveStrength: 7.5 } } },
  });
  const instances = {
    TRANSLATION: glb.accessor(new Float32Array([0, 0, 3, 1, 2, 6, -1, -2, 9]), 'VEC3'),
    ROTATION: glb.accessor(new Int16Array([0, 0, 0, 32767, 0, 32767, 0, 0, 32767, 0, 0, 0]), 'VEC4', { normalized: true }),
    SCALE: glb.accessor(new Float32Array([1, 1, 1, 2, 1, 0.5, -1, 1, 1]), 'VEC3'),
  };
  glb.place(square, { primitive: strip, node: { rotation: turn, scale: [1, 1, 2], extensions: { EXT_mesh_gpu_instancing: { attributes: instances } } } });
  glb.json.extensionsUsed = ['EXT_mesh_gpu_instancing', 'KHR_materials_emissive_strength'];
  const file = glb.write('places.glb'), points = join(folder, 'p.csv');
  rows(['points', file, '--count', '200', '-o', points]);
  const seen = (sky) => rows(['reference', file, '--points', points, '--env', sky, '--bounces', '0', '--samples', '16', '--albedo', 'scene']);
  const lit = seen('1,1,1'), dark = seen('0,0,0'), all = triangles(await read(file));
  const met = new Set(), at = new THREE.Vector3(), on = new THREE.Vector3(), weights = new THREE.Vector3();
  lit.forEach((row, i) => {
    const place = new THREE.Vector3(...row.slice(0, 3));
    const found = all.find(({ face }) => face.closestPointToPoint(place, on).distanceTo(place) < 1e-5);
    assert.ok(found, `${place.toArray()} is on no triangle`);
    met.add(found);
    near(row.slice(3, 6), found.face.getNormal(at).toArray(), 1e-5, 'normal'); // flat faces: geometric and shading
    found.face.getBarycoord(on, weights);
    const mixed = [0, 1, 2].map((c) => weights.x * found.colour[0][c] + weights.y * found.colour[1][c] + weights.z * found.colour[2][c]);
    const own = dark[i].slice(9, 12), reflected = row.slice(9, 12).map((x, c) => ((x - own[c]) * Math.PI) / (row[6 + c] - dark[i][6 + c]));
    near(reflected, mixed.map((x) => Math.min(x, 0.999)), 1e-4, 'albedo');
    near(own.map((x, c) => x - (reflected[c] * dark[i][6 + c]) / Math.PI), found.emission, 1e-4, 'emission');
  });
  assert.equal(met.size, all.length);
});

test('lamps of turned and scaled nodes shine as KHR_lights_punctual says of where three.js puts them', async () => {
  const glb = new Glb();
  glb.place([[-9, 0, 9], [9, 0, 9], [-9, 0, -9], [9, 0, -9]], { primitive: strip, normal: [0, 1, 0], material: { pbrMetallicRoughness: { baseColorFactor: [0, 0, 0, 1] } } });
  const lights = [
    { type: 'spot', color: [0.9, 0.8, 0.3], intensity: 17, range: 16, spot: { innerConeAngle: 0.3, outerConeAngle: 0.9 } },
    { type: 'point', color: [0.1, 0.2, 0.3], intensity: 30, range: 9 },
    { type: 'directional', color: [1, 0.5, 0.2], intensity: 0.3 },
  ];
  glb.json.extensions = { KHR_lights_punctual: { lights } };
  glb.json.extensionsUsed = ['KHR_lights_punctual'];
  const parent = glb.json.nodes.push({ rotation: [0, 0.5, 0, Math.sqrt(0.75)], scale: [2, 3, 0.5], translation: [1, 1, 1], children: [] }) - 1;
  glb.json.scenes[0].nodes.push(parent);
  lights.forEach((_, light) => {
    const rotation = [-0.6 - 0.05 * light, 0, 0.1, 0];
    rotation[3] = Math.sqrt(1 - rotation[0] ** 2 - rotation[2] ** 2);
    const node = { rotation, translation: [light - 1, 1 + light / 3, 0.5 * light], extensions: { KHR_lights_punctual: { light } } };
    glb.json.nodes[parent].children.push(glb.json.nodes.push(node) - 1);
  });
  const file = glb.write('lamps.glb'), points = join(folder, 'q.csv'), found = [];
  (await read(file)).traverse((o) => o.isLight && found.push(o));
  assert.equal(found.length, 3);
  rows(['points', file, '--count', '300', '-o', points]);
  const from = new THREE.Vector3(), to = new THREE.Vector3();
  let inside = 0, between = 0;
  for (const row of rows(['reference', file, '--points', points, '--bounces', '0', '--samples', '16'])) {
    const sum = [0, 0, 0];
    for (const lamp of found) {
      from.setFromMatrixPosition(lamp.matrixWorld);
      const aim = lamp.target && to.setFromMatrixPosition(lamp.target.matrixWorld).sub(from).normalize().clone();
      const way = new THREE.Vector3(...row.slice(0, 3)).sub(from), d = way.length();
      let share = Math.max(0, -(aim && lamp.isDirectionalLight ? aim : way.divideScalar(d)).y);
      if (!lamp.isDirectionalLight) share *= Math.max(0, 1 - (d / lamp.distance) ** 4) / d ** 2;
      if (lamp.isSpotLight) {
        const inner = Math.cos(lamp.angle * (1 - lamp.penumbra)), outer = Math.cos(lamp.angle);
        const ramp = Math.min(1, Math.max(0, (way.dot(aim) - outer) / (inner - outer)));
        share *= ramp ** 2;
        inside += ramp === 1, between += ramp > 0 && ramp < 1;
      }
      lamp.color.toArray().forEach((x, c) => (sum[c] += x * lamp.intensity * share));
    }
    near(row.slice(6, 9), sum, 1e-4 * (1 + Math.max(...sum)), 'irradiance'); // of positions in float
  }
  assert.ok(inside > 0 && between > 0, `${inside} points inside of the cone, ${between} between its angles`);
});
