// The bar at the top of every page.

import { h } from './dom';
import { themeButton } from './theme';

export function pageHeader(title: Node | string, ...tools: (Node | null)[]): HTMLElement {
  const logo = h('img', { src: '/kiln.svg', alt: '', width: 26, height: 26 });
  return h(
    'header',
    { class: 'top-bar' },
    h('a', { href: '/', class: 'brand', 'aria-label': 'Kiln, all jobs' }, logo, h('span', {}, 'Kiln')),
    h('h1', {}, title),
    h('div', { class: 'tools' }, ...tools, themeButton()),
  );
}
