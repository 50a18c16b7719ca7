// scene.glb from the network to three.js: the baked scene at once, the original one when it is asked for.
//
// The file's two scenes share their compressed geometry. GLTFLoader would decode both before it answers, so the JSON is
// shown to it with the default scene only, and the other one is loaded from the kept parser on demand.

import { Group, TextureLoader, type Object3D } from 'three';
import { DRACOLoader } from 'three/addons/loaders/DRACOLoader.js';
import { GLTFLoader, type GLTF, type GLTFParser } from 'three/addons/loaders/GLTFLoader.js';
import decoderScript from 'three/examples/jsm/libs/draco/gltf/draco_wasm_wrapper.js?url';
import decoderWasm from 'three/examples/jsm/libs/draco/gltf/draco_decoder.wasm?url';

interface Json {
  scene?: number;
  scenes?: unknown[];
  meshes?: { primitives: { extensions?: { KHR_draco_mesh_compression?: { bufferView: number } } }[] }[];
  [key: string]: unknown;
}

export interface LoadedAsset {
  gltf: GLTF;
  bytes: number;
  hasOriginal: boolean;
  loadOriginal(): Promise<Object3D>; // scene 1; a new load at each call
  dispose(): void; // the decoder's workers; what was loaded belongs to the caller
}

export type DownloadProgress = (loaded: number, total: number) => void;

/// Fetches the decoder; call it early.
export const createDecoder = (): DRACOLoader =>
  new DRACOLoader().setDecoderPath({ js: decoderScript, wasm: decoderWasm }).setWorkerLimit(2).preload();

/// Downloads and parses. The decoder is the asset's from then on.
export async function loadGltf(url: string, decoder: DRACOLoader, progress: DownloadProgress): Promise<LoadedAsset> {
  try {
    const file = await download(url, progress);
    return await parse(file, decoder);
  } catch (error) {
    decoder.dispose();
    throw error;
  }
}

async function parse(file: ArrayBuffer, decoder: DRACOLoader): Promise<LoadedAsset> {
  let scenes: unknown[] = [];
  const loader = new GLTFLoader().setDRACOLoader(decoder);
  loader.register((parser) => {
    const json = parser.json as Json;
    scenes = json.scenes ?? [];
    json.scenes = scenes.slice(0, 1);
    useImageElements(parser);
    return { name: 'KILN_default_scene_first' };
  });
  const bytes = file.byteLength;
  const gltf = await loader.parseAsync(file, '');
  return {
    gltf,
    bytes,
    hasOriginal: scenes.length > 1,
    loadOriginal: () => loadSecondScene(gltf.parser, scenes),
    dispose: () => decoder.dispose(),
  };
}

/// GLTFLoader prefers fetch(blob:) for images, which our Content-Security-Policy forbids (connect-src 'self'); <img> is allowed.
function useImageElements(parser: GLTFParser): void {
  (parser as unknown as { textureLoader: TextureLoader }).textureLoader = new TextureLoader(parser.options.manager);
}

async function loadSecondScene(parser: GLTFParser, scenes: unknown[]): Promise<Object3D> {
  const json = parser.json as Json;
  json.scenes = scenes;
  forgetCompressed(parser, json);
  const group = (await parser.getDependency('scene', 1)) as Group;
  group.updateMatrixWorld(true);
  return group;
}

/// The decoder keeps the buffers it was given; a second decode with other attributes needs fresh copies.
function forgetCompressed(parser: GLTFParser, json: Json): void {
  const cache = (parser as unknown as { cache: { remove(key: string): void } }).cache;
  for (const { primitives } of json.meshes ?? []) {
    for (const { extensions } of primitives) {
      const view = extensions?.KHR_draco_mesh_compression?.bufferView;
      if (view !== undefined) cache.remove(`bufferView:${view}`);
    }
  }
}

async function download(url: string, progress: DownloadProgress): Promise<ArrayBuffer> {
  const response = await fetch(url);
  if (!response.ok || !response.body)
    throw new Error(`the server answered ${response.status} for ${new URL(response.url).pathname}`);
  const total = Number(response.headers.get('Content-Length') ?? 0);
  const chunks: Uint8Array<ArrayBuffer>[] = [];
  let loaded = 0;
  for (const reader = response.body.getReader(); ;) {
    const { done, value } = await reader.read();
    if (done) break;
    chunks.push(value);
    progress((loaded += value.length), total);
  }
  return new Blob(chunks).arrayBuffer();
}
