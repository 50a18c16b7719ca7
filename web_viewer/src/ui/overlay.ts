// What covers the picture while there is none: progress, or the reason why.

import { announce, h, replaceChildren } from './dom';

export class Overlay {
  readonly element = h('div', { class: 'overlay' });

  show(text: string, fraction: number | null): void {
    const bar = h('progress', { max: 1, 'aria-label': text });
    if (fraction !== null && Number.isFinite(fraction)) bar.value = fraction;
    this.element.hidden = false;
    replaceChildren(this.element, h('p', {}, text), bar);
  }

  fail(message: string): void {
    this.element.hidden = false;
    const again = h('button', { type: 'button', onclick: () => location.reload() }, 'Try again');
    replaceChildren(
      this.element,
      h('p', { class: 'overlay-title' }, 'This cannot be shown'),
      h('pre', { class: 'problem', tabindex: 0 }, message),
      h('p', {}, again, ' ', h('a', { href: '/' }, 'All jobs')),
    );
    announce(message);
  }

  hide(): void {
    this.element.hidden = true;
  }
}
