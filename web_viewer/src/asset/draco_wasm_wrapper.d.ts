declare module 'three/examples/jsm/libs/draco/gltf/draco_wasm_wrapper.js' {
  const createDecoder: (options: { locateFile(): string }) => Promise<import('./draco_mesh').DracoModule>;
  export default createDecoder;
}
