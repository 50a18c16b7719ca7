// node make_field.mjs OUT.glb [lamps] [textured] [smooth]: a small ball of brushed metal over a floor, for the fixtures of light
// fields (fixtures/make_field.sh); with lamps a point, a spot and a sun above it. Textured: with
// a white texel as base colour, and half of the metal. Smooth: of more triangles and
// roughness .25, for the picture of tests/bench/lamps_picture.sh.

import { writeFileSync } from 'node:fs';

const smooth = process.argv.includes('smooth');
const textured = process.argv.includes('textured');
const [across, rings] = smooth ? [96, 64] : [20, 12];
const [radius, height] = [0.7, 0.75];
const ball = { position: [], normal: [], index: [] };
for (let j = 0; j <= rings; ++j)
  for (let i = 0; i <= across; ++i) {
    const [a, b] = [(2 * Math.PI * i) / across, (Math.PI * j) / rings];
    const n = [Math.sin(b) * Math.cos(a), Math.cos(b), Math.sin(b) * Math.sin(a)];
    ball.normal.push(...n);
    ball.position.push(radius * n[0], radius * n[1] + height, radius * n[2]);
  }
for (let j = 0; j < rings; ++j)
  for (let i = 0; i < across; ++i) {
    const [a, b] = [j * (across + 1) + i, (j + 1) * (across + 1) + i];
    if (j > 0) ball.index.push(a, a + 1, b + 1);
    if (j < rings - 1) ball.index.push(a, b + 1, b);
  }
const side = 1.5;
const floor = {
  position: [-side, 0, -side, side, 0, -side, side, 0, side, -side, 0, side],
  normal: [0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1, 0],
  index: [0, 2, 1, 0, 3, 2],
};

const [views, accessors, pieces] = [[], [], []];
let length = 0;
function add(array, type, more = {}) {
  pieces.push(Buffer.from(array.buffer));
  views.push({ buffer: 0, byteOffset: length, byteLength: array.byteLength });
  length += array.byteLength;
  const count = array.length / { SCALAR: 1, VEC2: 2, VEC3: 3 }[type];
  const componentType = array instanceof Float32Array ? 5126 : 5125;
  return accessors.push({ bufferView: views.length - 1, componentType, count, type, ...more }) - 1;
}
const bounds = (p) => ({
  min: [0, 1, 2].map((a) => Math.min(...p.filter((_, i) => i % 3 === a))),
  max: [0, 1, 2].map((a) => Math.max(...p.filter((_, i) => i % 3 === a))),
});
const primitive = ({ position, normal, index }, material) => {
  const p = Float32Array.from(position);
  const attributes = { POSITION: add(p, 'VEC3', bounds([...p])), NORMAL: add(Float32Array.from(normal), 'VEC3') };
  if (textured) attributes.TEXCOORD_0 = add(new Float32Array((2 * position.length) / 3).fill(0.5), 'VEC2');
  return { attributes, indices: add(Uint32Array.from(index), 'SCALAR'), material };
};
const finish = (baseColorFactor, metallicFactor, roughnessFactor) => ({
  pbrMetallicRoughness: {
    baseColorFactor,
    metallicFactor: textured ? metallicFactor / 2 : metallicFactor,
    roughnessFactor,
    ...(textured && { baseColorTexture: { index: 0 } }),
  },
});
const json = {
  asset: { version: '2.0' },
  scene: 0,
  scenes: [{ nodes: [0] }],
  nodes: [{ mesh: 0 }],
  meshes: [{ primitives: [primitive(ball, 0), primitive(floor, 1)] }],
  materials: [finish([0.95, 0.7, 0.35, 1], 1, smooth ? 0.25 : 0.35), finish([0.6, 0.2, 0.15, 1], 0, 0.6)],
  accessors,
  bufferViews: views,
  buffers: [{ byteLength: length }],
};
if (textured) {
  const white = 'iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAAAAAA6fptVAAAACklEQVR4nGP4DwABAQEAsTj2FAAAAABJRU5ErkJggg==';
  Object.assign(json, { textures: [{ source: 0 }], images: [{ uri: `data:image/png;base64,${white}` }] });
}
if (process.argv[3] === 'lamps') {
  const down = [-Math.SQRT1_2, 0, 0, Math.SQRT1_2]; // a quarter turn about x: -z becomes -y
  const tilted = [-0.5, -0.3, 0.1, 0.8].map((x) => x / Math.hypot(0.5, 0.3, 0.1, 0.8));
  const lights = [
    { type: 'point', color: [1, 0.8, 0.5], intensity: 6, range: 4 },
    { type: 'spot', color: [0.4, 0.7, 1], intensity: 8, spot: { innerConeAngle: 0.3, outerConeAngle: 0.5 } },
    { type: 'directional', intensity: 1 },
  ];
  const places = [{ translation: [1, 1.8, 1.1] }, { translation: [0, 2.4, 0], rotation: down }, { rotation: tilted }];
  json.extensionsUsed = ['KHR_lights_punctual'];
  json.extensions = { KHR_lights_punctual: { lights } };
  places.forEach((place, light) => {
    json.scenes[0].nodes.push(json.nodes.length);
    json.nodes.push({ ...place, extensions: { KHR_lights_punctual: { light } } });
  });
}
const text = Buffer.from(JSON.stringify(json));
const padded = Buffer.concat([text, Buffer.alloc((4 - (text.length % 4)) % 4, ' ')]);
const binary = Buffer.concat(pieces);
const head = (...words) => Buffer.from(Uint32Array.from(words).buffer);
writeFileSync(
  process.argv[2],
  Buffer.concat([
    head(0x46546c67, 2, 28 + padded.length + binary.length, padded.length, 0x4e4f534a),
    padded,
    head(binary.length, 0x004e4942),
    binary,
  ]),
);
