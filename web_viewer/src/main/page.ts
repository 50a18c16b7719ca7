// The page at `/view/{id}` before there is a picture: bars, a canvas and what covers it. No three.js here: this is there at once.

import { h } from '../ui/dom';
import { pageHeader } from '../ui/header';
import { Overlay } from '../ui/overlay';

export class Page {
  readonly title: HTMLElement;
  readonly overlay = new Overlay();
  readonly canvas = h('canvas', {
    class: 'stage',
    tabindex: 0,
    role: 'img',
    'aria-label': 'The baked model. Orbit with the arrow keys.',
  });
  private readonly preview = h('img', { class: 'preview', alt: '', hidden: true });
  readonly area = h('div', { class: 'stage-area' }, this.canvas, this.preview, this.overlay.element);
  readonly main = h('main', { class: 'view' }, this.area);
  private readonly undo: (() => void)[] = [];

  constructor(readonly id: string) {
    this.title = h('span', {}, id);
    document.body.append(pageHeader(this.title), this.main);
  }

  /// Shows the picture at `url`, that of the bake itself, until there is a live one.
  showPreview(url: string): void {
    this.preview.onload = () => {
      this.preview.hidden = false;
      performance.mark('kiln:preview');
    };
    this.preview.src = url;
  }

  /// Uncovers the canvas.
  showCanvas(): void {
    this.preview.remove();
    this.overlay.hide();
  }

  fail(message: string): void {
    this.preview.remove();
    this.overlay.fail(message);
  }

  /// What `dispose` does, last first.
  onDispose(...undo: (() => void)[]): void {
    this.undo.push(...undo);
  }

  /// Gives everything back: workers, GPU memory, listeners.
  dispose(): void {
    while (this.undo.length > 0) this.undo.pop()!();
  }
}
