// The lights a viewer can choose from, as SH coefficients of one order, before rotation and intensity.

import { bakedLight, brightLight, type RadianceTransferExtension } from '../asset/kiln_reader';
import { functionToEquirect, lightToEquirect, softened, type EquirectMap } from '../light/equirect';
import type { LightParts } from '../light/relighter';
import { kSkies, projectSky, projectSuns, skyPicture, type Sky, type Sun } from '../light/skies';
import { rotateAboutY, withOrder } from '../light/sh';

export interface LightChoice {
  id: string;
  label: string;
}

const kHarmonicsWidth = 128; // SH of order 10 resolve 20 degrees; 128 texels are 2.8 degrees apart
const kSkyWidth = 256; // a sun's glow is three texels wide
const kReflectedWidth = 512;
const kSameSky = 0.02; // core spreads the sun over texels of a map, we take a point: they differ by 0.0008 at order 4

export class Lights {
  private readonly known = new Map<string, Float32Array>();
  private readonly bright = new Map<string, Float32Array>(); // of these the part that is added up apart; empty: none
  /// Brightness of the model under each light, unturned, at intensity 1; filled by the viewer.
  readonly levels = new Map<string, number>();
  private map: EquirectMap | null = null;
  readonly choices: LightChoice[] = [];

  readonly order: number;
  private readonly bakedName: string;

  constructor(extension: Pick<RadianceTransferExtension, 'order' | 'light'>) {
    const { order, light } = extension;
    const baked = bakedLight(extension);
    [this.order, this.bakedName] = [order, light?.name ?? ''];
    this.known.set('baked', withOrder(baked, order));
    const bright = brightLight(extension);
    this.bright.set('baked', bright.length > 0 ? withOrder(bright, order) : bright);
    this.choices.push({
      id: 'baked',
      label: baked.length > 0 || (order === 0 && this.bakedName) ? `As baked: ${this.bakedName || 'environment'}` : 'As baked: no sky, lamps only',
    });
    if (order > 0) this.choices.push(...kSkies.map(({ id, label }) => ({ id, label })));
  }

  addFile(name: string, { light, bright, map }: LightParts & { map: EquirectMap }): void {
    this.known.set('file', light);
    this.bright.set('file', bright);
    this.levels.delete('file');
    this.map = map;
    const place = this.choices.findIndex(({ id }) => id === 'file');
    this.choices.splice(place < 0 ? this.choices.length : place, place < 0 ? 0 : 1, {
      id: 'file',
      label: `Dropped: ${name}`,
    });
  }

  coefficients(id: string): Float32Array {
    let light = this.known.get(id);
    if (!light) {
      const sky = kSkies.find((one) => one.id === id);
      light = sky ? projectSky(sky, this.order) : new Float32Array(3 * this.order ** 2);
      this.known.set(id, light);
    }
    return light;
  }

  parts(id: string): LightParts {
    const sky = kSkies.find((one) => one.id === id);
    if (!this.bright.has(id)) this.bright.set(id, sky ? projectSuns(sky, this.order) : new Float32Array(0));
    return { light: this.coefficients(id), bright: this.bright.get(id)! };
  }

  /// As the model receives it.
  turned(id: string, rotation: number, intensity: number): LightParts {
    const turn = (light: Float32Array) =>
      light.length > 0 ? rotateAboutY(this.order, light, rotation).map((x) => x * intensity) : light;
    const { light, bright } = this.parts(id);
    return { light: turn(light), bright: turn(bright) };
  }

  /// What three's image-based light gets: no suns (its filter loses small bright spots; they come as lamps) and no detail.
  reflection(id: string): { picture: () => EquirectMap; suns: readonly Sun[] } {
    const sky = this.skyOf(id);
    if (sky) return { picture: () => functionToEquirect(sky.radiance, kReflectedWidth), suns: sky.suns };
    return { picture: () => lightToEquirect(this.order, this.coefficients(id), kHarmonicsWidth), suns: [] };
  }

  /// A picture of the light: its harmonics as they are, or the sky itself. Where only harmonics are known they are softened.
  picture(id: string, harmonics: boolean): EquirectMap {
    if (harmonics) return lightToEquirect(this.order, this.coefficients(id), kHarmonicsWidth);
    if (id === 'file' && this.map) return this.map;
    const sky = this.skyOf(id);
    return sky
      ? skyPicture(sky, kSkyWidth)
      : lightToEquirect(this.order, softened(this.order, this.coefficients(id)), kHarmonicsWidth);
  }

  /// Of a job's own map neither formula nor harmonics are known beside radiosity.
  hasPicture(id: string): boolean {
    return id !== 'baked' || this.order > 0 || !this.bakedName || this.skyOf(id) !== undefined;
  }

  /// The formula behind a light. A bake says only the name of its sky; it is believed when the coefficients agree.
  private skyOf(id: string): Sky | undefined {
    if (id !== 'baked') return kSkies.find((one) => one.id === id);
    const named = kSkies.find((one) => one.id === this.bakedName);
    if (this.order === 0) return named; // there is nothing to compare
    return named && relativeDistance(this.coefficients(named.id), this.coefficients('baked')) < kSameSky
      ? named
      : undefined;
  }
}

function relativeDistance(a: Float32Array, b: Float32Array): number {
  let [difference, size] = [0, 0];
  for (let i = 0; i < a.length; ++i) [difference, size] = [difference + (a[i] - b[i]) ** 2, size + b[i] ** 2];
  return size > 0 ? Math.sqrt(difference / size) : 1;
}
