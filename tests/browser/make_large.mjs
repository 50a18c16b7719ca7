// A baked scene of any size for measurements: a hilly field with a smooth, plausible transfer, in the format of
// core/artifact/README.md. node make_large.mjs OUT.glb [vertices along a side] [order]

import { writeFileSync } from 'node:fs';
import { fileURLToPath } from 'node:url';
import { fromViewer, load } from './sources.mjs';

const { clampedCosineTransfer } = await load('light/sh.ts');

function field(side, order) {
  const vertices = side * side;
  const slots = 3 * order * order;
  const [position, normal, transfer] = [
    new Float32Array(3 * vertices),
    new Float32Array(3 * vertices),
    new Float32Array(slots * vertices),
  ];
  const height = (x, z) => 0.06 * Math.sin(9 * x) * Math.cos(7 * z) + 0.02 * Math.sin(31 * x + 17 * z);
  for (let v = 0; v < vertices; ++v) {
    const [x, z] = [(v % side) / (side - 1) - 0.5, Math.floor(v / side) / (side - 1) - 0.5];
    const slope = [height(x - 1e-3, z) - height(x + 1e-3, z), 2e-3, height(x, z - 1e-3) - height(x, z + 1e-3)];
    const n = slope.map((s) => s / Math.hypot(...slope));
    position.set([x, height(x, z), z], 3 * v);
    normal.set(n, 3 * v);
    const open = 0.75 + 4 * height(x, z); // valleys see less of the sky
    const t = clampedCosineTransfer(order, ...n);
    for (let c = 0; c < 3; ++c)
      for (let i = 0; i < t.length; ++i) transfer[slots * v + c * t.length + i] = t[i] * open * (1 - 0.05 * c);
  }
  const indices = new Uint32Array(6 * (side - 1) ** 2);
  for (let q = 0, at = 0; q < (side - 1) ** 2; ++q) {
    const a = Math.floor(q / (side - 1)) * side + (q % (side - 1));
    for (const index of [a, a + side, a + 1, a + 1, a + side, a + side + 1]) indices[at++] = index;
  }
  return { vertices, slots, position, normal, transfer, indices };
}

/// Slots to VEC4s in [-1, 1], with the scale and offset that undo it.
function packSlots({ vertices, slots, transfer }) {
  const [scale, offset, packed] = [[], [], []];
  for (let s = 0; s < slots; ++s) {
    let [low, high] = [Infinity, -Infinity];
    for (let v = 0; v < vertices; ++v)
      [low, high] = [Math.min(low, transfer[v * slots + s]), Math.max(high, transfer[v * slots + s])];
    offset.push((low + high) / 2);
    scale.push((high - low) / 2 || 1);
  }
  for (let k = 0; 4 * k < slots; ++k) {
    packed.push(
      Float32Array.from({ length: 4 * vertices }, (_, j) => {
        const slot = 4 * k + (j & 3);
        return slot < slots ? (transfer[(j >> 2) * slots + slot] - offset[slot]) / scale[slot] : 0;
      }),
    );
  }
  return { scale, offset, packed };
}

async function compress({ vertices, indices, position, normal }, packed) {
  const draco = await fromViewer('draco3dgltf').createEncoderModule({});
  const [builder, mesh] = [new draco.MeshBuilder(), new draco.Mesh()];
  builder.AddFacesToMesh(mesh, indices.length / 3, indices);
  const ids = {
    POSITION: builder.AddFloatAttributeToMesh(mesh, draco.POSITION, vertices, 3, position),
    NORMAL: builder.AddFloatAttributeToMesh(mesh, draco.NORMAL, vertices, 3, normal),
  };
  packed.forEach(
    (values, k) => (ids[`_PRT_${k}`] = builder.AddFloatAttributeToMesh(mesh, draco.GENERIC, vertices, 4, values)),
  );
  const encoder = new draco.ExpertEncoder(mesh);
  encoder.SetSpeedOptions(7, 7);
  for (const [name, id] of Object.entries(ids)) encoder.SetAttributeQuantization(id, name === 'POSITION' ? 16 : 12);
  const out = new draco.DracoInt8Array();
  const length = encoder.EncodeToDracoBuffer(false, out);
  return { ids, bytes: Buffer.from(Int8Array.from({ length }, (_, i) => out.GetValue(i)).buffer) };
}

function glb(json, binary) {
  const pad = (buffer, fill) => Buffer.concat([buffer, Buffer.alloc(-buffer.length & 3, fill)]);
  const [text, data] = [pad(Buffer.from(JSON.stringify(json)), ' '), pad(binary, 0)];
  const head = (length, kind) => Buffer.from(Uint32Array.of(length, kind).buffer);
  const total = 12 + 8 + text.length + 8 + data.length;
  return Buffer.concat([
    Buffer.from(Uint32Array.of(0x46546c67, 2, total).buffer),
    head(text.length, 0x4e4f534a),
    text,
    head(data.length, 0x004e4942),
    data,
  ]);
}

export async function makeLarge(side = 224, order = 6) {
  const mesh = field(side, order);
  const { scale, offset, packed } = packSlots(mesh);
  const { ids, bytes } = await compress(mesh, packed);
  const names = Object.keys(ids);
  const accessor = (type) => ({ componentType: 5126, count: mesh.vertices, type });
  const light = Array.from({ length: order * order }, (_, i) =>
    i === 0 ? [3, 3.2, 3.6] : i === 1 ? [1.2, 1.1, 1] : [0, 0, 0],
  );
  const json = {
    asset: { version: '2.0', extras: { kiln: { engine: 'make_large.mjs' } } },
    extensionsUsed: ['KHR_draco_mesh_compression', 'KHR_materials_unlit', 'KILN_radiance_transfer'],
    extensionsRequired: ['KHR_draco_mesh_compression'],
    scene: 0,
    scenes: [{ nodes: [0] }],
    nodes: [{ mesh: 0, scale: [10, 10, 10] }],
    materials: [{ extensions: { KHR_materials_unlit: {} }, doubleSided: true }],
    meshes: [
      {
        primitives: [
          {
            attributes: Object.fromEntries(names.map((name, i) => [name, i + 1])),
            indices: 0,
            material: 0,
            extensions: {
              KHR_draco_mesh_compression: { bufferView: 0, attributes: ids },
              KILN_radiance_transfer: { albedo: [0.6, 0.55, 0.45], emission: [0, 0, 0], material: 0 },
            },
          },
        ],
      },
    ],
    accessors: [
      { componentType: 5125, count: mesh.indices.length, type: 'SCALAR' },
      { ...accessor('VEC3'), min: [-0.5, -0.1, -0.5], max: [0.5, 0.1, 0.5] },
      accessor('VEC3'),
      ...packed.map(() => accessor('VEC4')),
    ],
    bufferViews: [{ buffer: 0, byteLength: bytes.length }],
    buffers: [{ byteLength: bytes.length + (-bytes.length & 3) }],
    extensions: {
      KILN_radiance_transfer: {
        version: 2,
        basis: 'real-sh',
        condonShortley: false,
        order,
        channels: 3,
        fixed: false,
        slots: order * order,
        form: 'raw',
        attributes: packed.map((_, k) => `_PRT_${k}`),
        scale,
        offset,
        light: { name: 'sky', coefficients: light },
        look: { exposure: 1, toneMap: 'shoulder-0.6' },
      },
    },
  };
  return glb(json, bytes);
}

if (process.argv[1] === fileURLToPath(import.meta.url)) {
  const [out, side, order] = process.argv.slice(2);
  writeFileSync(out, await makeLarge(Number(side ?? 224), Number(order ?? 6)));
}
