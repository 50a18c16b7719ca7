// Elements from code. Text always goes in as text, so that no name of a job can become markup.

type Child = Node | string | null | undefined | false;
type Attributes = Record<string, unknown>;

/// h('button', { type: 'button', onclick: f, class: 'x', 'aria-label': 'y' }, 'text'). A function value whose name starts with
/// "on" is a listener; true and false set or omit an attribute.
export function h<K extends keyof HTMLElementTagNameMap>(
  tag: K,
  attributes: Attributes = {},
  ...children: Child[]
): HTMLElementTagNameMap[K] {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) setAttribute(element, name, value);
  append(element, children);
  return element;
}

function setAttribute(element: HTMLElement, name: string, value: unknown): void {
  if (value === undefined || value === null || value === false) return;
  if (name.startsWith('on') && typeof value === 'function')
    element.addEventListener(name.slice(2), value as EventListener);
  else if (name === 'style') throw new Error('inline style attributes are forbidden by our Content-Security-Policy');
  else element.setAttribute(name, value === true ? '' : String(value));
}

function append(element: Element, children: Child[]): void {
  for (const child of children) if (child !== null && child !== undefined && child !== false) element.append(child);
}

export function replaceChildren(element: Element, ...children: Child[]): void {
  element.replaceChildren();
  append(element, children);
}

/// The text of a live region; screen readers speak it. The same text twice is spoken once.
export function announce(text: string): void {
  let region = document.getElementById('live');
  if (!region)
    document.body.append(
      (region = h('div', { id: 'live', class: 'visually-hidden', role: 'status', 'aria-live': 'polite' })),
    );
  if (region.textContent !== text) region.textContent = text;
}

let toastTimer = 0;

/// A short message at the foot of the page, spoken too.
export function toast(text: string, kind: 'info' | 'error' = 'info'): void {
  document.querySelector('.toast')?.remove();
  clearTimeout(toastTimer);
  const box = h('div', { class: `toast toast-${kind}` }, text);
  document.body.append(box);
  announce(text);
  toastTimer = window.setTimeout(() => box.remove(), kind === 'error' ? 10000 : 3500);
}

/// Copies to the clipboard, or selects nothing and says so where the browser does not let us.
export async function copyText(text: string, what: string): Promise<void> {
  try {
    await navigator.clipboard.writeText(text);
    toast(`${what} copied`);
  } catch {
    toast(`The browser did not allow copying. ${text}`, 'error');
  }
}
