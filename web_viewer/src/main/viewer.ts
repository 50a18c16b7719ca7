// The viewer without its panels: applies a ViewState to the stage. It keeps the state; panels and address listen to it.

import type { LoadedAsset } from '../asset/parse_gltf';
import type { ValuesReply } from '../light/messages';
import type { Relighter } from '../light/relighter';
import { unshadowedLevel } from '../light/unshadowed';
import { SkyBackground } from '../shaders/sky_background';
import { BakedModel } from './baked_model';
import { Comparison } from './comparison';
import { HeatMap, type HeatMapData } from './heat_map';
import type { Lights } from './lights';
import type { SkyPictures } from './sky_pictures';
import { kDefaultPose, type Stage } from './stage';
import { Store } from './store';
import type { ViewState } from './view_state';
import { Wireframe } from './wireframe';

/// What the legend shows.
export type Legend = Pick<HeatMapData, 'map' | 'range'> | null;

export const kWellExposed = 0.877; // the bake's tone map shows it as 0.8 of white: its own target for bright surfaces
const kOverexposed = 3 * kWellExposed;

const isFalseColour = (mode: ViewState['mode']): boolean => mode !== 'shaded' && mode !== 'light' && mode !== 'grid';

export class Viewer {
  onLegend: (legend: Legend) => void = () => {};
  /// Told by how many stops the original is exposed less than the baked side; 0 when they are exposed alike.
  onBefore: (stops: number) => void = () => {};
  onFailure: (message: string) => void = () => {};
  /// Called when the list of lights has grown.
  onLights: () => void = () => {};
  /// In place of the relighter's own question, while a lamp that moves is shown (lamp_view.ts).
  askLight: ((spare: Float32Array[]) => Promise<ValuesReply>) | null = null;
  private readonly background = new SkyBackground();
  private readonly unsubscribe: () => void;
  /// What the worker needed for the light that is shown.
  relitMilliseconds = 0;
  private wireframe: Wireframe | null = null;
  private heatMap: HeatMap | null = null;
  private comparison: Comparison | null = null;
  private comparisonAsked = false;
  private spare: Float32Array[] = [];
  private relighting = false;
  private relightAgain = false;
  private heatSerial = 0;
  private disposed = false;

  private constructor(
    readonly stage: Stage,
    readonly asset: LoadedAsset,
    readonly model: BakedModel,
    readonly state: Store<ViewState>,
    readonly relighter: Relighter,
    private readonly pictures: SkyPictures,
  ) {
    stage.scene.add(model.root, this.background.mesh);
    stage.setBounds(model.bounds);
    this.setPose();
    this.unsubscribe = state.subscribe((_state, changed) => this.apply(changed));
  }

  /// Resolves when the first light is on the screen. The viewer owns asset, relighter and pictures from then on.
  static async open(
    stage: Stage,
    asset: LoadedAsset,
    state: Store<ViewState>,
    { relighter, pictures }: { relighter: Relighter; pictures: SkyPictures },
  ): Promise<Viewer> {
    const model = await BakedModel.create(asset);
    const viewer = new Viewer(stage, asset, model, state, relighter, pictures);
    viewer.setLook();
    const lit = Promise.all([viewer.relightOnce(), viewer.measureLevel()]);
    model.setWhite(state.get().mode === 'light');
    viewer.showSky();
    stage.compile(); // while the worker computes
    await lit;
    performance.mark('kiln:lit');
    stage.drawNow();
    return viewer;
  }

  /// What the first picture did without, and the functions above tell of.
  complete(): void {
    const { wire, mode, compare } = this.state.get();
    const missing = new Set<keyof ViewState>();
    if (wire) missing.add('wire');
    if (isFalseColour(mode)) missing.add('mode');
    if (compare !== null) missing.add('compare');
    if (missing.size > 0) this.apply(missing);
  }

  private setPose(): void {
    const { pose } = this.state.get();
    this.stage.pose = pose ?? kDefaultPose;
    if (!pose) this.stage.frameModel();
  }

  private apply(changed: ReadonlySet<keyof ViewState>): void {
    const has = (...keys: (keyof ViewState)[]) => keys.some((key) => changed.has(key));
    const state = this.state.get();
    if (has('light', 'rotation', 'intensity', 'lamps')) void this.relight();
    if (has('light')) void this.measureLevel();
    if (has('ev', 'tone')) this.setLook();
    if (has('mode', 'channel', 'slot')) void this.showMode(state);
    if (has('wire')) this.showWire(state.wire);
    if (has('compare')) void this.compare(state.compare);
    if (has('light', 'rotation', 'intensity', 'lamps', 'background', 'compare', 'mode')) this.showSky();
    this.stage.requestDraw();
  }

  get lamps(): boolean {
    return this.model.transfer.fixed;
  }

  /// Of a file with links: where lamps that move must be seen from.
  get lampSamples(): Float32Array | null {
    return this.relighter.samples;
  }

  get lights(): Lights {
    return this.pictures.lights;
  }

  /// At most one request is under way; while it is, only the newest light waits.
  async relight(): Promise<void> {
    this.relightAgain = this.relighting;
    if (this.relighting) return;
    this.relighting = true;
    try {
      await this.relightOnce();
    } catch (error) {
      this.fail(error);
    }
    this.relighting = false;
    if (this.relightAgain) await this.relight();
  }

