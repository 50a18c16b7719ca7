// node field_points.mjs SCENE.glb: places on its triangles and eyes all around, 40 for each part, as kiln eval asks
// for them (fixtures/make_field.sh).

import { readFileSync } from 'node:fs';
import { glbJson } from './read_glb.mjs';
import { fromViewer, load } from './sources.mjs';

const file = readFileSync(process.argv[2]);
const { readPacked, unpack } = await load('asset/unpack.ts');
const draco = await fromViewer('draco3dgltf').createDecoderModule({});
const { baked } = unpack(draco, readPacked(file.buffer.slice(file.byteOffset, file.byteOffset + file.byteLength)));
const { json } = glbJson(file);
const { scale = [1, 1, 1], translation = [0, 0, 0] } = json.nodes[json.scenes[0].nodes[0]];
let seed = 1;
const random = () => (seed = (48271 * seed) % 0x7fffffff) / 0x7fffffff;

console.log('x,y,z,nx,ny,nz,vx,vy,vz');
for (const { positions, normals, indices } of baked)
  for (let row = 0; row < 40; ++row) {
    const first = 3 * Math.floor((row * indices.length) / 120);
    const [a, b] = [random(), random()];
    const weights = a + b > 1 ? [a + b - 1, 1 - a, 1 - b] : [1 - a - b, a, b];
    const mean = (values) =>
      [0, 1, 2].map((axis) => weights.reduce((sum, w, k) => sum + w * values[3 * indices[first + k] + axis], 0));
    const [z, angle] = [2 * random() - 1, 2 * Math.PI * random()];
    const view = [Math.sqrt(1 - z * z) * Math.cos(angle), Math.sqrt(1 - z * z) * Math.sin(angle), z];
    const place = mean(positions).map((x, axis) => scale[axis] * x + translation[axis]);
    console.log([...place, ...mean(normals), ...view].join(','));
  }
