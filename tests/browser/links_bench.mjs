// Processor milliseconds of applying the links of a file to a lamp that moves: node tests/browser/links_bench.mjs scene.glb ...
// One thread, as in the viewer's worker; medians of 21 places.

import { readFileSync } from 'node:fs';
import { load } from './sources.mjs';

const { readLinks, gatherRows, lightSenders, readVertices, solveNodes } = await load('light/links.ts');
const { splitGlb } = await load('asset/glb.ts');

const milliseconds = (from) => {
  const { user, system } = process.cpuUsage(from);
  return (user + system) / 1000;
};
const median = (values) => values.sort((a, b) => a - b)[values.length >> 1];

for (const path of process.argv.slice(2)) {
  const bytes = readFileSync(path);
  const { json, binary } = splitGlb(bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.length));
  const extension = json.extensions.KILN_meshless_light;
  const links = readLinks(extension, (i) => {
    const { byteOffset = 0, byteLength } = json.bufferViews[i];
    return binary.subarray(byteOffset, byteOffset + byteLength);
  });
  const seen = new Uint8Array(links.samples.length / 4).fill(1);
  const to = new Float32Array(3 * extension.vertices);
  const normals = new Float32Array(to.length).map((_, i) => (i % 3 === 1 ? 1 : 0));
  const spent = { senders: [], sweeps: [], receivers: [], vertices: [], all: [] };
  for (let k = 0; k < 24; ++k) {
    const whole = process.cpuUsage();
    const step = (name, act) => {
      const from = process.cpuUsage();
      const out = act();
      if (k > 2) spent[name].push(milliseconds(from));
      return out;
    };
    const lamp = { place: [0.01 * k, 0.1, 0.02], intensity: [1, 1, 1] };
    const direct = step('senders', () => lightSenders(links, lamp, seen));
    const nodes = step('sweeps', () => solveNodes(links, direct));
    const rows = step('receivers', () => gatherRows(links, nodes));
    step('vertices', () => readVertices(links, rows, normals, { first: 0, to }));
    if (k > 2) spent.all.push(milliseconds(whole));
  }
  const { senders, rows, links: count, vertices, sweeps } = extension;
  const figures = Object.fromEntries(Object.entries(spent).map(([name, values]) => [name, Number(median(values).toFixed(1))]));
  console.log(JSON.stringify({ path, senders, receivers: rows - senders, links: count, vertices, sweeps, cpu_ms: figures }));
}
