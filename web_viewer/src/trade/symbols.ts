// A shape for each series, told apart without colour: circle, square, diamond, triangles, plus.

export function symbol(series: number, x: number, y: number): string {
  const at = (dx: number, dy: number) => `${(x + dx).toFixed(1)} ${(y + dy).toFixed(1)}`;
  const polygon = (...corners: [number, number][]) => `M${corners.map(([dx, dy]) => at(dx, dy)).join('L')}Z`;
  switch (series % 6) {
    case 1:
      return polygon([-4.2, -4.2], [4.2, -4.2], [4.2, 4.2], [-4.2, 4.2]);
    case 2:
      return polygon([0, -6], [6, 0], [0, 6], [-6, 0]);
    case 3:
      return polygon([0, -5.6], [5.4, 4.2], [-5.4, 4.2]);
    case 4:
      return polygon([0, 5.6], [5.4, -4.2], [-5.4, -4.2]);
    case 5:
      return polygon(
        ...([
          [-1.8, -5.4],
          [1.8, -5.4],
          [1.8, -1.8],
          [5.4, -1.8],
          [5.4, 1.8],
          [1.8, 1.8],
          [1.8, 5.4],
          [-1.8, 5.4],
          [-1.8, 1.8],
          [-5.4, 1.8],
          [-5.4, -1.8],
          [-1.8, -1.8],
        ] as [number, number][]),
      );
    default:
      return `M${at(-4.6, 0)}A4.6 4.6 0 1 1 ${at(4.6, 0)}A4.6 4.6 0 1 1 ${at(-4.6, 0)}Z`;
  }
}
