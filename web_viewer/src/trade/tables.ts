// The runs in words: one in full, the presets, and all of them.

import { h } from '../ui/dom';
import { bytes, count, percent, plain, seconds } from '../ui/format';
import { kChoices, kRule, type Means } from './presets';
import type { Estimate, Run } from './runs';

const estimate = ({ value, low, high }: Estimate) => `${percent(value)} [${percent(low)}, ${percent(high)}]`;

const pairs = (entries: [string, string][]) =>
  h('dl', { class: 'pairs' }, ...entries.flatMap(([name, value]) => [h('dt', {}, name), h('dd', {}, value)]));

/// What came of it, what was predicted, what was in force.
export function runDetails(run: Run): HTMLElement[] {
  const { fields } = run;
  const number = (name: string) => (name in fields ? Number(fields[name]) : undefined);
  const beside = (text: string, predicted: string) => `${text}; the plan said ${predicted}`;
  const costs: [string, string][] = [
    [
      'Wall clock',
      fields.seconds
        ? beside(seconds(run.seconds.wall), seconds(number('predicted_seconds')))
        : seconds(run.seconds.wall),
    ],
    ['Processor', seconds(run.seconds.cpu)],
    ['scene.glb', fields.seconds ? beside(bytes(run.bytes), bytes(number('predicted_bytes'))) : bytes(run.bytes)],
  ];
  if (fields.seconds) {
    costs.push(
      ['Peak memory', beside(bytes(number('peak_memory_bytes')), bytes(number('predicted_memory_bytes')))],
      ['Rays', beside(count(number('rays')), count(number('predicted_rays')))],
      ['Surface', `${count(number('triangles'))} triangles, ${count(number('vertices'))} vertices`],
    );
  }
  const errors: [string, string][] = [
    ['Where it can be seen', estimate(run.errors.seen)],
    ['Hidden points too', estimate(run.errors.all)],
    ['Job’s own light', estimate(run.errors.jobLight)],
  ];
  if (fields.certified) {
    const certified = { value: number('certified')!, low: number('certified_low')!, high: number('certified_high')! };
    errors.push(['Its certificate said', estimate(certified)]);
  }
  const knobs = fields.parameters
    ? Object.entries(JSON.parse(fields.parameters) as Record<string, unknown>).map(
        ([name, value]): [string, string] => [
          name,
          typeof value === 'number' ? String(Number(value.toPrecision(4))) : plain(value),
        ],
      )
    : [];
  return [
    h('h2', {}, `${run.scene}: ${run.setting}`),
    h(
      'div',
      { class: 'trade-columns' },
      h('div', {}, h('h3', {}, 'Cost'), pairs(costs)),
      h('div', {}, h('h3', {}, 'Error, relRMSE and 95 % interval'), pairs(errors)),
      knobs.length ? h('div', {}, h('h3', {}, 'Knobs in force'), pairs(knobs)) : null,
    ),
  ];
}

function scrolling(label: string, heads: string[], rows: HTMLElement[]): HTMLElement {
  return h(
    'div',
    { class: 'table-scroll', tabindex: 0, role: 'region', 'aria-label': label },
    h(
      'table',
      {},
      h('thead', {}, h('tr', {}, ...heads.map((head) => h('th', { scope: 'col' }, head)))),
      h('tbody', {}, ...rows),
    ),
  );
}

const row = (head: string, ...cells: string[]) =>
  h('tr', {}, h('th', { scope: 'row' }, head), ...cells.map((cell) => h('td', {}, cell)));

export function presetTable(): HTMLElement {
  const cells = (m: Means) => [m.setting, seconds(m.cpu_seconds), percent(m.error), bytes(m.artifact_bytes)];
  const rows = kChoices.flatMap(({ preset, chosen, in_force }) => [
    row(preset, 'in force', ...cells(in_force)),
    row(preset, 'by rule', ...cells(chosen)),
  ]);
  return h(
    'section',
    { class: 'trade-presets' },
    h('h2', {}, 'Presets'),
    scrolling('Presets', ['Preset', 'Which', 'Setting', 'Processor', 'Error of both judgements', 'scene.glb'], rows),
    h('p', { class: 'hint' }, kRule),
  );
}

export function runTable(runs: Run[]): HTMLElement {
  const heads = [
    'Scene',
    'Setting',
    'Wall clock',
    'Processor',
    'Seen',
    'All points',
    'Job’s light',
    'scene.glb',
    'Peak memory',
  ];
  const rows = runs.map((run) =>
    row(
      run.scene,
      run.setting,
      seconds(run.seconds.wall),
      seconds(run.seconds.cpu),
      estimate(run.errors.seen),
      estimate(run.errors.all),
      estimate(run.errors.jobLight),
      bytes(run.bytes),
      bytes(Number(run.fields.peak_memory_bytes)),
    ),
  );
  return h(
    'details',
    { class: 'operation' },
    h('summary', {}, `All ${runs.length} runs as a table`),
    scrolling('All runs', heads, rows),
  );
}