  /// The bake chose an exposure for its own light. Under another one the picture is exposed so that the model comes out as
  /// bright; intensity and exposure still do what they say.
  private async measureLevel(): Promise<void> {
    const { light } = this.state.get();
    try {
      for (const id of light === 'baked' ? [] : ['baked', light]) {
        if (!this.lights.levels.has(id))
          this.lights.levels.set(id, await this.relighter.level(this.lights.coefficients(id)));
      }
      this.setLook();
    } catch (error) {
      this.fail(error);
    }
  }

  private setLook(): void {
    const { light, ev, tone } = this.state.get();
    const [baked, now] = [this.lights.levels.get('baked') ?? 0, this.lights.levels.get(light) ?? 0];
    const ratio = light !== 'baked' && baked > 0 && now > 0 ? baked / now : 1;
    const exposure = (this.model.transfer.look?.exposure ?? 1) * ratio;
    this.exposeComparison(light, exposure);
    this.stage.setLook(exposure * 2 ** ev, tone);
  }

  /// Without shadows a closed room is as bright as the open sky: at the exposure of the baked side it would be plain white.
  private exposeComparison(light: string, exposure: number): void {
    if (!this.comparison) return;
    const before = exposure * unshadowedLevel(this.lights.coefficients(light), this.model.normals);
    const ratio = before > kOverexposed ? kWellExposed / before : 1;
    this.comparison.exposure = ratio;
    this.onBefore(-Math.log2(ratio));
  }

  private async relightOnce(): Promise<void> {
    const { light, rotation, intensity, lamps } = this.state.get();
    const reply = this.askLight
      ? await this.askLight(this.spare)
      : await this.relighter.relight(this.lights.turned(light, rotation, intensity), lamps, this.spare);
    this.spare = this.model.setLight(reply.values);
    this.model.setArriving(reply.arriving);
    this.relitMilliseconds = reply.milliseconds;
    this.stage.requestDraw();
  }

  private async showMode({ mode, channel, slot }: Readonly<ViewState>): Promise<void> {
    const serial = ++this.heatSerial;
    try {
      const data = isFalseColour(mode) ? await this.heatData(mode, channel, slot) : null;
      if (serial !== this.heatSerial || this.disposed) return;
      this.heatMap?.dispose();
      this.heatMap = data && new HeatMap(this.model, data);
      this.model.setWhite(mode === 'light');
      this.onLegend(data);
      this.stage.requestDraw();
    } catch (error) {
      this.fail(error);
    }
  }

  private async heatData(mode: ViewState['mode'], channel: number, slot: number): Promise<HeatMapData> {
    if (mode === 'coefficient') {
      const { values, range } = await this.relighter.coefficient(
        channel,
        Math.min(slot, this.model.transfer.slots - 1),
      );
      return { per: 'vertex', values, map: 'diverging', range: [-range, range] };
    }
    const { values, range } = await this.relighter.measure(mode === 'weighted');
    return { per: 'triangle', values, map: 'viridis', range: [0, range] };
  }

  private showWire(wire: boolean): void {
    this.wireframe?.dispose();
    this.wireframe = wire ? new Wireframe(this.model) : null;
  }

  private async compare(divider: number | null): Promise<void> {
    this.comparisonAsked = divider !== null;
    if (divider === null) {
      this.comparison?.dispose();
      this.comparison = null;
    } else if (this.comparison) {
      this.comparison.divider = divider;
    } else if (this.asset.hasOriginal) {
      await this.loadComparison();
    } else {
      this.onFailure('This file has no second scene with the original materials.');
    }
  }

  private async loadComparison(): Promise<void> {
    try {
      const original = await this.asset.loadOriginal();
      if (!this.comparisonAsked || this.disposed || this.comparison) return;
      this.comparison = new Comparison(this.stage, original);
      this.comparison.divider = this.state.get().compare ?? 0.5;
      this.showSky();
      this.setLook();
    } catch (error) {
      this.fail(error);
    }
  }

  private showSky(): void {
    const { light, background, rotation, intensity, lamps, mode } = this.state.get();
    const plain = background === 'off' || (isFalseColour(mode) && !this.comparison); // a scale is read against grey
    const shown = plain ? null : this.pictures.background(light, background === 'harmonics');
    this.background.show(shown, rotation, intensity);
    if (this.comparison)
      this.comparison.setLight({ ...this.pictures.reflection(light), background: shown, rotation, intensity, lamps });
  }

  /// Reads a .hdr or .exr and makes it the light.
  async useFile(file: File): Promise<void> {
    const { light, map } = await this.relighter.project(file.name, await file.arrayBuffer(), this.lights.order);
    this.lights.addFile(file.name, light, map);
    this.pictures.dispose();
    this.onLights();
    if (this.state.get().light === 'file') this.apply(new Set<keyof ViewState>(['light']));
    else this.state.set({ light: 'file' });
  }

  private fail(error: unknown): void {
    if (!this.disposed) this.onFailure(error instanceof Error ? error.message : String(error));
  }

  dispose(): void {
    this.disposed = true;
    this.unsubscribe();
    this.relighter.dispose();
    this.comparison?.dispose();
    this.heatMap?.dispose();
    this.wireframe?.dispose();
    this.background.dispose();
    this.pictures.dispose();
    this.model.dispose();
  }
}
