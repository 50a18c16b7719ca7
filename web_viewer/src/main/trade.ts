// The page at `/trade`: what accuracy costs. Rows of trade.csv as two plots, one run in full, and the presets.

import { Scatter, type View } from '../trade/scatter';
import { presetTable, runDetails, runTable } from '../trade/tables';
import {
  kErrors,
  kMean,
  kSmallestError,
  kTimes,
  meansOverScenes,
  parseRuns,
  type ErrorKind,
  type Run,
  type TimeKind,
} from '../trade/runs';
import { kChosen, kPresets } from '../trade/presets';
import { symbol } from '../trade/symbols';
import { bytesTick, percentTick, secondsTick } from '../trade/ticks';
import csv from '../trade/trade.csv?raw';
import { announce, h, replaceChildren } from '../ui/dom';
import { bytes, percent, seconds } from '../ui/format';
import { pageHeader } from '../ui/header';
import { svg } from '../ui/svg';
import { applyTheme } from '../ui/theme';

const measured = parseRuns(csv);
const all = [...measured, ...meansOverScenes(measured)];
const scenes = [...new Set(measured.map((run) => run.scene)), kMean];
const standardOrder = measured.find((run) => run.setting === 'standard')?.order ?? 0;

const shownScenes = new Set(scenes.filter((scene) => scene !== kMean));
let errorKind: ErrorKind = 'seen';
let timeKind: TimeKind = 'cpu';

const details = h('section', { class: 'trade-details', 'aria-label': 'The run in full' });
const time = new Scatter('Time against error', select);
const size = new Scatter('Bytes against error', select);

const errorOf = (run: Run) => {
  const { value, low, high } = run.errors[errorKind];
  return { value: Math.max(value, kSmallestError), low, high };
};

function describe(run: Run): string {
  const { value, low, high } = run.errors[errorKind];
  const preset = kPresets.includes(run.setting) ? ', a preset' : '';
  return (
    `${run.scene}, ${run.setting}${preset}: ${percent(value)} [${percent(low)}, ${percent(high)}], ` +
    `${seconds(run.seconds[timeKind])}, ${bytes(run.bytes)}`
  );
}

/// The job's light judges every order by the same light; transport is judged under no sharper light than the order holds.
const comparable = (run: Run) => errorKind === 'jobLight' || errorKind === 'both' || run.order >= standardOrder;

function marksOf(run: Run) {
  const inForce = kPresets.includes(run.setting) ? [{ label: run.setting, byRule: false }] : [];
  const byRule = kChosen.filter((choice) => choice.chosen === run.setting);
  return [...inForce, ...(byRule.length ? [{ label: '', byRule: true }] : [])];
}

function select(run: Run): void {
  time.highlight(run);
  size.highlight(run);
  replaceChildren(details, ...runDetails(run));
}

function view(cost: View['cost'], costText: View['costText'], costLabel: string): View {
  return {
    runs: all.filter((run) => shownScenes.has(run.scene)),
    scenes,
    cost,
    costText,
    costLabel,
    errorLabel: `relRMSE: ${kErrors[errorKind]}`,
    error: errorOf,
    errorText: percentTick,
    comparable,
    describe,
    marks: marksOf,
  };
}

function show(): void {
  time.show(view((run) => run.seconds[timeKind], secondsTick, `time of the whole bake: ${kTimes[timeKind]}`));
  size.show(view((run) => run.bytes, bytesTick, 'size of scene.glb'));
}

function sceneBox(scene: string, series: number): HTMLElement {
  const box = h('input', { type: 'checkbox', id: `scene-${series}`, checked: shownScenes.has(scene) });
  box.addEventListener('change', () => {
    if (box.checked) shownScenes.add(scene);
    else shownScenes.delete(scene);
    show();
    announce(`${all.filter((run) => shownScenes.has(run.scene)).length} runs shown`);
  });
  const key = svg(
    'svg',
    { width: 16, height: 16, viewBox: '0 0 16 16', 'aria-hidden': 'true', class: 'trade-key' },
    svg('path', { d: symbol(series, 8, 8), class: `series-${series}` }),
  );
  return h('label', { class: 'field check trade-scene', for: box.id }, box, h('span', {}, key, ' ', scene));
}

function choice<K extends string>(id: string, label: string, words: Record<K, string>, set: (kind: K) => void) {
  const options = Object.entries(words) as [K, string][];
  const list = h('select', { id }, ...options.map(([value, text]) => h('option', { value }, text)));
  list.addEventListener('change', () => {
    set(list.value as K);
    show();
  });
  return h('div', { class: 'field' }, h('label', { for: id }, label), list);
}

function controls(): HTMLElement {
  return h(
    'div',
    { class: 'trade-controls' },
    h('fieldset', { class: 'trade-scenes' }, h('legend', {}, 'Scenes'), ...scenes.map(sceneBox)),
    choice('error', 'Error', kErrors, (kind) => (errorKind = kind)),
    choice('time', 'Time', kTimes, (kind) => (timeKind = kind)),
  );
}

function build(): void {
  const docs = h('a', { href: '/docs', class: 'text-link' }, 'HTTP interface');
  const lead = h(
    'p',
    { class: 'lead' },
    `${measured.length} bakes of ${scenes.length - 1} scenes under a clear sky, each knob turned, each result measured again `,
    'at other points by the path tracer. A line joins what nothing else beats in both; bars are 95 % intervals. A ring is a preset, ',
    'a dashed ring what the rule would make one. Hollow points hold fewer than ',
    `${standardOrder} bands of light: their transport is judged under softer light and stands in no line.`,
  );
  document.body.append(
    pageHeader('What accuracy costs', docs),
    h(
      'main',
      { class: 'docs trade' },
      lead,
      controls(),
      h('div', { class: 'trade-figures' }, time.element, size.element),
      details,
      presetTable(),
      runTable(measured),
    ),
  );
  show();
  const standard = measured.find((run) => run.setting === 'standard') ?? measured[0];
  if (standard) select(standard);
}

applyTheme();
build();
