// The picture of a finished job and everything round it. Loaded by open_view.ts while the light worker is at the file.

import { artifact, artifactUrl, getReport, type Job, type Report } from '../asset/jobs';
import type { RadianceTransferExtension } from '../asset/kiln_reader';
import { download } from '../asset/download';
import { parseGltf } from '../asset/parse_gltf';
import type { Relighter } from '../light/relighter';
import { announce, copyText, h, toast } from '../ui/dom';
import { Divider } from '../ui/divider';
import { helpDialog } from '../ui/help';
import { LegendBox } from '../ui/legend';
import { haveSizes, levelRows } from '../ui/levels';
import { statistics } from '../ui/statistics';
import { ViewPanel } from '../ui/view_panel';
import { bindAddress } from './address';
import { type KeyActions, listenToKeys, resetView } from './keyboard';
import { fetchLevel, Level, levelsOf } from './level';
import { LevelBySize } from './level_by_size';
import { Lights } from './lights';
import type { Page } from './page';
import { Probe } from './probe';
import { acceptDrops, turnLightByDragging } from './pointer';
import { saveScreenshot } from './screenshot';
import { SkyPictures } from './sky_pictures';
import { Stage } from './stage';
import { Store } from './store';
import { decodeState, type ViewState } from './view_state';
import { Viewer } from './viewer';

const kLegendTitles: Partial<Record<ViewState['mode'], string>> = {
  measure: 'Sum of |t − t′| over the edges',
  weighted: 'The same × √area',
  coefficient: 'Coefficient of the transfer vector',
  vertexError: 'Per vertex against per pixel, parts of white',
  levelError: 'This level against the finest, parts of white',
};

export interface Begun {
  context: WebGL2RenderingContext;
  relighter: Relighter; // with the job's scene.glb
  extension: RadianceTransferExtension;
  opened: Promise<ArrayBuffer>; // the scene.glb without compression and transfer vectors
  size: number; // of scene.glb itself
}

/// Resolves when the picture is shown and the page is complete.
export async function show(page: Page, job: Job, begun: Begun): Promise<void> {
  const { context, relighter, extension, opened, size } = begun;
  const stage = new Stage(page.canvas, context);
  page.onDispose(() => stage.dispose());
  performance.mark('kiln:stage');
  const report: Promise<Report | null> = artifact(job, 'report.json')
    ? getReport(job).catch(() => null)
    : Promise.resolve(null);
  const lights = new Lights(extension);
  const known = lights.choices.map(({ id }) => id);
  const state = new Store(decodeState(location.hash.slice(1), known));
  const pictures = new SkyPictures(lights);
  pictures.prepare(state.get()); // while the worker decodes
  const asset = await parseGltf(await opened, size);
  performance.mark('kiln:decoded');
  const most = stage.renderer.capabilities.maxTextureSize;
  const level = await Level.create(asset, relighter, most);
  const viewer = await Viewer.open(stage, level, state, pictures);
  viewer.openLevel = (index) => fetchLevel(job, index, most);
  page.onDispose(() => viewer.dispose());
  page.showCanvas();
  performance.mark('kiln:first-picture');
  announce('The model is shown');
  furnish(page, viewer, job, await report);
}

/// Everything round the picture.
function furnish(page: Page, viewer: Viewer, job: Job, report: Report | null): void {
  const { stage, state } = viewer;
  const { id, area, main } = page;
  const help = helpDialog();
  const levels = levelRows(levelsOf(job), report, viewer.model);
  const grid = artifact(job, 'grid.exr') !== undefined;
  const lightmap = artifact(job, kLightmap) !== undefined;
  const panel = new ViewPanel(viewer, statistics(viewer, report), { grid, levels, lightmap });
  if (haveSizes(levels)) {
    const bySize = new LevelBySize(viewer, levels.map(({ pixels }) => pixels ?? Infinity));
    page.onDispose(() => bySize.dispose());
  }
  const divider = new Divider(area, state);
  const legend = new LegendBox();
  const probe = new Probe(area, viewer);
  area.append(legend.element);
  main.append(panel.element);
  document.body.append(help);
  viewer.onLegend = (shown) => legend.show(shown, kLegendTitles[state.get().mode] ?? '');
  viewer.onBefore = (stops) => divider.showStops(stops);
  viewer.onFailure = (message) => toast(message, 'error');
  viewer.complete();
  const actions = { screenshot: () => void saveScreenshot(stage, id), help: () => help.showModal() };
  area.append(toolbar(viewer, job, actions));
  turnLightByDragging(stage, state);
  page.onDispose(
    acceptDrops((file) => void panel.useFile(file)),
    bindAddress(stage, state, () => viewer.lights.choices.map((choice) => choice.id)),
  );
  page.onDispose(
    listenToKeys(stage, state, viewer.asset.hasOriginal, actions),
    () => panel.dispose(),
    () => divider.dispose(),
    () => probe.dispose(),
  );
  void Promise.all([
    openGrid(page, viewer, job),
    openLightmap(page, viewer, job),
    openLamp(page, viewer, report),
    openPoints(page, viewer),
    openProgressive(page, viewer),
  ]).then(() => (document.documentElement.dataset.ready = 'true'));
  Object.assign(window, { kilnViewer: viewer, kilnDispose: () => page.dispose() });
}

