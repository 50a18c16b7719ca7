// scene.glb decoded without three.js: the independent side of the comparisons. Draco's own decoder, 30 lines of JSON.

import { fromViewer } from './sources.mjs';

export function glbJson(file) {
  const length = file.readUInt32LE(12);
  return { json: JSON.parse(file.subarray(20, 20 + length).toString('utf8')), binary: file.subarray(20 + length + 8) };
}

/// Every primitive of scene 0 with its decoded attributes and, per vertex, its flat transfer slots.
export async function decodeBaked(file) {
  const { json, binary } = glbJson(file);
  const draco = await fromViewer('draco3dgltf').createDecoderModule({});
  const extension = json.extensions.KILN_radiance_transfer;
  const node = json.nodes[json.scenes[0].nodes[0]];
  return {
    json,
    binary,
    extension,
    parts: json.meshes[node.mesh].primitives.map((primitive) =>
      decodePrimitive(draco, json, binary, primitive, extension),
    ),
  };
}

function decodePrimitive(draco, json, binary, primitive, extension) {
  const { bufferView, attributes } = primitive.extensions.KHR_draco_mesh_compression;
  const { byteOffset = 0, byteLength } = json.bufferViews[bufferView];
  const bytes = binary.subarray(byteOffset, byteOffset + byteLength);
  const decoder = new draco.Decoder();
  const mesh = new draco.Mesh();
  const status = decoder.DecodeArrayToMesh(new Int8Array(bytes), bytes.length, mesh);
  if (!status.ok()) throw new Error(status.error_msg());
  const read = (name) => {
    const values = new draco.DracoFloat32Array();
    decoder.GetAttributeFloatForAllPoints(mesh, decoder.GetAttributeByUniqueId(mesh, attributes[name]), values);
    return Float32Array.from({ length: values.size() }, (_, i) => values.GetValue(i));
  };
  const stored = extension.attributes.map(read);
  const slots = extension.channels * extension.slots;
  const vertices = mesh.num_points();
  const numberAt = (v, j) => extension.offset[j] + extension.scale[j] * stored[j >> 2][4 * v + (j & 3)];
  const slotAt = extension.form === 'raw' ? numberAt : slotOfComponents(json, binary, extension, numberAt);
  const transfer = Float64Array.from({ length: vertices * slots }, (_, i) => slotAt(Math.floor(i / slots), i % slots));
  const own = primitive.extensions.KILN_radiance_transfer;
  const colours = attributes._ALBEDO === undefined ? null : read('_ALBEDO'); // RGBA, replaces the factor
  const albedoAt = (v) => (colours ? [...colours.subarray(4 * v, 4 * v + 3)] : own.albedo);
  return {
    vertices,
    slots,
    transfer,
    position: read('POSITION'),
    normal: read('NORMAL'),
    albedoAt,
    emission: own.emission,
    material: json.materials[own.material],
    arrivingAt: own.glossy ? arrivingOf(json, binary, extension.glossy, extension.glossy.attributes.map(read)) : null,
  };
}

const floatsOf = ({ bufferViews }, binary, view) => {
  const { byteOffset = 0, byteLength } = bufferViews[view];
  return Float32Array.from({ length: byteLength / 4 }, (_, i) => binary.readFloatLE(byteOffset + 4 * i));
};

/// (v, light) -> the coefficients of what arrives there, three numbers each: the matrix of the vertex times the light.
function arrivingOf(json, binary, glossy, stored) {
  const count = glossy.order ** 2;
  const inputs = count + (glossy.fixed ? 1 : 0);
  const stride = glossy.channels * count * inputs;
  const rows = floatsOf(json, binary, glossy.components.bufferView);
  return (v, light) => {
    const matrix = Float64Array.from(rows.subarray(0, stride));
    for (let k = 0; k < glossy.components.rank; ++k) {
      const weight = glossy.offset[k] + glossy.scale[k] * stored[k >> 2][4 * v + (k & 3)];
      for (let s = 0; s < stride; ++s) matrix[s] += weight * rows[(k + 1) * stride + s];
    }
    return Array.from({ length: count }, (_, o) =>
      [0, 1, 2].map((c) => {
        const first = ((glossy.channels === 3 ? c : 0) * count + o) * inputs;
        let sum = glossy.fixed ? matrix[first + count] : 0;
        for (let i = 0; i < count; ++i) sum += matrix[first + i] * light[3 * i + c];
        return sum;
      }),
    );
  };
}

