// A level of detail: a model on the GPU and the worker that holds its numbers. scene.glb is the finest, lod1.glb and on
// are the same with fewer vertices.

import { artifact, artifactUrl, type Artifact, type Job } from '../asset/jobs';
import { download } from '../asset/download';
import { type LoadedAsset, parseGltf } from '../asset/parse_gltf';
import { Relighter } from '../light/relighter';
import { BakedModel } from './baked_model';
import { FieldLook } from './field_look';

/// The artefacts of a job that are levels of one model, finest first.
export function levelsOf(job: Job): Artifact[] {
  const numbered = (one: Artifact): number => Number(/^lod([1-9]\d*)\.glb$/.exec(one.name)?.[1] ?? NaN);
  const coarser = (job.artifacts ?? []).filter((one) => numbered(one) > 0).sort((a, b) => numbered(a) - numbered(b));
  return [artifact(job, 'scene.glb')!, ...coarser];
}

/// Downloads a level and decodes it in a worker of its own.
export async function fetchLevel(job: Job, index: number, most: number): Promise<Level> {
  const name = levelsOf(job)[index]?.name;
  if (!name) throw new Error(`This job has no level of detail ${index}.`);
  const relighter = new Relighter();
  try {
    const file = await download(artifactUrl(job, name), () => {});
    const bytes = file.byteLength;
    return await Level.create(await parseGltf(await relighter.open(file), bytes), relighter, most);
  } catch (error) {
    relighter.dispose();
    throw new Error(`${name} cannot be shown: ${(error as Error).message}`);
  }
}

export class Level {
  readonly field: FieldLook | null = null;
  /// Why there is a light field in the file and none to look at.
  readonly missing: string | null = null;
  spare: Float32Array[] = []; // arrays of light that the worker may use again

  private constructor(
    readonly asset: LoadedAsset,
    readonly model: BakedModel,
    readonly relighter: Relighter,
    most: number,
  ) {
    if (!relighter.field) return;
    try {
      this.field = new FieldLook(model, relighter.field, relighter, most);
      relighter.field = null; // the look has its own
    } catch (error) {
      this.missing = (error as Error).message;
    }
  }

  /// Takes relighter, which has opened the file. `most`: texels that a texture may have across.
  static async create(asset: LoadedAsset, relighter: Relighter, most: number): Promise<Level> {
    return new Level(asset, await BakedModel.create(asset, relighter.lobes !== null || relighter.lamps.length > 0), relighter, most);
  }

  dispose(): void {
    this.field?.dispose();
    this.model.dispose();
    this.relighter.dispose();
  }
}
