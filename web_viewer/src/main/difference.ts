// Two pictures of the model from the same eye, and how far they are apart at each pixel, as a colour:
//   max over channels of exposure * |radiance_a - radiance_b|       1 is what shows as white
// Radiance is compared before tone mapping.

import { HalfFloatType, Mesh, type Object3D, OrthographicCamera, PlaneGeometry, Scene, ShaderMaterial, Vector2,
  WebGLRenderTarget } from 'three';
import { colourMapTexture } from '../shaders/colour_maps';
import type { Stage } from './stage';

export const kDifferenceRange: readonly [number, number] = [0, 0.2];

const vertexShader = /* glsl */ `
varying vec2 vUv;
void main() {
  vUv = uv;
  gl_Position = vec4(position.xy, 0.0, 1.0);
}`;

const fragmentShader = /* glsl */ `
uniform sampler2D first, second, scale;
uniform float exposure;
varying vec2 vUv;
void main() {
  vec4 a = texture2D(first, vUv), b = texture2D(second, vUv);
  vec3 apart = exposure * abs(a.rgb - b.rgb);
  float t = clamp(max(apart.r, max(apart.g, apart.b)) / ${kDifferenceRange[1].toFixed(3)}, 0.0, 1.0);
  gl_FragColor = vec4(texture2D(scale, vec2((255.0 * t + 0.5) / 256.0, 0.5)).rgb, max(a.a, b.a));
  #include <colorspace_fragment>
}`;

/// What stands in the scene for one of the two pictures.
export type Side = () => void;

export class Difference {
  private readonly targets = [0, 1].map(() => new WebGLRenderTarget(1, 1, { type: HalfFloatType, samples: 4 }));
  private readonly scale = colourMapTexture('viridis');
  private readonly material = new ShaderMaterial({
    vertexShader,
    fragmentShader,
    transparent: true,
    depthTest: false,
    toneMapped: false,
    uniforms: {
      first: { value: this.targets[0].texture },
      second: { value: this.targets[1].texture },
      scale: { value: this.scale },
      exposure: { value: 1 },
    },
  });
  private readonly plane = new Mesh(new PlaneGeometry(2, 2), this.material);
  private readonly scene = new Scene().add(this.plane);
  private readonly camera = new OrthographicCamera();

  /// `sides` are set up one after the other, the first one last of all again; `hidden` is in no picture.
  constructor(
    private readonly stage: Stage,
    private readonly sides: readonly [Side, Side],
    private readonly hidden: Object3D,
  ) {
    this.plane.frustumCulled = false;
    stage.drawModel = () => this.draw();
  }

  private draw(): void {
    const { renderer, scene, camera } = this.stage;
    const size = renderer.getDrawingBufferSize(new Vector2());
    const visible = this.hidden.visible;
    this.hidden.visible = false;
    renderer.setClearAlpha(0);
    this.targets.forEach((target, i) => {
      this.sides[i]();
      target.setSize(size.x, size.y);
      renderer.setRenderTarget(target);
      renderer.render(scene, camera);
    });
    renderer.setRenderTarget(null);
    renderer.setClearAlpha(1);
    this.hidden.visible = visible;
    this.sides[0]();
    this.material.uniforms.exposure.value = renderer.toneMappingExposure;
    renderer.render(this.scene, this.camera);
  }

  dispose(): void {
    this.stage.drawModel = null;
    for (const target of this.targets) target.dispose();
    this.plane.geometry.dispose();
    this.material.dispose();
    this.scale.dispose();
  }
}
