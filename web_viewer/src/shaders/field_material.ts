// The material of light fields: what asset/light_field.ts says, for each fragment, with the three corners' r-RFs as they
// are. The geometry has three vertices of its own for each triangle (main/field_look.ts): a fragment must know its
// corners, and WebGL 2 does not tell. Harmonics are evaluated once, whatever the number of corners. Albedo, textures and
// emission are in the field; of the textures only the opacity counts.
//
// With PER_VERTEX the field is evaluated at the vertices and colours are interpolated (figure 6 of the paper): several
// times faster, and highlights break at edges.

import { DataTexture, type MeshBasicMaterial, RGBAIntegerFormat, ShaderMaterial, UnsignedIntType } from 'three';
import { type FieldTexels, fieldCount, halfAt, texelsOf } from '../asset/light_field';
import { sides, transformOf, uvOf } from './baked_material';
import { harmonicsCode } from './harmonics_code';

/// r-RFs as a texture, and the same r-RFs in its own memory, so that nobody need keep the first ones. No vertex is split
/// between two rows. Throws where it would be larger than `most` texels across.
export function fieldTexture(field: FieldTexels, most: number): { texture: DataTexture; texels: FieldTexels } {
  const { degree, halves } = field;
  const texels = texelsOf(degree);
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

/// radianceSeen(corners, weights, n, v): both unit, v towards the eye.
function fieldFunctions(degree: number): string {
  const products: string[][] = Array.from({ length: texelsOf(degree) }, (_, texel) => [
    `fetchEight(a, b, c, weights, ${texel}, low, high);`,
  ]);
  for (let c = 0; c < 3; ++c)
    for (let i = 0; i < fieldCount(degree); ++i) {
      const half = halfAt(degree, i, c);
      const one = `${half & 4 ? 'high' : 'low'}.${'xyzw'[half & 3]}`;
      products[half >> 3].push(`sum.${'rgb'[c]} += ${one} * y${i};`);
    }
  return /* glsl */ `
uniform highp usampler2D field;
uniform float fieldUnit;
ivec2 placeOf(int vertex) {
  int perRow = textureSize(field, 0).x / ${texelsOf(degree)};
  return ivec2((vertex % perRow) * ${texelsOf(degree)}, vertex / perRow);
}
vec4 four(uvec2 pairs) { return vec4(unpackHalf2x16(pairs.x), unpackHalf2x16(pairs.y)); }
void fetchEight(ivec2 a, ivec2 b, ivec2 c, vec3 weights, int texel, out vec4 low, out vec4 high) {
  ivec2 at = ivec2(texel, 0);
  uvec4 p = texelFetch(field, a + at, 0), q = texelFetch(field, b + at, 0), r = texelFetch(field, c + at, 0);
  low = weights.x * four(p.xy) + weights.y * four(q.xy) + weights.z * four(r.xy);
  high = weights.x * four(p.zw) + weights.y * four(q.zw) + weights.z * four(r.zw);
}
vec3 radianceSeen(ivec3 corners, vec3 weights, vec3 n, vec3 v) {
  float above = dot(n, v);
  vec3 raised = v - min(above, 0.0) * n;
  float size = length(raised);
  vec3 r = 2.0 * max(above, 0.0) * n - (size > 0.0 ? raised / size : n);
  float x = r.x, y = r.y, z = r.z;
  ${harmonicsCode(degree)}
  ivec2 a = placeOf(corners.x), b = placeOf(corners.y), c = placeOf(corners.z);
  vec3 sum = vec3(0.0);
  vec4 low, high;
  ${products.flat().join('\n  ')}
  return max(fieldUnit * sum, vec3(0.0));
}`;
}

// What is interpolated is taken inside the triangle: beside it weights would be negative.
const varyings = /* glsl */ `
#ifdef PER_VERTEX
centroid varying vec3 vSeen;
#else
flat varying ivec3 vCorners;
centroid varying vec3 vWeights;
centroid varying vec3 vNormal;
centroid varying vec3 vToEye;
#endif
#ifdef VERTEX_ALBEDO
varying float vAlpha;
#endif
#ifdef ALBEDO_MAP
varying vec2 vAlbedoUv;
#endif
`;

const vertexShader = (functions: string) => /* glsl */ `
${varyings}
attribute uvec3 corners;
#ifdef VERTEX_ALBEDO
attribute vec4 _albedo;
#endif
#ifdef ALBEDO_MAP
uniform mat3 albedoMapTransform;
#endif
#ifdef USE_UV1_SET
attribute vec2 uv1;
#endif
#ifdef PER_VERTEX
${functions}
#endif
void main() {
  int own = gl_VertexID % 3;
  vec3 n = mat3(modelMatrix) * normal;
  vec3 toEye = cameraPosition - (modelMatrix * vec4(position, 1.0)).xyz;
#ifdef PER_VERTEX
  ivec3 here = ivec3(int(corners[own]));
  vSeen = radianceSeen(here, vec3(1.0, 0.0, 0.0), normalize(n), normalize(toEye));
#else
  vCorners = ivec3(corners);
  vWeights = vec3(own == 0, own == 1, own == 2);
  vNormal = n;
  vToEye = toEye;
#endif
#ifdef VERTEX_ALBEDO
  vAlpha = _albedo.a;
#endif
#ifdef ALBEDO_MAP
  vAlbedoUv = (albedoMapTransform * vec3(ALBEDO_UV, 1.0)).xy;
#endif
  gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0);
}`;

const fragmentShader = (functions: string) => /* glsl */ `
${varyings}
uniform float alpha;
uniform float alphaCutoff;
#ifdef ALBEDO_MAP
uniform sampler2D albedoMap;
#endif
#ifndef PER_VERTEX
${functions}
#endif
#include <common>
#include <dithering_pars_fragment>
void main() {
  float opacity = alpha;
#ifdef VERTEX_ALBEDO
  opacity = vAlpha;
#endif
#ifdef ALBEDO_MAP
  opacity *= texture2D(albedoMap, vAlbedoUv).a;
#endif
  if (opacity < alphaCutoff) discard;
#ifdef PER_VERTEX
  vec3 seen = vSeen;
#else
  vec3 seen = radianceSeen(vCorners, vWeights, normalize(vNormal), normalize(vToEye));
#endif
  gl_FragColor = vec4(seen, opacity);
  #include <tonemapping_fragment>
  #include <colorspace_fragment>
  #include <dithering_fragment>
}`;

export interface FieldSurface {
  degree: number;
  texture: DataTexture; // of fieldTexture()
  unit: number; // of FieldTexels
  unlit: MeshBasicMaterial; // of scene 0: opacity and sides
  vertexAlbedo: boolean; // the geometry has `_albedo`
}

/// Owns only itself; the textures belong to others.
export function fieldMaterial(surface: FieldSurface, perVertex: boolean): ShaderMaterial {
  const { degree, texture, unit, unlit, vertexAlbedo } = surface;
  const defines: Record<string, string> = {};
  const map = unlit.transparent || unlit.alphaTest > 0 ? unlit.map : null;
  if (perVertex) defines.PER_VERTEX = '';
  if (vertexAlbedo) defines.VERTEX_ALBEDO = '';
  if (map) [defines.ALBEDO_MAP, defines.ALBEDO_UV] = ['', uvOf(map)];
  if (map?.channel === 1) defines.USE_UV1_SET = '';
  return new ShaderMaterial({
    name: unlit.name,
    dithering: true, // as the material of baked light
    vertexShader: vertexShader(fieldFunctions(degree)),
    fragmentShader: fragmentShader(fieldFunctions(degree)),
    defines,
    uniforms: {
      field: { value: texture },
      fieldUnit: { value: unit },
      alpha: { value: unlit.opacity },
      alphaCutoff: { value: unlit.alphaTest },
      albedoMap: { value: map },
      albedoMapTransform: { value: transformOf(map) },
    },
    ...sides(unlit),
  });
}
