// Levels of detail: a slider from the finest to the coarsest, with what each costs and misses.

import type { Artifact, Report } from '../asset/jobs';
import type { Controls } from './controls';
import { h } from './dom';
import { bytes, count, percent } from './format';

export interface LevelRow {
  name: string;
  bytes: number;
  vertices?: number;
  error?: number; // relative, towards every eye
  pixels?: number; // how large it may be on the screen
}

/// `finest`: what is known of scene.glb without a report.
export function levelRows(
  levels: readonly Artifact[],
  report: Report | null,
  finest: { vertices: number },
): LevelRow[] {
  const field = report?.lightfield;
  return levels.map(({ name, bytes }, i) => {
    const known = field?.levels?.find(({ file }) => file === name);
    if (i === 0) return { name, bytes, vertices: finest.vertices, error: field?.certificate?.relrmse };
    const pixels = known?.screen_pixels ?? undefined;
    return { name, bytes, vertices: known?.vertices, error: known?.certificate?.relrmse, pixels };
  });
}

/// Whether the report says of every coarser level how large it may be.
export const haveSizes = (levels: readonly LevelRow[]): boolean =>
  levels.length > 1 && levels.slice(1).every(({ pixels }) => pixels !== undefined);

export function levelSlider(controls: Controls, levels: readonly LevelRow[]): HTMLElement {
  const last = levels.length - 1;
  const cells = (row: LevelRow) =>
    [row.name, count(row.vertices), bytes(row.bytes), percent(row.error), count(row.pixels)];
  const rows = levels.map((row) => h('tr', {}, ...cells(row).map((text) => h('td', {}, text))));
  controls.bind('level', (level) =>
    rows.forEach((row, i) => row.setAttribute('aria-current', String(i === level))),
  );
  const show = (at: number) => (at === 0 ? 'finest' : `${at} of ${last}`);
  const head = ['File', 'Vertices', 'Bytes', 'Error', 'Pixels'].map((text) => h('th', { scope: 'col' }, text));
  return h(
    'div',
    {},
    controls.slider('level', 'Level of detail', { min: 0, max: last, step: 1, show }),
    ...(haveSizes(levels) ? [controls.checkbox('levelBySize', 'As coarse as its size on the screen allows')] : []),
    h('table', { class: 'levels' }, h('thead', {}, h('tr', {}, ...head)), h('tbody', {}, ...rows)),
  );
}
