// node make_ball.mjs OUT.ply [ACROSS]: a ball with bumps and coloured bands, 12 ACROSS^2 triangles (ACROSS 40 by
// default), for the fixtures of reduced models:
//   kiln bake ball.ply -r recipe.json -o out      {"steps": [{"do": "reduce", "triangles": 1200, "normal_map": 256}]}

import { writeFileSync } from 'node:fs';

const across = Number(process.argv[3] ?? 40);

/// On the face of a cube whose axis is `axis` and side `side`, pushed out to a ball with bumps.
function place(axis, side, u, v) {
  const cube = [0, 0, 0];
  [cube[axis], cube[(axis + 1) % 3], cube[(axis + 2) % 3]] = [side, side * (2 * u - 1), 2 * v - 1];
  const length = Math.hypot(...cube);
  const [x, y, z] = cube.map((c) => c / length);
  const radius = 1 + 0.03 * Math.sin(18 * x) * Math.sin(18 * y) * Math.sin(18 * z);
  const band = 0.5 + 0.5 * Math.sin(6 * y + 2 * x);
  return { at: [x * radius, y * radius, z * radius], colour: [230 - 60 * band, 150 + 60 * band, 110 + 90 * band] };
}

const [vertices, faces] = [[], []];
for (const axis of [0, 1, 2])
  for (const side of [-1, 1]) {
    const first = vertices.length;
    for (let j = 0; j <= across; ++j)
      for (let i = 0; i <= across; ++i) vertices.push(place(axis, side, i / across, j / across));
    for (let j = 0; j < across; ++j)
      for (let i = 0; i < across; ++i) {
        const a = first + j * (across + 1) + i;
        faces.push([a, a + 1, a + across + 2], [a, a + across + 2, a + across + 1]);
      }
  }
const head = `ply
format ascii 1.0
element vertex ${vertices.length}
property float x
property float y
property float z
property uchar red
property uchar green
property uchar blue
element face ${faces.length}
property list uchar int vertex_indices
end_header
`;
const lines = [
  ...vertices.map(({ at, colour }) => [...at.map((x) => x.toFixed(6)), ...colour.map(Math.round)].join(' ')),
  ...faces.map((corners) => `3 ${corners.join(' ')}`),
];
writeFileSync(process.argv[2], `${head}${lines.join('\n')}\n`);
