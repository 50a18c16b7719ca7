// The light itself behind the model: a picture of the sphere on a triangle that covers the screen.
//   u = 0.5 + atan2(z, x) / (2 pi),   v from the top = 0.5 - asin(y) / pi

import {
  BufferGeometry,
  Float32BufferAttribute,
  Matrix4,
  Mesh,
  type PerspectiveCamera,
  ShaderMaterial,
  type Texture,
} from 'three';

const vertexShader = /* glsl */ `
uniform mat4 viewToWorld;
varying vec3 vDirection;
void main() {
  gl_Position = vec4(position.xy, 1.0, 1.0);
  vec4 view = inverse(projectionMatrix) * vec4(position.xy, 1.0, 1.0);
  vDirection = mat3(viewToWorld) * (view.xyz / view.w);
}`;

const fragmentShader = /* glsl */ `
uniform sampler2D sky;
uniform float rotation;  // radians about +Y, +Z towards +X
uniform float intensity;
varying vec3 vDirection;
#include <common>
#include <dithering_pars_fragment>
void main() {
  vec3 w = normalize(vDirection);
  float c = cos(rotation), s = sin(rotation);
  vec3 d = vec3(c * w.x - s * w.z, w.y, s * w.x + c * w.z);
  vec2 uv = vec2(0.5 + atan(d.z, d.x) / 6.283185307179586, 0.5 - asin(clamp(d.y, -1.0, 1.0)) / 3.141592653589793);
  gl_FragColor = vec4(max(vec3(0.0), intensity * textureLod(sky, uv, 0.0).rgb), 1.0);
  #include <tonemapping_fragment>
  #include <colorspace_fragment>
  #include <dithering_fragment>
}`;

/// Owns its triangle and material, not the texture it shows.
export class SkyBackground {
  private readonly material = new ShaderMaterial({
    vertexShader,
    fragmentShader,
    dithering: true, // a sky changes slowly: 8 bits alone show as bands
    depthTest: false,
    depthWrite: false,
    uniforms: {
      sky: { value: null },
      rotation: { value: 0 },
      intensity: { value: 1 },
      viewToWorld: { value: new Matrix4() },
    },
  });
  readonly mesh = new Mesh(new BufferGeometry(), this.material);

  constructor() {
    this.mesh.geometry.setAttribute('position', new Float32BufferAttribute([-1, -1, 0, 3, -1, 0, -1, 3, 0], 3));
    this.mesh.frustumCulled = false;
    this.mesh.renderOrder = -1;
    this.mesh.onBeforeRender = (_renderer, _scene, camera) => {
      this.material.uniforms.viewToWorld.value.copy((camera as PerspectiveCamera).matrixWorld);
      this.material.uniformsNeedUpdate = true;
    };
  }

  show(sky: Texture | null, rotationDegrees: number, intensity: number): void {
    this.mesh.visible = sky !== null;
    this.material.uniforms.sky.value = sky;
    this.material.uniforms.rotation.value = (rotationDegrees * Math.PI) / 180;
    this.material.uniforms.intensity.value = intensity;
  }

  dispose(): void {
    this.mesh.removeFromParent();
    this.mesh.geometry.dispose();
    this.material.dispose();
  }
}
