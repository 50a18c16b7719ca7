// One number per vertex (attribute `measure`) as a colour of a scale. Never tone mapped: the legend must fit.

import { DoubleSide, ShaderMaterial } from 'three';
import { colourMapTexture, type ColourMapName } from './colour_maps';

const vertexShader = /* glsl */ `
attribute float measure;
centroid varying float vMeasure;
varying vec3 vView;
void main() {
  vMeasure = measure;
  vec4 view = modelViewMatrix * vec4(position, 1.0);
  vView = view.xyz;
  gl_Position = projectionMatrix * view;
}`;

const fragmentShader = /* glsl */ `
uniform sampler2D scale;
uniform vec2 range; // measures at the two ends of the scale
centroid varying float vMeasure;
varying vec3 vView;
void main() {
  float t = clamp((vMeasure - range.x) / (range.y - range.x), 0.0, 1.0);
  vec3 colour = texture2D(scale, vec2((255.0 * t + 0.5) / 256.0, 0.5)).rgb;
  // A hint of shape from the face's own normal; too little to be read as another value.
  vec3 normal = normalize(cross(dFdx(vView), dFdy(vView)));
  gl_FragColor = vec4(colour * (0.8 + 0.2 * abs(normal.z)), 1.0);
  #include <colorspace_fragment>
}`;

/// Disposing it disposes its scale texture too.
export function falseColourMaterial(map: ColourMapName, range: readonly [number, number]): ShaderMaterial {
  const scale = colourMapTexture(map);
  const material = new ShaderMaterial({
    vertexShader,
    fragmentShader,
    side: DoubleSide,
    toneMapped: false,
    // Used while a wireframe stands in front (wireframe.ts).
    polygonOffsetFactor: 1,
    polygonOffsetUnits: 1,
    uniforms: { scale: { value: scale }, range: { value: range[0] < range[1] ? [...range] : [0, 1] } },
  });
  material.addEventListener('dispose', () => scale.dispose());
  return material;
}
