// One plot of runs: a listbox of points for the keyboard and screen readers, the nearest point for the pointer.
// Arrow keys go along the cost axis within what is shown, Home and End to its ends.

import { h } from '../ui/dom';
import { svg } from '../ui/svg';
import { logAxis, logTicks, type Axis } from './axis';
import { paretoFront } from './front';
import type { Estimate, Run } from './runs';
import { symbol } from './symbols';

export interface Mark {
  label: string; // "draft"; empty: not written
  byRule: boolean; // chosen by the rule, else in force
}

export interface View {
  runs: Run[];
  scenes: string[]; // all, so that a scene keeps its colour whatever is shown
  cost: (run: Run) => number;
  costLabel: string;
  costText: (cost: number) => string; // of a tick
  errorLabel: string;
  error: (run: Run) => Estimate; // never below what can be drawn
  errorText: (error: number) => string; // of a tick
  comparable: (run: Run) => boolean; // may stand in a front
  describe: (run: Run) => string;
  marks: (run: Run) => Mark[];
}

const kHeight = 400;
const kEdge = { left: 62, right: 18, top: 32, bottom: 54 };
const kReach = 30; // pixels from the pointer to the point it means

export class Scatter {
  readonly element: HTMLElement;
  private readonly plot: SVGElement;
  private readonly tip = h('div', { class: 'trade-tip', hidden: true, 'aria-hidden': 'true' });
  private view: View | null = null;
  private labels: { x: number; y: number }[] = []; // middles of those placed
  private points: { run: Run; x: number; y: number; element: SVGElement }[] = [];
  private current: Run | null = null;

  /// `select` is told which run the reader means.
  constructor(
    title: string,
    private readonly select: (run: Run) => void,
  ) {
    this.plot = svg('svg', { role: 'listbox', 'aria-label': `${title}: runs, cheapest first`, class: 'trade-plot' });
    const area = h('div', { class: 'trade-area' }, this.plot, this.tip);
    this.element = h('section', { class: 'trade-figure' }, h('h2', {}, title), area);
    this.plot.addEventListener('keydown', (event) => this.onKey(event as KeyboardEvent));
    this.plot.addEventListener('pointermove', (event) => this.onPointer(event as PointerEvent));
    this.plot.addEventListener('pointerdown', (event) => this.onPointer(event as PointerEvent));
    this.plot.addEventListener('pointerleave', () => (this.tip.hidden = true));
    this.plot.addEventListener('focusin', (event) => this.onFocus(event.target as Element));
    this.plot.addEventListener('focusout', () => (this.tip.hidden = true));
    new ResizeObserver(() => this.draw()).observe(area);
  }

  show(view: View): void {
    this.view = view;
    this.draw();
  }

  /// Marks the run in this plot too.
  highlight(run: Run): void {
    this.current = run;
    for (const { run: one, element } of this.points) {
      element.setAttribute('aria-selected', String(one === run));
      element.setAttribute('tabindex', one === run ? '0' : '-1');
    }
    if (!this.points.some((point) => point.run === run)) this.points[0]?.element.setAttribute('tabindex', '0');
  }

  private draw(): void {
    const { view } = this;
    const width = this.plot.parentElement?.clientWidth ?? 0;
    if (!view || width === 0) return;
    const focused = this.plot.contains(document.activeElement);
    const x = logAxis(view.runs.map(view.cost), kEdge.left, width - kEdge.right);
    const errors = view.runs.map((run) => view.error(run).value);
    const y = logAxis(errors, kHeight - kEdge.bottom, kEdge.top);
    this.plot.setAttribute('viewBox', `0 0 ${width} ${kHeight}`);
    this.plot.setAttribute('height', String(kHeight));
    const shown = [...view.runs].sort((a, b) => view.cost(a) - view.cost(b));
    this.labels = [];
    this.points = shown.map((run) => this.point(view, run, x(view.cost(run)), y(view.error(run).value)));
    const fronts = view.scenes.map((scene, i) => this.front(view, scene, i, x, y));
    this.plot.replaceChildren(
      svg('g', { 'aria-hidden': 'true' }, ...grid(view, x, y, width), ...fronts),
      ...this.points.map((point) => point.element),
    );
    this.tip.hidden = true;
    if (this.current) this.highlight(this.current);
    else this.points[0]?.element.setAttribute('tabindex', '0');
    if (focused) (this.plot.querySelector('[tabindex="0"]') as SVGElement | null)?.focus();
  }

  private point(view: View, run: Run, x: number, y: number) {
    const series = view.scenes.indexOf(run.scene);
    const element = svg(
      'g',
      {
        role: 'option',
        'aria-label': view.describe(run),
        'aria-selected': 'false',
        tabindex: -1,
        class: 'trade-point',
      },
      ...view.marks(run).flatMap((mark) => [ring(mark, x, y), ...this.label(mark, x, y)]),
      svg('path', { d: symbol(series, x, y), class: `series-${series}${view.comparable(run) ? '' : ' hollow'}` }),
    );
    return { run, x, y, element };
  }

