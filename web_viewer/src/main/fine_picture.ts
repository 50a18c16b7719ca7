// Many samples a pixel where the model is small. A mirror that bends within a pixel shows another part of the sky at each
// place of it, so that one sample a pixel flickers, and any change of the triangles is seen. So the square of the picture
// that holds the model is drawn again, s times as large,
//   s = ceil(kFinest / pixels across the sphere around the model)
// and each pixel is the mean of s x s samples as the display would show them: what core/bake/level_switch.h compares.
// Transparent surfaces are tone mapped with what is behind them; outlines are averages too, of light and not of its code.

import {
  Color,
  GLSL3,
  HalfFloatType,
  Matrix4,
  Mesh,
  NearestFilter,
  OrthographicCamera,
  PlaneGeometry,
  Scene,
  ShaderMaterial,
  Vector2,
  Vector3,
  Vector4,
  WebGLRenderTarget,
} from 'three';
import type { Box3, PerspectiveCamera, WebGLRenderer } from 'three';

export const kFinest = 384; // samples across the sphere, at least: LevelPictures::kFinest
const kSide = 1024; // texels of the target
const kMost = 32; // samples a side of a pixel: the smallest size that levels are compared at has so many

const vertexShader = /* glsl */ `
uniform vec4 square; // clip coordinates of its corners
void main() {
  gl_Position = vec4(mix(square.xy, square.zw, uv), 0.0, 1.0);
}`;

const fragmentShader = /* glsl */ `
uniform sampler2D samples;
uniform int times;
uniform vec2 corner; // pixel of the square's first one
uniform vec3 background;
layout(location = 0) out highp vec4 pc_fragColor;
#define gl_FragColor pc_fragColor
void main() {
  ivec2 first = (ivec2(gl_FragCoord.xy) - ivec2(corner)) * times;
  vec3 sum = vec3(0.0);
  for (int y = 0; y < times; ++y) {
    for (int x = 0; x < times; ++x) {
      vec4 one = texelFetch(samples, first + ivec2(x, y), 0);
      vec3 light = one.rgb;
#ifdef TONE_MAPPING
      light = toneMapping(light);
#endif
      sum += mix(background, light, one.a);
    }
  }
  gl_FragColor = vec4(sum / float(times * times), 1.0);
  #include <colorspace_fragment>
}`;

/// Pixels of the drawing buffer, counted from its lower left corner.
interface Square {
  x: number;
  y: number;
  width: number;
  height: number;
}

export class FinePicture {
  private readonly target = new WebGLRenderTarget(kSide, kSide, {
    type: HalfFloatType,
    minFilter: NearestFilter,
    magFilter: NearestFilter,
  });
  private readonly material = new ShaderMaterial({
    glslVersion: GLSL3,
    vertexShader,
    fragmentShader,
    depthTest: false,
    depthWrite: false,
    uniforms: {
      samples: { value: this.target.texture },
      times: { value: 1 },
      corner: { value: new Vector2() },
      square: { value: new Vector4() },
      background: { value: new Color() },
    },
  });
  private readonly plane = new Mesh(new PlaneGeometry(2, 2), this.material);
  private readonly scene = new Scene().add(this.plane);
  private readonly camera = new OrthographicCamera();

  constructor(private readonly renderer: WebGLRenderer) {
    this.plane.frustumCulled = false;
  }

  /// Over a picture of the scene that has been drawn. `across`: pixels of the sphere around the model, which is in `box`.
  draw(scene: Scene, camera: PerspectiveCamera, box: Box3, across: number): void {
    const { renderer, target, material } = this;
    const size = renderer.getDrawingBufferSize(new Vector2());
    const square = squareAround(box, camera, size);
    if (!square) return;
    const { x, y, width, height } = square;
    const most = Math.floor(kSide / Math.max(width, height));
    const times = Math.min(Math.ceil(kFinest / across), kMost, most);
    if (times < 2) return;
    target.viewport.set(0, 0, times * width, times * height);
    camera.setViewOffset(size.x, size.y, x, size.y - y - height, width, height);
    renderer.setRenderTarget(target);
    renderer.setClearAlpha(0);
    renderer.render(scene, camera);
    renderer.setClearAlpha(1);
    renderer.setRenderTarget(null);
    camera.clearViewOffset();
    const { uniforms } = material;
    uniforms.times.value = times;
    uniforms.corner.value.set(x, y);
    const clip = (pixel: number, all: number) => (2 * pixel) / all - 1;
    uniforms.square.value.set(clip(x, size.x), clip(y, size.y), clip(x + width, size.x), clip(y + height, size.y));
    renderer.getClearColor(uniforms.background.value);
    const { autoClear } = renderer;
    renderer.autoClear = false;
    renderer.render(this.scene, this.camera);
    renderer.autoClear = autoClear;
  }

  dispose(): void {
    this.target.dispose();
    this.plane.geometry.dispose();
    this.material.dispose();
  }
}

/// Whole pixels, one more than needed on each side, cut to the canvas; null: nothing of the box is on it, or some of it is
/// behind the eye.
function squareAround(box: Box3, camera: PerspectiveCamera, size: Vector2): Square | null {
  camera.updateMatrixWorld();
  const toClip = new Matrix4().multiplyMatrices(camera.projectionMatrix, camera.matrixWorldInverse);
  const [low, high] = [new Vector2(Infinity, Infinity), new Vector2(-Infinity, -Infinity)];
  for (let corner = 0; corner < 8; ++corner) {
    const pick = (bit: number, axis: 'x' | 'y' | 'z') => (corner & bit ? box.max[axis] : box.min[axis]);
    const place = new Vector3(pick(1, 'x'), pick(2, 'y'), pick(4, 'z'));
    if (place.clone().applyMatrix4(camera.matrixWorldInverse).z >= 0) return null;
    place.applyMatrix4(toClip);
    const pixel = new Vector2(((place.x + 1) / 2) * size.x, ((place.y + 1) / 2) * size.y);
    low.min(pixel);
    high.max(pixel);
  }
  const cut = (value: number, most: number) => Math.min(Math.max(value, 0), most);
  const [x, y] = [cut(Math.floor(low.x) - 1, size.x), cut(Math.floor(low.y) - 1, size.y)];
  const [width, height] = [cut(Math.ceil(high.x) + 1, size.x) - x, cut(Math.ceil(high.y) + 1, size.y) - y];
  return width > 0 && height > 0 ? { x, y, width, height } : null;
}
