// The list of keys and gestures, as a modal dialog.

import { h } from './dom';

const kHelp: readonly [string, string][] = [
  ['Drag · arrow keys', 'orbit'],
  ['Right drag · Shift + arrow keys', 'pan'],
  ['Click', 'the number at that point'],
  ['Drag the ball', 'through the light of a grid'],
  ['Drag the lamp · I J K L U O', 'move the light of a file with links'],
  ['Wheel · pinch · Page Up, Page Down', 'zoom'],
  ['Shift + drag · [ and ]', 'turn the light'],
  ['+ and −', 'exposure'],
  ['F', 'frame the model'],
  ['R', 'reset the view'],
  ['W', 'wireframe'],
  ['B', 'background'],
  ['C', 'before and after'],
  ['1 … 5', 'what the surface shows'],
  ['S', 'save a picture'],
  ['Drop .hdr or .exr', 'light the model with it'],
  ['H or ?', 'this help'],
];

export function helpDialog(): HTMLDialogElement {
  const close = h('button', { type: 'button', class: 'primary' }, 'Close');
  const rows = kHelp.flatMap(([keys, does]) => [h('dt', {}, keys), h('dd', {}, does)]);
  const dialog = h(
    'dialog',
    { class: 'help', 'aria-labelledby': 'help-title' },
    h('h2', { id: 'help-title' }, 'Keys and gestures'),
    h('dl', { class: 'pairs keys' }, ...rows),
    close,
  );
  close.addEventListener('click', () => dialog.close());
  dialog.addEventListener('click', (event) => event.target === dialog && dialog.close());
  return dialog;
}
