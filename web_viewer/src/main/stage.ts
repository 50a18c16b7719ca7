// The renderer, the camera and its controls. Draws only when asked to; between two requests nothing runs.
// Nothing is drawn before the first drawNow(), so that no picture without light is made.

import {
  ACESFilmicToneMapping,
  Box3,
  LinearToneMapping,
  MOUSE,
  NeutralToneMapping,
  PerspectiveCamera,
  Scene,
  Sphere,
  type ToneMapping,
  Vector3,
  WebGLRenderer,
} from 'three';
import { OrbitControls } from 'three/addons/controls/OrbitControls.js';
import { ShoulderToneMapping } from '../shaders/tone_map';
import { FinePicture, kFinest } from './fine_picture';
import type { ToneMap } from './view_state';
import { pixelRatio } from './webgl';

const kToneMappings: Record<ToneMap, ToneMapping> = {
  baked: ShoulderToneMapping,
  neutral: NeutralToneMapping,
  aces: ACESFilmicToneMapping,
  none: LinearToneMapping, // exposure and clamping only
};

/// Camera place and target in units of the model's radius about its centre: it fits any scale, and short numbers do.
export type CameraPose = readonly [number, number, number, number, number, number];

const kPlainBackground = 0x5b5e64; // about that of preview.png

// The first picture is framed as preview.png is (core/bake/preview.cpp): one takes the place of the other.
export const kDefaultPose: CameraPose = [0.9, 0.84, 1.8, 0, 0, 0];
const kHalfView = 0.32; // tangent of half the vertical angle of a 3:2 picture, all of which any canvas shows
const kHalfWidth = 1.5 * kHalfView;
const kMargin = 1.06;

export class Stage {
  readonly scene = new Scene();
  readonly camera = new PerspectiveCamera();
  readonly renderer: WebGLRenderer;
  readonly controls: OrbitControls;
  /// Called in place of the plain draw when set (the comparison draws two halves).
  drawWith: ((width: number, height: number) => void) | null = null;
  /// Called in place of a plain picture of the scene when set (a difference draws two and compares them).
  drawModel: (() => void) | null = null;
  onDrawn: (() => void) | null = null;
  onMoved: (() => void) | null = null;
  /// Whether a model that is small gets several samples a pixel.
  fine = false;
  private finePicture: FinePicture | null = null;
  private readonly box = new Box3();
  private readonly bounds = new Sphere(new Vector3(), 1);
  private readonly resizes: ResizeObserver;
  private frame = -1; // that of the animation; -1: nothing is to be drawn, not yet or no more

  constructor(
    readonly canvas: HTMLCanvasElement,
    context: WebGL2RenderingContext,
  ) {
    this.renderer = new WebGLRenderer({ canvas, context });
    this.renderer.info.autoReset = true;
    this.renderer.setClearColor(kPlainBackground);
    this.controls = new OrbitControls(this.camera, canvas);
    this.controls.mouseButtons = { LEFT: MOUSE.ROTATE, MIDDLE: MOUSE.DOLLY, RIGHT: MOUSE.PAN };
    this.controls.addEventListener('change', () => {
      this.requestDraw();
      this.onMoved?.();
    });
    this.resizes = new ResizeObserver(() => this.resize());
    this.resizes.observe(canvas);
    canvas.addEventListener('webglcontextrestored', this.requestDraw);
    this.resize();
  }

  requestDraw = (): void => {
    if (this.frame === 0) this.frame = requestAnimationFrame(() => this.drawNow());
  };

  drawNow(): void {
    cancelAnimationFrame(this.frame);
    this.frame = 0;
    this.fitPlanes();
    const { clientWidth, clientHeight } = this.canvas;
    if (this.drawWith) this.drawWith(clientWidth, clientHeight);
    else this.drawScene();
    this.onDrawn?.();
  }

  drawScene(): void {
    if (this.drawModel) return this.drawModel();
    this.renderer.render(this.scene, this.camera);
    if (!this.fine || this.pixelsAcross >= kFinest) return;
    this.finePicture ??= new FinePicture(this.renderer);
    this.finePicture.draw(this.scene, this.camera, this.box, this.pixelsAcross);
  }

  /// Sets the driver to what the next picture needs. Without it that picture waits for one shader after the other.
  compile(): void {
    this.renderer.compile(this.scene, this.camera);
  }

  setLook(exposure: number, toneMap: ToneMap): void {
    this.renderer.toneMapping = kToneMappings[toneMap];
    this.renderer.toneMappingExposure = exposure;
    this.requestDraw();
  }

