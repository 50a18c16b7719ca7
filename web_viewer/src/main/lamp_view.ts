// A point lamp that moves: direct light by a cube of distances at each pixel, reflected light from the file's links. The
// direct light follows at once; reflected light as fast as the worker answers, the newest place first.

import { Box3, Mesh, MeshBasicMaterial, SphereGeometry, Vector3 } from 'three';
import type { ValuesReply } from '../light/messages';
import { LampShadow } from '../shaders/lamp_shadow';
import { kWellExposed, type Viewer } from './viewer';
import type { ViewState } from './view_state';

const kBallSize = 0.025; // of the model's radius
const kStep = 0.04; // of the half extents, for each key pressed

export class LampView {
  ball: Mesh<SphereGeometry, MeshBasicMaterial> | null = null;
  /// Milliseconds of the newest answer: all of it, and what the worker spent.
  milliseconds = { all: 0, worker: 0 };
  private readonly shadow: LampShadow;
  private readonly box = new Box3();
  private readonly place = new Vector3();
  private readonly uniforms;
  private asking = false; // the GPU has not yet said what the lamp reaches
  private power = 0; // W/sr at 0 stops; 0: not yet chosen
  private last: Promise<void> = Promise.resolve();
  private readonly unsubscribe: () => void;

  constructor(
    private readonly viewer: Viewer,
    samples: Float32Array,
    private readonly home: [number, number, number] | null,
  ) {
    const { model, stage } = viewer;
    this.box.copy(model.bounds);
    const { matrixWorld } = model.parts[0].mesh;
    const meshes = model.parts.map(({ mesh }) => mesh);
    this.shadow = new LampShadow(stage.renderer, meshes, samples, { toWorld: matrixWorld, size: stage.radius });
    this.uniforms = {
      ...this.shadow.uniforms(),
      lampIntensity: { value: new Vector3() },
      lampDirect: { value: 1 },
      lampGlow: { value: 0 },
    };
    for (const { material } of model.parts) Object.assign(material.uniforms, this.uniforms);
    this.unsubscribe = viewer.state.subscribe((_, changed) => this.apply(changed));
    window.addEventListener('keydown', this.press);
    this.apply(new Set<keyof ViewState>(['lamp']));
  }

  /// When the light that was asked for last is shown.
  settled(): Promise<void> {
    return this.last;
  }

  moveTo(place: Vector3): void {
    const { middle, half } = this.extent();
    const at = place.clone().sub(middle).divide(half).clampScalar(-1, 1);
    this.viewer.state.set({ lampAt: [at.x, at.y, at.z] });
  }

  private extent(): { middle: Vector3; half: Vector3 } {
    const half = this.box.getSize(new Vector3()).multiplyScalar(0.5);
    half.clampScalar(1e-6 * this.viewer.stage.radius, Infinity);
    return { middle: this.box.getCenter(new Vector3()), half };
  }

  private apply(changed: ReadonlySet<keyof ViewState>): void {
    const state = this.viewer.state.get();
    const keys: (keyof ViewState)[] = ['lamp', 'lampAt', 'lampPower', 'lampBaked'];
    if (changed.has('lamp')) this.show(state.lamp);
    if (changed.has('lampIndirect')) this.viewer.stage.requestDraw();
    this.uniforms.lampDirect.value = state.lampIndirect ? 0 : 1;
    this.uniforms.lampGlow.value = state.lampBaked ? 1 : 0;
    if (!keys.some((key) => changed.has(key))) return;
    if (state.lamp) this.hang(state);
    this.last = this.viewer.relight();
  }

  private show(shown: boolean): void {
    const { model, stage } = this.viewer;
    this.viewer.askLight = shown ? (spare) => this.light(spare) : null;
    for (const { material } of model.parts) {
      if (shown) material.defines.LAMP = '';
      else delete material.defines.LAMP;
      material.needsUpdate = true;
    }
    if (shown && !this.ball) {
      const look = new MeshBasicMaterial({ color: 0xfff2c0, toneMapped: false });
      this.ball = new Mesh(new SphereGeometry(kBallSize * stage.radius, 24, 16), look);
      stage.scene.add(this.ball);
    } else if (!shown) {
      this.takeBall();
    }
    stage.requestDraw();
  }

  /// Moves the lamp to where the state wants it, with its shadows.
  private hang({ lampAt, lampPower }: Readonly<ViewState>): void {
    const { middle, half } = this.extent();
    if (!lampAt && this.home) this.place.set(...this.home);
    else this.place.set(...(lampAt ?? ([0, 0, 0] as const))).multiply(half).add(middle);
    this.ball?.position.copy(this.place);
    if (!this.asking) this.shadow.moveTo(this.place); // else the next answer's: cubes do not queue up
    this.uniforms.lampIntensity.value.setScalar(this.power * 2 ** lampPower);
    this.viewer.stage.requestDraw();
  }

  private async light(spare: Float32Array[]): Promise<ValuesReply> {
    const start = performance.now();
    const { lampPower, lampBaked } = this.viewer.state.get();
    const place = this.place.clone();
    if (!place.equals(this.shadow.place)) this.shadow.moveTo(place);
    this.asking = true;
    const seen = await this.shadow.seen().finally(() => (this.asking = false));
    if (this.power === 0) this.choosePower(place, seen);
    const { matrixWorld } = this.viewer.model.parts[0].mesh;
    const size = new Vector3().setFromMatrixScale(matrixWorld).x;
    const at = place.applyMatrix4(matrixWorld.clone().invert());
    const watts = (this.power * 2 ** lampPower) / size ** 2;
    const lamp = { place: at.toArray() as [number, number, number], intensity: [watts, watts, watts] as const };
    const reply = await this.viewer.relighter.lamp(lamp, seen, lampBaked, spare);
    this.milliseconds = { all: performance.now() - start, worker: reply.milliseconds };
    return reply;
  }

  /// So that what the lamp reaches is well exposed in the mean, where it hangs first.
  private choosePower(place: Vector3, seen: Uint8Array): void {
    const exposure = this.viewer.stage.renderer.toneMappingExposure || 1;
    this.power = kWellExposed / (exposure * Math.max(1e-30, this.shadow.meanLight(place, seen)));
    const { lampPower } = this.viewer.state.get();
    this.uniforms.lampIntensity.value.setScalar(this.power * 2 ** lampPower);
  }

  private readonly press = (event: KeyboardEvent): void => {
    const target = event.target as HTMLElement | null;
    if (!this.ball || event.ctrlKey || event.metaKey || event.altKey) return;
    if (target?.closest?.('input:not([type=checkbox]), select, textarea, dialog[open], [role=slider]')) return;
    const step = { j: [-1, 0, 0], l: [1, 0, 0], o: [0, 1, 0], u: [0, -1, 0], i: [0, 0, -1], k: [0, 0, 1] }[event.key];
    if (!step) return;
    event.preventDefault();
    const { half } = this.extent();
    this.moveTo(this.place.clone().add(new Vector3(...step).multiplyScalar(kStep).multiply(half)));
  };

  private takeBall(): void {
    this.ball?.removeFromParent();
    this.ball?.geometry.dispose();
    this.ball?.material.dispose();
    this.ball = null;
  }

  dispose(): void {
    this.unsubscribe();
    window.removeEventListener('keydown', this.press);
    this.viewer.askLight = null;
    this.takeBall();
    this.shadow.dispose();
  }
}
