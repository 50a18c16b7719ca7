// Light from the points that it was solved on, splatted level by level, in place of the light at the vertices; and the points
// themselves, those whose coefficients matter (figure 4 of Lehtinen et al. 2007).

import {
  AddEquation,
  BufferAttribute,
  BufferGeometry,
  Color,
  CustomBlending,
  DoubleSide,
  FloatType,
  GLSL3,
  InstancedBufferAttribute,
  InstancedBufferGeometry,
  Mesh,
  NearestFilter,
  OneFactor,
  PlaneGeometry,
  Points,
  PointsMaterial,
  Scene,
  ShaderMaterial,
  Vector2,
  WebGLRenderTarget,
} from 'three';
import type { PointField } from '../asset/point_field';
import { showPointLight } from '../shaders/baked_material';
import * as code from '../shaders/splat_code';
import type { Viewer } from './viewer';

const kDotPixels = 4;
const kDotLift = 0.002; // of the unit cube, off the surface
const kMatters = 0.02; // of the mean light: smaller coefficients are no dots

const added = {
  blending: CustomBlending,
  blendEquation: AddEquation,
  blendSrc: OneFactor,
  blendDst: OneFactor,
  depthTest: false,
  depthWrite: false,
  transparent: true,
  toneMapped: false,
  glslVersion: GLSL3,
} as const;

const target = (count: number, depthBuffer: boolean) =>
  new WebGLRenderTarget(1, 1, { count, type: FloatType, minFilter: NearestFilter, magFilter: NearestFilter, depthBuffer });

export class PointsView {
  /// What is shown: place and normal, the sums of a level, the light.
  readonly surface = target(2, true);
  private readonly sums = target(1, false);
  readonly light = target(1, false);
  private readonly surfaceScene = new Scene();
  private readonly surfaceMaterials: ShaderMaterial[] = [];
  private readonly levels: Scene[] = [];
  private readonly geometries: BufferGeometry[] = [];
  private readonly splat = new ShaderMaterial({
    ...added,
    vertexShader: code.splatVertex,
    fragmentShader: code.splatFragment,
    side: DoubleSide,
    uniforms: {
      near: { value: 0 },
      places: { value: this.surface.textures[0] },
      normals: { value: this.surface.textures[1] },
    },
  });
  private readonly level = new ShaderMaterial({
    ...added,
    vertexShader: code.levelVertex,
    fragmentShader: code.levelFragment,
    uniforms: { sums: { value: this.sums.texture } },
  });
  private readonly whole = new Scene();
  readonly dots: Points<BufferGeometry, PointsMaterial>;
  private readonly unsubscribe: () => void;

  constructor(
    private readonly viewer: Viewer,
    readonly field: PointField,
  ) {
    const { model, stage } = viewer;
    const { matrixWorld } = model.parts[0].mesh;
    const fixed = <T extends Mesh | Points>(one: T, matrix = matrixWorld): T => {
      one.matrixAutoUpdate = false;
      one.matrix.copy(matrix);
      one.frustumCulled = false;
      return one;
    };
    for (const { geometry, mesh, unlit } of model.parts) {
      const look = new ShaderMaterial({
        vertexShader: code.surfaceVertex,
        fragmentShader: code.surfaceFragment,
        glslVersion: GLSL3,
        side: unlit.side,
      });
      this.surfaceMaterials.push(look);
      this.surfaceScene.add(fixed(new Mesh(geometry, look), mesh.matrixWorld));
    }
    field.levelEnd.forEach((end, i) => {
      const geometry = this.levelGeometry(field.levelEnd[i - 1] ?? 0, end);
      this.geometries.push(geometry);
      this.levels.push(new Scene().add(fixed(new Mesh(geometry, this.splat))));
    });
    const plane = new PlaneGeometry(2, 2);
    this.geometries.push(plane);
    this.whole.add(fixed(new Mesh(plane, this.level)));
    const look = new PointsMaterial({ color: 0xe8380d, size: kDotPixels, sizeAttenuation: false, toneMapped: false });
    this.dots = fixed(new Points(this.dotGeometry(), look));
    stage.scene.add(this.dots);
    this.unsubscribe = viewer.state.subscribe((_, changed) => {
      if (changed.has('points') || changed.has('pointLevels') || changed.has('dots')) this.apply();
    });
    this.apply();
  }