  /// The model's place and size: framing, near and far planes follow from it.
  setBounds(box: Box3): void {
    this.box.copy(box);
    if (!box.isEmpty()) box.getBoundingSphere(this.bounds);
    if (!(this.bounds.radius > 0)) this.bounds.radius = 1;
    this.controls.minDistance = 0.02 * this.bounds.radius;
    this.controls.maxDistance = 200 * this.bounds.radius; // some twelve pixels, the smallest that levels are compared at
  }

  get radius(): number {
    return this.bounds.radius;
  }

  /// Of the sphere around the model on the drawn picture; infinite inside it.
  get pixelsAcross(): number {
    const { center, radius } = this.bounds;
    const distance = this.camera.position.distanceTo(center);
    if (distance <= radius) return Infinity;
    const focal = this.renderer.getContext().drawingBufferHeight / 2 / Math.tan((this.camera.fov * Math.PI) / 360);
    return (2 * focal * radius) / Math.sqrt(distance * distance - radius * radius);
  }

  get pose(): CameraPose {
    const { center, radius } = this.bounds;
    const place = this.camera.position.clone().sub(center).divideScalar(radius);
    const target = this.controls.target.clone().sub(center).divideScalar(radius);
    return [place.x, place.y, place.z, target.x, target.y, target.z];
  }

  set pose(pose: CameraPose) {
    const { center, radius } = this.bounds;
    this.camera.position.set(pose[0], pose[1], pose[2]).multiplyScalar(radius).add(center);
    this.controls.target.set(pose[3], pose[4], pose[5]).multiplyScalar(radius).add(center);
    this.controls.update();
    this.requestDraw();
  }

  /// Moves back along the present direction until the whole model is seen.
  frameModel(): void {
    const { center, radius } = this.bounds;
    const direction = this.camera.position.clone().sub(this.controls.target).normalize();
    this.controls.target.copy(center);
    this.camera.position.copy(center).addScaledVector(direction, radius);
    this.camera.lookAt(center);
    this.camera.position.copy(center).addScaledVector(direction, this.framingDistance());
    this.controls.update();
    this.requestDraw();
  }

  /// How far from the centre the camera must stand to have every corner of the box in the 3:2 picture, with a margin.
  private framingDistance(): number {
    const turn = this.camera.quaternion.clone().invert();
    let distance = 0.1 * this.bounds.radius;
    for (let corner = 0; corner < 8; ++corner) {
      const pick = (bit: number, axis: 'x' | 'y' | 'z') => (corner & bit ? this.box.max[axis] : this.box.min[axis]);
      const seen = new Vector3(pick(1, 'x'), pick(2, 'y'), pick(4, 'z')).sub(this.bounds.center).applyQuaternion(turn);
      distance = Math.max(distance, seen.z + kMargin * Math.max(Math.abs(seen.x) / kHalfWidth, Math.abs(seen.y) / kHalfView));
    }
    return distance;
  }

  /// As near as the model allows: depth is told apart by a near plane's share of the distance, and a contact line is
  /// where two depths are alike.
  private fitPlanes(): void {
    const { center, radius } = this.bounds;
    const distance = this.camera.position.distanceTo(center);
    this.camera.near = Math.max(0.005 * radius, 0.9 * (distance - radius));
    this.camera.far = distance + 64 * radius;
    this.camera.updateProjectionMatrix();
  }

  private resize(): void {
    const { clientWidth, clientHeight } = this.canvas;
    if (clientWidth === 0 || clientHeight === 0) return;
    this.renderer.setDrawingBufferSize(clientWidth, clientHeight, pixelRatio());
    this.camera.aspect = clientWidth / clientHeight;
    this.camera.fov = (360 / Math.PI) * Math.atan(Math.max(kHalfView, kHalfWidth / this.camera.aspect));
    this.camera.updateProjectionMatrix();
    if (this.frame >= 0) this.drawNow(); // a resized canvas is blank: do not wait for the next frame
  }

  dispose(): void {
    cancelAnimationFrame(this.frame);
    this.frame = -1; // no request starts a frame any more
    this.resizes.disconnect();
    this.canvas.removeEventListener('webglcontextrestored', this.requestDraw);
    this.controls.dispose();
    this.finePicture?.dispose();
    this.renderer.dispose();
    this.renderer.forceContextLoss(); // the GPU's memory now, not when the garbage collector comes by
  }
}
