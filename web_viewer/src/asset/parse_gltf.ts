// The unpacked scene.glb to three.js: the baked scene at once, the original one when it is asked for.
//
// GLTFLoader would load both scenes and all textures before it answers, so the JSON is shown to it with the default scene
// only, and the other one is loaded from the kept parser on demand.

import { type Group, TextureLoader, type Object3D } from 'three';
import { GLTFLoader, type GLTF, type GLTFParser } from 'three/addons/loaders/GLTFLoader.js';
import { splitGlb } from './glb';

interface Json {
  scenes?: unknown[];
}

export interface LoadedAsset {
  gltf: GLTF;
  bytes: number; // of scene.glb as it was downloaded
  hasOriginal: boolean;
  loadOriginal(): Promise<Object3D>; // scene 1; a new load at each call
}

/// `file`: the unpacked one. What is loaded belongs to the caller.
export async function parseGltf(file: ArrayBuffer, bytes: number): Promise<LoadedAsset> {
  let scenes: unknown[] = [];
  const loader = new GLTFLoader();
  loader.register((parser) => {
    const json = parser.json as Json;
    scenes = json.scenes ?? [];
    json.scenes = scenes.slice(0, 1);
    useImageElements(parser);
    return { name: 'KILN_default_scene_first' };
  });
  const gltf = await loader.parseAsync(file, '');
  return { gltf, bytes, hasOriginal: scenes.length > 1, loadOriginal: () => loadSecondScene(gltf.parser, scenes) };
}

/// A glTF without transfer vectors, as it came. Throws, in words, on a compression that this page does not read.
export async function parsePlainGltf(file: ArrayBuffer): Promise<GLTF> {
  const used = (splitGlb(file).json as { extensionsUsed?: string[] }).extensionsUsed ?? [];
  const compression = used.find((name) => kCompressions.includes(name));
  if (compression)
    throw new Error(`The model came back as it was sent, compressed with ${compression}, which this page cannot read.`);
  const loader = new GLTFLoader();
  loader.register((parser) => {
    useImageElements(parser);
    return { name: 'KILN_plain' };
  });
  return loader.parseAsync(file, '');
}

const kCompressions = ['KHR_draco_mesh_compression', 'EXT_meshopt_compression', 'KHR_texture_basisu'];

/// GLTFLoader prefers fetch(blob:) for images, which our Content-Security-Policy forbids (connect-src 'self'); <img> is allowed.
function useImageElements(parser: GLTFParser): void {
  (parser as unknown as { textureLoader: TextureLoader }).textureLoader = new TextureLoader(parser.options.manager);
}

async function loadSecondScene(parser: GLTFParser, scenes: unknown[]): Promise<Object3D> {
  (parser.json as Json).scenes = scenes;
  const group = (await parser.getDependency('scene', 1)) as Group;
  group.updateMatrixWorld(true);
  return group;
}
