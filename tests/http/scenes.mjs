// Small scenes made by formula, as glTF and GLB.

/** A unit cube of 12 triangles with flat normals. */
function cubeArrays(scale) {
  const positions = [], normals = [], indices = [];
  for (let axis = 0; axis < 3; ++axis) {
    for (const side of [-1, 1]) {
      const base = positions.length / 3;
      for (const [u, v] of [[-1, -1], [1, -1], [1, 1], [-1, 1]]) {
        const corner = [0, 0, 0], normal = [0, 0, 0];
        corner[axis] = side * scale;
        corner[(axis + 1) % 3] = u * scale;
        corner[(axis + 2) % 3] = v * scale;
        normal[axis] = side;
        positions.push(...corner);
        normals.push(...normal);
      }
      const quad = side > 0 ? [0, 1, 2, 0, 2, 3] : [0, 2, 1, 0, 3, 2];
      indices.push(...quad.map((i) => base + i));
    }
  }
  return {positions, normals, indices};
}

/** A bumpy square of 2 n^2 triangles. */
function gridArrays(n) {
  const positions = [], normals = [], indices = [];
  for (let y = 0; y <= n; ++y) {
    for (let x = 0; x <= n; ++x) {
      positions.push(x / n, 0.1 * Math.sin(x) * Math.cos(y), y / n);
      normals.push(0, 1, 0);
      if (x === n || y === n) continue;
      const a = y * (n + 1) + x, b = a + n + 1;
      indices.push(a, b, a + 1, a + 1, b, b + 1);
    }
  }
  return {positions, normals, indices};
}

function pack({positions, normals, indices}) {
  const bytes = Buffer.concat([Buffer.from(new Float32Array(positions).buffer), Buffer.from(new Float32Array(normals).buffer),
    Buffer.from(new Uint32Array(indices).buffer)]);
  const low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
  positions.forEach((value, i) => {
    low[i % 3] = Math.min(low[i % 3], Math.fround(value));
    high[i % 3] = Math.max(high[i % 3], Math.fround(value));
  });
  const floats = positions.length * 4;
  const json = {
    asset: {version: '2.0'}, scene: 0, scenes: [{nodes: [0]}], nodes: [{mesh: 0}],
    meshes: [{primitives: [{attributes: {POSITION: 0, NORMAL: 1}, indices: 2}]}],
    accessors: [
      {bufferView: 0, componentType: 5126, count: positions.length / 3, type: 'VEC3', min: low, max: high},
      {bufferView: 1, componentType: 5126, count: normals.length / 3, type: 'VEC3'},
      {bufferView: 2, componentType: 5125, count: indices.length, type: 'SCALAR'}],
    bufferViews: [
      {buffer: 0, byteOffset: 0, byteLength: floats}, {buffer: 0, byteOffset: floats, byteLength: floats},
      {buffer: 0, byteOffset: 2 * floats, byteLength: indices.length * 4}],
    buffers: [{byteLength: bytes.length}],
  };
  return {json, bytes};
}

function glb({json, bytes}) {
  let text = Buffer.from(JSON.stringify(json));
  text = Buffer.concat([text, Buffer.alloc((4 - (text.length % 4)) % 4, ' ')]);
  const head = Buffer.alloc(20);
  head.write('glTF', 0);
  head.writeUInt32LE(2, 4);
  head.writeUInt32LE(28 + text.length + bytes.length, 8);
  head.writeUInt32LE(text.length, 12);
  head.write('JSON', 16);
  const chunk = Buffer.alloc(8);
  chunk.writeUInt32LE(bytes.length, 0);
  chunk.write('BIN\0', 4);
  return Buffer.concat([head, text, chunk, bytes]);
}

/** Cubes of different size are different content: none is answered from another's result. */
export const cubeGlb = (scale = 1) => glb(pack(cubeArrays(scale)));
export const gridGlb = (n) => glb(pack(gridArrays(n)));

/** A .gltf whose buffer is a file beside it. */
export function cubeGltf(uri, scale = 1) {
  const {json, bytes} = pack(cubeArrays(scale));
  json.buffers[0].uri = uri;
  return {gltf: Buffer.from(JSON.stringify(json)), bytes};
}
