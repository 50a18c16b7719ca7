// A ball is dragged in the plane through its middle that faces the camera. The camera's own gestures rest meanwhile.

import { type Mesh, Plane, Raycaster, Vector2, Vector3 } from 'three';
import type { Viewer } from './viewer';

/// What is dragged: nothing while `ball` is null.
export interface Dragged {
  readonly ball: Mesh | null;
  moveTo(place: Vector3): void;
}

/// Returns what ends it.
export function dragBall(viewer: Viewer, view: Dragged): () => void {
  const { canvas, camera, controls } = viewer.stage;
  const ray = new Raycaster();
  const plane = new Plane();
  const grip = new Vector3();
  let pointer = -1;

  const aim = (event: PointerEvent): void => {
    const { left, top, width, height } = canvas.getBoundingClientRect();
    const [x, y] = [event.clientX - left, event.clientY - top];
    ray.setFromCamera(new Vector2((2 * x) / width - 1, 1 - (2 * y) / height), camera);
  };
  const down = (event: PointerEvent): void => {
    if (event.button !== 0 || event.shiftKey || !view.ball) return;
    aim(event);
    const hit = ray.intersectObject(view.ball, false)[0];
    const wall = ray.intersectObjects(viewer.model.parts.map(({ mesh }) => mesh), false)[0];
    if (!hit || (wall && wall.distance < hit.distance)) return;
    plane.setFromNormalAndCoplanarPoint(camera.getWorldDirection(new Vector3()), hit.point);
    grip.copy(view.ball.position).sub(hit.point);
    pointer = event.pointerId;
    controls.enabled = false;
    canvas.setPointerCapture(pointer);
  };
  const move = (event: PointerEvent): void => {
    if (event.pointerId !== pointer) return;
    aim(event);
    const place = ray.ray.intersectPlane(plane, new Vector3());
    if (place) view.moveTo(place.add(grip));
  };
  const up = (event: PointerEvent): void => {
    if (event.pointerId !== pointer) return;
    pointer = -1;
    controls.enabled = true;
  };
  canvas.addEventListener('pointerdown', down, { capture: true });
  canvas.addEventListener('pointermove', move);
  canvas.addEventListener('pointerup', up);
  canvas.addEventListener('pointercancel', up);
  return () => {
    canvas.removeEventListener('pointerdown', down, { capture: true });
    canvas.removeEventListener('pointermove', move);
    canvas.removeEventListener('pointerup', up);
    canvas.removeEventListener('pointercancel', up);
  };
}
