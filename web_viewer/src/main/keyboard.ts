// Keys of the viewer page. Never while the user types or works a control that has keys of its own.

import { Spherical, Vector3 } from 'three';
import { kDefaultPose, type Stage } from './stage';
import type { Store } from './store';
import { kDefaultState, type Mode, type ViewState } from './view_state';

const kNumbered: readonly Mode[] = ['shaded', 'light', 'measure', 'weighted', 'coefficient'];
const kOrbitStep = Math.PI / 36;

export interface KeyActions {
  screenshot(): void;
  help(): void;
}

/// Returns what ends it.
export function listenToKeys(
  stage: Stage,
  state: Store<ViewState>,
  canCompare: boolean,
  actions: KeyActions,
): () => void {
  const listener = (event: KeyboardEvent): void => {
    if (event.ctrlKey || event.metaKey || event.altKey || ownsKeys(event.target)) return;
    if (press(event)) event.preventDefault();
  };
  const press = (event: KeyboardEvent): boolean => moveCamera(stage, event) || changeState(event.key) || act(event.key);

  const changeState = (key: string): boolean => {
    const now = state.get();
    const mode = kNumbered[Number(key) - 1];
    if (mode) state.set({ mode });
    else if (key === 'w') state.set({ wire: !now.wire });
    else if (key === 'b') state.set({ background: now.background === 'off' ? 'sky' : 'off' });
    else if (key === 'c' && canCompare) state.set({ compare: now.compare === null ? 0.5 : null });
    else if (key === '[' || key === ']') state.set({ rotation: turned(now.rotation, key === ']' ? 5 : -5) });
    else if (key === '+' || key === '=' || key === '-')
      state.set({ ev: Math.min(6, Math.max(-6, now.ev + (key === '-' ? -0.5 : 0.5))) });
    else return false;
    return true;
  };

  const act = (key: string): boolean => {
    if (key === 'f') stage.frameModel();
    else if (key === 'r') resetView(stage, state);
    else if (key === 's') actions.screenshot();
    else if (key === 'h' || key === '?') actions.help();
    else return false;
    return true;
  };

  window.addEventListener('keydown', listener);
  return () => window.removeEventListener('keydown', listener);
}

/// Degrees kept in [-180, 180].
export const turned = (rotation: number, by: number): number => ((((rotation + by + 180) % 360) + 360) % 360) - 180;

export function resetView(stage: Stage, state: Store<ViewState>): void {
  stage.pose = kDefaultPose;
  stage.frameModel();
  const { light, rotation, intensity, lamps, ev } = kDefaultState;
  state.set({ light, rotation, intensity, lamps, ev });
}

function ownsKeys(target: EventTarget | null): boolean {
  return (
    target instanceof HTMLElement &&
    target.closest('input:not([type=checkbox]), select, textarea, dialog[open], [role=slider]') !== null
  );
}

function moveCamera(stage: Stage, event: KeyboardEvent): boolean {
  const sideways = { ArrowLeft: -1, ArrowRight: 1 }[event.key] ?? 0;
  const upwards = { ArrowUp: 1, ArrowDown: -1 }[event.key] ?? 0;
  const zoom = { PageUp: 0.9, PageDown: 1 / 0.9 }[event.key] ?? 1;
  if (sideways === 0 && upwards === 0 && zoom === 1) return false;
  const { camera, controls } = stage;
  const arm = camera.position.clone().sub(controls.target).multiplyScalar(zoom);
  if (event.shiftKey) {
    const step = 0.05 * arm.length();
    const shift = new Vector3(sideways * step, upwards * step, 0).applyQuaternion(camera.quaternion);
    controls.target.add(shift);
  } else {
    const ball = new Spherical().setFromVector3(arm);
    ball.theta += sideways * kOrbitStep;
    ball.phi -= upwards * kOrbitStep;
    arm.setFromSpherical(ball.makeSafe());
  }
  camera.position.copy(controls.target).add(arm);
  controls.update();
  stage.requestDraw();
  return true;
}
