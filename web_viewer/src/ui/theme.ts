// Dark or light: the system's choice until the user makes one, which is remembered.

import { h } from './dom';

const kKey = 'kiln-theme';
type Theme = 'dark' | 'light';

const systemTheme = (): Theme => (matchMedia('(prefers-color-scheme: light)').matches ? 'light' : 'dark');

function storedTheme(): Theme | null {
  try {
    const stored = localStorage.getItem(kKey);
    return stored === 'dark' || stored === 'light' ? stored : null;
  } catch {
    return null; // storage may be forbidden
  }
}

const currentTheme = (): Theme => (document.documentElement.dataset.theme as Theme) ?? systemTheme();

export function applyTheme(): void {
  const stored = storedTheme();
  if (stored) document.documentElement.dataset.theme = stored;
}

/// A button that changes it.
export function themeButton(): HTMLButtonElement {
  const label = () => `Switch to ${currentTheme() === 'dark' ? 'light' : 'dark'} theme`;
  const button = h(
    'button',
    { type: 'button', class: 'icon-button', 'aria-label': label(), title: 'Dark or light theme' },
    '◐',
  );
  button.addEventListener('click', () => {
    const next: Theme = currentTheme() === 'dark' ? 'light' : 'dark';
    document.documentElement.dataset.theme = next;
    try {
      localStorage.setItem(kKey, next);
    } catch {
      // not remembered, then
    }
    button.setAttribute('aria-label', label());
  });
  return button;
}
