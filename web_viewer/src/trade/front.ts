// The Pareto front: what nothing else beats in both cost and error.

/// Indices of the front by ascending cost; of equal points the first.
export function paretoFront(points: { cost: number; error: number }[]): number[] {
  const order = points.map((_, i) => i);
  order.sort((a, b) => points[a].cost - points[b].cost || points[a].error - points[b].error || a - b);
  let best = Infinity;
  return order.filter((i) => {
    if (points[i].error >= best) return false;
    best = points[i].error;
    return true;
  });
}
