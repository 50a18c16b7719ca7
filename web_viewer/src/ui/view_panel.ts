// The panel beside the picture: light, look, what is shown, statistics.

import type { Viewer } from '../main/viewer';
import type { ViewState } from '../main/view_state';
import { Controls } from './controls';
import { h, toast } from './dom';

const kDegrees = (value: number) => `${Math.round(value)}°`;

export class ViewPanel {
  readonly element: HTMLElement;
  private readonly controls: Controls;

  constructor(
    private readonly viewer: Viewer,
    statistics: HTMLElement,
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
      return [h('p', {}, `${viewer.lights.choices[0].label}. Radiosity is the light of the bake and cannot be changed.`)];
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
    if (viewer.model.transfer.fixed) out.push(controls.checkbox('lamps', 'Lamps of the scene'));
    return out;
  }

  async useFile(file: File): Promise<void> {
    try {
      if (this.viewer.lights.order === 0) throw new Error('Radiosity is the light of the bake and cannot be changed.');
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
    const { channels, slots } = viewer.model.transfer;
    const slot = h(
      'div',
      { class: 'sub' },
      controls.number('slot', 'Coefficient', 0, slots - 1),
      slotName(viewer, controls),
    );
    if (channels === 3) slot.prepend(controls.numbered('channel', 'Channel', ['red', 'green', 'blue']));
    controls.bind('mode', (mode) => (slot.hidden = mode !== 'coefficient'));
    return [
      controls.select('mode', 'Surface', () => modes).element,
      slot,
      controls.checkbox('wire', 'Wireframe'),
      compareSwitch(viewer, controls),
    ];
  }

  dispose(): void {
    this.viewer.onLights = () => {};
    this.controls.dispose();
    this.element.remove();
  }
}

function slotName(viewer: Viewer, controls: Controls): HTMLElement {
  const text = h('p', { class: 'hint' });
  controls.bind('slot', (slot) => {
    const band = Math.floor(Math.sqrt(slot));
    const lamp = slot === viewer.model.transfer.order ** 2;
    text.textContent = lamp ? 'Light of the scene’s own lamps' : `Band l = ${band}, m = ${slot - band * (band + 1)}`;
  });
  return text;
}

function compareSwitch(viewer: Viewer, controls: Controls): HTMLElement {
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
