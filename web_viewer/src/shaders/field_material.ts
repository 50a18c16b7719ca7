// The material of light fields: what asset/light_field.ts says, for each fragment, with the three corners' r-RFs as they
// are. The geometry has three vertices of its own for each triangle (main/field_look.ts): a fragment must know its
// corners, and WebGL 2 does not tell. Harmonics are evaluated once, whatever the number of corners. Albedo, textures and
// emission are in the field; of the textures only the opacity counts. Where the field keeps the sky apart (sky_code.ts) or
// lamps (lamp_code.ts), base colour and finish say how a fragment mirrors them; where it keeps diffuse light apart, the
// fragment's colour multiplies it; where it keeps emission apart, that is the fragment's.
//
// With PER_VERTEX the field is evaluated at the vertices and colours are interpolated (figure 6 of the paper): several
// times faster, and highlights break at edges.

import {
  Color,
  type DataArrayTexture,
  DataTexture,
  type MeshBasicMaterial,
  RGBAIntegerFormat,
  ShaderMaterial,
  type Texture,
  UnsignedIntType,
} from 'three';
import {
  type FieldShape,
  type FieldTexels,
  diffuseHalfAt,
  fieldCount,
  halfAt,
  kLeastSeen,
  lampHalfAt,
  skyHalfAt,
  texelsOf,
} from '../asset/light_field';
import type { FieldLamp } from '../asset/field_lamps';
import { kVisibilityCount } from '../asset/mirrored_sky';
import { type Finish, type Glow, sides, transformOf, uvOf } from './baked_material';
import { harmonicsCode } from './harmonics_code';
import { lampFunctions, lampUniforms } from './lamp_code';
import { lobeFunctions } from './mirror';
import { skyFunctions } from './sky_code';

/// r-RFs as a texture, and the same r-RFs in its own memory, so that nobody need keep the first ones. No vertex is split
/// between two rows. Throws where it would be larger than `most` texels across.
export function fieldTexture(field: FieldTexels, most: number): { texture: DataTexture; texels: FieldTexels } {
  const { halves } = field;
  const texels = texelsOf(field);
  const perRow = Math.floor(most / texels);
  const vertices = halves.length / (8 * texels);
  const rows = Math.max(1, Math.ceil(vertices / perRow));
  if (rows > most)
    throw new Error(`The light field of ${vertices} vertices is larger than a texture may be here (${most}²).`);
  const [width, height] = rows === 1 ? [Math.max(1, vertices) * texels, 1] : [perRow * texels, rows];
  const own = new Uint16Array(8 * width * height);
  own.set(halves);
  const texture = new DataTexture(new Uint32Array(own.buffer), width, height, RGBAIntegerFormat, UnsignedIntType);
  texture.internalFormat = 'RGBA32UI';
  texture.needsUpdate = true;
  return { texture, texels: { ...field, halves: own } };
}

