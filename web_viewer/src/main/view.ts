// The page at `/view/{id}`: waits for the job, loads its scene.glb, shows it.

import { artifact, artifactUrl, explain, finished, follow, getJob, getReport, type Job, type Report } from '../asset/jobs';
import { createDecoder, loadGltf } from '../asset/load_gltf';
import { Relighter } from '../light/relighter';
import { kSkies } from '../light/skies';
import { announce, copyText, h, replaceChildren, toast } from '../ui/dom';
import { bytes } from '../ui/format';
import { Divider } from '../ui/divider';
import { pageHeader } from '../ui/header';
import { helpDialog } from '../ui/help';
import { LegendBox } from '../ui/legend';
import { statistics } from '../ui/statistics';
import { applyTheme } from '../ui/theme';
import { ViewPanel } from '../ui/view_panel';
import { listenToKeys, resetView, turned } from './keyboard';
import { Stage } from './stage';
import { Store } from './store';
import { decodeState, encodeState, type ViewState } from './view_state';
import { Viewer } from './viewer';

applyTheme();

const kLegendTitles: Partial<Record<ViewState['mode'], string>> = {
  measure: 'Sum of |t − t′| over the edges',
  weighted: 'The same × √area',
  coefficient: 'Coefficient of the transfer vector',
};

const id = decodeURIComponent(/\/view\/([^/]+)/.exec(location.pathname)?.[1] ?? '');
const title = h('span', {}, id);
const canvas = h('canvas', { class: 'stage', tabindex: 0, role: 'img', 'aria-label': 'The baked model. Orbit with the arrow keys.' });
const overlay = h('div', { class: 'overlay' });
const area = h('div', { class: 'stage-area' }, canvas, overlay);
const main = h('main', { class: 'view' }, area);
const help = helpDialog();
const undo: (() => void)[] = [];

function showOverlay(text: string, fraction: number | null): void {
  const bar = h('progress', { max: 1, 'aria-label': text });
  if (fraction !== null && Number.isFinite(fraction)) bar.value = fraction;
  overlay.hidden = false;
  replaceChildren(overlay, h('p', {}, text), bar);
}

function showFailure(message: string): void {
  overlay.hidden = false;
  const again = h('button', { type: 'button', onclick: () => location.reload() }, 'Try again');
  replaceChildren(overlay, h('p', { class: 'overlay-title' }, 'This cannot be shown'), h('pre', { class: 'problem', tabindex: 0 }, message), h('p', {}, again, ' ', h('a', { href: '/' }, 'All jobs')));
  announce(message);
}

/// Resolves with the finished job; shows its progress until then.
function whenFinished(job: Job): Promise<Job> {
  if (finished(job)) return Promise.resolve(job);
  showOverlay(`The job is ${job.status}`, null);
  return new Promise((resolve) => {
    const stop = follow(id, {
      job: (news) => {
        announce(`The job is ${news.status}`);
        if (!finished(news)) return showOverlay(`The job is ${news.status}`, null);
        stop();
        resolve(news);
      },
      progress: (_id, { stage, fraction }) => showOverlay(`Baking: ${stage}, ${Math.floor(100 * fraction)} %`, fraction),
    });
    undo.push(stop);
  });
}

function createStage(): Stage {
  try {
    return new Stage(canvas);
  } catch {
    throw new Error('This browser gives no WebGL 2. Kiln’s viewer needs it; hardware acceleration may be turned off in the settings.');
  }
}

async function screenshot(stage: Stage): Promise<void> {
  stage.drawNow();
  const picture = await new Promise<Blob | null>((resolve) => canvas.toBlob(resolve, 'image/png'));
  if (!picture) return toast('The browser gave no picture', 'error');
  const url = URL.createObjectURL(picture);
  h('a', { href: url, download: `kiln-${id}.png` }).click();
  setTimeout(() => URL.revokeObjectURL(url), 10000);
  toast('Picture saved');
}

/// Shift + drag turns the light instead of the camera.
function turnLightByDragging(stage: Stage, state: Store<ViewState>): void {
  let pointer = -1;
  const down = (event: PointerEvent) => {
    if (!event.shiftKey || event.button !== 0) return;
    pointer = event.pointerId;
    stage.controls.enabled = false;
    canvas.setPointerCapture(pointer);
  };
  const move = (event: PointerEvent) => {
    if (event.pointerId === pointer) state.set({ rotation: Math.round(turned(state.get().rotation, 0.4 * event.movementX)) });
  };
  const up = (event: PointerEvent) => {
    if (event.pointerId !== pointer) return;
    pointer = -1;
    stage.controls.enabled = true;
  };
  canvas.addEventListener('pointerdown', down, { capture: true });
  canvas.addEventListener('pointermove', move);
  canvas.addEventListener('pointerup', up);
  canvas.addEventListener('pointercancel', up);
}