/// A grid that cannot be shown costs the page nothing else.
async function openGrid(page: Page, viewer: Viewer, job: Job): Promise<void> {
  if (!artifact(job, 'grid.exr')) return;
  try {
    const [file, { readGrid }, { GridView }, { dragBall }] = await Promise.all([
      download(artifactUrl(job, 'grid.exr'), () => {}),
      import('../asset/grid_file'),
      import('./grid_view'),
      import('./ball_drag'),
    ]);
    const grid = readGrid(file);
    const view = new GridView(viewer, grid);
    page.onDispose(dragBall(viewer, view), () => view.dispose());
    Object.assign(window, { kilnGrid: view });
  } catch (error) {
    toast(`grid.exr cannot be shown: ${(error as Error).message}`, 'error');
  }
}

const kLightmap = 'lightmap.exr';

/// Without it the light of the vertices stays.
async function openLightmap(page: Page, viewer: Viewer, job: Job): Promise<void> {
  if (!artifact(job, kLightmap)) return;
  try {
    const [file, { readLightmap }, { LightmapView }] = await Promise.all([
      download(artifactUrl(job, kLightmap), () => {}),
      import('../asset/lightmap_file'),
      import('./lightmap_view'),
    ]);
    const view = new LightmapView(viewer, readLightmap(file));
    page.onDispose(() => view.dispose());
    Object.assign(window, { kilnLightmap: view });
  } catch (error) {
    toast(`lightmap.exr cannot be shown: ${(error as Error).message}`, 'error');
  }
}

/// A lamp that moves, where the file has links for it.
async function openLamp(page: Page, viewer: Viewer, report: Report | null): Promise<void> {
  if (!viewer.lampSamples) return;
  try {
    const [{ LampView }, { dragBall }] = await Promise.all([import('./lamp_view'), import('./ball_drag')]);
    const view = new LampView(viewer, viewer.lampSamples, brightestPlace(report));
    page.onDispose(dragBall(viewer, view), () => view.dispose());
    Object.assign(window, { kilnLamp: view });
    await view.settled();
  } catch (error) {
    toast(`The lamp cannot be shown: ${(error as Error).message}`, 'error');
  }
}

/// Light from the points that it was solved on, where the file has them.
async function openPoints(page: Page, viewer: Viewer): Promise<void> {
  if (!viewer.points) return;
  try {
    const { PointsView } = await import('./points_view');
    const view = new PointsView(viewer, viewer.points);
    page.onDispose(() => view.dispose());
    Object.assign(window, { kilnPoints: view });
  } catch (error) {
    toast(`The points cannot be shown: ${(error as Error).message}`, 'error');
  }
}

/// A mesh at any level of detail, where the file has one.
async function openProgressive(page: Page, viewer: Viewer): Promise<void> {
  if (!viewer.progressive) return;
  const { ProgressiveView } = await import('./progressive_view');
  const view = new ProgressiveView(viewer, viewer.progressive);
  page.onDispose(() => view.dispose());
  Object.assign(window, { kilnProgressive: view });
}

/// Of the places where the certificate hung lamps.
function brightestPlace(report: Report | null): [number, number, number] | null {
  const lamps = report?.links?.certificate?.lamps ?? [];
  return lamps.reduce<(typeof lamps)[number] | null>((a, b) => (a && a.mean_light >= b.mean_light ? a : b), null)?.place ?? null;
}

export function toolbar(viewer: Pick<Viewer, 'stage' | 'state'>, job: Job, actions: KeyActions): HTMLElement {
  const { stage, state } = viewer;
  const button = (text: string, keys: string, action: () => void) =>
    h('button', { type: 'button', title: keys, onclick: action }, text);
  const curl = `curl -o scene.glb '${location.origin}${artifactUrl(job, 'scene.glb')}'`;
  return h(
    'div',
    { class: 'toolbar', role: 'toolbar', 'aria-label': 'View' },
    button('Frame', 'F', () => stage.frameModel()),
    button('Reset', 'R', () => resetView(stage, state)),
    button('Save picture', 'S', actions.screenshot),
    button('Copy link', '', () => void copyText(location.href, 'Link')),
    button('Copy curl', '', () => void copyText(curl, 'Command')),
    button('Help', 'H', actions.help),
  );
}
