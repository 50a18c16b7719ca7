// Round numbers along an axis, without the trailing zeros that measured values have.

const short = (value: number, unit: string) => `${Number(value.toPrecision(3))}\u00a0${unit}`;

export const secondsTick = (s: number): string => (s < 1 ? short(1000 * s, 'ms') : short(s, 's'));
export const bytesTick = (b: number): string => (b < 1e6 ? short(b / 1e3, 'kB') : short(b / 1e6, 'MB'));
export const percentTick = (e: number): string => short(100 * e, '%');
