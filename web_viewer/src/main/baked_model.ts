// The baked scene on the GPU: geometry, one material per part, and the `light` attribute that the worker fills.

import {
  Box3,
  BufferAttribute,
  type BufferGeometry,
  Color,
  type DataTexture,
  DynamicDrawUsage,
  type Material,
  type Mesh,
  type MeshBasicMaterial,
  type Object3D,
  type ShaderMaterial,
  SRGBColorSpace,
  type Texture,
} from 'three';
import { readRadianceTransfer, type RadianceTransfer, type TransferPart } from '../asset/kiln_reader';
import type { LoadedAsset } from '../asset/parse_gltf';
import { bakedMaterial, type Finish, type Glow } from '../shaders/baked_material';
import { listTexture, lobeTexture } from '../shaders/mirror';

export interface BakedPart {
  mesh: Mesh<BufferGeometry, Material>;
  geometry: BufferGeometry; // kept here: false colours and light fields put another one in its place
  material: ShaderMaterial;
  unlit: MeshBasicMaterial; // of scene 0, which says opacity and sides
  albedo: TransferPart['albedo'];
  finish: Finish | null; // where something mirrors
  glow: Glow | null; // emission through a texture,
  emission: TransferPart['emission']; // and where it has none
  light: BufferAttribute;
}

export class BakedModel {
  readonly parts: BakedPart[] = [];
  readonly root: Object3D;
  readonly bounds: Box3;
  private readonly owned = new Set<Material | Texture>();

  private constructor(
    asset: LoadedAsset,
    readonly transfer: RadianceTransfer,
  ) {
    this.root = asset.gltf.scene;
    this.root.updateMatrixWorld(true);
    this.bounds = new Box3().setFromObject(this.root);
  }

  /// `mirrors`: every part's finish will be asked for.
  static async create(asset: LoadedAsset, mirrors: boolean): Promise<BakedModel> {
    const transfer = await readRadianceTransfer(asset.gltf);
    if (!transfer || transfer.parts.length === 0) throw new Error('this glTF carries no KILN_radiance_transfer');
    const model = new BakedModel(asset, transfer);
    const { glossy } = transfer;
    const lobes = glossy ? lobeTexture(transfer.lobes, glossy.order) : null;
    if (lobes) model.owned.add(lobes);
    for (const part of transfer.parts) model.parts.push(await model.dress(part, asset, lobes, mirrors));
    return model;
  }

  get vertices(): number {
    return this.parts.reduce((sum, part) => sum + part.light.count, 0);
  }

  get triangles(): number {
    return this.parts.reduce((sum, { geometry }) => sum + (geometry.index?.count ?? 0) / 3, 0);
  }

  get normals(): Float32Array[] {
    return this.parts.map(({ geometry }) => {
      const normal = geometry.getAttribute('normal');
      return Float32Array.from({ length: 3 * normal.count }, (_, i) => normal.getComponent(Math.floor(i / 3), i % 3));
    });
  }

  /// Shows new light and gives back the arrays it replaces.
  setLight(values: Float32Array[]): Float32Array[] {
    return this.parts.map(({ light }, i) => {
      const before = light.array as Float32Array;
      light.array = values[i];
      light.needsUpdate = true;
      return before;
    });
  }

  /// Shows new light that arrives at parts with matrices; one array for each part.
  setArriving(arriving: Float32Array[]): void {
    this.parts.forEach(({ material }, i) => {
      if (!arriving[i]?.length) return;
      (material.uniforms.arriving.value as DataTexture | null)?.dispose();
      material.uniforms.arriving.value = listTexture(arriving[i]);
    });
  }

  setWhite(white: boolean): void {
    for (const { material } of this.parts) material.uniforms.white.value = white;
  }

  private async dress(
    part: TransferPart,
    asset: LoadedAsset,
    lobes: DataTexture | null,
    mirrors: boolean,
  ): Promise<BakedPart> {
    const geometry = part.geometry;
    const unlit = part.mesh.material as MeshBasicMaterial;
    const glow = await loadGlow(asset, part.material);
    this.owned.add(unlit);
    if (glow) this.owned.add(glow.map);
    const glossy = part.glossy && lobes !== null;
    const finish = glossy || mirrors ? await loadFinish(asset, part.material) : null;
    if (finish?.map) this.owned.add(finish.map);
    const arriving = glossy ? { arriving: listTexture(new Float32Array(0)), lobes, order: this.transfer.glossy!.order } : null;
    const light = new BufferAttribute(new Float32Array(3 * geometry.getAttribute('position').count), 3);
    geometry.setAttribute('light', light.setUsage(DynamicDrawUsage));
    const material = bakedMaterial({
      unlit,
      glow,
      albedo: part.albedo,
      emission: part.emission,
      vertexAlbedo: geometry.hasAttribute('_albedo'),
      mirror: finish && arriving && { ...finish, ...arriving },
    });
    part.mesh.material = material;
    const mesh = part.mesh as BakedPart['mesh'];
    return { mesh, geometry, material, unlit, albedo: part.albedo, finish, glow, emission: part.emission, light };
  }

  dispose(): void {
    this.root.removeFromParent();
    for (const { geometry, material } of this.parts) {
      geometry.dispose();
      (material.uniforms.arriving.value as Texture | null)?.dispose();
      material.dispose();
    }
    disposeAll(this.owned);
  }
}

/// The emission texture of an original material, and nothing else of it: its other textures are not needed here.
async function loadGlow({ gltf }: LoadedAsset, material: number): Promise<Glow | null> {
  const definition = (gltf.parser.json as { materials?: GltfMaterial[] }).materials?.[material];
  if (!definition?.emissiveTexture) return null;
  const loaded: { emissiveMap?: Texture } = {};
  await gltf.parser.assignTexture(loaded, 'emissiveMap', definition.emissiveTexture, SRGBColorSpace);
  if (!loaded.emissiveMap) return null;
  const [r, g, b] = definition.emissiveFactor ?? [0, 0, 0];
  const strength = definition.extensions?.KHR_materials_emissive_strength?.emissiveStrength ?? 1;
  return { map: loaded.emissiveMap, factor: new Color().setRGB(r, g, b).multiplyScalar(strength) };
}

interface GltfMaterial {
  pbrMetallicRoughness?: {
    metallicFactor?: number;
    roughnessFactor?: number;
    metallicRoughnessTexture?: { index: number };
  };
  emissiveTexture?: { index: number };
  emissiveFactor?: [number, number, number];
  extensions?: { KHR_materials_emissive_strength?: { emissiveStrength?: number } };
}

/// Textures, and materials with every texture they hold.
export function disposeAll(owned: Iterable<Material | Texture>): void {
  for (const one of owned) {
    for (const value of Object.values(one)) if ((value as Texture | null)?.isTexture) (value as Texture).dispose();
    one.dispose();
  }
}

/// Metalness and roughness of an original material.
async function loadFinish({ gltf }: LoadedAsset, material: number): Promise<Finish> {
  const definition = (gltf.parser.json as { materials?: GltfMaterial[] }).materials?.[material];
  const finish = definition?.pbrMetallicRoughness ?? {};
  const { metallicFactor = 1, roughnessFactor = 1, metallicRoughnessTexture } = finish;
  const loaded: { map?: Texture } = {};
  if (metallicRoughnessTexture) await gltf.parser.assignTexture(loaded, 'map', metallicRoughnessTexture);
  return { metallic: metallicFactor, roughness: roughnessFactor, map: loaded.map ?? null };
}
