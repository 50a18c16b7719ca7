// The material of baked light:  radiance = albedo * value + emission, then exposure, tone mapping and sRGB.
//
// `value` (attribute `light`, linear RGB) was computed by the light worker; nothing here depends on the number of coefficients.
// Exposure and tone mapping are three's (renderer.toneMapping): the same for baked and original materials.

import { Color, type Material, Matrix3, type MeshBasicMaterial, ShaderMaterial, type Texture } from 'three';

const vertexShader = /* glsl */ `
attribute vec3 light;
varying vec3 vLight;
#ifdef VERTEX_ALBEDO
attribute vec4 _albedo;
varying vec4 vAlbedo;
#endif
#ifdef USE_UV1_SET
attribute vec2 uv1;
#endif
#ifdef ALBEDO_MAP
uniform mat3 albedoMapTransform;
varying vec2 vAlbedoUv;
#endif
#ifdef EMISSION_MAP
uniform mat3 emissionMapTransform;
varying vec2 vEmissionUv;
#endif

void main() {
  vLight = light;
#ifdef VERTEX_ALBEDO
  vAlbedo = _albedo;
#endif
#ifdef ALBEDO_MAP
  vAlbedoUv = (albedoMapTransform * vec3(ALBEDO_UV, 1.0)).xy;
#endif
#ifdef EMISSION_MAP
  vEmissionUv = (emissionMapTransform * vec3(EMISSION_UV, 1.0)).xy;
#endif
  gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0);
}`;

const fragmentShader = /* glsl */ `
uniform vec3 albedo;
uniform float alpha;
uniform float alphaCutoff;
uniform vec3 emission;
uniform bool white;
varying vec3 vLight;
#ifdef VERTEX_ALBEDO
varying vec4 vAlbedo;
#endif
#ifdef ALBEDO_MAP
uniform sampler2D albedoMap;
varying vec2 vAlbedoUv;
#endif
#ifdef EMISSION_MAP
uniform sampler2D emissionMap;
varying vec2 vEmissionUv;
#endif
#include <common>
#include <dithering_pars_fragment>

void main() {
#ifdef VERTEX_ALBEDO
  vec4 base = vAlbedo;
#else
  vec4 base = vec4(albedo, alpha);
#endif
#ifdef ALBEDO_MAP
  base *= texture2D(albedoMap, vAlbedoUv);
#endif
  if (base.a < alphaCutoff) discard;
  vec3 emitted = emission;
#ifdef EMISSION_MAP
  emitted *= texture2D(emissionMap, vEmissionUv).rgb;
#endif
  // Spherical harmonics ring: a point in deep shadow may come out a little below zero.
  vec3 value = max(vLight, vec3(0.0));
  gl_FragColor = vec4(white ? value : base.rgb * value + emitted, base.a);
  #include <tonemapping_fragment>
  #include <colorspace_fragment>
  #include <dithering_fragment>
}`;

/// Emission through a texture, which the extension leaves to the original material.
export interface Glow {
  map: Texture;
  factor: Color;
}

export interface BakedLook {
  unlit: MeshBasicMaterial; // of scene 0: base colour texture, alpha mode, sides
  glow: Glow | null; // emission through a texture
  albedo: readonly number[];
  emission: readonly number[];
  vertexAlbedo: boolean;
}

const uvOf = (map: Texture): string => (map.channel === 1 ? 'uv1' : 'uv');

const transformOf = (map?: Texture | null): Matrix3 => {
  if (!map) return new Matrix3();
  if (map.matrixAutoUpdate) map.updateMatrix();
  return map.matrix;
};

/// Owns only itself; the textures belong to the model.
export function bakedMaterial({ unlit, glow, albedo, emission, vertexAlbedo }: BakedLook): ShaderMaterial {
  const [albedoMap, emissionMap] = [unlit.map, glow?.map ?? null];
  const defines: Record<string, string> = {};
  if (vertexAlbedo) defines.VERTEX_ALBEDO = '';
  if (albedoMap) [defines.ALBEDO_MAP, defines.ALBEDO_UV] = ['', uvOf(albedoMap)];
  if (emissionMap) [defines.EMISSION_MAP, defines.EMISSION_UV] = ['', uvOf(emissionMap)];
  if (albedoMap?.channel === 1 || emissionMap?.channel === 1) defines.USE_UV1_SET = '';
  return new ShaderMaterial({
    name: unlit.name,
    dithering: true, // soft shadows show bands in 8 bits
    vertexShader,
    fragmentShader,
    defines,
    uniforms: {
      albedo: { value: new Color().setRGB(albedo[0], albedo[1], albedo[2]) },
      alpha: { value: unlit.opacity },
      alphaCutoff: { value: unlit.alphaTest },
      emission: { value: glow?.factor ?? new Color().setRGB(emission[0], emission[1], emission[2]) },
      white: { value: false },
      albedoMap: { value: albedoMap },
      albedoMapTransform: { value: transformOf(albedoMap) },
      emissionMap: { value: emissionMap },
      emissionMapTransform: { value: transformOf(emissionMap) },
    },
    ...sides(unlit),
  });
}

const sides = ({ side, transparent, depthWrite }: Material) => ({
  side,
  transparent,
  depthWrite,
  polygonOffset: true, // leaves room for the wireframe in front
  polygonOffsetFactor: 1,
  polygonOffsetUnits: 1,
});
