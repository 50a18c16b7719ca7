// A click on the model tells the number under it: the light, or the false-colour value that is shown.

import { type BufferAttribute, type Intersection, Raycaster, Vector2 } from 'three';
import { announce, h } from '../ui/dom';
import type { Viewer } from './viewer';

const kStill = 4; // pixels a click may move before it is a drag

export class Probe {
  private readonly box = h('div', { class: 'probe', hidden: true });
  private readonly ray = new Raycaster();
  private start: { x: number; y: number } | null = null;
  private readonly undo: () => void;

  constructor(
    area: HTMLElement,
    private readonly viewer: Viewer,
  ) {
    const { canvas } = viewer.stage;
    const down = (event: PointerEvent) => {
      this.box.hidden = true;
      this.start = event.button === 0 && !event.shiftKey ? { x: event.clientX, y: event.clientY } : null;
    };
    const up = (event: PointerEvent) => {
      if (this.start && Math.hypot(event.clientX - this.start.x, event.clientY - this.start.y) < kStill)
        this.read(event);
    };
    const unsubscribe = viewer.state.subscribe(() => (this.box.hidden = true));
    area.append(this.box);
    canvas.addEventListener('pointerdown', down);
    canvas.addEventListener('pointerup', up);
    this.undo = () => {
      canvas.removeEventListener('pointerdown', down);
      canvas.removeEventListener('pointerup', up);
      unsubscribe();
    };
  }

  private read(event: PointerEvent): void {
    const { canvas, camera } = this.viewer.stage;
    const { left, top, width, height } = canvas.getBoundingClientRect();
    const [x, y] = [event.clientX - left, event.clientY - top];
    this.ray.setFromCamera(new Vector2((2 * x) / width - 1, 1 - (2 * y) / height), camera);
    if (!this.viewer.model.root.visible) return; // another mesh is shown: progressive_view.ts
    const meshes = this.viewer.model.parts.map((part) => part.mesh);
    const hit = this.ray.intersectObjects(meshes, false)[0];
    if (hit) this.show(this.describe(hit), x, y, width);
  }

  private describe(hit: Intersection): string {
    const { level, stage } = this.viewer;
    const seen = level.field?.seenAt(hit, stage.camera.position);
    return seen ? `Radiance ${seen.map((v) => v.toPrecision(3)).join(', ')} towards the eye` : describe(hit);
  }

  private show(text: string, x: number, y: number, width: number): void {
    this.box.hidden = false;
    this.box.textContent = text;
    this.box.style.top = `${y + 14}px`;
    this.box.style.left = `${Math.min(x + 14, width - this.box.offsetWidth - 8)}px`;
    announce(text);
  }

  dispose(): void {
    this.undo();
    this.box.remove();
  }
}

function describe(hit: Intersection): string {
  const { geometry } = hit.object as Viewer['model']['parts'][number]['mesh'];
  const measure = geometry.getAttribute('measure') as BufferAttribute | undefined;
  if (measure) return interpolate(hit, measure)[0].toPrecision(3);
  const value = interpolate(hit, geometry.getAttribute('light') as BufferAttribute);
  return `Light ${value.map((v) => v.toPrecision(3)).join(', ')} at albedo 1`;
}

function interpolate({ face, barycoord }: Intersection, attribute: BufferAttribute): number[] {
  const { array, itemSize } = attribute;
  const corners = [face!.a, face!.b, face!.c];
  const weights = barycoord!.toArray();
  return Array.from({ length: itemSize }, (_, i) =>
    corners.reduce((sum, corner, k) => sum + weights[k] * array[itemSize * corner + i], 0),
  );
}
