// One mesh from Draco's bytes. The decoder itself is given: draco_module.ts has the browser's, tests have node's.

/// What is called of the decoder's interface, in its own names.
export interface DracoModule {
  Decoder: new () => Decoder;
  Mesh: new () => Mesh;
  DT_FLOAT32: number;
  HEAPF32: Float32Array<ArrayBuffer>;
  HEAPU32: Uint32Array<ArrayBuffer>;
  _malloc(bytes: number): number;
  _free(at: number): void;
  destroy(object: unknown): void;
}

interface Mesh {
  ptr: number;
  num_points(): number;
  num_faces(): number;
}

interface Attribute {
  ptr: number;
  num_components(): number;
}

interface Decoder {
  DecodeArrayToMesh(bytes: Int8Array, length: number, mesh: Mesh): { ok(): boolean; error_msg(): string };
  GetAttributeByUniqueId(mesh: Mesh, id: number): Attribute;
  GetAttributeDataArrayForAllPoints(mesh: Mesh, from: Attribute, type: number, bytes: number, to: number): boolean;
  GetTrianglesUInt32Array(mesh: Mesh, bytes: number, to: number): boolean;
}

/// Owns memory of the decoder: dispose() gives it back. The arrays it has returned stay; the same question, the same array.
export class DracoMesh {
  private readonly decoder: Decoder;
  private readonly mesh: Mesh;
  private readonly read = new Map<number, Float32Array<ArrayBuffer>>();
  private triangles: Uint32Array<ArrayBuffer> | null = null;

  constructor(
    private readonly draco: DracoModule,
    bytes: Uint8Array<ArrayBuffer>,
  ) {
    this.decoder = new draco.Decoder();
    this.mesh = new draco.Mesh();
    const signed = new Int8Array(bytes.buffer, bytes.byteOffset, bytes.byteLength);
    const status = this.decoder.DecodeArrayToMesh(signed, signed.byteLength, this.mesh);
    if (status.ok() && this.mesh.ptr !== 0) return;
    const reason = status.error_msg();
    this.dispose();
    throw new Error(`the geometry cannot be decoded: ${reason}`);
  }

  get points(): number {
    return this.mesh.num_points();
  }

  /// Three for each triangle, all below `points`.
  indices(): Uint32Array<ArrayBuffer> {
    return (this.triangles ??= this.readTriangles());
  }

  /// The attribute of Draco's unique `id`, `components` numbers for each point.
  floats(id: number, components: number): Float32Array<ArrayBuffer> {
    let out = this.read.get(id);
    if (!out) this.read.set(id, (out = this.readFloats(id, components)));
    if (out.length !== components * this.points) throw new Error(`attribute ${id} has two meanings`);
    return out;
  }

  private readFloats(id: number, components: number): Float32Array<ArrayBuffer> {
    const { draco, decoder, mesh } = this;
    const attribute = decoder.GetAttributeByUniqueId(mesh, id);
    if (attribute.ptr === 0 || attribute.num_components() !== components)
      throw new Error(`the geometry has no attribute ${id} of ${components} components`);
    const count = components * this.points;
    return this.borrow(4 * count, (at) => {
      const good = decoder.GetAttributeDataArrayForAllPoints(mesh, attribute, draco.DT_FLOAT32, 4 * count, at);
      if (!good) throw new Error(`attribute ${id} of the geometry cannot be read`);
      return draco.HEAPF32.slice(at / 4, at / 4 + count);
    });
  }

  private readTriangles(): Uint32Array<ArrayBuffer> {
    const count = 3 * this.mesh.num_faces();
    return this.borrow(4 * count, (at) => {
      const good = this.decoder.GetTrianglesUInt32Array(this.mesh, 4 * count, at);
      if (!good) throw new Error('the triangles of the geometry cannot be read');
      return this.draco.HEAPU32.slice(at / 4, at / 4 + count);
    });
  }

  /// `bytes` of the decoder's memory for as long as `use` runs.
  private borrow<T>(bytes: number, use: (at: number) => T): T {
    const at = this.draco._malloc(bytes);
    try {
      return use(at);
    } finally {
      this.draco._free(at);
    }
  }

  dispose(): void {
    this.draco.destroy(this.mesh);
    this.draco.destroy(this.decoder);
  }
}
