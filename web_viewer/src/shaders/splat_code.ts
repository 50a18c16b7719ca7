// Light on points, splatted (Lehtinen et al. 2007, section 6.2), in three kinds of passes over float targets:
//   1. place and normal of what each pixel shows, in the coordinates of the points
//   2. for each level, added up over its points:  (w_j a_j, w_j),  w_j = K(|p - x_j| / r_j) max(0, n . n_j)
//   3. for each level, added to the light:  sum of w_j a_j / sum of w_j, where that is above 1e-12
// A point is drawn as the rectangle that holds the box around its ball; where the near plane cuts that, as the screen.

export const surfaceVertex = /* glsl */ `
out vec3 vPlace;
out vec3 vNormal;
void main() {
  vPlace = position;
  vNormal = normal;
  gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0);
}`;

export const surfaceFragment = /* glsl */ `
in vec3 vPlace;
in vec3 vNormal;
layout(location = 0) out vec4 place;
layout(location = 1) out vec4 facing;
void main() {
  place = vec4(vPlace, 1.0);
  facing = vec4(normalize(vNormal), 1.0);
}`;

export const splatVertex = /* glsl */ `
in vec4 site;
in vec3 siteNormal;
in vec3 coefficient;
uniform float near;
flat out vec4 vSite;
flat out vec3 vSiteNormal;
flat out vec3 vCoefficient;
void main() {
  vSite = site;
  vSiteNormal = siteNormal;
  vCoefficient = coefficient;
  vec3 c = (modelViewMatrix * vec4(site.xyz, 1.0)).xyz;
  float r = site.w * length(modelMatrix[0].xyz);
  float first = -c.z - r, last = -c.z + r;
  gl_Position = vec4(position.xy, 0.0, 1.0);
  if (last < near) gl_Position = vec4(2.0, 2.0, 2.0, 1.0);
  if (first <= near) return;
  vec2 focal = vec2(projectionMatrix[0][0], projectionMatrix[1][1]);
  vec2 low = focal * min((c.xy - r) / first, (c.xy - r) / last), high = focal * max((c.xy + r) / first, (c.xy + r) / last);
  gl_Position.xy = mix(low, high, 0.5 * position.xy + 0.5);
}`;

export const splatFragment = /* glsl */ `
flat in vec4 vSite;
flat in vec3 vSiteNormal;
flat in vec3 vCoefficient;
uniform highp sampler2D places;
uniform highp sampler2D normals;
out vec4 sum;
void main() {
  ivec2 at = ivec2(gl_FragCoord.xy);
  vec4 n = texelFetch(normals, at, 0);
  if (n.w == 0.0) discard;
  float r = distance(texelFetch(places, at, 0).xyz, vSite.xyz) / vSite.w;
  float w = ((2.0 * r - 3.0) * r * r + 1.0) * dot(n.xyz, vSiteNormal);
  if (r >= 1.0 || w <= 0.0) discard;
  sum = vec4(w * vCoefficient, w);
}`;

export const levelVertex = /* glsl */ `
void main() { gl_Position = vec4(position.xy, 0.0, 1.0); }`;

export const levelFragment = /* glsl */ `
uniform highp sampler2D sums;
out vec4 light;
void main() {
  vec4 sum = texelFetch(sums, ivec2(gl_FragCoord.xy), 0);
  light = sum.w > 1e-12 ? vec4(sum.rgb / sum.w, 1.0) : vec4(0.0);
}`;
