// Gestures that are not the camera's.

import { turned } from './keyboard';
import type { Stage } from './stage';
import type { Store } from './store';
import type { ViewState } from './view_state';

/// Shift + drag turns the light instead of the camera. The listeners go with the canvas.
export function turnLightByDragging(stage: Stage, state: Store<ViewState>): void {
  const { canvas } = stage;
  let pointer = -1;
  const down = (event: PointerEvent) => {
    if (!event.shiftKey || event.button !== 0) return;
    pointer = event.pointerId;
    stage.controls.enabled = false;
    canvas.setPointerCapture(pointer);
  };
  const move = (event: PointerEvent) => {
    if (event.pointerId === pointer)
      state.set({ rotation: Math.round(turned(state.get().rotation, 0.4 * event.movementX)) });
  };
  const up = (event: PointerEvent) => {
    if (event.pointerId !== pointer) return;
    pointer = -1;
    stage.controls.enabled = true;
  };
  canvas.addEventListener('pointerdown', down, { capture: true });
  canvas.addEventListener('pointermove', move);
  canvas.addEventListener('pointerup', up);
  canvas.addEventListener('pointercancel', up);
}

/// Files dropped anywhere on the page. Returns what ends it.
export function acceptDrops(use: (file: File) => void): () => void {
  const over = (event: DragEvent) => event.preventDefault();
  const drop = (event: DragEvent) => {
    event.preventDefault();
    const file = event.dataTransfer?.files[0];
    if (file) use(file);
  };
  window.addEventListener('dragover', over);
  window.addEventListener('drop', drop);
  return () => {
    window.removeEventListener('dragover', over);
    window.removeEventListener('drop', drop);
  };
}
