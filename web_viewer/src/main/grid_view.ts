// What the viewer shows of an irradiance vector grid: surfaces lit by it alone, a ball that hangs in it, the boxes
// of the cells of which not every corner counts, and an arrow at each vertex. Nothing is made before it is asked for.

import {
  BufferAttribute,
  BufferGeometry,
  InstancedBufferAttribute,
  InstancedBufferGeometry,
  LineBasicMaterial,
  LineSegments,
  DataUtils,
  FrontSide,
  type Material,
  Mesh,
  ShaderMaterial,
  SphereGeometry,
  Vector3,
} from 'three';
import { type GridFile, kCellBytes, kRoomBytes } from '../asset/grid_file';
import { gridMaterial } from '../shaders/grid_material';
import { GridTextures } from '../shaders/grid_textures';
import type { Viewer } from './viewer';
import type { ViewState } from './view_state';

const kBallSize = 0.08; // of the model's radius

interface Shown {
  dispose(): void;
}

export class GridView {
  ball: Mesh | null = null;
  private readonly textures: GridTextures;
  private readonly ballMaterial: ShaderMaterial;
  private surfaces: Shown | null = null;
  private boxes: Shown | null = null;
  private arrows: Shown | null = null;
  private readonly unsubscribe: (() => void)[];

  constructor(
    private readonly viewer: Viewer,
    readonly grid: GridFile,
  ) {
    this.textures = new GridTextures(grid);
    this.ballMaterial = gridMaterial(this.textures, false);
    this.unsubscribe = [
      viewer.state.subscribe((state, changed) => this.apply(state, changed)),
      viewer.shown.subscribe(() => this.dressAnew()),
    ];
    this.apply(viewer.state.get(), new Set<keyof ViewState>(['mode', 'ball', 'ballAt', 'cells', 'arrows']));
  }

  private apply(state: Readonly<ViewState>, changed: ReadonlySet<keyof ViewState>): void {
    if (changed.has('mode')) this.surfaces = swap(this.surfaces, state.mode === 'grid', () => this.lightSurfaces());
    if (changed.has('ball')) this.showBall(state.ball);
    if (changed.has('ballAt') || changed.has('ball')) this.placeBall(state.ballAt);
    if (changed.has('cells')) this.boxes = swap(this.boxes, state.cells, () => this.add(cellBoxes(this.grid)));
    if (changed.has('arrows')) this.arrows = swap(this.arrows, state.arrows, () => this.add(vertexArrows(this.grid)));
    this.viewer.stage.requestDraw();
  }

  /// Another level of detail has other meshes.
  private dressAnew(): void {
    this.surfaces?.dispose();
    this.surfaces = swap(null, this.viewer.state.get().mode === 'grid', () => this.lightSurfaces());
  }

  /// The model's meshes with the grid's material in place of their own, seen from the sides they are seen from.
  private lightSurfaces(): Shown {
    const front = gridMaterial(this.textures, true);
    const both = gridMaterial(this.textures, true);
    front.side = FrontSide;
    const undo = this.viewer.model.parts.map(({ mesh }) => {
      const own = mesh.material;
      const material = [own].flat().every((m) => m.side === FrontSide) ? front : both;
      mesh.material = material;
      return () => {
        if (mesh.material === material) mesh.material = own;
      };
    });
    return {
      dispose: () => {
        for (const step of undo) step();
        front.dispose();
        both.dispose();
      },
    };
  }

  private showBall(shown: boolean): void {
    if (shown === (this.ball !== null)) return;
    if (!this.ball) {
      this.ball = new Mesh(new SphereGeometry(kBallSize * this.viewer.stage.radius, 48, 32), this.ballMaterial);
      this.viewer.stage.scene.add(this.ball);
      return;
    }
    this.ball.removeFromParent();
    this.ball.geometry.dispose();
    this.ball = null;
  }

  /// `at` counts from the middle of the grid in its half extents; null: the middle.
  private placeBall(at: ViewState['ballAt']): void {
    const { middle, half } = extent(this.grid);
    this.ball?.position.copy(new Vector3(...(at ?? [0, 0, 0])).multiply(half).add(middle));
  }

  /// Where a place of the world is in the terms of ViewState.ballAt: inside the grid's box.
  ballAt(place: Vector3): [number, number, number] {
    const { middle, half } = extent(this.grid);
    const inside = place.clone().sub(middle).divide(half).clamp(new Vector3(-1, -1, -1), new Vector3(1, 1, 1));
    return [inside.x, inside.y, inside.z];
  }

  moveTo(place: Vector3): void {
    this.viewer.state.set({ ballAt: this.ballAt(place) });
  }

  private add(lines: LineSegments): Shown {
    this.viewer.stage.scene.add(lines);
    return {
      dispose: () => {
        lines.removeFromParent();
        lines.geometry.dispose();
        (lines.material as Material).dispose();
      },
    };
  }

  dispose(): void {
    for (const end of this.unsubscribe) end();
    this.showBall(false);
    for (const shown of [this.surfaces, this.boxes, this.arrows]) shown?.dispose();
    this.ballMaterial.dispose();
    this.textures.dispose();
  }
}

