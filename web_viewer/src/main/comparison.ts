// Before and after: left of the divider the original materials under the same light without shadows (three's image-based
// light, what a viewer shows without a bake), right of it the baked model.

import {
  Color,
  DirectionalLight,
  Group,
  type Light,
  type Mesh,
  type Object3D,
  type Material,
  Scene,
  type Texture,
} from 'three';
import { disposeAll } from './baked_model';
import type { Sun } from '../light/skies';
import type { Stage } from './stage';
import { SkyBackground } from '../shaders/sky_background';

export interface ComparisonLight {
  reflection: Texture; // equirectangular, for scene.environment
  suns: readonly Sun[];
  background: Texture | null;
  rotation: number;
  intensity: number;
  lamps: boolean;
}

export class Comparison {
  divider = 0.5;
  /// The exposure of the original, as a multiple of that of the baked side.
  exposure = 1;
  private readonly scene = new Scene();
  private readonly light: OriginalLight;

  constructor(
    private readonly stage: Stage,
    original: Object3D,
  ) {
    this.light = new OriginalLight(this.scene, original);
    stage.drawWith = (width, height) => this.draw(width, height);
  }

  setLight(light: ComparisonLight): void {
    this.light.set(light);
  }

  private draw(width: number, height: number): void {
    const { renderer, camera } = this.stage;
    const split = Math.round(this.divider * width);
    renderer.setScissorTest(true);
    renderer.setScissor(0, 0, split, height);
    const own = renderer.toneMappingExposure;
    renderer.toneMappingExposure = own * this.exposure;
    renderer.render(this.scene, camera);
    renderer.toneMappingExposure = own;
    renderer.setScissor(split, 0, width - split, height);
    this.stage.drawScene();
    renderer.setScissorTest(false);
  }

  dispose(): void {
    this.stage.drawWith = null;
    this.light.dispose();
  }
}

/// A model with its original materials in a scene of three's, lit by three's image-based light and by lamps for suns. Owns
/// the model.
export class OriginalLight {
  private readonly background = new SkyBackground();
  private readonly suns = new Group();

  constructor(
    private readonly scene: Scene,
    private readonly original: Object3D,
  ) {
    scene.add(original, this.background.mesh, this.suns);
  }

  set({ reflection, suns, background, rotation, intensity, lamps }: ComparisonLight): void {
    this.scene.environment = reflection;
    this.scene.environmentRotation.y = (rotation * Math.PI) / 180;
    this.scene.environmentIntensity = intensity;
    this.background.show(background, rotation, intensity);
    this.setSuns(suns, rotation, intensity);
    this.original.traverse((object) => {
      if ((object as Light).isLight) object.visible = lamps;
    });
  }

  private setSuns(suns: readonly Sun[], rotation: number, intensity: number): void {
    this.suns.rotation.y = (rotation * Math.PI) / 180;
    this.suns.clear();
    for (const { direction, irradiance } of suns) {
      const lamp = new DirectionalLight(new Color().setRGB(...irradiance), intensity);
      lamp.position.set(...direction);
      this.suns.add(lamp);
    }
  }

  dispose(): void {
    this.scene.environment = null;
    this.background.dispose();
    this.suns.removeFromParent();
    this.original.removeFromParent();
    const materials = new Set<Material>();
    this.original.traverse((object) => {
      const { geometry, material } = object as Mesh;
      geometry?.dispose();
      for (const one of [material].flat()) if (one) materials.add(one);
    });
    disposeAll(materials);
  }
}
