// Product Gauss quadrature on the sphere, cut at the horizon y = 0: skies jump there.

export interface QuadraturePoint {
  x: number;
  y: number;
  z: number;
  weight: number;
}

const known = new Map<number, QuadraturePoint[]>();

/// `rows` Gauss-Legendre rows in y for each half times 2 * rows equal steps in azimuth: exact for polynomials of degree
/// 2 * rows - 1. The weights sum to 4 pi. Computed once for each size.
export function sphereQuadrature(rows: number): readonly QuadraturePoint[] {
  let points = known.get(rows);
  if (!points) known.set(rows, (points = buildSphere(rows)));
  return points;
}

function buildSphere(rows: number): QuadraturePoint[] {
  const points: QuadraturePoint[] = [];
  const circle = Array.from({ length: 2 * rows }, (_, k) => (Math.PI * (k + 0.5)) / rows);
  for (const [node, weight] of gaussLegendre(rows)) {
    for (const y of [(node - 1) / 2, (node + 1) / 2]) {
      const radius = Math.sqrt(1 - y * y);
      for (const angle of circle)
        points.push({
          x: radius * Math.cos(angle),
          y,
          z: radius * Math.sin(angle),
          weight: (weight * Math.PI) / (2 * rows),
        });
    }
  }
  return points;
}

/// Nodes and weights on [-1, 1] by Newton's method on P_n.
export function gaussLegendre(n: number): [number, number][] {
  const out: [number, number][] = [];
  for (let i = 0; i < n; ++i) {
    let x = Math.cos((Math.PI * (i + 0.75)) / (n + 0.5));
    let slope = 1;
    for (let step = 0; step < 100; ++step) {
      let [below, here] = [1, x];
      for (let k = 2; k <= n; ++k) [below, here] = [here, ((2 * k - 1) * x * here - (k - 1) * below) / k];
      slope = (n * (x * here - below)) / (x * x - 1);
      const change = here / slope;
      x -= change;
      if (Math.abs(change) < 1e-15) break;
    }
    out.push([x, 2 / ((1 - x * x) * slope * slope)]);
  }
  return out;
}
