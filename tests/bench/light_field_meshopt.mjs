// meshoptimizer's attribute-aware simplifier (its WASM build), for tests/bench/light_field.cpp.
//   node light_field_meshopt.mjs IN OUT      IN: vertices, triangles, target, weight; positions, colours, indices
import {readFileSync, writeFileSync} from 'node:fs';

import {MeshoptSimplifier} from '../../web_viewer/node_modules/meshoptimizer/index.js';

await MeshoptSimplifier.ready;
const file = readFileSync(process.argv[2]);
const buffer = file.buffer.slice(file.byteOffset, file.byteOffset + file.byteLength);
const [vertices, triangles, target] = new Uint32Array(buffer, 0, 3);
const weight = new Float32Array(buffer, 12, 1)[0];
const positions = new Float32Array(buffer, 16, 3 * vertices);
const colours = new Float32Array(buffer, 16 + 12 * vertices, 3 * vertices);
const indices = new Uint32Array(buffer, 16 + 24 * vertices, 3 * triangles);
const [out] = MeshoptSimplifier.simplifyWithAttributes(
    indices, positions, 3, colours, 3, [weight, weight, weight], null, 3 * target, 1e9);
writeFileSync(process.argv[3], new Uint8Array(out.buffer, out.byteOffset, out.byteLength));
