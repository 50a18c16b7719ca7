// Draco's decoder for the browser: WebAssembly, compiled while it arrives.

import createDecoder from 'three/examples/jsm/libs/draco/gltf/draco_wasm_wrapper.js';
import wasm from 'three/examples/jsm/libs/draco/gltf/draco_decoder.wasm?url';
import type { DracoModule } from './draco_mesh';

export const loadDraco = (): Promise<DracoModule> => createDecoder({ locateFile: () => wasm });
