// The viewer without its panels: applies a ViewState to the stage. It keeps the state; panels and address listen to it.

import type { LoadedAsset } from '../asset/parse_gltf';
import type { PointField } from '../asset/point_field';
import type { ValuesReply } from '../light/messages';
import type { Relighter } from '../light/relighter';
import { unshadowedLevel } from '../light/unshadowed';
import { SkyBackground } from '../shaders/sky_background';
import type { BakedModel } from './baked_model';
import { Comparison } from './comparison';
import type { Level } from './level';
import type { Lights } from './lights';
import type { SkyPictures } from './sky_pictures';
import { kDefaultPose, type Stage } from './stage';
import { Store } from './store';
import { isFalseColour, type Legend, Surfaces } from './surfaces';
import type { ViewState } from './view_state';

export const kWellExposed = 0.877; // the bake's tone map shows it as 0.8 of white: its own target for bright surfaces
const kOverexposed = 3 * kWellExposed;

export class Viewer {
  onLegend: (legend: Legend) => void = () => {};
  /// Told by how many stops the original is exposed less than the baked side; 0 when they are exposed alike.
  onBefore: (stops: number) => void = () => {};
  onFailure: (message: string) => void = () => {};
  /// Called when the list of lights has grown.
  onLights: () => void = () => {};
  /// Told what is shown of a progressive mesh.
  onDetail: (text: string) => void = () => {};
  /// Told which points are shown.
  onDots: (text: string) => void = () => {};
  /// In place of the relighter's own question, while a lamp that moves is shown (lamp_view.ts).
  askLight: ((spare: Float32Array[]) => Promise<ValuesReply>) | null = null;
  private readonly background = new SkyBackground();
  private readonly surfaces: Surfaces;
  private readonly unsubscribe: () => void;
  /// What the worker needed for the light that is shown.
  relitMilliseconds = 0;
  private comparison: Comparison | null = null;
  private comparisonAsked = false;
  private relighting = false;
  private relightAgain = false;
  private levelSerial = 0;
  /// The level on the screen. Who dresses its meshes listens.
  readonly shown: Store<{ index: number; level: Level }>;
  /// Loads another one; view.ts knows from where.
  openLevel: (index: number) => Promise<Level> = () => Promise.reject(new Error('This job has no levels of detail.'));
  private disposed = false;

  private constructor(
    readonly stage: Stage,
    private readonly finest: Level,
    readonly state: Store<ViewState>,
    private readonly pictures: SkyPictures,
  ) {
    this.shown = new Store({ index: 0, level: finest });
    this.surfaces = new Surfaces(stage, finest, this.background.mesh);
    stage.scene.add(finest.model.root, this.background.mesh);
    stage.setBounds(finest.model.bounds);
    this.setPose();
    this.unsubscribe = state.subscribe((_state, changed) => this.apply(changed));
  }

  /// Resolves when the first light is on the screen. The viewer owns level and pictures from then on.
  static async open(stage: Stage, level: Level, state: Store<ViewState>, pictures: SkyPictures): Promise<Viewer> {
    const viewer = new Viewer(stage, level, state, pictures);
    viewer.setLook();
    const lit = Promise.all([viewer.relightOnce(), viewer.measureLevel()]);
    viewer.surfaces.dress(level, state.get().mode);
    viewer.showSky();
    stage.compile(); // while the worker computes
    await lit;
    performance.mark('kiln:lit');
    stage.drawNow();
    return viewer;
  }

  /// What the first picture did without, and the functions above tell of.
  complete(): void {
    const { wire, mode, compare, level } = this.state.get();
    const missing = new Set<keyof ViewState>();
    if (this.finest.missing) this.onFailure(this.finest.missing);
    if (level > 0) missing.add('level');
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
    if (has('level')) void this.showLevel(state.level);
    if (has('mode', 'channel', 'slot')) void this.showMode(state);
    if (has('wire', 'mode')) this.surfaces.showWire(this.level, state);
    if (has('compare')) void this.compare(state.compare);
    if (has('light', 'rotation', 'intensity', 'lamps', 'background', 'compare', 'mode')) this.showSky();
    this.stage.requestDraw();
  }

  get level(): Level {
    return this.shown.get().level;
  }

  get model(): BakedModel {
    return this.level.model;
  }

  get relighter(): Relighter {
    return this.level.relighter;
  }

