// node make_lightmap.mjs OUT.glb: a grey room with a point light, four vertices a wall, walls side by side in TEXCOORD_1,
// for the fixtures of lightmaps:
//   kiln bake room.glb -r recipe.json -o out
//   {"steps": [{"do": "radiosity", "deliver": ["vertices", "lightmap"], "subdivide": "off", "lightmap": {"size": 64}}], "quality": "draft"}

import { writeFileSync } from 'node:fs';
import { load } from './sources.mjs';

const { joinGlb } = await load('asset/glb.ts');
const [positions, normals, uvs, indices] = [[], [], [], []];
for (let wall = 0; wall < 6; ++wall) {
  const [axis, side, first] = [wall >> 1, wall % 2 ? 1 : -1, positions.length / 3];
  for (const [u, v] of [[0, 0], [1, 0], [1, 1], [0, 1]]) {
    const [p, n] = [[0, 0, 0], [0, 0, 0]];
    [p[axis], p[(axis + 1) % 3], p[(axis + 2) % 3]] = [side, 2 * u - 1, 2 * v - 1];
    n[axis] = -side;
    positions.push(...p);
    normals.push(...n);
    uvs.push(((wall % 3) + 0.02 + 0.96 * u) / 3, (Math.floor(wall / 3) + 0.02 + 0.96 * v) / 2);
  }
  const corners = side < 0 ? [0, 1, 2, 0, 2, 3] : [0, 2, 1, 0, 3, 2];
  indices.push(...corners.map((k) => first + k));
}
const arrays = [Float32Array.from(positions), Float32Array.from(normals), Float32Array.from(uvs), Uint32Array.from(indices)];
const bytes = arrays.map(({ buffer }) => new Uint8Array(buffer));
const types = ['VEC3', 'VEC3', 'VEC2', 'SCALAR'];
const begins = bytes.map((_, i) => bytes.slice(0, i).reduce((sum, { length }) => sum + length, 0));
const json = {
  asset: { version: '2.0' },
  extensionsUsed: ['KHR_lights_punctual'],
  extensions: { KHR_lights_punctual: { lights: [{ type: 'point', intensity: 3 }] } },
  scene: 0,
  scenes: [{ nodes: [0, 1] }],
  nodes: [{ mesh: 0 }, { translation: [0.3, 0.25, -0.4], extensions: { KHR_lights_punctual: { light: 0 } } }],
  meshes: [{ primitives: [{ attributes: { POSITION: 0, NORMAL: 1, TEXCOORD_0: 2, TEXCOORD_1: 2 }, indices: 3, material: 0 }] }],
  materials: [{ name: 'wall', pbrMetallicRoughness: { baseColorFactor: [0.5, 0.5, 0.5, 1], metallicFactor: 0 } }],
  accessors: types.map((type, i) => ({
    bufferView: i,
    componentType: i < 3 ? 5126 : 5125,
    count: i < 3 ? 24 : 36,
    type,
    ...(i === 0 ? { min: [-1, -1, -1], max: [1, 1, 1] } : {}),
  })),
  bufferViews: bytes.map(({ length }, i) => ({ buffer: 0, byteOffset: begins[i], byteLength: length })),
  buffers: [{ byteLength: bytes.reduce((sum, { length }) => sum + length, 0) }],
};
writeFileSync(process.argv[2], new Uint8Array(joinGlb(json, bytes)));