  private levelGeometry(first: number, end: number): InstancedBufferGeometry {
    const { sites, normals, coefficients } = this.field;
    const out = new InstancedBufferGeometry();
    const corners = new Float32Array([-1, -1, 0, 1, -1, 0, 1, 1, 0, -1, 1, 0]);
    out.setAttribute('position', new BufferAttribute(corners, 3)).setIndex([0, 1, 2, 0, 2, 3]);
    const each = (all: Float32Array, size: number) => new InstancedBufferAttribute(all.slice(size * first, size * end), size);
    out.setAttribute('site', each(sites, 4)).setAttribute('siteNormal', each(normals, 3));
    out.setAttribute('coefficient', each(coefficients, 3));
    out.instanceCount = end - first;
    return out;
  }

  /// The coarsest points, and finer ones by their coefficients.
  private dotGeometry(): BufferGeometry {
    const { sites, normals, coefficients, levelEnd } = this.field;
    const size = (j: number) => Math.max(...[0, 1, 2].map((c) => Math.abs(coefficients[3 * j + c])));
    const coarse = levelEnd[0] ?? 0;
    let mean = 0;
    for (let j = 0; j < coarse; ++j) mean += size(j) / coarse;
    const places: number[] = [];
    for (let j = 0; j < sites.length / 4; ++j) {
      if (j >= coarse && size(j) <= kMatters * mean) continue;
      for (let c = 0; c < 3; ++c) places.push(sites[4 * j + c] + kDotLift * normals[3 * j + c]);
    }
    const out = new BufferGeometry().setAttribute('position', new BufferAttribute(new Float32Array(places), 3));
    this.geometries.push(out);
    return out;
  }

  private apply(): void {
    const { points, dots } = this.viewer.state.get();
    for (const { material } of this.viewer.model.parts) showPointLight(material, points ? this.light.texture : null);
    this.viewer.stage.drawModel = points ? () => this.draw() : null;
    this.dots.visible = dots;
    const { count } = this.dots.geometry.getAttribute('position');
    this.viewer.onDots(dots ? `${count} of ${this.field.sites.length / 4} points: coefficients above ${100 * kMatters} % of the mean light` : '');
    this.viewer.stage.requestDraw();
  }

  private draw(): void {
    const { renderer, scene, camera } = this.viewer.stage;
    const { pointLevels } = this.viewer.state.get();
    const size = renderer.getDrawingBufferSize(new Vector2());
    const [colour, alpha] = [renderer.getClearColor(new Color()), renderer.getClearAlpha()];
    const into = (to: WebGLRenderTarget, from: Scene, clear: boolean) => {
      renderer.setRenderTarget(to);
      if (clear) renderer.clear();
      renderer.render(from, camera);
    };
    for (const one of [this.surface, this.sums, this.light]) one.setSize(size.x, size.y);
    this.splat.uniforms.near.value = camera.near;
    renderer.setClearColor(0, 0);
    renderer.autoClear = false;
    into(this.surface, this.surfaceScene, true);
    this.levels.slice(0, pointLevels).forEach((level, i) => {
      into(this.sums, level, true);
      into(this.light, this.whole, i === 0);
    });
    renderer.autoClear = true;
    renderer.setClearColor(colour, alpha);
    renderer.setRenderTarget(null);
    renderer.render(scene, camera);
  }

  dispose(): void {
    this.unsubscribe();
    this.viewer.stage.drawModel = null;
    this.dots.removeFromParent();
    for (const one of [this.surface, this.sums, this.light, this.splat, this.level, this.dots.material]) one.dispose();
    for (const one of [...this.surfaceMaterials, ...this.geometries]) one.dispose();
  }
}
