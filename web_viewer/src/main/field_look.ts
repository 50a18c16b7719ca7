// The model under its light field: other geometry and materials in place of the baked ones, while they are shown.

import {
  BufferAttribute,
  BufferGeometry,
  type Intersection,
  type Material,
  type Mesh,
  type ShaderMaterial,
  type Texture,
  Vector3,
} from 'three';
import { type FieldTexels, type Mirror, seenRadiance } from '../asset/light_field';
import type { FieldLamp } from '../asset/field_lamps';
import { MirroredSky, type SkyData } from '../asset/mirrored_sky';
import { fieldMaterial, fieldTexture, type SkyLook } from '../shaders/field_material';
import { lobeTexture } from '../shaders/mirror';
import { skyTexture } from '../shaders/sky_code';
import type { BakedModel, BakedPart } from './baked_model';
import { colourAt, emissionAt, finishAt } from './texture_probe';

export type Evaluation = 'fragment' | 'vertex';

interface Dressed {
  part: BakedPart;
  mesh: Mesh<BufferGeometry, Material>;
  own: { geometry: BufferGeometry; material: Material };
  split: BufferGeometry;
  texture: Texture;
  materials: Record<Evaluation, ShaderMaterial>;
  texels: FieldTexels;
}

/// Owns what it makes of the field, and nothing of the model.
export class FieldLook {
  readonly degree: number;
  readonly emission: boolean; // is kept apart
  readonly bytes: number; // of its textures
  private readonly parts: Dressed[];
  /// What the field keeps apart; null: nothing.
  readonly sky: SkyLook | null = null;
  readonly lobes: Texture | null = null;
  private readonly mirrored: MirroredSky | null = null;
  private readonly table: Float32Array | null;

  readonly lamps: readonly FieldLamp[];

  /// `most`: texels that a texture may have across. Throws where a part needs more.
  constructor(model: BakedModel, field: readonly FieldTexels[], apart: { sky: SkyData | null; lamps: FieldLamp[]; lobes: Float32Array | null }, most: number) {
    const { sky, lamps, lobes } = apart;
    this.lamps = lamps;
    this.table = lobes;
    if (lobes) this.lobes = lobeTexture(lobes, 1);
    this.degree = field[0].degree;
    this.emission = field[0].emission;
    this.bytes = field.reduce((sum, { halves }) => sum + halves.byteLength, 0);
    if (sky) {
      this.mirrored = new MirroredSky(sky);
      this.sky = { texture: skyTexture(this.mirrored), unit: sky.unit };
      this.bytes += this.sky.texture.image.data!.byteLength;
    }
    this.parts = model.parts.map((part, i) => dress(part, field[i], this, most));
  }

  /// null: the model's own look, where nobody else has put another on it.
  show(evaluation: Evaluation | null): void {
    for (const { mesh, own, split, materials } of this.parts) {
      if (evaluation) [mesh.geometry, mesh.material] = [split, materials[evaluation]];
      else if (mesh.geometry === split) mesh.geometry = own.geometry;
      if (!evaluation && Object.values<Material>(materials).includes(mesh.material)) mesh.material = own.material;
    }
  }

  /// Radiance towards an eye from where a ray has hit; undefined: the field is not shown there.
  seenAt(hit: Intersection, eye: Vector3): number[] | undefined {
    const { object, faceIndex, barycoord, point } = hit;
    const part = this.parts.find(({ mesh, split }) => mesh === object && mesh.geometry === split);
    if (!part) return undefined;
    const { index, attributes } = part.own.geometry;
    const corners = [0, 1, 2].map((k) => index!.getX(3 * faceIndex! + k)) as [number, number, number];
    const weights = barycoord!.toArray();
    const normal = new Vector3();
    corners.forEach((v, k) =>
      normal.addScaledVector(new Vector3().fromBufferAttribute(attributes.normal, v), weights[k]),
    );
    const view = eye.clone().sub(point).normalize();
    const place = new Vector3();
    corners.forEach((v, k) =>
      place.addScaledVector(new Vector3().fromBufferAttribute(attributes.position, v), weights[k]),
    );
    const { mirrored: sky, lamps, table: lobes } = this;
    const mirror = { sky, lamps, lobes, place: place.toArray(), ...mirroringAt(part.part, corners, weights) };
    const seen = seenRadiance(part.texels, corners, weights, normal.normalize().toArray(), view.toArray(), mirror);
    if (!part.texels.emission) return seen;
    const emitted = emissionAt(part.part, corners, weights);
    return seen.map((x, c) => x + emitted[c]);
  }

  dispose(): void {
    this.show(null);
    this.sky?.texture.dispose();
    this.lobes?.dispose();
    for (const { split, texture, materials } of this.parts) {
      split.dispose();
      texture.dispose();
      for (const material of Object.values(materials)) material.dispose();
    }
  }
}

function dress(part: BakedPart, field: FieldTexels, { sky, lamps, lobes }: FieldLook, most: number): Dressed {
  const { mesh, geometry, material, unlit, albedo, finish, glow, emission } = part;
  const own = { geometry, material };
  const { texture, texels } = fieldTexture(field, most);
  const vertexAlbedo = own.geometry.hasAttribute('_albedo');
  const look = { unlit, albedo, finish, glow, emission, sky, lamps, lobes, vertexAlbedo };
  const surface = { shape: field, texture, unit: field.unit, ...look };
  const materials = { fragment: fieldMaterial(surface, false), vertex: fieldMaterial(surface, true) };
  return { part, mesh, own, split: splitTriangles(own.geometry), texture, materials, texels };
}

/// How the surface mirrors there, and colours diffuse light.
function mirroringAt(
  part: BakedPart,
  corners: readonly number[],
  weights: readonly number[],
): Pick<Mirror, 'f0' | 'roughness' | 'color'> {
  const base = colourAt(part, corners, weights);
  const [roughness, metallic] = finishAt(part, corners, weights);
  type Three = [number, number, number];
  const f0 = base.map((c) => 0.04 * (1 - metallic) + c * metallic) as Three;
  return { f0, roughness, color: base.map((c) => c * (1 - metallic)) as Three };
}

const kKept = ['position', 'normal', 'uv', 'uv1', '_albedo'];

/// Three vertices of its own for each triangle, each with the numbers of all three corners.
function splitTriangles(geometry: BufferGeometry): BufferGeometry {
  const indices = geometry.index!.array;
  const out = new BufferGeometry();
  for (const name of kKept) {
    if (!geometry.hasAttribute(name)) continue;
    const { array, itemSize } = geometry.getAttribute(name) as BufferAttribute;
    const values = new Float32Array(itemSize * indices.length);
    for (let i = 0; i < indices.length; ++i)
      for (let c = 0; c < itemSize; ++c) values[itemSize * i + c] = array[itemSize * indices[i] + c];
    out.setAttribute(name, new BufferAttribute(values, itemSize));
  }
  const corners = new Uint32Array(3 * indices.length);
  for (let i = 0; i < corners.length; ++i) corners[i] = indices[3 * Math.floor(i / 9) + (i % 3)];
  out.setAttribute('corners', new BufferAttribute(corners, 3));
  out.boundingSphere = geometry.boundingSphere;
  out.boundingBox = geometry.boundingBox;
  return out;
}
