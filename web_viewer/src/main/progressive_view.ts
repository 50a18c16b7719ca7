// A progressive mesh under its light field, at any level of detail, in place of the file's own triangles. Nothing is
// decoded before it is asked for. A step costs a pass over the triangles that are shown: arrays are filled anew, and
// r-RFs are written for the vertices that have changed.

import { BufferAttribute, BufferGeometry, type DataTexture, Group, Mesh, type ShaderMaterial } from 'three';
import { emptyTexels, type FieldTexels, texelWriter } from '../asset/light_field';
import { ProgressiveMesh } from '../light/progressive_mesh';
import { fieldMaterial, fieldTexture } from '../shaders/field_material';
import { count, percent } from '../ui/format';
import type { BakedPart } from './baked_model';
import type { FieldLook } from './field_look';
import type { Viewer } from './viewer';
import type { ViewState } from './view_state';

export class ProgressiveView {
  private shape: ProgressiveShape | null = null;
  private hidden: { visible: boolean } | null = null; // the model that gives way
  private readonly undo: (() => void)[];

  constructor(
    private readonly viewer: Viewer,
    private readonly bytes: Uint8Array,
  ) {
    const keys = ['detail', 'mode', 'level'] as const;
    this.undo = [
      viewer.state.subscribe((state, changed) => keys.some((key) => changed.has(key)) && this.apply(state)),
      viewer.shown.subscribe(() => this.apply(viewer.state.get())),
    ];
    this.apply(viewer.state.get());
  }

  private apply({ detail, mode }: Readonly<ViewState>): void {
    const { viewer } = this;
    const shown = detail < 1 && (mode === 'shaded' || mode === 'vertices');
    if (this.hidden) this.hidden.visible = true;
    this.hidden = null;
    this.shape?.group.removeFromParent();
    viewer.onDetail(shown ? this.show(detail, mode === 'vertices') : '');
    viewer.stage.requestDraw();
  }

  /// What is shown then, in words.
  private show(detail: number, perVertex: boolean): string {
    const { viewer } = this;
    try {
      this.shape ??= new ProgressiveShape(this.bytes, viewer);
    } catch (error) {
      return (error as Error).message;
    }
    this.shape.goTo(detail, perVertex);
    viewer.stage.scene.add(this.shape.group);
    this.hidden = viewer.model.root;
    this.hidden.visible = false;
    const { mesh } = this.shape;
    const added = `${percent(mesh.error(mesh.level))} of error estimated against the finest`;
    return `${count(mesh.vertexCount)} vertices, ${count(mesh.triangleCount)} triangles, ${added}`;
  }

  dispose(): void {
    for (const end of this.undo) end();
    if (this.hidden) this.hidden.visible = true;
    this.shape?.dispose();
  }
}

/// The triangles of one material.
interface Part {
  mesh: Mesh<BufferGeometry, ShaderMaterial>;
  materials: readonly [ShaderMaterial, ShaderMaterial]; // at each pixel, at the vertices
  attributes: { from: { values: Float32Array; width: number }; to: Float32Array; times: readonly number[] | null }[];
  corners: Uint32Array;
  used: number; // triangles
}

/// What the light field keeps apart.
type Apart = Pick<FieldLook, 'sky' | 'lamps' | 'lobes'>;

const kAttributes = [
  ['position', 'position'],
  ['normal', 'normal'],
  ['uv0', 'uv'],
  ['uv1', 'uv1'],
  ['color', '_albedo'],
] as const;

class ProgressiveShape {
  readonly group = new Group();
  readonly mesh: ProgressiveMesh;
  private readonly base: number;
  private readonly texels: FieldTexels;
  private readonly write: ReturnType<typeof texelWriter>;
  private readonly texture: DataTexture;
  private readonly parts: Part[];

  /// Throws, in words, on bytes that do not fit together or the scene.
  constructor(bytes: Uint8Array, { model, stage, level }: Viewer) {
    const sky = level.field?.sky ?? null;
    const lamps = level.field?.lamps ?? [];
    const lobes = level.field?.lobes ?? null;
    this.mesh = new ProgressiveMesh(bytes);
    if (this.mesh.part.some((part) => part >= model.parts.length))
      throw new Error('The progressive mesh has parts that the scene has not.');
    this.base = this.mesh.vertexCount;
    const light = this.mesh.columns.get('coefficients')!;
    const all = light.values.length / light.width;
    const { degree, columns } = this.mesh;
    const emission = level.field?.emission ?? false;
    const [seen, diffuse] = [columns.has('visibility'), columns.has('diffuse')];
    const shape = { degree, sky: seen, lamps: columns.get('lamps')?.width ?? 0, emission, diffuse };
    if (shape.sky && !sky) throw new Error('The progressive mesh sees a sky that the scene has not.');
    if (shape.lamps !== lamps.length) throw new Error('The progressive mesh sees other lamps than the scene has.');
    if (diffuse && !lobes) throw new Error('The progressive mesh has diffuse light that the scene has not.');
    const largest = Math.max(this.mesh.largest('coefficients'), diffuse ? this.mesh.largest('diffuse') : 0);
    const empty = emptyTexels(shape, all, largest);
    ({ texture: this.texture, texels: this.texels } = fieldTexture(empty, stage.renderer.capabilities.maxTextureSize));
    this.write = texelWriter(this.texels);
    for (let v = 0; v < all; ++v) this.writeTexels(v);
    this.mesh.touched.clear();
    this.parts = model.parts.map((part, i) => this.makePart(part, { sky, lamps, lobes }, i));
    for (const { mesh } of this.parts) this.group.add(mesh);
    this.group.matrixAutoUpdate = false;
    this.group.matrix.copy(model.parts[0].mesh.matrixWorld); // one node has all parts
    this.group.matrixWorldNeedsUpdate = true;
  }

