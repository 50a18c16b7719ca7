// What a grid alone makes of a surface:  radiance = albedo * E(p, n) / pi, then exposure, tone mapping and sRGB.

import { DoubleSide, FrontSide, ShaderMaterial } from 'three';
import { gridLookup, type GridTextures } from './grid_textures';

const vertexShader = /* glsl */ `
varying vec3 vPlace;
varying vec3 vNormal;
void main() {
  vec4 place = modelMatrix * vec4(position, 1.0);
  vPlace = place.xyz;
  vNormal = mat3(modelMatrix) * normal;
  gl_Position = projectionMatrix * viewMatrix * place;
}`;

const fragmentShader = (parts: number) => /* glsl */ `
uniform float albedo;
uniform bool surface;
varying vec3 vPlace;
varying vec3 vNormal;
#include <common>
#include <dithering_pars_fragment>
${gridLookup(parts)}

void main() {
  vec3 e = gridIrradiance(vPlace, normalize(vNormal), surface);
  gl_FragColor = vec4(albedo * e * RECIPROCAL_PI, 1.0);
  #include <tonemapping_fragment>
  #include <colorspace_fragment>
  #include <dithering_fragment>
}`;

/// `surface`: it stands where the bake's own surfaces stand; else it hangs in free space. Owns only itself.
export function gridMaterial(textures: GridTextures, surface: boolean): ShaderMaterial {
  const parts = Number(textures.defines.GRID_PARTS);
  return new ShaderMaterial({
    name: surface ? 'grid on surfaces' : 'grid in space',
    dithering: true,
    vertexShader,
    fragmentShader: fragmentShader(parts),
    defines: { ...textures.defines },
    uniforms: { ...textures.uniforms, albedo: { value: surface ? 1 : 0.8 }, surface: { value: surface } },
    side: surface ? DoubleSide : FrontSide,
    // Used while a wireframe stands in front (wireframe.ts).
    polygonOffsetFactor: 1,
    polygonOffsetUnits: 1,
  });
}
