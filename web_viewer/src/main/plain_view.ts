// A model that was reduced and not lit (core/bake/reduce_step.h): its own materials and normal map under three's image-based
// light, suns as lamps, nothing shadowed. The page round it is the viewer's, less what only baked light has.

import { type BufferGeometry, type Material, type Mesh, type Light, type Object3D, Box3 } from 'three';
import { artifact, type Job, type Report } from '../asset/jobs';
import { parsePlainGltf } from '../asset/parse_gltf';
import type { RadianceTransferExtension } from '../asset/kiln_reader';
import type { Relighter } from '../light/relighter';
import { kSkies, projectSky } from '../light/skies';
import { unshadowedLevel } from '../light/unshadowed';
import { announce } from '../ui/dom';
import { helpDialog } from '../ui/help';
import { statistics } from '../ui/statistics';
import { ViewPanel } from '../ui/view_panel';
import { bindAddress } from './address';
import { OriginalLight } from './comparison';
import { listenToKeys } from './keyboard';
import { Lights } from './lights';
import type { Page } from './page';
import { acceptDrops, turnLightByDragging } from './pointer';
import { saveScreenshot } from './screenshot';
import { SkyPictures } from './sky_pictures';
import { kDefaultPose, Stage } from './stage';
import { Store } from './store';
import { toolbar } from './view';
import { decodeState, type ViewState } from './view_state';
import { kWellExposed } from './viewer';
import { Wireframe } from './wireframe';

const kOrder = 6; // of the harmonics that stand for a dropped map
const kOwnSky = 'studio'; // where the job names none; under an even sky nothing without shadows has a shape

export class PlainModel {
  readonly parts: { mesh: Mesh<BufferGeometry, Material | Material[]>; geometry: BufferGeometry }[] = [];
  readonly bounds: Box3;
  readonly transfer = null;
  lamps = false;

  constructor(readonly root: Object3D) {
    root.updateMatrixWorld(true);
    this.bounds = new Box3().setFromObject(root);
    root.traverse((object) => {
      if ((object as Mesh).isMesh) this.parts.push(prepared(object as Mesh));
      this.lamps ||= (object as Light).isLight === true;
    });
  }

  get vertices(): number {
    return this.parts.reduce((sum, { mesh }) => sum + mesh.geometry.getAttribute('position').count, 0);
  }

  get triangles(): number {
    return this.parts.reduce((sum, { mesh }) => sum + mesh.geometry.index!.count / 3, 0);
  }

  /// In the axes of the meshes: they are turned seldom, and this only sets an exposure.
  get normals(): ArrayLike<number>[] {
    return this.parts.flatMap(({ mesh }) => mesh.geometry.getAttribute('normal')?.array ?? []);
  }
}

/// As a wireframe asks for it: with an index, and room for lines where it stands.
function prepared(mesh: Mesh): PlainModel['parts'][number] {
  const { geometry, material } = mesh;
  for (const one of [material].flat()) one.polygonOffsetFactor = one.polygonOffsetUnits = 1;
  if (!geometry.index)
    geometry.setIndex(Array.from({ length: geometry.getAttribute('position').count }, (_, vertex) => vertex));
  return { mesh, geometry };
}

/// Applies a ViewState to a plain model, as Viewer does to a baked one. Owns what it is given.
export class PlainViewer {
  onLights: () => void = () => {};
  readonly asset: { bytes: number; hasOriginal: false };
  private readonly light: OriginalLight;
  private readonly unsubscribe: () => void;
  private wireframe: Wireframe | null = null;

  constructor(
    readonly stage: Stage,
    readonly model: PlainModel,
    readonly state: Store<ViewState>,
    private readonly given: { relighter: Relighter; pictures: SkyPictures; bytes: number },
  ) {
    this.asset = { bytes: given.bytes, hasOriginal: false };
    this.light = new OriginalLight(stage.scene, model.root);
    stage.setBounds(model.bounds);
    stage.pose = state.get().pose ?? kDefaultPose;
    if (!state.get().pose) stage.frameModel();
    this.unsubscribe = state.subscribe((_state, changed) => this.apply(changed));
    this.apply(new Set<keyof ViewState>(['light', 'wire']));
  }

  get lights(): Lights {
    return this.given.pictures.lights;
  }

  get lamps(): boolean {
    return this.model.lamps;
  }

  private apply(changed: ReadonlySet<keyof ViewState>): void {
    const has = (...keys: (keyof ViewState)[]) => keys.some((key) => changed.has(key));
    if (has('light', 'ev', 'tone')) this.setLook();
    if (has('light', 'rotation', 'intensity', 'lamps', 'background')) this.setLight();
    if (has('wire')) this.showWire(this.state.get().wire);
    this.stage.requestDraw();
  }

