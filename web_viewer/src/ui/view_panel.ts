// The panel beside the picture: light, look, what is shown, statistics.

import type { StoredTransfer } from '../asset/kiln_reader';
import type { Lights } from '../main/lights';
import type { Store } from '../main/store';
import type { ViewState } from '../main/view_state';
import { Controls } from './controls';
import { h, toast } from './dom';
import { type LevelRow, levelSlider } from './levels';

const kDegrees = (value: number) => `${Math.round(value)}°`;

/// What the panel is about.
export interface Shown {
  readonly state: Store<ViewState>;
  readonly lights: Lights;
  readonly lamps: boolean; // the scene has some
  readonly lampSamples?: Float32Array | null; // the file has links for lamps that move
  readonly asset: { hasOriginal: boolean };
  readonly model: { transfer: Pick<StoredTransfer, 'order' | 'channels' | 'slots'> | null }; // null: a plain model
  readonly level?: { field: unknown }; // null: the model has no light field
  readonly progressive?: Uint8Array | null; // the file has a progressive mesh
  readonly points?: { levelEnd: readonly number[] } | null; // the file has the light of its points
  onDetail?: (text: string) => void;
  onDots?: (text: string) => void;
  onLights: () => void;
  useFile(file: File): Promise<void>;
}

const kPlain =
  'This model was reduced, not lit: there is no light in it to look at or to compare with. Add a step prt, radiosity or grid to the recipe.';

export class ViewPanel {
  readonly element: HTMLElement;
  private readonly controls: Controls;

  constructor(
    private readonly viewer: Shown,
    statistics: HTMLElement,
    private readonly has: { grid: boolean; lightmap: boolean; levels: readonly LevelRow[] },
  ) {
    this.controls = new Controls(viewer.state);
    this.element = h(
      'aside',
      { class: 'panel', 'aria-label': 'Settings and statistics' },
      section('Light', true, ...this.light()),
      section('Look', true, ...this.look()),
      section('Show', true, ...this.show()),
      section('Statistics', false, statistics),
    );
  }

  private light(): HTMLElement[] {
    const { controls, viewer } = this;
    if (viewer.lights.order === 0)
      return viewer.lampSamples ? this.lamp() : [h('p', {}, `${viewer.lights.choices[0].label}. ${this.unchangeable}`)];
    const picker = controls.select('light', 'Environment', () => viewer.lights.choices);
    viewer.onLights = picker.refill;
    const file = h('input', { type: 'file', id: 'environment-file', accept: '.hdr,.exr' });
    file.addEventListener('change', () => file.files?.[0] && void this.useFile(file.files[0]));
    const out = [
      picker.element,
      h('div', { class: 'field' }, h('label', { for: file.id }, 'Your own .hdr or .exr'), file),
      controls.slider('rotation', 'Rotation', { min: -180, max: 180, step: 1, show: kDegrees }),
      controls.slider('intensity', 'Intensity', { min: 0, max: 4, step: 0.01, show: (v) => `× ${v.toFixed(2)}` }),
    ];
    if (viewer.lamps) out.push(controls.checkbox('lamps', 'Lamps of the scene'));
    return out;
  }

  private get unchangeable(): string {
    const what = this.viewer.level?.field ? 'A light field' : 'Radiosity';
    return `${what} is the light of the bake and cannot be changed.`;
  }

  private lamp(): HTMLElement[] {
    const { controls } = this;
    return [
      controls.checkbox('lamp', 'A lamp that moves (drag it; I J K L U O)'),
      controls.slider('lampPower', 'Power', { min: -6, max: 6, step: 0.1, show: (v) => `${v > 0 ? '+' : ''}${v.toFixed(1)} stops` }),
      controls.checkbox('lampIndirect', 'Reflected light alone'),
      controls.checkbox('lampBaked', 'The light of the bake too'),
    ];
  }

  async useFile(file: File): Promise<void> {
    try {
      if (this.viewer.lights.order === 0) throw new Error(this.unchangeable);
      await this.viewer.useFile(file);
      toast(`${file.name} lights the scene`);
    } catch (error) {
      toast((error as Error).message, 'error');
    }
  }

  private look(): HTMLElement[] {
    const tones = [
      { id: 'baked', label: 'As baked, soft shoulder' },
      { id: 'neutral', label: 'Khronos PBR Neutral' },
      { id: 'aces', label: 'ACES filmic' },
      { id: 'none', label: 'None, clamped' },
    ];
    const backgrounds = [
      { id: 'sky', label: 'Sky' },
      { id: 'harmonics', label: 'The harmonics of the light' },
      { id: 'off', label: 'Plain' },
    ];
    return [
      this.controls.slider('ev', 'Exposure', {
        min: -6,
        max: 6,
        step: 0.1,
        show: (v) => `${v > 0 ? '+' : ''}${v.toFixed(1)} EV`,
      }),
      this.controls.select('tone', 'Tone mapping', () => tones).element,
      this.controls.select('background', 'Background', () => backgrounds).element,
    ];
  }

