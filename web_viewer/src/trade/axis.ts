// A logarithmic axis: values onto pixels, and round numbers along it.

export interface Axis {
  (value: number): number;
  low: number;
  high: number;
}

/// The range of the values, with a margin at both ends.
export function logAxis(values: number[], from: number, to: number): Axis {
  const lowest = values.length ? Math.min(...values) : 1;
  const highest = values.length ? Math.max(...values) : 1;
  const margin = Math.max(1.15, (highest / lowest) ** 0.06);
  const [low, high] = [lowest / margin, highest * margin];
  const at = (value: number) => from + ((to - from) * Math.log(value / low)) / Math.log(high / low);
  return Object.assign(at, { low, high });
}

/// 1, 2 and 5 times powers of ten; powers alone where that would be many, more between where it would be few.
export function logTicks({ low, high }: { low: number; high: number }): number[] {
  const decades = Math.log10(high / low);
  const steps = decades > 2.5 ? [1] : decades > 0.8 ? [1, 2, 5] : [1, 1.5, 2, 3, 4, 5, 6, 7, 8, 9];
  const ticks: number[] = [];
  for (let e = Math.floor(Math.log10(low)); e <= Math.ceil(Math.log10(high)); ++e)
    for (const step of steps) ticks.push(Number(`${step}e${e}`));
  return ticks.filter((tick) => tick >= low && tick <= high);
}
