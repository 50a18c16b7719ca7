// Which places a point lamp reaches: distances to the nearest surface in all directions, in a cube map, and two readers of
// it: a GLSL function for pixels, and one picture with a pixel for each of a list of places.
// A place is moved along its normal by two texels' width before it is asked for, so that surfaces do not shade themselves.

import {
  BoxGeometry,
  type BufferGeometry,
  CubeCamera,
  DataTexture,
  DoubleSide,
  FloatType,
  type Material,
  Matrix3,
  Matrix4,
  Mesh,
  NearestFilter,
  NoBlending,
  OrthographicCamera,
  PlaneGeometry,
  RedFormat,
  RGBAFormat,
  Scene,
  ShaderMaterial,
  UnsignedByteType,
  Vector3,
  WebGLCubeRenderTarget,
  type WebGLRenderer,
  WebGLRenderTarget,
} from 'three';

const kSide = 1024; // texels of a face of the cube

export const lampFunctions = /* glsl */ `
uniform samplerCube lampDistance;
uniform vec3 lampPlace;
const float lampTexel = ${(2 / kSide).toFixed(8)};

/// 1 where the way to the lamp is free. \`aside\`: in texels.
float lampSeenAt(vec3 place, vec3 normal, vec2 aside) {
  vec3 way = place - lampPlace;
  float far = length(way);
  way += normal * (2.0 * lampTexel * far);
  vec3 u = normalize(cross(way, abs(way.y) < 0.9 * far ? vec3(0.0, 1.0, 0.0) : vec3(1.0, 0.0, 0.0)));
  vec3 v = cross(way / far, u);
  vec3 towards = way + (u * aside.x + v * aside.y) * lampTexel * far;
  return textureCube(lampDistance, towards).r * 1.002 >= length(way) ? 1.0 : 0.0;
}
`;

export class LampShadow {
  private readonly cube = new WebGLCubeRenderTarget(kSide, {
    type: FloatType,
    format: RedFormat,
    minFilter: NearestFilter,
    magFilter: NearestFilter,
    generateMipmaps: false,
  });
  private readonly scene = new Scene();
  private readonly camera: CubeCamera;
  private readonly sky: Mesh;
  private readonly material: ShaderMaterial;
  private readonly places: DataTexture;
  private readonly normals: DataTexture;
  private readonly picture: WebGLRenderTarget;
  private readonly asking: Mesh<PlaneGeometry, ShaderMaterial>;
  private readonly flat = new OrthographicCamera();
  readonly count: number;