const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const unit = (a) => a.map((x) => x / Math.sqrt(dot(a, a)));

/// What vertex `v` sends towards `view`, straight from the format's "Specular parts"; `harmonics(order, [x, y, z])`.
export function radianceTowards({ json, binary, extension }, part, v, view, light, harmonics) {
  const { glossy } = extension;
  const { metallicFactor: metallic = 1, roughnessFactor: roughness = 1 } = part.material.pbrMetallicRoughness;
  const n = unit([...part.normal.subarray(3 * v, 3 * v + 3)]);
  const nv = dot(n, view);
  const table = floatsOf(json, binary, glossy.lobes.bufferView);
  const number = lobeBetween(table, 3 + 5 * (glossy.order - 1), roughness, nv);
  const t = unit(n.map((x, i) => x * nv - view[i]));
  const arriving = part.arrivingAt(v, light);
  const mirror = arriving[0].map((x) => number(2) * x * Math.sqrt(1 / (4 * Math.PI)));
  for (let j = 0; j < 5; ++j) {
    const angle = (72 * j * Math.PI) / 180;
    const y = harmonics(glossy.order, n.map((x, i) => x * Math.cos(angle) + t[i] * Math.sin(angle)));
    for (let i = 1; i < y.length; ++i)
      for (let c = 0; c < 3; ++c) mirror[c] += number(5 * Math.floor(Math.sqrt(i)) - 2 + j) * y[i] * arriving[i][c];
  }
  const value = valueAt(extension, part, v, light);
  return part.albedoAt(v).map((base, c) => {
    const f0 = 0.04 * (1 - metallic) + base * metallic;
    const below = (1 - metallic) * base * (1 - 0.04 * number(0) - number(1)) * value[c];
    return below + (f0 * number(0) + number(1)) * Math.max(0, mirror[c]) + part.emission[c];
  });
}

/// Number k of the table at a place between four entries.
function lobeBetween(table, width, roughness, nv) {
  const [row, view] = [15 * roughness, (31 * Math.acos(Math.min(1, Math.max(0, nv)))) / (Math.PI / 2)];
  const [r, c] = [Math.min(14, Math.floor(row)), Math.min(30, Math.floor(view))];
  const at = (i, j, k) => table[((r + i) * 32 + c + j) * width + k];
  const across = (i, k) => at(i, 0, k) * (1 - view + c) + at(i, 1, k) * (view - c);
  return (k) => across(0, k) * (1 - row + r) + across(1, k) * (row - r);
}

/// Slot `s` of vertex `v`: the mean and the weighted rows, or the lamps' light that stands behind the weights.
function slotOfComponents(json, binary, extension, numberAt) {
  const { rank, bufferView } = extension.components;
  const flat = extension.channels * extension.slots;
  const row = (k, s) => binary.readFloatLE((json.bufferViews[bufferView].byteOffset ?? 0) + 4 * (k * flat + s));
  return (v, s) => {
    if (extension.fixed && s % extension.slots === extension.slots - 1)
      return numberAt(v, rank + Math.floor(s / extension.slots));
    let sum = row(0, s);
    for (let k = 0; k < rank; ++k) sum += numberAt(v, k) * row(k + 1, s);
    return sum;
  };
}

/// RGB of a white surface at vertex `v`, straight from the definition.
export function valueAt(extension, part, v, light, lamps = true) {
  const count = extension.order ** 2;
  return [0, 1, 2].map((c) => {
    const first = v * part.slots + (extension.channels === 3 ? c : 0) * extension.slots;
    let sum = extension.fixed && lamps ? part.transfer[first + count] : 0;
    for (let i = 0; i < count; ++i) sum += light[3 * i + c] * part.transfer[first + i];
    return sum;
  });
}
