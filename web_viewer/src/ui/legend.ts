// The scale of a false-colour picture.

import type { Legend } from '../main/surfaces';
import { paintScale } from '../shaders/colour_maps';
import { h } from './dom';

export class LegendBox {
  private readonly canvas = h('canvas', { width: 240, height: 12, 'aria-hidden': 'true' });
  private readonly title = h('span', {});
  private readonly low = h('span', {});
  private readonly high = h('span', {});
  readonly element = h(
    'div',
    { class: 'legend', hidden: true },
    this.title,
    this.canvas,
    h('div', { class: 'legend-ends' }, this.low, this.high),
  );

  show(legend: Legend, title: string): void {
    this.element.hidden = legend === null;
    if (!legend) return;
    paintScale(this.canvas, legend.map);
    this.title.textContent = title;
    this.low.textContent = legend.range[0] === 0 ? '0' : `${legend.range[0].toPrecision(3)} and below`;
    this.high.textContent = `${legend.range[1].toPrecision(3)} and above`;
  }
}