  /// Beside the ring, where no other label is; nothing when it is crowded all around.
  private label({ label }: Mark, x: number, y: number): SVGElement[] {
    if (!label) return [];
    const width = this.plot.parentElement?.clientWidth ?? 0;
    const half = 3.6 * label.length;
    for (const [side, up] of [
      [1, -12],
      [1, 14],
      [-1, -12],
      [-1, 14],
    ] as const) {
      const at = { x: x + side * (13 + half), y: y + up };
      const outside = at.x + half > width || at.x - half < kEdge.left;
      if (outside || this.labels.some((l) => Math.abs(l.x - at.x) < 64 && Math.abs(l.y - at.y) < 15)) continue;
      this.labels.push(at);
      return [svg('text', { x: at.x, y: at.y + 4, 'text-anchor': 'middle', class: 'name' }, label)];
    }
    return [];
  }

  private front(view: View, scene: string, series: number, x: Axis, y: Axis): SVGElement {
    const runs = view.runs.filter((run) => run.scene === scene && view.comparable(run));
    const front = paretoFront(runs.map((run) => ({ cost: view.cost(run), error: view.error(run).value })));
    const places = front.map((i) => ({ run: runs[i], px: x(view.cost(runs[i])), error: view.error(runs[i]) }));
    const clamp = (error: number) =>
      Math.min(Math.max(y(Math.max(error, y.low)), kEdge.top), kHeight - kEdge.bottom).toFixed(1);
    return svg(
      'g',
      { class: `front series-${series}` },
      svg('path', {
        d: places.map(({ px, error }, i) => `${i ? 'L' : 'M'}${px.toFixed(1)} ${y(error.value).toFixed(1)}`).join(''),
      }),
      ...places.map(({ px, error }) =>
        svg('path', { class: 'reach', d: `M${px.toFixed(1)} ${clamp(error.low)}V${clamp(error.high)}` }),
      ),
    );
  }

  private onKey(event: KeyboardEvent): void {
    const at = this.points.findIndex(({ element }) => element === document.activeElement);
    const last = this.points.length - 1;
    const next: Record<string, number> = {
      ArrowRight: Math.min(at + 1, last),
      ArrowDown: Math.min(at + 1, last),
      ArrowLeft: Math.max(at - 1, 0),
      ArrowUp: Math.max(at - 1, 0),
      Home: 0,
      End: last,
    };
    if (at < 0 || !(event.key in next)) return;
    event.preventDefault();
    this.points[next[event.key]].element.focus();
  }

  private onFocus(target: Element): void {
    const point = this.points.find(({ element }) => element === target);
    if (point) this.mean(point);
  }

  private onPointer(event: PointerEvent): void {
    const box = this.plot.getBoundingClientRect();
    const [px, py] = [event.clientX - box.left, event.clientY - box.top];
    const distance = (p: { x: number; y: number }) => Math.hypot(p.x - px, p.y - py);
    const nearest = this.points.reduce(
      (best, p) => (best && distance(best) <= distance(p) ? best : p),
      this.points.at(0),
    );
    if (nearest && distance(nearest) <= kReach) this.mean(nearest);
    else this.tip.hidden = true;
  }

  private mean(point: { run: Run; x: number; y: number }): void {
    this.select(point.run);
    this.tip.textContent = this.view?.describe(point.run) ?? '';
    this.tip.hidden = false;
    const room = this.plot.parentElement?.clientWidth ?? 0;
    const left = Math.min(Math.max(point.x - this.tip.offsetWidth / 2, 4), room - this.tip.offsetWidth - 4);
    const above = point.y - this.tip.offsetHeight - 16;
    this.tip.style.left = `${left}px`;
    this.tip.style.top = `${above > 0 ? above : point.y + 18}px`;
  }
}

function grid(view: View, x: Axis, y: Axis, width: number): SVGElement[] {
  const bottom = kHeight - kEdge.bottom;
  const ticks = logTicks(x);
  const every = Math.ceil(ticks.length / Math.max(1, Math.floor((width - kEdge.left) / 62)));
  return [
    svg('text', { x: 0, y: 14 }, view.errorLabel),
    svg('text', { x: (kEdge.left + width - kEdge.right) / 2, y: kHeight - 8, 'text-anchor': 'middle' }, view.costLabel),
    ...ticks.flatMap((tick, i) => [
      svg('path', { class: 'grid-line', d: `M${x(tick)} ${kEdge.top}V${bottom}` }),
      ...(i % every ? [] : [svg('text', { x: x(tick), y: bottom + 20, 'text-anchor': 'middle' }, view.costText(tick))]),
    ]),
    ...logTicks(y).flatMap((tick) => [
      svg('path', { class: 'grid-line', d: `M${kEdge.left} ${y(tick)}H${width - kEdge.right}` }),
      svg('text', { x: kEdge.left - 8, y: y(tick) + 4, 'text-anchor': 'end' }, view.errorText(tick)),
    ]),
  ];
}

const ring = ({ byRule }: Mark, x: number, y: number): SVGElement =>
  svg('circle', { cx: x, cy: y, r: byRule ? 12 : 9, class: byRule ? 'ring by-rule' : 'ring' });
