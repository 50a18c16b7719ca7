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
  };
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
