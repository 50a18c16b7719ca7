// node validate.mjs FILE.glb...: the Khronos validator finds no error, neither in the file as it is nor once its Draco
// geometry is decompressed (the validator does not look inside Draco). Exit: 0 valid, 1 errors, 77 no node_modules.

import { readFile } from 'node:fs/promises';

async function tools() {
  try {
    const [validator, core, extensions, draco] = await Promise.all([
      import('gltf-validator'), import('@gltf-transform/core'), import('@gltf-transform/extensions'), import('draco3dgltf'),
    ]);
    return { validator: validator.default, core, extensions, draco: draco.default };
  } catch (error) {
    console.log(`SKIPPED: ${error.message.split('\n')[0]} (run "npm ci" in tests/gltf)`);
    process.exit(77);
  }
}

const { validator, core, extensions, draco } = await tools();

/** Our own extension, so that gltf-transform does not warn; its numbers are tested in C++. */
async function decompressed(bytes) {
  const io = new core.NodeIO()
    .registerExtensions(extensions.ALL_EXTENSIONS)
    .registerDependencies({ 'draco3d.decoder': await draco.createDecoderModule() })
    .setVertexLayout(core.VertexLayout.SEPARATE); // interleaved, 27 VEC4s would pass the stride limit of 252
  const document = await io.readBinary(bytes);
  for (const used of document.getRoot().listExtensionsUsed()) {
    if (used.extensionName === 'KHR_draco_mesh_compression') used.dispose();
  }
  return { document, bytes: await io.writeBinary(document) };
}

/** Every attribute the file promises has arrived, and coefficients and colours are in the range that the format states. */
function contentErrors(document) {
  const errors = [];
  for (const mesh of document.getRoot().listMeshes()) {
    for (const [i, primitive] of mesh.listPrimitives().entries()) {
      for (const name of primitive.listSemantics()) {
        const bound = name.startsWith('_PRT_') ? [-1, 1] : name.startsWith('COLOR_') || name === '_ALBEDO' ? [0, 1] : null;
        if (!bound) continue;
        const values = primitive.getAttribute(name).getArray();
        if (values.some((v) => !(v >= bound[0] && v <= bound[1]))) {
          errors.push(`${mesh.getName()}/${i}/${name}: a value outside [${bound}]`);
        }
      }
    }
  }
  return errors;
}

async function validate(name, stage, bytes) {
  const report = await validator.validateBytes(bytes, { uri: name, maxIssues: 20 });
  const { numErrors, numWarnings, numInfos } = report.issues;
  console.log(`${name} ${stage}: ${numErrors} errors, ${numWarnings} warnings, ${numInfos} infos`);
  for (const m of report.issues.messages.filter((m) => m.severity < 2)) console.log(`  ${m.code} ${m.pointer}: ${m.message}`);
  return numErrors;
}

let errors = 0;
for (const file of process.argv.slice(2)) {
  const bytes = new Uint8Array(await readFile(file));
  errors += await validate(file, 'as written', bytes);
  const plain = await decompressed(bytes);
  errors += await validate(file, 'decompressed', plain.bytes);
  for (const error of contentErrors(plain.document)) {
    console.log(`  ${error}`);
    errors += 1;
  }
}
process.exit(errors > 0 ? 1 : 0);
