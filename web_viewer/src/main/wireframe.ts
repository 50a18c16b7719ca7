// The triangles' edges over the shaded model. Each edge once; the positions are the model's own.
// While it stands the surfaces are moved back to leave it room. Not otherwise: the offset grows with a surface's slope,
// and what lies behind a steep one would show through along its edges.

import { BufferAttribute, BufferGeometry, LineBasicMaterial, LineSegments, type Material, type Mesh } from 'three';

/// What a wireframe stands on, and the triangles it shows: indexed ones.
export interface Wired {
  parts: readonly { mesh: Mesh<BufferGeometry, Material | Material[]>; geometry: BufferGeometry }[];
}

export class Wireframe {
  private readonly material = new LineBasicMaterial({
    color: 0x0a0a0a,
    transparent: true,
    opacity: 0.55,
    toneMapped: false,
  });
  private readonly lines: LineSegments[];
  private readonly moved = new Set<Material>();

  constructor(private readonly model: Wired) {
    this.lines = model.parts.map(({ mesh, geometry }) => {
      const edges = new BufferGeometry();
      edges.setAttribute('position', geometry.getAttribute('position'));
      edges.setIndex(new BufferAttribute(edgesOf(geometry.index!.array), 1));
      const lines = new LineSegments(edges, this.material);
      mesh.add(lines);
      mesh.onBeforeRender = (_renderer, _scene, _camera, _geometry, material) => {
        material.polygonOffset = true;
        this.moved.add(material);
      };
      return lines;
    });
  }

  dispose(): void {
    for (const { mesh } of this.model.parts) mesh.onBeforeRender = () => {};
    for (const material of this.moved) material.polygonOffset = false;
    for (const lines of this.lines) {
      lines.removeFromParent();
      lines.geometry.deleteAttribute('position'); // the model's: it must outlive this geometry
      lines.geometry.dispose();
    }
    this.material.dispose();
  }
}

/// Pairs of vertex indices, each undirected edge once.
export function edgesOf(indices: ArrayLike<number>): Uint32Array {
  const seen = new Set<number>();
  const out: number[] = [];
  for (let i = 0; i < indices.length; ++i) {
    const [a, b] = [indices[i], indices[i % 3 === 2 ? i - 2 : i + 1]];
    const [low, high] = a < b ? [a, b] : [b, a];
    const key = high * 0x4000000 + low; // both below 2^26
    if (seen.has(key)) continue;
    seen.add(key);
    out.push(low, high);
  }
  return Uint32Array.from(out);
}
