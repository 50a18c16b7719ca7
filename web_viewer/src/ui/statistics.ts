// What is known about the result: counts, certificate, plan, warnings.

import type { Report } from '../asset/jobs';
import type { StoredTransfer } from '../asset/kiln_reader';
import { h } from './dom';
import { bytes, count, percent, plain, seconds } from './format';

type Row = readonly [string, string];

/// What is counted.
interface Counted {
  asset: { bytes: number };
  model: {
    vertices: number;
    triangles: number;
    transfer: Pick<StoredTransfer, 'order' | 'channels' | 'fixed' | 'slots' | 'units'> | null;
  };
  level?: { field: { degree: number; bytes: number } | null };
}

export function statistics(viewer: Counted, report: Report | null): HTMLElement {
  const box = h('div', { class: 'statistics' }, pairs(sizes(viewer)));
  if (!report) return box;
  if (report.certificate?.relrmse !== undefined)
    box.append(h('h3', {}, 'Certificate'), certificate(report.certificate, report.error_sources));
  if (report.lightfield && viewer.level?.field)
    box.append(h('h3', {}, 'Light field'), pairs(lightField(viewer.level.field, report.lightfield)));
  if (report.reduce) box.append(h('h3', {}, 'Reduction'), pairs(reduction(report.reduce, report)));
  if (report.grid) box.append(h('h3', {}, 'Grid'), pairs(grid(report.grid)));
  if (report.links) box.append(h('h3', {}, 'Links'), pairs(links(report.links)));
  if (report.glossy?.radiance) box.append(h('h3', {}, 'Specular parts'), pairs(specular(report.glossy)));
  if (report.warnings?.length)
    box.append(h('h3', {}, `Warnings (${report.warnings.length})`), warnings(report.warnings));
  if (report.plan?.length) box.append(h('h3', {}, 'Plan'), plan(report.plan));
  if (report.stages?.length) box.append(h('h3', {}, 'Time'), pairs(stages(report)));
  if (report.result?.streams?.length)
    box.append(h('h3', {}, 'Bytes'), pairs(report.result.streams.map((s): Row => [s.name, bytes(s.bytes)])));
  return box;
}

function sizes({ model, asset }: Counted): Row[] {
  const per = asset.bytes / Math.max(1, model.vertices);
  const rows: Row[] = [
    ['Vertices', count(model.vertices)],
    ['Triangles', count(model.triangles)],
    ['File', `${bytes(asset.bytes)}, ${per.toFixed(1)} B per vertex`],
  ];
  if (!model.transfer) return rows;
  const { order, channels, fixed, slots, units } = model.transfer;
  return [
    ...rows,
    ['Harmonics', order > 0 ? `order ${order}, ${order * order} × ${channels === 3 ? 'RGB' : 'grey'}` : 'none: radiosity'],
    ['Numbers per vertex', `${channels * slots}${fixed ? ', lamps among them' : ''}`],
    ['Units', (units ?? '–').replace('^-1', '⁻¹').replace('^-2', '⁻²')],
  ];
}

const interval = (ends?: readonly [number, number]): string =>
  ends ? ` (95\u00a0%: ${percent(ends[0])} to ${percent(ends[1])})` : '';

const withInterval = (c: { relrmse: number; interval?: [number, number] }): string =>
  percent(c.relrmse) + interval(c.interval);

const kSources: readonly (readonly [string, string])[] = [
  ['noise', 'Error from noise'],
  ['noise_of_reflections', 'of reflected light'],
  ['points', 'from points around vertices'],
  ['interpolation', 'from interpolation'],
  ['bounce_tail', 'from bounces left out'],
  ['quantisation', 'from quantisation'],
  ['compression', 'from compression'],
  ['truncation', 'Own light cut by the order'],
];

const sources = (from: Report['error_sources']): Row[] =>
  kSources.flatMap(([key, label]): Row[] => (from?.[key] === undefined ? [] : [[label, percent(from[key])]]));

function certificate(c: NonNullable<Report['certificate']>, from: Report['error_sources']): HTMLElement {
  const rows: Row[] = [
    ...(c.seen ? [['Where it can be seen', withInterval(c.seen)] as const] : []),
    ...(c.job_light ? [['Own light, in full detail', withInterval(c.job_light)] as const] : []),
    ...sources(from),
    ['Without worst 1 %', percent(c.relrmse_without_worst_1pct)],
    ['99th percentile', percent(c.p99)],
    ['Bias', c.bias === undefined ? '–' : `${(100 * c.bias).toFixed(2).replace('-', '−')}\u00a0%`],
    ['Measured at', `${count(c.points)} points, ${count(c.samples)} paths each`],
    ...(c.lightings ?? []).map((l): Row => [`under ${l.name}`, percent(l.relrmse)]),
  ];
  return h(
    'div',
    {},
    h('p', { class: 'headline' }, h('strong', {}, percent(c.relrmse)), ` relative error${interval(c.interval)}`),
    pairs(rows),
  );
}

