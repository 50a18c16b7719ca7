// Labelled controls bound to one key of the view's state, both ways.

import type { Store } from '../main/store';
import type { ViewState } from '../main/view_state';
import { h, replaceChildren } from './dom';

type Keys<T> = { [K in keyof ViewState]: ViewState[K] extends T ? K : never }[keyof ViewState];

/// Builds controls; `dispose` ends what they listen to.
export class Controls {
  private readonly undo: (() => void)[] = [];

  constructor(private readonly state: Store<ViewState>) {}

  slider(
    key: Keys<number>,
    label: string,
    range: { min: number; max: number; step: number; show(value: number): string },
  ): HTMLElement {
    const output = h('output', { for: `c-${key}` });
    const input = h('input', { type: 'range', id: `c-${key}`, min: range.min, max: range.max, step: range.step });
    input.addEventListener('input', () => this.state.set({ [key]: Number(input.value) }));
    this.bind(key, (value) => {
      input.value = String(value);
      output.textContent = range.show(value as number);
      input.setAttribute('aria-valuetext', output.textContent);
    });
    return h('div', { class: 'field slider' }, h('label', { for: input.id }, label), output, input);
  }

  checkbox(key: Keys<boolean>, label: string): HTMLElement {
    const input = h('input', { type: 'checkbox', id: `c-${key}` });
    input.addEventListener('change', () => this.state.set({ [key]: input.checked }));
    this.bind(key, (value) => (input.checked = value as boolean));
    return h('div', { class: 'field check' }, input, h('label', { for: input.id }, label));
  }

  /// `refill` may be called when the choices have changed.
  select(
    key: Keys<string>,
    label: string,
    choices: () => { id: string; label: string }[],
  ): { element: HTMLElement; refill(): void } {
    const input = h('select', { id: `c-${key}` });
    const refill = () => {
      replaceChildren(input, ...choices().map((choice) => h('option', { value: choice.id }, choice.label)));
      input.value = String(this.state.get()[key]);
    };
    refill();
    input.addEventListener('change', () => this.state.set({ [key]: input.value }));
    this.bind(key, (value) => (input.value = String(value)));
    return { element: h('div', { class: 'field' }, h('label', { for: input.id }, label), input), refill };
  }

  /// A number chosen by name; the first name stands for 0.
  numbered(key: Keys<number>, label: string, names: readonly string[]): HTMLElement {
    const input = h('select', { id: `c-${key}` }, ...names.map((name, value) => h('option', { value }, name)));
    input.addEventListener('change', () => this.state.set({ [key]: Number(input.value) }));
    this.bind(key, (value) => (input.value = String(value)));
    return h('div', { class: 'field inline' }, h('label', { for: input.id }, label), input);
  }

  number(key: Keys<number>, label: string, min: number, max: number): HTMLElement {
    const input = h('input', { type: 'number', id: `c-${key}`, min, max, step: 1 });
    input.addEventListener('input', () => {
      const value = Math.round(Number(input.value));
      if (input.value !== '' && value >= min && value <= max) this.state.set({ [key]: value });
    });
    this.bind(key, (value) => {
      if (document.activeElement !== input) input.value = String(value);
    });
    return h('div', { class: 'field inline' }, h('label', { for: input.id }, label), input);
  }

  /// Calls `show` now and whenever one of the keys changes.
  bind<K extends keyof ViewState>(key: K, show: (value: ViewState[K]) => void): void {
    show(this.state.get()[key]);
    this.undo.push(this.state.subscribe((state, changed) => changed.has(key) && show(state[key])));
  }

  dispose(): void {
    for (const undo of this.undo) undo();
  }
}