  /// Of the finest level, which has the original materials.
  get asset(): LoadedAsset {
    return this.finest.asset;
  }

  get lamps(): boolean {
    return this.model.transfer.fixed;
  }

  /// Of a file with links: where lamps that move must be seen from.
  get lampSamples(): Float32Array | null {
    return this.finest.relighter.samples;
  }

  /// Of a file with the light of its points.
  get points(): PointField | null {
    return this.finest.relighter.points;
  }

  /// Of a file with a progressive mesh: its bytes.
  get progressive(): Uint8Array | null {
    return this.finest.field && this.finest.relighter.progressive;
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
          this.lights.levels.set(id, await this.relighter.level(this.lights.parts(id)));
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
    const exposure = (this.finest.model.transfer.look?.exposure ?? 1) * ratio; // levels change nothing
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
    const levels = this.state.get().mode === 'levelError' ? [this.level, this.finest] : [this.level];
    for (const level of new Set(levels)) await this.relightLevel(level);
    this.stage.requestDraw();
  }

  private async relightLevel(level: Level): Promise<void> {
    const { light, rotation, intensity, lamps } = this.state.get();
    const spare = level.spare;
    level.spare = []; // an array is given away once
    const reply = this.askLight
      ? await this.askLight(spare)
      : await level.relighter.relight(this.lights.turned(light, rotation, intensity), lamps, spare);
    level.spare = level.model.setLight(reply.values);
    level.model.setArriving(reply.arriving);
    this.relitMilliseconds = reply.milliseconds;
  }

  /// The level that is shown stays until the other one is lit. A request that is overtaken comes to nothing.
  private async showLevel(index: number): Promise<void> {
    const serial = ++this.levelSerial;
    if (index === this.shown.get().index) return;
    let level: Level | null = null;
    try {
      level = index === 0 ? this.finest : await this.openLevel(index);
      if (serial === this.levelSerial && !this.disposed) await this.relightLevel(level);
    } catch (error) {
      if (level !== this.finest) level?.dispose();
      if (serial !== this.levelSerial) return;
      this.fail(error);
      this.state.set({ level: this.shown.get().index });
      return;
    }
    if (serial === this.levelSerial && !this.disposed) this.swapLevel(index, level);
    else if (level !== this.finest) level.dispose();
  }

  private swapLevel(index: number, level: Level): void {
    const before = this.level;
    this.surfaces.strip(before);
    before.model.root.removeFromParent();
    this.stage.scene.add(level.model.root);
    this.shown.set({ index, level });
    if (before !== this.finest) before.dispose();
    if (level.missing) this.onFailure(level.missing);
    this.apply(new Set<keyof ViewState>(['mode', 'wire']));
  }

  private async showMode(state: Readonly<ViewState>): Promise<void> {
    try {
      if (state.mode === 'levelError') await this.relightLevel(this.finest);
      const legend = await this.surfaces.show(this.level, state);
      if (legend === undefined || this.disposed) return;
      this.onLegend(legend);
      this.stage.requestDraw();
    } catch (error) {
      this.fail(error);
    }
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
    const grey = isFalseColour(mode) && !this.comparison; // a scale is read against it
    const plain = background === 'off' || grey || !this.lights.hasPicture(light);
    const shown = plain ? null : this.pictures.background(light, background === 'harmonics');
    this.background.show(shown, rotation, intensity);
    if (this.comparison)
      this.comparison.setLight({ ...this.pictures.reflection(light), background: shown, rotation, intensity, lamps });
  }

  /// Reads a .hdr or .exr and makes it the light.
  async useFile(file: File): Promise<void> {
    const projected = await this.finest.relighter.project(file.name, await file.arrayBuffer(), this.lights.order);
    this.lights.addFile(file.name, projected);
    this.pictures.dispose();
    this.onLights();
    if (this.state.get().light === 'file') this.apply(new Set<keyof ViewState>(['light']));
    else this.state.set({ light: 'file' });
  }

  private fail(error: unknown): void {
    if (error instanceof DOMException && error.name === 'AbortError') return; // its level is gone
    if (!this.disposed) this.onFailure(error instanceof Error ? error.message : String(error));
  }

  dispose(): void {
    this.disposed = true;
    this.unsubscribe();
    this.comparison?.dispose();
    this.surfaces.strip(this.level);
    this.background.dispose();
    this.pictures.dispose();
    for (const level of new Set([this.level, this.finest])) level.dispose();
  }
}
