// Numbers and times for people.

export function bytes(value: number | undefined): string {
  if (value === undefined) return '–';
  const units = ['B', 'kB', 'MB', 'GB'];
  let unit = 0;
  while (value >= 1000 && unit < units.length - 1) [value, unit] = [value / 1000, unit + 1];
  return `${unit === 0 ? value : value.toPrecision(3)} ${units[unit]}`;
}

export const count = (value: number | undefined): string =>
  value === undefined ? '–' : Math.round(value).toLocaleString('en');

export const percent = (fraction: number | undefined): string =>
  fraction === undefined || !Number.isFinite(fraction)
    ? '–'
    : `${(100 * fraction).toPrecision(fraction < 0.1 ? 2 : 3)}\u00a0%`;

export function seconds(value: number | null | undefined): string {
  if (value === null || value === undefined || !Number.isFinite(value)) return '–';
  if (value < 1) return `${Math.round(1000 * value)} ms`;
  if (value < 60) return `${value.toPrecision(2)} s`;
  const minutes = Math.floor(value / 60);
  return minutes < 60
    ? `${minutes} min ${Math.round(value % 60)} s`
    : `${Math.floor(minutes / 60)} h ${minutes % 60} min`;
}

export function ago(time: string | null, now = Date.now()): string {
  if (!time) return '–';
  const passed = (now - Date.parse(time)) / 1000;
  if (!Number.isFinite(passed)) return '–';
  if (passed < 45) return 'just now';
  if (passed < 3600) return `${Math.max(1, Math.round(passed / 60))} min ago`;
  if (passed < 86400) return `${Math.round(passed / 3600)} h ago`;
  return `${Math.round(passed / 86400)} d ago`;
}

/// Any JSON value on one line.
export const plain = (value: unknown): string =>
  value === null || value === undefined ? '–' : typeof value === 'object' ? JSON.stringify(value) : String(value);
