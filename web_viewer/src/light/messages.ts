// What the page and the light worker say to each other. Each request is answered by one reply with its `serial`. The worker
// begins: its first message is a reply to no request.

import type { PointField } from '../asset/point_field';
import type { EquirectMap } from './equirect';
import type { FieldTexels } from '../asset/light_field';
import type { FieldLamp } from '../asset/field_lamps';
import type { SkyData } from '../asset/mirrored_sky';
import type { PointLamp } from './links';

/// Unpacks a scene.glb, keeps its transfer vectors and hands over the rest.
export interface OpenRequest {
  kind: 'open';
  file: ArrayBuffer;
}

export interface RelightRequest {
  kind: 'relight';
  light: Float32Array;
  bright: Float32Array; // its bright part (brightOf in equirect.ts); empty: none
  lamps: boolean;
  reuse: Float32Array[]; // arrays to write to, one per part; or none
}

/// What a lamp reflects to every vertex, by links.
export interface LampRequest {
  kind: 'lamp';
  lamp: PointLamp; // unit cube
  seen: Uint8Array; // a byte for each sample
  baked: boolean; // the light of the bake is added
  reuse: Float32Array[];
}

/// How bright the model is under a light: the 90th percentile over the vertices of the brightest channel.
export interface LevelRequest {
  kind: 'level';
  light: Float32Array;
  bright: Float32Array;
}

export interface MeasureRequest {
  kind: 'measure';
  weighted: boolean;
}

export interface CoefficientRequest {
  kind: 'coefficient';
  channel: number;
  slot: number;
}

/// An environment file to be read, shrunk and projected.
export interface ProjectRequest {
  kind: 'project';
  name: string;
  file: ArrayBuffer;
  order: number;
}

export type Request =
  OpenRequest | RelightRequest | LampRequest | LevelRequest | MeasureRequest | CoefficientRequest | ProjectRequest;

export interface ValuesReply {
  values: Float32Array[]; // one per part
  arriving: Float32Array[]; // of a relight request, see arrivingLight(): one per part, empty where it has no matrices
  range: number; // where a colour scale should end; of a level request the level
  milliseconds: number; // spent computing
}

export interface ProjectReply {
  light: Float32Array;
  bright: Float32Array;
  map: EquirectMap;
}

export type Reply = { serial: number } & (
  | { begun: true }
  // a GLB without compression and without transfer vectors; of links the senders' samples: place and normal of each, six
  // numbers; the light field of each part, the sky and lamps it keeps apart, and how surfaces mirror; the light on points; the bytes of a
  // progressive mesh
  | {
      opened: ArrayBuffer;
      samples: Float32Array | null;
      field: FieldTexels[] | null;
      sky: SkyData | null;
      lamps: FieldLamp[];
      lobes: Float32Array | null;
      points: PointField | null;
      progressive: Uint8Array<ArrayBuffer> | null;
    }
  | { values: ValuesReply }
  | { projected: ProjectReply }
  | { failure: string }
);
