// A number per triangle or per vertex, shown as a colour instead of the baked material.

import { BufferAttribute, BufferGeometry, type Material, type Mesh, type ShaderMaterial } from 'three';
import type { ColourMapName } from '../shaders/colour_maps';
import { falseColourMaterial } from '../shaders/false_colour_material';
import type { BakedModel } from './baked_model';

export interface HeatMapData {
  per: 'triangle' | 'vertex';
  values: Float32Array[]; // one per part
  map: ColourMapName;
  range: readonly [number, number];
}

export class HeatMap {
  private readonly material: ShaderMaterial;
  private readonly undo: (() => void)[] = [];

  constructor(model: BakedModel, data: HeatMapData) {
    this.material = falseColourMaterial(data.map, data.range);
    model.parts.forEach(({ mesh }, i) => {
      const own =
        data.per === 'triangle'
          ? splitTriangles(mesh.geometry, data.values[i])
          : withMeasure(mesh.geometry, data.values[i]);
      this.dress(mesh, own);
    });
  }

  private dress(mesh: Mesh<BufferGeometry, Material>, own: BufferGeometry): void {
    const { geometry, material } = mesh;
    [mesh.geometry, mesh.material] = [own, this.material];
    this.undo.push(() => {
      [mesh.geometry, mesh.material] = [geometry, material];
      if (own.index === geometry.index) {
        own.deleteAttribute('position'); // shared with the model: it must outlive this geometry
        own.setIndex(null);
      }
      own.dispose();
    });
  }

  dispose(): void {
    for (const undo of this.undo) undo();
    this.undo.length = 0;
    this.material.dispose();
  }
}

/// Three vertices of its own for each triangle, so that one number fills it.
function splitTriangles(geometry: BufferGeometry, values: Float32Array): BufferGeometry {
  const indices = geometry.index!.array;
  const from = geometry.getAttribute('position').array;
  const positions = new Float32Array(3 * indices.length);
  const measures = new Float32Array(indices.length);
  for (let i = 0; i < indices.length; ++i) {
    for (let c = 0; c < 3; ++c) positions[3 * i + c] = from[3 * indices[i] + c];
    measures[i] = values[Math.floor(i / 3)];
  }
  const out = new BufferGeometry();
  out.setAttribute('position', new BufferAttribute(positions, 3));
  out.setAttribute('measure', new BufferAttribute(measures, 1));
  return out;
}

/// The same positions and triangles with a number per vertex.
function withMeasure(geometry: BufferGeometry, values: Float32Array): BufferGeometry {
  const out = new BufferGeometry();
  out.setAttribute('position', geometry.getAttribute('position'));
  out.setAttribute('measure', new BufferAttribute(values, 1));
  out.setIndex(geometry.index);
  return out;
}