  /// 0: the base, 1: all; between them vertices grow by the same factor at each step.
  goTo(detail: number, perVertex: boolean): void {
    const { mesh, base } = this;
    const light = mesh.columns.get('coefficients')!;
    const all = light.values.length / light.width;
    const wanted = base * (all / base) ** detail;
    mesh.goTo(all > base ? ((mesh.levels - 1) * (wanted - base)) / (all - base) : 0);
    for (const v of mesh.touched) this.writeTexels(v);
    if (mesh.touched.size > 0) this.texture.needsUpdate = true;
    mesh.touched.clear();
    for (const part of this.parts) part.mesh.material = part.materials[perVertex ? 1 : 0];
    this.fill();
  }

  private writeTexels(vertex: number): void {
    const { series, visibility, lamps, diffuse } = this.write;
    const into = { coefficients: series, visibility, lamps, diffuse };
    for (const [name, write] of Object.entries(into)) {
      const column = this.mesh.columns.get(name);
      if (column) write(vertex, column.values, column.width * vertex);
    }
  }

  /// Three vertices of its own for each triangle, as field_material.ts asks for.
  private fill(): void {
    const { triangles, part, triangleCount } = this.mesh;
    for (const one of this.parts) one.used = 0;
    for (let t = 0; t < triangleCount; ++t) {
      const into = this.parts[part.length > 0 ? part[t] : 0];
      const first = 3 * into.used++;
      for (let k = 0; k < 3; ++k) {
        const v = triangles[3 * t + k];
        for (const { from, to, times } of into.attributes)
          for (let c = 0; c < from.width; ++c)
            to[from.width * (first + k) + c] = from.values[from.width * v + c] * (times?.[c] ?? 1);
        for (let other = 0; other < 3; ++other) into.corners[3 * (first + k) + other] = triangles[3 * t + other];
      }
    }
    for (const { mesh, used } of this.parts) {
      mesh.geometry.setDrawRange(0, 3 * used);
      const { attributes } = mesh.geometry;
      for (const name of Object.keys(attributes)) attributes[name].needsUpdate = true;
    }
  }

  private makePart(look: BakedPart, { sky, lamps, lobes }: Apart, index: number): Part {
    const { unlit, albedo, finish, glow, emission, geometry: own } = look;
    const { part, triangles, columns } = this.mesh;
    const most = part.length > 0 ? part.reduce((sum, one) => sum + Number(one === index), 0) : triangles.length / 3;
    const geometry = new BufferGeometry();
    const attributes: Part['attributes'] = [];
    for (const [name, shown] of kAttributes) {
      const from = columns.get(name);
      if (!from || !own.hasAttribute(shown)) continue;
      const to = new Float32Array(3 * from.width * most);
      geometry.setAttribute(shown, new BufferAttribute(to, from.width));
      // The base colour's factor is in `_albedo` already, but not in colours.
      attributes.push({ from, to, times: name === 'color' ? [...albedo.slice(0, 3), unlit.opacity] : null });
    }
    const corners = new Uint32Array(9 * most);
    geometry.setAttribute('corners', new BufferAttribute(corners, 3));
    const vertexAlbedo = geometry.hasAttribute('_albedo');
    const { unit } = this.texels;
    const dress = { unlit, albedo, finish, glow, emission, sky, lamps, lobes, vertexAlbedo };
    const surface = { shape: this.texels, unit, texture: this.texture, ...dress };
    const materials = [fieldMaterial(surface, false), fieldMaterial(surface, true)] as const;
    const mesh = new Mesh(geometry, materials[0]);
    mesh.frustumCulled = false; // its bounds change with the level
    return { mesh, materials, attributes, corners, used: 0 };
  }

  dispose(): void {
    this.group.removeFromParent();
    this.texture.dispose();
    for (const { mesh, materials } of this.parts) {
      mesh.geometry.dispose();
      for (const material of materials) material.dispose();
    }
  }
}
