// The tone map that the bake itself uses for COLOR_0 and preview.png (core/artifact/look.h, "shoulder-0.6"):
//   x <= 0.6 ? x : 1 - 0.4 exp(-(x - 0.6) / 0.4)   for each channel of the exposed radiance
// three leaves one tone mapping to its users, as a function of a shader chunk.

import { CustomToneMapping, ShaderChunk } from 'three';

const kEmpty = 'vec3 CustomToneMapping( vec3 color ) { return color; }';
const kShoulder = /* glsl */ `
vec3 CustomToneMapping( vec3 color ) {
  vec3 x = max( toneMappingExposure * color, vec3( 0.0 ) );
  return mix( x, 1.0 - 0.4 * exp( ( 0.6 - x ) / 0.4 ), step( 0.6, x ) );
}`;

ShaderChunk.tonemapping_pars_fragment = ShaderChunk.tonemapping_pars_fragment.replace(kEmpty, kShoulder);

export const ShoulderToneMapping = CustomToneMapping;