function swap(now: Shown | null, wanted: boolean, make: () => Shown): Shown | null {
  if (wanted === (now !== null)) return now;
  if (wanted) return make();
  now?.dispose();
  return null;
}

function extent({ size, origin, spacing }: GridFile): { middle: Vector3; half: Vector3 } {
  const half = new Vector3(...spacing.map((s, a) => (s * size[a]) / 2));
  return { half, middle: half.clone().add(new Vector3(...origin)).sub(new Vector3(...spacing).divideScalar(2)) };
}

const placeOf = (i: number, [x, y]: GridFile['size']): number[] => [
  i % x,
  Math.floor(i / x) % y,
  Math.floor(i / (x * y)),
];

/// Twelve edges for each cell of which not every corner counts everywhere.
function cellBoxes(grid: GridFile): LineSegments {
  const geometry = new InstancedBufferGeometry();
  const corner = (b: number) => [b & 1, (b >> 1) & 1, (b >> 2) & 1];
  const edges = [0, 1, 2].flatMap((axis) =>
    [0, 1, 2, 3, 4, 5, 6, 7]
      .filter((b) => !((b >> axis) & 1))
      .flatMap((b) => [...corner(b), ...corner(b | (1 << axis))]),
  );
  geometry.setAttribute('position', new BufferAttribute(Float32Array.from(edges), 3));
  geometry.setAttribute('cell', new InstancedBufferAttribute(Float32Array.from(partialCells(grid)), 3));
  const material = new ShaderMaterial({
    vertexShader: /* glsl */ `
attribute vec3 cell;
uniform vec3 origin, spacing;
void main() { gl_Position = projectionMatrix * viewMatrix * vec4(origin + spacing * (cell + position), 1.0); }`,
    fragmentShader: 'void main() { gl_FragColor = vec4(0.15, 0.65, 1.0, 0.35); }',
    uniforms: { origin: { value: new Vector3(...grid.origin) }, spacing: { value: new Vector3(...grid.spacing) } },
    transparent: true,
    depthWrite: false,
  });
  const lines = new LineSegments(geometry, material);
  lines.frustumCulled = false; // its bounds are in the instances
  return lines;
}

function partialCells({ corners, cells }: GridFile): number[] {
  const out: number[] = [];
  if (!corners) return out;
  for (let i = 0; i < corners.length / kCellBytes; ++i) {
    const cell = corners.subarray(kCellBytes * i, kCellBytes * (i + 1));
    const sides = [0, 1, 2, 3, 4, 5].flatMap((d) => [cell[4 * d + 2], ...(cell[4 * d + 1] ? [cell[4 * d + 3]] : [])]);
    const rooms = cell.subarray(kRoomBytes, kRoomBytes + 8);
    const whole = sides.every((b) => b === 255 || b === 0) && rooms.every((b) => b === 255);
    if (!whole) out.push(...placeOf(i, cells));
  }
  return out;
}

/// A line at each vertex along the net flux (Phi, channels together), as long as the light is one-sided, in its hue.
function vertexArrows(grid: GridFile): LineSegments {
  const count = grid.size[0] * grid.size[1] * grid.size[2];
  const [position, colour] = [new Float32Array(6 * count), new Float32Array(6 * count)];
  const length = 0.9 * Math.min(...grid.spacing);
  for (let v = 0; v < count; ++v) {
    const { flux, light } = vertexLight(grid, v);
    const at = placeOf(v, grid.size);
    for (let a = 0; a < 3; ++a) {
      const start = grid.origin[a] + at[a] * grid.spacing[a];
      position[6 * v + a] = start;
      position[6 * v + 3 + a] = start + length * flux[a];
      colour[6 * v + a] = colour[6 * v + 3 + a] = light[a] / Math.max(1e-20, ...light);
    }
  }
  const geometry = new BufferGeometry();
  geometry.setAttribute('position', new BufferAttribute(position, 3));
  geometry.setAttribute('color', new BufferAttribute(colour, 3));
  return new LineSegments(geometry, new LineBasicMaterial({ vertexColors: true, toneMapped: false }));
}

/// Net flux over the flux from all sides (at most 1 in length), and light from all sides up to a factor.
function vertexLight(grid: GridFile, v: number): { flux: number[]; light: number[] } {
  const half = (part: number, c: number) => DataUtils.fromHalfFloat(grid.parts[part][4 * v + c]);
  const sum = (part: number) => half(part, 0) + half(part, 1) + half(part, 2);
  if (grid.blend === 'exact') {
    // Of even light each A_i is half of what comes from all sides.
    const all = Math.max(1e-20, sum(3) + sum(4) + sum(5)) / 1.5;
    return {
      flux: [0, 1, 2].map((a) => sum(a) / all),
      light: [0, 1, 2].map((c) => half(3, c) + half(4, c) + half(5, c)),
    };
  }
  const sides = [0, 1, 2, 3, 4, 5];
  const all = Math.max(1e-20, sides.reduce((s, d) => s + sum(2 * d), 0)) / 1.5;
  return {
    flux: [0, 1, 2].map((a) => (sum(4 * a) - sum(4 * a + 2)) / all),
    light: [0, 1, 2].map((c) => sides.reduce((s, d) => s + half(2 * d, c), 0)),
  };
}
