// The line between before and after: dragged, or moved with the arrow keys.

import type { Store } from '../main/store';
import type { ViewState } from '../main/view_state';
import { h } from './dom';

export class Divider {
  private readonly line = h(
    'div',
    {
      class: 'divider',
      role: 'slider',
      tabindex: 0,
      'aria-label': 'Divider between before and after',
      'aria-valuemin': 0,
      'aria-valuemax': 100,
      hidden: true,
    },
    h('span', { class: 'divider-knob', 'aria-hidden': 'true' }, '⇔'),
  );
  private readonly before = h('span', { class: 'side-label side-before', hidden: true }, 'Before: unshadowed light');
  private readonly after = h('span', { class: 'side-label side-after', hidden: true }, 'After: baked');
  private readonly unsubscribe: () => void;

  constructor(
    private readonly area: HTMLElement,
    private readonly state: Store<ViewState>,
  ) {
    area.append(this.before, this.after, this.line);
    this.line.addEventListener('pointerdown', (event) => this.line.setPointerCapture(event.pointerId));
    this.line.addEventListener('pointermove', (event) => {
      if (this.line.hasPointerCapture(event.pointerId)) this.moveTo(event.clientX);
    });
    this.line.addEventListener('keydown', (event) => this.key(event));
    this.unsubscribe = state.subscribe((_state, changed) => changed.has('compare') && this.show());
    this.show();
  }

  /// `stops`: how much less the left side is exposed.
  showStops(stops: number): void {
    const exposed = stops > 0 ? `, exposed ${stops.toFixed(1)} EV less` : '';
    this.before.textContent = `Before: unshadowed light${exposed}`;
  }

  private moveTo(clientX: number): void {
    const { left, width } = this.area.getBoundingClientRect();
    this.set((clientX - left) / width);
  }

  private key(event: KeyboardEvent): void {
    const step = { ArrowLeft: -0.02, ArrowRight: 0.02, PageDown: -0.2, PageUp: 0.2, Home: -1, End: 1 }[event.key];
    if (step === undefined) return;
    event.preventDefault();
    event.stopPropagation();
    this.set((this.state.get().compare ?? 0.5) + step);
  }

  private set(value: number): void {
    this.state.set({ compare: Math.min(1, Math.max(0, value)) });
  }

  private show(): void {
    const { compare } = this.state.get();
    for (const part of [this.line, this.before, this.after]) part.hidden = compare === null;
    if (compare === null) return;
    this.line.style.left = `${100 * compare}%`;
    this.line.setAttribute('aria-valuenow', String(Math.round(100 * compare)));
  }

  dispose(): void {
    this.unsubscribe();
    for (const part of [this.line, this.before, this.after]) part.remove();
  }
}