/// radianceSeen(corners, weights, place, n, v, surface): the place is of the unit cube, n and v are unit, v towards the eye.
function fieldFunctions(shape: FieldShape): string {
  const { degree } = shape;
  const products: string[][] = Array.from({ length: texelsOf(shape) }, (_, texel) => [
    `fetchEight(a, b, c, weights, ${texel}, low, high);`,
  ]);
  const put = (half: number, code: (one: string) => string) =>
    products[half >> 3].push(code(`${half & 4 ? 'high' : 'low'}.${'xyzw'[half & 3]}`));
  for (let c = 0; c < 3; ++c)
    for (let i = 0; i < fieldCount(degree); ++i)
      put(halfAt(degree, i, c), (one) => `sum.${'rgb'[c]} += ${one} * y${i};`);
  for (let c = 0; shape.sky && c < 3; ++c)
    put(halfAt(degree, 0, c), (one) => `least.${'rgb'[c]} = ${one};`);
  for (let i = 0; shape.sky && i < kVisibilityCount; ++i)
    put(skyHalfAt(degree, i), (one) => `visibility[${i}] = ${one};`);
  for (let c = 0; shape.diffuse && c < 3; ++c) put(diffuseHalfAt(shape, c), (one) => `diffuse.${'rgb'[c]} = ${one};`);
  for (let k = 0; k < shape.lamps; ++k) put(lampHalfAt(shape, k), (one) => `lamps[${k}] = ${one};`);
  return /* glsl */ `
uniform highp usampler2D field;
uniform float fieldUnit;
ivec2 placeOf(int vertex) {
  int perRow = textureSize(field, 0).x / ${texelsOf(shape)};
  return ivec2((vertex % perRow) * ${texelsOf(shape)}, vertex / perRow);
}
vec4 four(uvec2 pairs) { return vec4(unpackHalf2x16(pairs.x), unpackHalf2x16(pairs.y)); }
void fetchEight(ivec2 a, ivec2 b, ivec2 c, vec3 weights, int texel, out vec4 low, out vec4 high) {
  ivec2 at = ivec2(texel, 0);
  uvec4 p = texelFetch(field, a + at, 0), q = texelFetch(field, b + at, 0), r = texelFetch(field, c + at, 0);
  low = weights.x * four(p.xy) + weights.y * four(q.xy) + weights.z * four(r.xy);
  high = weights.x * four(p.zw) + weights.y * four(q.zw) + weights.z * four(r.zw);
}
${shape.sky || shape.diffuse ? `#define LOBE_TEXELS 1\n${lobeFunctions}` : ''}
${shape.sky ? skyFunctions : ''}
${shape.lamps > 0 ? lampFunctions(shape.lamps) : ''}
vec3 radianceSeen(ivec3 corners, vec3 weights, vec3 place, vec3 n, vec3 v, Surface surface) {
  float above = dot(n, v);
  vec3 raised = v - min(above, 0.0) * n;
  float size = length(raised);
  vec3 seen = size > 0.0 ? raised / size : n;
  vec3 r = 2.0 * max(above, 0.0) * n - seen;
  float x = r.x, y = r.y, z = r.z;
  ${harmonicsCode(degree)}
  ivec2 a = placeOf(corners.x), b = placeOf(corners.y), c = placeOf(corners.z);
  vec3 sum = vec3(0.0), least = vec3(0.0), diffuse = vec3(0.0);
  vec4 low, high;
  ${shape.sky ? `float visibility[${kVisibilityCount}];` : ''}
  ${shape.lamps > 0 ? `float lamps[${shape.lamps}];` : ''}
  ${products.flat().join('\n  ')}
  ${shape.diffuse ? sentCode(shape.sky) : ''}
  sum *= fieldUnit;
  ${shape.sky ? 'sum += mirroredSky(n, seen, surface.f0, surface.roughness, visibility);' : ''}
  ${shape.lamps > 0 ? 'sum += lampHighlights(place, n, seen, surface.f0, surface.roughness, lamps);' : ''}
  return max(sum, max(vec3(0.0), fieldUnit * ${kLeastSeen} * y0 * least));
}`;
}

/// Diffuse light that is kept apart goes through the specular layer and takes on the colour of the place.
const sentCode = (sky: boolean): string => /* glsl */ `
  vec2 kept = lobeAt(max(0.0, dot(n, seen)), surface.roughness, 0).xy;
  vec3 sent = surface.diffuse * diffuse * (1.0 - 0.04 * kept.x - kept.y);
  sum += sent;
  ${sky ? 'least += sent / y0;' : ''}`;

// What is interpolated is taken inside the triangle: beside it weights would be negative.
const varyings = /* glsl */ `
#ifdef PER_VERTEX
centroid varying vec3 vSeen;
#else
flat varying ivec3 vCorners;
centroid varying vec3 vWeights;
centroid varying vec3 vPlace;
centroid varying vec3 vNormal;
centroid varying vec3 vToEye;
#endif
#ifdef VERTEX_ALBEDO
varying vec4 vAlbedo;
#endif
#ifdef ALBEDO_MAP
varying vec2 vAlbedoUv;
#endif
#ifdef FINISH_MAP
varying vec2 vFinishUv;
#endif
#ifdef EMISSION_MAP
varying vec2 vEmissionUv;
#endif
`;

// Both shaders: base colour and opacity, and what of them mirrors.
const surfaceFunctions = /* glsl */ `
struct Surface {
  vec3 f0;
  vec3 diffuse; // (1 - metallic) base colour
  float roughness;
};
uniform vec4 albedo;
#ifdef ALBEDO_MAP
uniform sampler2D albedoMap;
#endif
uniform float metallic;
uniform float roughness;
#ifdef FINISH_MAP
uniform sampler2D finishMap;
#endif
vec4 baseHere() {
  vec4 base = albedo;
#ifdef VERTEX_ALBEDO
  base = vAlbedo;
#endif
#ifdef ALBEDO_MAP
  base *= textureHere(albedoMap, vAlbedoUv);
#endif
  return base;
}
Surface surfaceOf(vec3 base) {
  vec2 finish = vec2(roughness, metallic);
#ifdef FINISH_MAP
  finish *= textureHere(finishMap, vFinishUv).gb;
#endif
  return Surface(mix(vec3(0.04), base, finish.y), base * (1.0 - finish.y), finish.x);
}`;

const vertexShader = (functions: string) => /* glsl */ `
${varyings}
attribute uvec3 corners;
#ifdef VERTEX_ALBEDO
attribute vec4 _albedo;
#endif
#ifdef ALBEDO_MAP
uniform mat3 albedoMapTransform;
#endif
#ifdef FINISH_MAP
uniform mat3 finishMapTransform;
#endif
#ifdef EMISSION_MAP
uniform mat3 emissionMapTransform;
#endif
#ifdef USE_UV1_SET
attribute vec2 uv1;
#endif
#ifdef PER_VERTEX
vec4 textureHere(sampler2D map, vec2 uv) { return textureLod(map, uv, 0.0); }
${surfaceFunctions}
${functions}
#endif
void main() {
  int own = gl_VertexID % 3;
  vec3 n = mat3(modelMatrix) * normal;
  vec3 toEye = cameraPosition - (modelMatrix * vec4(position, 1.0)).xyz;
#ifdef VERTEX_ALBEDO
  vAlbedo = _albedo;
#endif
#ifdef ALBEDO_MAP
  vAlbedoUv = (albedoMapTransform * vec3(ALBEDO_UV, 1.0)).xy;
#endif
#ifdef FINISH_MAP
  vFinishUv = (finishMapTransform * vec3(FINISH_UV, 1.0)).xy;
#endif
#ifdef EMISSION_MAP
  vEmissionUv = (emissionMapTransform * vec3(EMISSION_UV, 1.0)).xy;
#endif
#ifdef PER_VERTEX
  ivec3 here = ivec3(int(corners[own]));
  vSeen = radianceSeen(here, vec3(1.0, 0.0, 0.0), position, normalize(n), normalize(toEye), surfaceOf(baseHere().rgb));
#else
  vCorners = ivec3(corners);
  vWeights = vec3(own == 0, own == 1, own == 2);
  vPlace = position;
  vNormal = n;
  vToEye = toEye;
#endif
  gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0);
}`;

const fragmentShader = (functions: string) => /* glsl */ `
${varyings}
uniform float alphaCutoff;
uniform vec3 emission;
#ifdef EMISSION_MAP
uniform sampler2D emissionMap;
#endif
vec4 textureHere(sampler2D map, vec2 uv) { return texture2D(map, uv); }
${surfaceFunctions}
#ifndef PER_VERTEX
${functions}
#endif
#include <common>
#include <dithering_pars_fragment>
void main() {
  vec4 base = baseHere();
  if (base.a < alphaCutoff) discard;
#ifdef PER_VERTEX
  vec3 seen = vSeen;
#else
  vec3 seen = radianceSeen(vCorners, vWeights, vPlace, normalize(vNormal), normalize(vToEye), surfaceOf(base.rgb));
#endif
  vec3 emitted = emission;
#ifdef EMISSION_MAP
  emitted *= textureHere(emissionMap, vEmissionUv).rgb;
#endif
  gl_FragColor = vec4(seen + emitted, base.a);
  #include <tonemapping_fragment>
  #include <colorspace_fragment>
  #include <dithering_fragment>
}`;

/// The sky of a light field.
export interface SkyLook {
  texture: DataArrayTexture;
  unit: number;
}

export interface FieldSurface {
  shape: FieldShape;
  texture: DataTexture; // of fieldTexture()
  unit: number; // of FieldTexels
  unlit: MeshBasicMaterial; // of scene 0: base colour texture, opacity and sides
  albedo: readonly number[];
  finish: Finish | null;
  glow: Glow | null;
  emission: readonly number[]; // without glow
  sky: SkyLook | null;
  lamps: readonly FieldLamp[];
  lobes: Texture | null; // the table (mirror.ts), where the sky or diffuse light is apart
  vertexAlbedo: boolean; // the geometry has `_albedo`
}

/// Owns only itself; the textures belong to others.
export function fieldMaterial(surface: FieldSurface, perVertex: boolean): ShaderMaterial {
  const { shape, texture, unit, unlit, albedo, finish, glow, emission, sky, lamps, lobes, vertexAlbedo } = surface;
  const coloured = shape.sky || shape.lamps > 0 || shape.diffuse;
  const defines: Record<string, string> = {};
  const map = coloured || unlit.transparent || unlit.alphaTest > 0 ? unlit.map : null;
  const finishMap = coloured ? (finish?.map ?? null) : null;
  const emissionMap = shape.emission ? (glow?.map ?? null) : null;
  const emitted = !shape.emission ? new Color(0) : (glow?.factor ?? new Color().setRGB(emission[0], emission[1], emission[2]));
  if (perVertex) defines.PER_VERTEX = '';
  if (vertexAlbedo) defines.VERTEX_ALBEDO = '';
  if (map) [defines.ALBEDO_MAP, defines.ALBEDO_UV] = ['', uvOf(map)];
  if (finishMap) [defines.FINISH_MAP, defines.FINISH_UV] = ['', uvOf(finishMap)];
  if (emissionMap) [defines.EMISSION_MAP, defines.EMISSION_UV] = ['', uvOf(emissionMap)];
  if ([map, finishMap, emissionMap].some((one) => one?.channel === 1)) defines.USE_UV1_SET = '';
  const functions = fieldFunctions(shape);
  const { r, g, b } = new Color().setRGB(albedo[0], albedo[1], albedo[2]);
  return new ShaderMaterial({
    name: unlit.name,
    dithering: true, // as the material of baked light
    vertexShader: vertexShader(functions),
    fragmentShader: fragmentShader(functions),
    defines,
    uniforms: {
      field: { value: texture },
      fieldUnit: { value: unit },
      sky: { value: sky?.texture ?? null },
      skyUnit: { value: sky?.unit ?? 1 },
      lobes: { value: lobes },
      ...lampUniforms(lamps.slice(0, shape.lamps)),
      albedo: { value: [r, g, b, unlit.opacity] },
      alphaCutoff: { value: unlit.alphaTest },
      albedoMap: { value: map },
      albedoMapTransform: { value: transformOf(map) },
      metallic: { value: finish?.metallic ?? 0 },
      roughness: { value: finish?.roughness ?? 1 },
      finishMap: { value: finishMap },
      finishMapTransform: { value: transformOf(finishMap) },
      emission: { value: emitted },
      emissionMap: { value: emissionMap },
      emissionMapTransform: { value: transformOf(emissionMap) },
    },
    ...sides(unlit),
  });
}
