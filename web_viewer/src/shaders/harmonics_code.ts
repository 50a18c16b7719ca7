// Spherical harmonics as straight-line GLSL: no array that a compiler must find a place for, and no loop.
//   Y(l, +-m) = sqrt(2) P(l, m)(z) { Re | Im } (x + iy)^m       light/sh.ts, whose recurrence is written out here
//   P(l, m) = a(l, m) (z P(l-1, m) - P(l-2, m) / a(l-1, m)),  a(l, m)^2 = (4 l^2 - 1) / (l^2 - m^2)

/// Statements that declare floats y0 .. y(n-1), n = (degree + 1)^2, from floats x, y, z.
export function harmonicsCode(degree: number): string {
  const lines: string[] = [];
  let sectoral = Math.sqrt(1 / (4 * Math.PI)); // P(m, m)
  for (let m = 0; m <= degree; ++m) {
    if (m === 1) lines.push('float c1 = x;', 'float s1 = y;');
    if (m > 1) lines.push(`float c${m} = x * c${m - 1} - y * s${m - 1};`, `float s${m} = x * s${m - 1} + y * c${m - 1};`);
    for (let l = m; l <= degree; ++l) {
      lines.push(`float p${l}_${m} = ${associated(l, m, m === 0 ? sectoral : Math.SQRT2 * sectoral)};`);
      const centre = l * (l + 1);
      if (m === 0) lines.push(`float y${centre} = p${l}_0;`);
      else lines.push(`float y${centre + m} = p${l}_${m} * c${m};`, `float y${centre - m} = p${l}_${m} * s${m};`);
    }
    sectoral *= Math.sqrt((2 * m + 3) / (2 * m + 2));
  }
  return lines.join('\n');
}

const ratio = (l: number, m: number): number => Math.sqrt((4 * l * l - 1) / (l * l - m * m));

function associated(l: number, m: number, first: number): string {
  if (l === m) return literal(first);
  const up = `z * p${l - 1}_${m}`;
  const below = l === m + 1 ? '' : ` - ${literal(1 / ratio(l - 1, m))} * p${l - 2}_${m}`;
  return `${literal(ratio(l, m))} * (${up}${below})`;
}

const literal = (value: number): string => (Number.isInteger(value) ? value.toFixed(1) : String(value));