  /// Exposed as a white model is well exposed under the light, unturned and at intensity 1.
  private setLook(): void {
    const { light, ev, tone } = this.state.get();
    const { levels } = this.lights;
    if (!levels.has(light)) levels.set(light, unshadowedLevel(this.lights.coefficients(light), this.model.normals));
    const level = levels.get(light)!;
    this.stage.setLook((level > 0 ? kWellExposed / level : 1) * 2 ** ev, tone);
  }

  private setLight(): void {
    const { light, background, rotation, intensity, lamps } = this.state.get();
    const { pictures } = this.given;
    const shown = background === 'off' ? null : pictures.background(light, background === 'harmonics');
    this.light.set({ ...pictures.reflection(light), background: shown, rotation, intensity, lamps });
  }

  private showWire(wire: boolean): void {
    this.wireframe?.dispose();
    this.wireframe = wire ? new Wireframe(this.model) : null;
  }

  /// Reads a .hdr or .exr and makes it the light.
  async useFile(file: File): Promise<void> {
    const { relighter, pictures } = this.given;
    const projected = await relighter.project(file.name, await file.arrayBuffer(), kOrder);
    this.lights.addFile(file.name, projected);
    pictures.dispose();
    this.onLights();
    if (this.state.get().light === 'file') this.apply(new Set<keyof ViewState>(['light']));
    else this.state.set({ light: 'file' });
  }

  dispose(): void {
    this.unsubscribe();
    this.wireframe?.dispose();
    this.light.dispose();
    this.given.pictures.dispose();
    this.given.relighter.dispose();
  }
}

/// The job's own sky where it is one of those with a formula.
function lightsOf({ recipe }: Report): Lights {
  const builtin = recipe?.environment?.builtin;
  const asked = kSkies.find(({ id }) => id === builtin);
  const sky = asked ?? kSkies.find(({ id }) => id === kOwnSky)!;
  const flat = projectSky(sky, kOrder);
  const coefficients = Array.from({ length: flat.length / 3 }, (_, i) => Array.from(flat.subarray(3 * i, 3 * i + 3)));
  const like: Pick<RadianceTransferExtension, 'order' | 'light'> = { order: kOrder, light: { name: sky.id, coefficients } };
  const lights = new Lights(like);
  lights.choices[0].label = `${sky.label} (${asked ? 'the job’s' : 'by default'})`;
  return lights;
}

/// Resolves when the picture is shown and the page is complete.
export async function showPlain(
  page: Page,
  job: Job,
  opened: { context: WebGL2RenderingContext; relighter: Relighter; file: ArrayBuffer; report: Report },
): Promise<void> {
  const { context, relighter, file, report } = opened;
  const stage = new Stage(page.canvas, context);
  page.onDispose(() => stage.dispose());
  const lights = lightsOf(report);
  const known = () => lights.choices.map(({ id }) => id);
  const asked = decodeState(location.hash.slice(1), known());
  const state = new Store({ ...asked, rotation: asked.rotation || (report.recipe?.environment?.rotation_deg ?? 0) });
  const gltf = await parsePlainGltf(file);
  const root = gltf.scene ?? gltf.scenes[0];
  if (!root) throw new Error('this glTF has no scene');
  const viewer = new PlainViewer(stage, new PlainModel(root), state, {
    relighter,
    pictures: new SkyPictures(lights),
    bytes: file.byteLength,
  });
  page.onDispose(() => viewer.dispose());
  stage.drawNow();
  page.canvas.setAttribute('aria-label', 'The reduced model. Orbit with the arrow keys.');
  page.showCanvas();
  announce('The model is shown');

  const help = helpDialog();
  const grid = artifact(job, 'grid.exr') !== undefined;
  const panel = new ViewPanel(viewer, statistics(viewer, report), { grid, lightmap: false, levels: [] });
  const actions = { screenshot: () => void saveScreenshot(stage, page.id), help: () => help.showModal() };
  page.main.append(panel.element);
  document.body.append(help);
  page.area.append(toolbar(viewer, job, actions));
  turnLightByDragging(stage, state);
  page.onDispose(
    acceptDrops((dropped) => void panel.useFile(dropped)),
    bindAddress(stage, state, known),
    listenToKeys(stage, state, false, actions),
    () => panel.dispose(),
  );
  document.documentElement.dataset.ready = 'true';
  Object.assign(window, { kilnViewer: viewer, kilnDispose: () => page.dispose() });
}
