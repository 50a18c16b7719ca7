// A three.js application as a stranger would write it: stock loaders, our reader, nothing of the viewer.

import { BufferAttribute, MeshBasicMaterial } from 'three';
import { DRACOLoader } from 'three/addons/loaders/DRACOLoader.js';
import { GLTFLoader } from 'three/addons/loaders/GLTFLoader.js';
import { lightValues, readRadianceTransfer } from '../../../web_viewer/src/asset/kiln_reader';

async function run(): Promise<unknown> {
  const decoder = new DRACOLoader().setDecoderPath('/draco/');
  const gltf = await new GLTFLoader().setDRACOLoader(decoder).loadAsync('/scene.glb');
  const baked = await readRadianceTransfer(gltf);
  if (!baked) throw new Error('no KILN_radiance_transfer');
  const parts = baked.parts.map((part) => {
    const values = lightValues(baked, part.geometry, baked.bakedLight);
    part.geometry.setAttribute('color', new BufferAttribute(values, 3));
    part.mesh.material = new MeshBasicMaterial({ vertexColors: true });
    return { albedo: part.albedo, values: [...values] };
  });
  decoder.dispose();
  return { scenes: gltf.scenes.length, order: baked.order, parts };
}

run().then(
  (result) => Object.assign(window, { result }),
  (error: Error) => Object.assign(window, { result: { error: error.message } }),
);
