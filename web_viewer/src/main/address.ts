// The address follows the view, and the view an address that the user edits.

import type { Stage } from './stage';
import type { Store } from './store';
import { decodeState, encodeState, type ViewState } from './view_state';

/// Returns what ends it.
export function bindAddress(stage: Stage, state: Store<ViewState>, lights: () => string[]): () => void {
  let timer = 0;
  const write = () => {
    clearTimeout(timer);
    timer = window.setTimeout(() => {
      const text = encodeState({ ...state.get(), pose: stage.pose });
      history.replaceState(null, '', text ? `#${text}` : location.pathname);
    }, 200);
  };
  const unsubscribe = state.subscribe(write);
  stage.onMoved = write;
  const read = () => {
    const wanted = decodeState(location.hash.slice(1), lights());
    state.set(wanted);
    if (wanted.pose) stage.pose = wanted.pose;
  };
  window.addEventListener('hashchange', read);
  return () => {
    unsubscribe();
    clearTimeout(timer);
    stage.onMoved = null;
    window.removeEventListener('hashchange', read);
  };
}
