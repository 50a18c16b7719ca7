// Chooses the level of detail by how large the model is on the screen: the coarsest that the report says nobody sees
// come in (core/bake/level_switch.h). A coarser one waits until there is some room, so that none flickers.

import type { Viewer } from './viewer';

const kRoom = 0.9;

/// `pixels`: for each level how large it may be where it takes the place of the one before; of the finest unused.
export function levelForSize(pixels: readonly number[], size: number, now: number): number {
  let level = 0;
  while (level + 1 < pixels.length && size <= pixels[level + 1] * (level + 1 > now ? kRoom : 1)) ++level;
  return level;
}

export class LevelBySize {
  private readonly undo: () => void;

  constructor(
    private readonly viewer: Viewer,
    private readonly pixels: readonly number[],
  ) {
    const { stage, state } = viewer;
    stage.controls.addEventListener('change', this.choose);
    window.addEventListener('resize', this.choose);
    this.undo = state.subscribe((_, changed) => changed.has('levelBySize') && this.choose());
    this.choose();
  }

  private readonly choose = (): void => {
    const { stage, state } = this.viewer;
    const { levelBySize, level } = state.get();
    if (levelBySize) state.set({ level: levelForSize(this.pixels, stage.pixelsAcross, level) });
  };

  dispose(): void {
    this.viewer.stage.controls.removeEventListener('change', this.choose);
    window.removeEventListener('resize', this.choose);
    this.undo();
  }
}