/// Its certificate has eyes all around.
function lightField(field: { degree: number; bytes: number }, of: NonNullable<Report['lightfield']>): Row[] {
  const { certificate: c } = of;
  return [
    ['Degree', `${field.degree}: ${(field.degree + 1) ** 2} × RGB a vertex`],
    ['On the graphics card', bytes(field.bytes)],
    ...(c ? [['Relative error towards random eyes', withInterval(c)] as const] : []),
    ...(c?.points ? [['measured at', `${count(c.points)} points, ${count(c.samples)} paths each`] as const] : []),
  ];
}

/// Distances in parts of the diagonal of the model's box.
function reduction(of: NonNullable<Report['reduce']>, { scene, result }: Report): Row[] {
  const before = of.input ?? (scene as { triangles?: number } | undefined);
  const after = of.input ? (scene as { triangles?: number } | undefined) : result;
  if (of.unchanged) return [['Triangles', `${count(before?.triangles)}, as they came`]];
  const { error: e } = of;
  const degrees = (value: number) => `${value.toPrecision(2)}°`;
  const bent = of.charts > 0 ? ` RMS, ${degrees(of.normal_degrees_rms_without_map)} without the normal map` : ' RMS';
  return [
    ['Triangles in', count(before?.triangles)],
    ['Triangles out', count(after?.triangles)],
    ['From the model to this', `${percent(e.rms)} of the diagonal RMS, at most ${percent(e.max)}`],
    ['From this to the model', `${percent(e.rms_back)} RMS, at most ${percent(e.max_back)}`],
    ['Normals', degrees(of.normal_degrees_rms) + bent],
  ];
}

function grid(of: NonNullable<Report['grid']>): Row[] {
  const { size, blend, content, bytes: file, rays_per_vertex: rays, certificate: c } = of;
  const from = (name: string): string => percent(c?.sources?.[name]);
  return [
    ['Vertices', size.join(' × ')],
    ['Light', `${content}, ${blend} blend`],
    ['File', bytes(file)],
    ['Rays per vertex', count(rays)],
    ...(c ? [['Relative error', withInterval(c)] as const] : []),
    ['from noise, lattice, storage', ['noise', 'lattice', 'storage'].map(from).join(', ')],
  ];
}

function links({ senders, receivers, links: kept, share_of_possible: share, bytes: file, certificate: c }: NonNullable<Report['links']>): Row[] {
  return [
    ['Senders, receivers', `${count(senders)}, ${count(receivers)}`],
    ['Links', `${count(kept)}, ${percent(share)} of possible`],
    ['In the file', bytes(file)],
    ...(c ? [['Relative error of reflected light', withInterval(c)] as const] : []),
    ...(c?.of_rms === undefined
      ? []
      : [['relative to its root mean square', percent(c.of_rms) + interval(c.of_rms_interval)] as const]),
    ...linkSources(c?.sources),
  ];
}

const kLinkSources: readonly (readonly [string, string])[] = [
  ['noise', 'from noise'],
  ['links', 'from groups of senders'],
  ['senders', 'from cells of senders'],
  ['interpolation', 'from interpolation'],
];

const linkSources = (from: Record<string, number> | undefined): Row[] =>
  kLinkSources.flatMap(([key, label]): Row[] => (from?.[key] === undefined ? [] : [[label, percent(from[key])]]));

/// The certificate of matrices, with eyes all around.
function specular({ radiance, transport, truncation }: NonNullable<Report['glossy']>): Row[] {
  return [
    ...(radiance ? [['Towards random eyes', withInterval(radiance)] as const] : []),
    ...(transport ? [['from the bake', withInterval(transport)] as const] : []),
    ...(truncation ? [['from the lobe cut by the order', withInterval(truncation)] as const] : []),
  ];
}

function warnings(list: NonNullable<Report['warnings']>): HTMLElement {
  const item = (w: (typeof list)[number]) =>
    h('li', {}, h('code', {}, w.code), ` ${w.message}`, w.where ? h('span', { class: 'hint' }, ` ${w.where}`) : null);
  return h('ul', { class: 'warnings' }, ...list.map(item));
}

function plan(list: NonNullable<Report['plan']>): HTMLElement {
  const item = (d: (typeof list)[number]) =>
    h(
      'li',
      {},
      h('strong', {}, `${d.decision}: ${plain(d.value)}`),
      ` ${d.reason}`,
      d.saves ? h('span', { class: 'hint' }, ` Saves ${plain(d.saves)}.`) : null,
    );
  return h('ul', { class: 'plan' }, ...list.map(item));
}

function stages(report: Report): Row[] {
  const rows = (report.stages ?? []).map((s): Row => [
    s.name,
    s.rays ? `${seconds(s.seconds)}, ${count(s.rays)} rays` : seconds(s.seconds),
  ]);
  if (report.seconds !== undefined) rows.push(['all', seconds(report.seconds)]);
  if (report.peak_memory_bytes) rows.push(['peak memory', bytes(report.peak_memory_bytes)]);
  return rows;
}

function pairs(rows: readonly Row[]): HTMLElement {
  return h('dl', { class: 'pairs' }, ...rows.flatMap(([name, value]) => [h('dt', {}, name), h('dd', {}, value)]));
}
