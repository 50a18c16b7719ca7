// The GLB container (glTF 2.0, section 4.4): a header, a JSON text, a binary chunk.

const kMagic = 0x46546c67; // "glTF"
const kJson = 0x4e4f534a;
const kBinary = 0x004e4942;

export interface Glb {
  json: unknown;
  binary: Uint8Array<ArrayBuffer>; // a view of the file
}

/// Throws, in words, on what is no GLB or is cut off.
export function splitGlb(file: ArrayBuffer): Glb {
  const view = new DataView(file);
  if (file.byteLength < 20 || view.getUint32(0, true) !== kMagic) throw new Error('this is no GLB file');
  if (view.getUint32(4, true) !== 2) throw new Error(`this is GLB version ${view.getUint32(4, true)}, not 2`);
  const text = chunkAt(view, 12, kJson);
  if (!text) throw new Error('this GLB file does not begin with its JSON');
  const next = text.byteOffset + text.byteLength;
  const binary = next + 8 <= file.byteLength ? chunkAt(view, next, kBinary) : null;
  return { json: JSON.parse(new TextDecoder().decode(text)), binary: binary ?? new Uint8Array(0) };
}

function chunkAt(view: DataView<ArrayBuffer>, at: number, kind: number): Uint8Array<ArrayBuffer> | null {
  const length = view.getUint32(at, true);
  if (view.getUint32(at + 4, true) !== kind) return null;
  if (at + 8 + length > view.byteLength) throw new Error('this GLB file is cut off');
  return new Uint8Array(view.buffer, at + 8, length);
}

/// `pieces` make up the binary chunk: one after another, each begins at the next multiple of four.
export function joinGlb(json: unknown, pieces: readonly Uint8Array[]): ArrayBuffer {
  const text = new TextEncoder().encode(JSON.stringify(json));
  const binary = pieces.reduce((sum, piece) => sum + padded(piece.byteLength), 0);
  const out = new ArrayBuffer(28 + padded(text.byteLength) + binary);
  const view = new DataView(out);
  const bytes = new Uint8Array(out);
  const words = (at: number, ...values: number[]) => values.forEach((word, i) => view.setUint32(at + 4 * i, word, true));
  words(0, kMagic, 2, out.byteLength, padded(text.byteLength), kJson);
  bytes.fill(0x20, 20, 20 + padded(text.byteLength)); // JSON is padded with spaces
  bytes.set(text, 20);
  let at = 20 + padded(text.byteLength);
  words(at, binary, kBinary);
  at += 8;
  for (const piece of pieces) {
    bytes.set(piece, at);
    at += padded(piece.byteLength);
  }
  return out;
}

export const padded = (length: number): number => (length + 3) & ~3;
