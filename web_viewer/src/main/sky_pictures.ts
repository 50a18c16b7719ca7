// The textures of the light that is shown: at most one for the background and one for reflections, made when first needed.

import type { Texture } from 'three';
import type { Sun } from '../light/skies';
import { skyTexture } from '../shaders/sky_texture';
import type { Lights } from './lights';
import type { ViewState } from './view_state';

interface Kept {
  key: string;
  texture: Texture;
}

export class SkyPictures {
  private shown: Kept | null = null;
  private reflected: Kept | null = null;

  constructor(readonly lights: Lights) {}

  /// Makes what the first picture will show.
  prepare({ light, background }: Readonly<ViewState>): void {
    if (background !== 'off') this.background(light, background === 'harmonics');
  }

  background(light: string, harmonics: boolean): Texture {
    this.shown = this.keep(this.shown, `${light} ${harmonics}`, () =>
      skyTexture(this.lights.picture(light, harmonics), false),
    );
    return this.shown.texture;
  }

  reflection(light: string): { reflection: Texture; suns: readonly Sun[] } {
    const { picture, suns } = this.lights.reflection(light);
    this.reflected = this.keep(this.reflected, light, () => skyTexture(picture(), true));
    return { reflection: this.reflected.texture, suns };
  }

  private keep(kept: Kept | null, key: string, make: () => Texture): Kept {
    if (kept?.key === key) return kept;
    kept?.texture.dispose();
    return { key, texture: make() };
  }

  /// May be used again afterwards: pictures are then made anew.
  dispose(): void {
    this.shown?.texture.dispose();
    this.reflected?.texture.dispose();
    this.shown = this.reflected = null;
  }
}