  private show(): HTMLElement[] {
    const { controls, viewer } = this;
    const modes: { id: ViewState['mode']; label: string }[] = [
      { id: 'shaded', label: 'Lit surface' },
      { id: 'light', label: 'Light alone, white surface' },
      { id: 'measure', label: 'Where to refine (eq. 3)' },
      { id: 'weighted', label: 'Where to refine, by area' },
      { id: 'coefficient', label: 'One coefficient' },
    ];
    const [hasField, hasLevels] = [Boolean(viewer.level?.field), this.has.levels.length > 1];
    if (hasField) {
      modes[0].label = 'Light field, at each pixel';
      modes.splice(1, 0, { id: 'vertices', label: 'Light field, at the vertices' });
      modes.push({ id: 'vertexError', label: 'What the vertices miss of it' });
    }
    if (hasLevels) modes.push({ id: 'levelError', label: 'What this level of detail misses' });
    if (this.has.grid) modes.push({ id: 'grid', label: 'Light of the grid, white surface' });
    if (!viewer.model.transfer) return this.showPlain();
    const { channels, slots } = viewer.model.transfer;
    const slot = h(
      'div',
      { class: 'sub' },
      controls.number('slot', 'Coefficient', 0, slots - 1),
      slotName(viewer.model.transfer, controls),
    );
    if (channels === 3) slot.prepend(controls.numbered('channel', 'Channel', ['red', 'green', 'blue']));
    controls.bind('mode', (mode) => (slot.hidden = mode !== 'coefficient'));
    return [
      controls.select('mode', 'Surface', () => modes).element,
      slot,
      ...(hasLevels ? [levelSlider(controls, this.has.levels)] : []),
      ...(viewer.progressive ? this.detail() : []),
      controls.checkbox('wire', 'Wireframe'),
      ...(this.has.lightmap ? [controls.checkbox('lightmap', 'Light from the lightmap (off: from the vertices)')] : []),
      ...(viewer.points ? this.points(viewer.points.levelEnd.length) : []),
      ...(this.has.grid ? this.grid() : []),
      compareSwitch(viewer, controls),
    ];
  }

  /// What only baked light has is there, so that it can be found, and disabled.
  private showPlain(): HTMLElement[] {
    const { controls, viewer } = this;
    const why = h('p', { class: 'hint', id: 'why-plain' }, kPlain);
    const mode = { id: 'c-mode', disabled: true, 'aria-describedby': why.id };
    const surface = h(
      'div',
      { class: 'field' },
      h('label', { for: mode.id }, 'Surface'),
      h('select', mode, h('option', {}, 'Lit surface')),
    );
    const compare = compareSwitch(viewer, controls);
    compare.querySelector('input')!.setAttribute('aria-describedby', why.id);
    return [controls.checkbox('wire', 'Wireframe'), surface, compare, why];
  }

  private detail(): HTMLElement[] {
    const { controls, viewer } = this;
    const text = h('p', { class: 'hint', id: 'detail-text' });
    viewer.onDetail = (what) => (text.textContent = what);
    const show = (share: number) => (share === 1 ? 'all' : share.toFixed(2));
    const play = h('button', { type: 'button', onclick: () => playDetail(viewer.state) }, 'Play from coarse to fine');
    return [controls.slider('detail', 'Progressive mesh', { min: 0, max: 1, step: 0.002, show }), play, text];
  }

  private points(levels: number): HTMLElement[] {
    const { controls, viewer } = this;
    const text = h('p', { class: 'hint', id: 'dots-text' });
    viewer.onDots = (what) => (text.textContent = what);
    const show = (count: number) => (count >= levels ? 'all' : `${count}`);
    return [
      controls.checkbox('points', 'Light from the points, splatted (off: from the vertices)'),
      controls.slider('pointLevels', 'Levels of points', { min: 1, max: levels, step: 1, show }),
      controls.checkbox('dots', 'Points whose coefficients matter'),
      text,
    ];
  }

  private grid(): HTMLElement[] {
    const { controls } = this;
    return [
      controls.checkbox('ball', 'A ball in the grid (drag it)'),
      controls.checkbox('cells', 'Cells that a surface crosses'),
      controls.checkbox('arrows', 'Where light flows'),
    ];
  }

  dispose(): void {
    this.viewer.onLights = () => {};
    this.viewer.onDetail = () => {};
    this.viewer.onDots = () => {};
    this.controls.dispose();
    this.element.remove();
  }
}

const kPlaySeconds = 6;

/// Until it is done or somebody else moves the slider.
function playDetail(state: Store<ViewState>): void {
  const start = performance.now();
  let last = 0;
  state.set({ detail: last });
  const step = () => {
    if (state.get().detail !== last) return;
    last = Math.min(1, (performance.now() - start) / (1000 * kPlaySeconds));
    state.set({ detail: last });
    if (last < 1) requestAnimationFrame(step);
  };
  requestAnimationFrame(step);
}

function slotName({ order }: Pick<StoredTransfer, 'order'>, controls: Controls): HTMLElement {
  const text = h('p', { class: 'hint' });
  controls.bind('slot', (slot) => {
    const band = Math.floor(Math.sqrt(slot));
    const lamp = slot === order ** 2;
    text.textContent = lamp ? 'Light of the scene’s own lamps' : `Band l = ${band}, m = ${slot - band * (band + 1)}`;
  });
  return text;
}

function compareSwitch(viewer: Shown, controls: Controls): HTMLElement {
  const input = h('input', { type: 'checkbox', id: 'c-compare', disabled: !viewer.asset.hasOriginal });
  input.addEventListener('change', () => viewer.state.set({ compare: input.checked ? 0.5 : null }));
  controls.bind('compare', (divider) => (input.checked = divider !== null));
  return h('div', { class: 'field check' }, input, h('label', { for: input.id }, 'Before and after'));
}

function section(title: string, open: boolean, ...content: Node[]): HTMLElement {
  const body = h('div', { class: 'section-body' });
  body.append(...content);
  return h('details', { class: 'section', open }, h('summary', {}, h('h2', {}, title)), body);
}
