// The page at `/view/{id}`: waits for the job, loads its scene.glb, shows it.

import {
  artifact,
  artifactUrl,
  explain,
  finished,
  follow,
  getJob,
  getReport,
  type Job,
  type Report,
} from '../asset/jobs';
import { createDecoder, loadGltf } from '../asset/load_gltf';
import { Relighter } from '../light/relighter';
import { kSkies } from '../light/skies';
import { announce, copyText, h, toast } from '../ui/dom';
import { bytes } from '../ui/format';
import { Divider } from '../ui/divider';
import { pageHeader } from '../ui/header';
import { helpDialog } from '../ui/help';
import { LegendBox } from '../ui/legend';
import { Overlay } from '../ui/overlay';
import { statistics } from '../ui/statistics';
import { applyTheme } from '../ui/theme';
import { ViewPanel } from '../ui/view_panel';
import { bindAddress } from './address';
import { listenToKeys, resetView } from './keyboard';
import { Probe } from './probe';
import { acceptDrops, turnLightByDragging } from './pointer';
import { saveScreenshot } from './screenshot';
import { Stage } from './stage';
import { Store } from './store';
import { decodeState, type ViewState } from './view_state';
import { Viewer } from './viewer';

applyTheme();

const kLegendTitles: Partial<Record<ViewState['mode'], string>> = {
  measure: 'Sum of |t − t′| over the edges',
  weighted: 'The same × √area',
  coefficient: 'Coefficient of the transfer vector',
};

const id = decodeURIComponent(/\/view\/([^/]+)/.exec(location.pathname)?.[1] ?? '');
const title = h('span', {}, id);
const canvas = h('canvas', {
  class: 'stage',
  tabindex: 0,
  role: 'img',
  'aria-label': 'The baked model. Orbit with the arrow keys.',
});
const overlay = new Overlay();
const area = h('div', { class: 'stage-area' }, canvas, overlay.element);
const main = h('main', { class: 'view' }, area);
const help = helpDialog();
const undo: (() => void)[] = [];

/// Resolves with the finished job; shows its progress until then.
function whenFinished(job: Job): Promise<Job> {
  if (finished(job)) return Promise.resolve(job);
  overlay.show(`The job is ${job.status}`, null);
  return new Promise((resolve) => {
    const stop = follow(id, {
      job: (news) => {
        announce(`The job is ${news.status}`);
        if (!finished(news)) return overlay.show(`The job is ${news.status}`, null);
        stop();
        resolve(news);
      },
      progress: (_id, { stage, fraction }) =>
        overlay.show(`Baking: ${stage}, ${Math.floor(100 * fraction)} %`, fraction),
    });
    undo.push(stop);
  });
}

function createStage(): Stage {
  try {
    return new Stage(canvas);
  } catch {
    throw new Error(
      'This browser gives no WebGL 2. Kiln’s viewer needs it; hardware acceleration may be turned off in the settings.',
    );
  }
}

interface Tools {
  decoder: ReturnType<typeof createDecoder>;
  relighter: Relighter;
  stage: Stage;
}

/// What takes time and does not depend on the job: begun while the job is asked for.
function createTools(): Tools {
  const [decoder, relighter] = [createDecoder(), new Relighter()];
  undo.push(
    () => decoder.dispose(),
    () => relighter.dispose(),
  );
  const stage = createStage();
  undo.push(() => stage.dispose());
  return { decoder, relighter, stage };
}

async function show(job: Job, tools: Tools): Promise<void> {
  const file = artifact(job, 'scene.glb');
  if (job.status !== 'succeeded' || !file)
    throw new Error(job.error ? explain(job.error) : `The job is ${job.status}; there is nothing to show.`);
  const loaded = (done: number, total: number) =>
    overlay.show(
      total ? `Loading ${bytes(done)} of ${bytes(total)}` : `Loading ${bytes(done)}`,
      total ? done / total : null,
    );
  const report: Promise<Report | null> = artifact(job, 'report.json')
    ? getReport(job).catch(() => null)
    : Promise.resolve(null);
  const asset = await loadGltf(artifactUrl(job, 'scene.glb'), tools.decoder, loaded);
  performance.mark('kiln:decoded');
  const state = new Store(decodeState(location.hash.slice(1), ['baked', ...kSkies.map((sky) => sky.id)]));
  const viewer = await Viewer.open(tools.stage, asset, state, tools.relighter);
  undo.push(() => viewer.dispose());
  overlay.hide();
  performance.mark('kiln:first-picture');
  announce('The model is shown');
  furnish(viewer, job, await report);
}

/// Everything round the picture.
function furnish(viewer: Viewer, job: Job, report: Report | null): void {
  const { stage, state } = viewer;
  const panel = new ViewPanel(viewer, statistics(viewer, report));
  const divider = new Divider(area, state);
  const legend = new LegendBox();
  const probe = new Probe(area, viewer);
  area.append(legend.element);
  main.append(panel.element);
  viewer.onLegend = (shown) => legend.show(shown, kLegendTitles[state.get().mode] ?? '');
  viewer.onBefore = (stops) => divider.showStops(stops);
  viewer.onFailure = (message) => toast(message, 'error');
  toolbar(viewer, job);
  turnLightByDragging(stage, state);
  undo.push(
    acceptDrops((file) => void panel.useFile(file)),
    bindAddress(stage, state, () => viewer.lights.choices.map((choice) => choice.id)),
  );
  const actions = { screenshot: () => void saveScreenshot(stage, id), help: () => help.showModal() };
  undo.push(
    listenToKeys(stage, state, viewer.asset.hasOriginal, actions),
    () => panel.dispose(),
    () => divider.dispose(),
    () => probe.dispose(),
  );
  document.documentElement.dataset.ready = 'true';
  Object.assign(window, { kilnViewer: viewer, kilnDispose: dispose });
}

function toolbar(viewer: Viewer, job: Job): void {
  const { stage, state } = viewer;
  const button = (text: string, keys: string, action: () => void) =>
    h('button', { type: 'button', title: keys, onclick: action }, text);
  const curl = `curl -o scene.glb '${location.origin}${artifactUrl(job, 'scene.glb')}'`;
  area.append(
    h(
      'div',
      { class: 'toolbar', role: 'toolbar', 'aria-label': 'View' },
      button('Frame', 'F', () => stage.frameModel()),
      button('Reset', 'R', () => resetView(stage, state)),
      button('Save picture', 'S', () => void saveScreenshot(stage, id)),
      button('Copy link', '', () => void copyText(location.href, 'Link')),
      button('Copy curl', '', () => void copyText(curl, 'Command')),
      button('Help', 'H', () => help.showModal()),
    ),
  );
}

/// Gives everything back: workers, GPU memory, listeners.
function dispose(): void {
  while (undo.length > 0) undo.pop()!();
}

async function start(): Promise<void> {
  document.body.append(pageHeader(title), main, help);
  overlay.show('Asking for the job', null);
  try {
    performance.mark('kiln:script');
    const asked = getJob(id);
    asked.catch(() => undefined); // is awaited below
    const tools = createTools();
    performance.mark('kiln:stage');
    const job = await asked;
    title.textContent = job.label || id;
    document.title = `${job.label || id} – Kiln`;
    await show(await whenFinished(job), tools);
  } catch (error) {
    overlay.fail((error as Error).message);
    dispose();
  }
}

void start();
