// The material of baked light:  radiance = albedo * value + emission, then exposure, tone mapping and sRGB.
// Where a part has matrices (mirror.ts):
//   radiance = (1 - metallic) albedo (1 - 0.04 a - b) value + (F0 a + b) mirror + emission
//   F0 = mix(0.04, albedo, metallic)
// With a lightmap (LIGHTMAP: lightmap_view.ts) the value is its irradiance / pi, filtered at each pixel.
// With light from points (POINTS: points_view.ts) the value is that of the pixel.
// With a lamp that moves (LAMP: lamp_view.ts) its direct light is added to the value at each pixel:
//   lampIntensity cos / (pi d^2), a share of shadow taps free
//
// `value` (attribute `light`, linear RGB) was computed by the light worker; nothing here depends on the number of coefficients.
// Exposure and tone mapping are three's (renderer.toneMapping): the same for baked and original materials.

import { Color, type Material, Matrix3, type MeshBasicMaterial, ShaderMaterial, type Texture } from 'three';
import { lampFunctions } from './lamp_shadow';
import { lobeFunctions, lobeTexels, mirrorFunctions } from './mirror';

// What goes from one shader to the other. Light is taken inside the triangle: thin ones extrapolate it to any darkness.
const varyings = /* glsl */ `
centroid varying vec3 vLight;
#ifdef LAMP
varying vec3 vLampPlace;
varying vec3 vLampNormal;
#endif
#ifdef LIGHTMAP
varying vec2 vLightmapUv;
#endif
#ifdef VERTEX_ALBEDO
varying vec4 vAlbedo;
#endif
#ifdef ALBEDO_MAP
varying vec2 vAlbedoUv;
#endif
#ifdef EMISSION_MAP
varying vec2 vEmissionUv;
#endif
#ifdef MIRROR
centroid varying vec3 vMirror;
varying vec3 vNormal;
varying vec3 vToEye;
#ifdef FINISH_MAP
varying vec2 vFinishUv;
#endif
#endif
`;

const vertexShader = /* glsl */ `
${varyings}
attribute vec3 light;
#ifdef VERTEX_ALBEDO
attribute vec4 _albedo;
#endif
#if defined(USE_UV1_SET) || defined(LIGHTMAP)
attribute vec2 uv1;
#endif
#ifdef ALBEDO_MAP
uniform mat3 albedoMapTransform;
#endif
#ifdef EMISSION_MAP
uniform mat3 emissionMapTransform;
#endif

#ifdef MIRROR
uniform float roughness;
#ifdef FINISH_MAP
uniform sampler2D finishMap;
uniform mat3 finishMapTransform;
#endif
${lobeFunctions}
${mirrorFunctions}
#endif

void main() {
  vLight = light;
#ifdef LIGHTMAP
  vLightmapUv = uv1;
#endif
#ifdef LAMP
  vLampPlace = (modelMatrix * vec4(position, 1.0)).xyz;
  vLampNormal = mat3(modelMatrix) * normal;
#endif
#ifdef MIRROR
  float rough = roughness;
#ifdef FINISH_MAP
  vFinishUv = (finishMapTransform * vec3(FINISH_UV, 1.0)).xy;
  rough *= textureLod(finishMap, vFinishUv, 0.0).g;
#endif
  vNormal = mat3(modelMatrix) * normal;
  vToEye = cameraPosition - (modelMatrix * vec4(position, 1.0)).xyz;
  vMirror = mirrorAt(gl_VertexID, normalize(vNormal), normalize(vToEye), rough);
#endif
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
${varyings}
uniform vec3 albedo;
uniform float alpha;
uniform float alphaCutoff;
uniform vec3 emission;
uniform bool white;
#ifdef LIGHTMAP
uniform sampler2D lightmap;
#endif
#ifdef POINTS
uniform highp sampler2D pointLight;
#endif
#ifdef ALBEDO_MAP
uniform sampler2D albedoMap;
#endif
#ifdef EMISSION_MAP
uniform sampler2D emissionMap;
#endif
#ifdef MIRROR
uniform float metallic;
uniform float roughness;
#ifdef FINISH_MAP
uniform sampler2D finishMap;
#endif
${lobeFunctions}
/// What a surface of this base colour sends to the eye.
vec3 reflected(vec3 base, vec3 value) {
  vec2 finish = vec2(roughness, metallic);
#ifdef FINISH_MAP
  finish *= texture2D(finishMap, vFinishUv).gb;
#endif
  vec2 ab = lobeAt(dot(normalize(vNormal), normalize(vToEye)), finish.x, 0).xy;
  vec3 f0 = mix(vec3(0.04), base, finish.y);
  return (1.0 - finish.y) * base * (1.0 - 0.04 * ab.x - ab.y) * value + (f0 * ab.x + ab.y) * vMirror;
}
#else
vec3 reflected(vec3 base, vec3 value) { return base * value; }
#endif
#ifdef LAMP
uniform vec3 lampIntensity;
uniform float lampDirect;
uniform float lampGlow;
${lampFunctions}
vec3 lampLight() {
  vec3 way = lampPlace - vLampPlace;
  vec3 n = normalize(vLampNormal);
  float far2 = dot(way, way);
  float facing = dot(way, n);
  if (facing <= 0.0 || lampDirect == 0.0) return vec3(0.0);
  float seen = 0.0;
  for (int i = -1; i <= 1; ++i)
    for (int j = -1; j <= 1; ++j) seen += lampSeenAt(vLampPlace, n, vec2(float(i), float(j)));
  return lampIntensity * (lampDirect * seen / 9.0 * facing / (3.14159265 * far2 * sqrt(far2)));
}
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
#ifdef POINTS
  vec3 value = max(texelFetch(pointLight, ivec2(gl_FragCoord.xy), 0).rgb, vec3(0.0));
#elif defined(LIGHTMAP)
  vec3 value = texture2D(lightmap, vLightmapUv).rgb / 3.14159265;
#else
  vec3 value = max(vLight, vec3(0.0));
#endif
#ifdef LAMP
  value += lampLight();
  emitted *= lampGlow;
#endif
  gl_FragColor = vec4(white ? value : reflected(base.rgb, value) + emitted, base.a);
  #include <tonemapping_fragment>
  #include <colorspace_fragment>
  #include <dithering_fragment>
}`;