/// The address follows the view, and the view an address that the user edits.
function bindAddress(stage: Stage, state: Store<ViewState>, lights: () => string[]): void {
  let timer = 0;
  const write = () => {
    clearTimeout(timer);
    timer = window.setTimeout(() => {
      const text = encodeState({ ...state.get(), pose: stage.pose });
      history.replaceState(null, '', text ? `#${text}` : location.pathname);
    }, 200);
  };
  undo.push(state.subscribe(write), () => clearTimeout(timer));
  stage.onMoved = write;
  const read = () => {
    const wanted = decodeState(location.hash.slice(1), lights());
    state.set(wanted);
    if (wanted.pose) stage.pose = wanted.pose;
  };
  window.addEventListener('hashchange', read);
  undo.push(() => window.removeEventListener('hashchange', read));
}

function acceptEnvironments(panel: ViewPanel): void {
  const over = (event: DragEvent) => event.preventDefault();
  const drop = (event: DragEvent) => {
    event.preventDefault();
    const file = event.dataTransfer?.files[0];
    if (file) void panel.useFile(file);
  };
  window.addEventListener('dragover', over);
  window.addEventListener('drop', drop);
  undo.push(() => window.removeEventListener('dragover', over), () => window.removeEventListener('drop', drop));
}

interface Tools {
  decoder: ReturnType<typeof createDecoder>;
  relighter: Relighter;
  stage: Stage;
}

/// What takes time and does not depend on the job: begun while the job is asked for.
function createTools(): Tools {
  const [decoder, relighter] = [createDecoder(), new Relighter()];
  undo.push(() => decoder.dispose(), () => relighter.dispose());
  const stage = createStage();
  undo.push(() => stage.dispose());
  return { decoder, relighter, stage };
}

async function show(job: Job, tools: Tools): Promise<void> {
  const file = artifact(job, 'scene.glb');
  if (job.status !== 'succeeded' || !file) throw new Error(job.error ? explain(job.error) : `The job is ${job.status}; there is nothing to show.`);
  const loaded = (done: number, total: number) =>
    showOverlay(total ? `Loading ${bytes(done)} of ${bytes(total)}` : `Loading ${bytes(done)}`, total ? done / total : null);
  const report: Promise<Report | null> = artifact(job, 'report.json') ? getReport(job).catch(() => null) : Promise.resolve(null);
  const asset = await loadGltf(artifactUrl(job, 'scene.glb'), tools.decoder, loaded);
  const state = new Store(decodeState(location.hash.slice(1), ['baked', ...kSkies.map((sky) => sky.id)]));
  const viewer = await Viewer.open(tools.stage, asset, state, tools.relighter);
  undo.push(() => viewer.dispose());
  overlay.hidden = true;
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
  area.append(legend.element);
  main.append(panel.element);
  viewer.onLegend = (shown) => legend.show(shown, kLegendTitles[state.get().mode] ?? '');
  viewer.onFailure = (message) => toast(message, 'error');
  toolbar(viewer, job);
  turnLightByDragging(stage, state);
  acceptEnvironments(panel);
  bindAddress(stage, state, () => viewer.lights.choices.map((choice) => choice.id));
  const actions = { screenshot: () => void screenshot(stage), help: () => help.showModal() };
  undo.push(listenToKeys(stage, state, viewer.asset.hasOriginal, actions), () => panel.dispose(), () => divider.dispose());
  document.documentElement.dataset.ready = 'true';
  Object.assign(window, { kilnViewer: viewer, kilnDispose: dispose });
}

function toolbar(viewer: Viewer, job: Job): void {
  const { stage, state } = viewer;
  const button = (text: string, keys: string, action: () => void) => h('button', { type: 'button', title: keys, onclick: action }, text);
  const curl = `curl -o scene.glb '${location.origin}${artifactUrl(job, 'scene.glb')}'`;
  area.append(
    h(
      'div',
      { class: 'toolbar', role: 'toolbar', 'aria-label': 'View' },
      button('Frame', 'F', () => stage.frameModel()),
      button('Reset', 'R', () => resetView(stage, state)),
      button('Save picture', 'S', () => void screenshot(stage)),
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
  showOverlay('Asking for the job', null);
  try {
    const asked = getJob(id);
    asked.catch(() => undefined); // is awaited below
    const tools = createTools();
    const job = await asked;
    title.textContent = job.label || id;
    document.title = `${job.label || id} – Kiln`;
    await show(await whenFinished(job), tools);
  } catch (error) {
    showFailure((error as Error).message);
    dispose();
  }
}

void start();
