// The lightmap of a bake in place of the light at its vertices, where both are there to choose from.

import type { Texture } from 'three';
import { lightmapPrimitives } from '../asset/lightmap_file';
import { showLightmap } from '../shaders/baked_material';
import type { Viewer } from './viewer';

export class LightmapView {
  private readonly unsubscribe: () => void;

  /// Owns the texture from then on.
  constructor(
    private readonly viewer: Viewer,
    private readonly texture: Texture,
  ) {
    this.unsubscribe = viewer.state.subscribe((_state, changed) => {
      if (changed.has('lightmap')) this.apply();
    });
    this.apply();
  }

  private apply(): void {
    const texture = this.viewer.state.get().lightmap ? this.texture : null;
    const { parts } = this.viewer.model;
    for (const index of lightmapPrimitives(this.viewer.asset.gltf.parser.json)) {
      const part = parts[index];
      if (part?.geometry.hasAttribute('uv1')) showLightmap(part.material, texture);
    }
    this.viewer.stage.requestDraw();
  }

  dispose(): void {
    this.unsubscribe();
    this.texture.dispose();
  }
}