/// Emission through a texture, which the extension leaves to the original material.
export interface Glow {
  map: Texture;
  factor: Color;
}

/// Metalness and roughness. The texture belongs to the model.
export interface Finish {
  metallic: number;
  roughness: number;
  map: Texture | null; // G roughness, B metallic, as in glTF
}

/// How a part with matrices reflects.
export interface Mirrored extends Finish {
  arriving: Texture; // listTexture() of what arrives
  lobes: Texture;
  order: number; // of the matrices
}

export interface BakedLook {
  unlit: MeshBasicMaterial; // of scene 0: base colour texture, alpha mode, sides
  glow: Glow | null; // emission through a texture
  albedo: readonly number[];
  emission: readonly number[];
  vertexAlbedo: boolean;
  mirror: Mirrored | null; // it has matrices
}

export const uvOf = (map: Texture): string => (map.channel === 1 ? 'uv1' : 'uv');

export const transformOf = (map?: Texture | null): Matrix3 => {
  if (!map) return new Matrix3();
  if (map.matrixAutoUpdate) map.updateMatrix();
  return map.matrix;
};

/// Owns only itself; the textures belong to the model.
export function bakedMaterial({ unlit, glow, albedo, emission, vertexAlbedo, mirror }: BakedLook): ShaderMaterial {
  const [albedoMap, emissionMap, finishMap] = [unlit.map, glow?.map ?? null, mirror?.map ?? null];
  const defines: Record<string, string> = {};
  if (vertexAlbedo) defines.VERTEX_ALBEDO = '';
  if (albedoMap) [defines.ALBEDO_MAP, defines.ALBEDO_UV] = ['', uvOf(albedoMap)];
  if (emissionMap) [defines.EMISSION_MAP, defines.EMISSION_UV] = ['', uvOf(emissionMap)];
  if (finishMap) [defines.FINISH_MAP, defines.FINISH_UV] = ['', uvOf(finishMap)];
  if ([albedoMap, emissionMap, finishMap].some((map) => map?.channel === 1)) defines.USE_UV1_SET = '';
  if (mirror) {
    defines.MIRROR = '';
    defines.MIRROR_ORDER = `${mirror.order}`;
    defines.LOBE_TEXELS = `${lobeTexels(mirror.order)}`;
  }
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
      lightmap: { value: null },
      pointLight: { value: null },
      albedoMap: { value: albedoMap },
      albedoMapTransform: { value: transformOf(albedoMap) },
      emissionMap: { value: emissionMap },
      emissionMapTransform: { value: transformOf(emissionMap) },
      metallic: { value: mirror?.metallic ?? 0 },
      roughness: { value: mirror?.roughness ?? 1 },
      finishMap: { value: finishMap },
      finishMapTransform: { value: transformOf(finishMap) },
      arriving: { value: mirror?.arriving ?? null },
      lobes: { value: mirror?.lobes ?? null },
    },
    ...sides(unlit),
  });
}

/// Puts a lightmap in place of the light at the vertices; null: takes it away. The texture is the caller's.
export function showLightmap(material: ShaderMaterial, texture: Texture | null): void {
  material.uniforms.lightmap.value = texture;
  if (texture) material.defines.LIGHTMAP = '';
  else delete material.defines.LIGHTMAP;
  material.needsUpdate = true;
}

/// Puts light from points, a texel a pixel, in place of all other; null: takes it away. The texture is the caller's.
export function showPointLight(material: ShaderMaterial, texture: Texture | null): void {
  material.uniforms.pointLight.value = texture;
  if (texture) material.defines.POINTS = '';
  else delete material.defines.POINTS;
  material.needsUpdate = true;
}

export const sides = ({ side, transparent, depthWrite }: Material) => ({
  side,
  transparent,
  depthWrite,
  // Used while a wireframe stands in front (wireframe.ts).
  polygonOffsetFactor: 1,
  polygonOffsetUnits: 1,
});