  /// `samples`: place and normal of each in the frame that `toWorld` leaves; `size`: of the model.
  constructor(
    private readonly renderer: WebGLRenderer,
    meshes: readonly Mesh<BufferGeometry, Material>[],
    samples: Float32Array,
    { toWorld, size }: { toWorld: Matrix4; size: number },
  ) {
    this.material = new ShaderMaterial({
      vertexShader: /* glsl */ `
varying vec3 vPlace;
void main() {
  vPlace = (modelMatrix * vec4(position, 1.0)).xyz;
  gl_Position = projectionMatrix * viewMatrix * vec4(vPlace, 1.0);
}`,
      fragmentShader: /* glsl */ `
varying vec3 vPlace;
uniform vec3 lampPlace;
void main() { gl_FragColor = vec4(length(vPlace - lampPlace)); }`,
      uniforms: { lampPlace: { value: new Vector3() } },
      side: DoubleSide,
      blending: NoBlending,
      toneMapped: false,
    });
    for (const { geometry, matrixWorld } of meshes) {
      const caster = new Mesh(geometry, this.material);
      caster.matrixAutoUpdate = false; // each is drawn on the faces that it may be seen on
      caster.matrix.copy(matrixWorld);
      this.scene.add(caster);
    }
    // What nothing stands in is as far as a box round all of it: a cleared texel would be near.
    this.sky = new Mesh(new BoxGeometry(6 * size, 6 * size, 6 * size), this.material);
    this.sky.matrixAutoUpdate = false;
    this.sky.frustumCulled = false;
    this.scene.add(this.sky);
    this.camera = new CubeCamera(2e-3 * size, 8 * size, this.cube);
    this.scene.add(this.camera);

    this.count = samples.length / 6;
    const width = Math.max(1, Math.ceil(Math.sqrt(this.count)));
    const height = Math.max(1, Math.ceil(this.count / width));
    const [place, normal] = [new Float32Array(4 * width * height), new Float32Array(4 * width * height)];
    const turn = new Matrix3().getNormalMatrix(toWorld);
    const v = new Vector3();
    for (let k = 0; k < this.count; ++k) {
      v.fromArray(samples, 6 * k).applyMatrix4(toWorld).toArray(place, 4 * k);
      v.fromArray(samples, 6 * k + 3).applyMatrix3(turn).normalize().toArray(normal, 4 * k);
    }
    const texture = (data: Float32Array<ArrayBuffer>) => {
      const out = new DataTexture(data, width, height, RGBAFormat, FloatType);
      out.needsUpdate = true;
      return out;
    };
    [this.places, this.normals] = [texture(place), texture(normal)];
    this.picture = new WebGLRenderTarget(width, height, { type: UnsignedByteType, depthBuffer: false });
    const asking = new ShaderMaterial({
      vertexShader: 'void main() { gl_Position = vec4(position.xy, 0.0, 1.0); }',
      fragmentShader: /* glsl */ `
uniform sampler2D places, normals;
${lampFunctions}
void main() {
  ivec2 at = ivec2(gl_FragCoord.xy);
  gl_FragColor = vec4(lampSeenAt(texelFetch(places, at, 0).xyz, texelFetch(normals, at, 0).xyz, vec2(0.0)));
}`,
      uniforms: { ...this.uniforms(), places: { value: this.places }, normals: { value: this.normals } },
      blending: NoBlending,
      depthTest: false,
      toneMapped: false,
    });
    this.asking = new Mesh(new PlaneGeometry(2, 2), asking);
    this.asking.frustumCulled = false;
  }

  /// What lampFunctions needs. The same objects each time: the lamp moves in all of them.
  uniforms(): { lampDistance: { value: unknown }; lampPlace: { value: Vector3 } } {
    return { lampDistance: { value: this.cube.texture }, lampPlace: this.material.uniforms.lampPlace as { value: Vector3 } };
  }

  /// Where the cube was drawn.
  get place(): Vector3 {
    return this.material.uniforms.lampPlace.value as Vector3;
  }

  /// Draws the cube anew.
  moveTo(place: Vector3): void {
    this.place.copy(place);
    this.camera.position.copy(place);
    this.sky.position.copy(place);
    this.sky.updateMatrix();
    this.camera.update(this.renderer, this.scene);
  }

  /// A byte for each sample: 0 where the lamp does not reach it.
  async seen(): Promise<Uint8Array<ArrayBuffer>> {
    const { renderer, picture, asking, flat } = this;
    const before = renderer.getRenderTarget();
    renderer.setRenderTarget(picture);
    renderer.render(asking, flat);
    renderer.setRenderTarget(before);
    const pixels = new Uint8Array(4 * picture.width * picture.height);
    await renderer.readRenderTargetPixelsAsync(picture, 0, 0, picture.width, picture.height, pixels);
    return Uint8Array.from({ length: this.count }, (_, k) => pixels[4 * k]);
  }

  /// Mean of cos / (pi d^2) over the samples that a lamp there reaches.
  meanLight(place: Vector3, seen: Uint8Array): number {
    const [places, normals] = [this.places.image.data, this.normals.image.data] as unknown as Float32Array[];
    let [sum, count] = [0, 0];
    const [way, n] = [new Vector3(), new Vector3()];
    for (let k = 0; k < this.count; ++k) {
      way.fromArray(places, 4 * k).sub(place).negate();
      const facing = way.dot(n.fromArray(normals, 4 * k));
      if (seen[k] === 0 || facing <= 0) continue;
      sum += facing / (Math.PI * way.length() ** 3);
      ++count;
    }
    return count > 0 ? sum / count : 0;
  }

  dispose(): void {
    this.cube.dispose();
    this.sky.geometry.dispose();
    this.picture.dispose();
    this.places.dispose();
    this.normals.dispose();
    this.material.dispose();
    this.asking.material.dispose();
    this.asking.geometry.dispose();
  }
}
