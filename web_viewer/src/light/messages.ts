// What the page and the light worker say to each other. Each request is answered by exactly one reply with its `serial`.

import type { EquirectMap } from './equirect';
import type { TransferShape } from './transfer';

/// One primitive as it was delivered.
export interface PartData {
  attributes: Float32Array[]; // _PRT_0.., 4 flat slots each
  positions: Float32Array;
  indices: Uint32Array;
}

export interface LoadRequest {
  kind: 'load';
  shape: TransferShape;
  scale: number[];
  offset: number[];
  parts: PartData[];
}

export interface RelightRequest {
  kind: 'relight';
  light: Float32Array;
  lamps: boolean;
  reuse: Float32Array[]; // arrays to write to, one per part; or none
}

/// How bright the model is under a light: the 90th percentile over the vertices of the brightest channel.
export interface LevelRequest {
  kind: 'level';
  light: Float32Array;
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
  LoadRequest | RelightRequest | LevelRequest | MeasureRequest | CoefficientRequest | ProjectRequest;

export interface ValuesReply {
  values: Float32Array[]; // one per part
  range: number; // where a colour scale should end; of a level request the level
  milliseconds: number; // spent computing
}

export interface ProjectReply {
  light: Float32Array;
  map: EquirectMap;
}

export type Reply = { serial: number } & ({ values: ValuesReply } | { projected: ProjectReply } | { failure: string });
