// What the meshes of the level on the screen wear: their baked material, the light field, or false colours; and lines.

import type { Object3D } from 'three';
import { Difference, kDifferenceRange } from './difference';
import { HeatMap, type HeatMapData } from './heat_map';
import type { Level } from './level';
import type { Stage } from './stage';
import type { Mode, ViewState } from './view_state';
import { Wireframe } from './wireframe';

/// What the legend shows.
export type Legend = Pick<HeatMapData, 'map' | 'range'> | null;

const isHeat = (mode: Mode): boolean => mode === 'measure' || mode === 'weighted' || mode === 'coefficient';
const isDifference = (mode: Mode): boolean => mode === 'vertexError' || mode === 'levelError';
export const isFalseColour = (mode: Mode): boolean => isHeat(mode) || isDifference(mode);

export class Surfaces {
  private wireframe: Wireframe | null = null;
  private heatMap: HeatMap | null = null;
  private difference: Difference | null = null;
  private serial = 0;

  /// `hidden`: what is in no difference.
  constructor(
    private readonly stage: Stage,
    private readonly finest: Level,
    private readonly hidden: Object3D,
  ) {}

  /// As the light field, where there is one, or as the baked material. What false colours need more, show() brings.
  dress({ field, model }: Level, mode: Mode): void {
    const byField = mode === 'shaded' || mode === 'vertices' || isDifference(mode);
    field?.show(byField ? (mode === 'vertices' ? 'vertex' : 'fragment') : null);
    this.stage.fine = field !== null && byField;
    model.setWhite(mode === 'light');
  }

  /// Resolves with the legend once `mode` is shown; with undefined when a newer call has overtaken this one.
  async show(level: Level, { mode, channel, slot }: Readonly<ViewState>): Promise<Legend | undefined> {
    const serial = ++this.serial;
    const data = isHeat(mode) ? await heatData(level, mode, channel, slot) : null;
    if (serial !== this.serial) return undefined;
    this.undress(level);
    this.dress(level, mode);
    this.heatMap = data && new HeatMap(level.model, data);
    if (isDifference(mode)) this.compareTwo(level, mode);
    return this.difference ? { map: 'viridis', range: kDifferenceRange } : data;
  }

  /// In differences lines would be seen as such.
  showWire({ model }: Level, { wire, mode }: Readonly<ViewState>): void {
    this.wireframe?.dispose();
    this.wireframe = wire && !isDifference(mode) ? new Wireframe(model) : null;
  }

  /// Leaves the level as it came.
  strip(level: Level): void {
    ++this.serial;
    this.undress(level);
    this.wireframe?.dispose();
    this.wireframe = null;
  }

  private undress({ field }: Level): void {
    this.heatMap?.dispose();
    this.difference?.dispose();
    this.heatMap = this.difference = null;
    field?.show(null);
  }

  private compareTwo(level: Level, mode: Mode): void {
    const { stage, finest, hidden } = this;
    const { field } = level;
    finest.field?.show('fragment');
    const put = (one: Level, other: Level) => () => {
      other.model.root.removeFromParent();
      stage.scene.add(one.model.root);
    };
    if (mode === 'levelError')
      this.difference = new Difference(stage, [put(level, finest), put(finest, level)], hidden);
    else if (field)
      this.difference = new Difference(stage, [() => field.show('fragment'), () => field.show('vertex')], hidden);
  }
}

async function heatData(level: Level, mode: Mode, channel: number, slot: number): Promise<HeatMapData> {
  const { model, relighter } = level;
  if (mode === 'coefficient') {
    const { values, range } = await relighter.coefficient(channel, Math.min(slot, model.transfer.slots - 1));
    return { per: 'vertex', values, map: 'diverging', range: [-range, range] };
  }
  const { values, range } = await relighter.measure(mode === 'weighted');
  return { per: 'triangle', values, map: 'viridis', range: [0, range] };
}
