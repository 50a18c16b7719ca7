#!/usr/bin/env python3
"""Seeds that a mutator can work on: glTFs with files beside them become GLBs, one a file.

    pack.py MODELS OUT        every .gltf below MODELS with one buffer, up to 400 kB as a GLB
"""
import base64
import json
import pathlib
import struct
import sys
import urllib.parse

MOST_BYTES = 400_000


def fetch(folder, uri):
    if uri.startswith("data:"):
        return base64.b64decode(uri.split(",", 1)[1])
    return (folder / urllib.parse.unquote(uri)).read_bytes()


def pack(path):
    gltf = json.loads(path.read_text(encoding="utf-8-sig"))
    buffers = gltf.get("buffers", [])
    if len(buffers) != 1 or "uri" not in buffers[0]:
        return None
    binary = bytearray(fetch(path.parent, buffers[0].pop("uri")))
    for image in gltf.get("images", []):
        if "uri" not in image:
            continue
        pixels = fetch(path.parent, image.pop("uri"))
        binary += bytes(-len(binary) % 4)
        view = {"buffer": 0, "byteOffset": len(binary), "byteLength": len(pixels)}
        image |= {"bufferView": len(gltf.setdefault("bufferViews", [])),
                  "mimeType": "image/png" if pixels.startswith(b"\x89PNG") else "image/jpeg"}
        gltf["bufferViews"].append(view)
        binary += pixels
    buffers[0]["byteLength"] = len(binary)
    text = json.dumps(gltf).encode()
    text += b" " * (-len(text) % 4)
    binary += bytes(-len(binary) % 4)
    chunks = struct.pack("<II", len(text), 0x4E4F534A) + text + struct.pack("<II", len(binary), 0x004E4942) + binary
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


def main():
    models, out = pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2])
    out.mkdir(parents=True, exist_ok=True)
    for path in sorted(models.rglob("*.gltf")):
        try:
            glb = pack(path)
        except (OSError, ValueError):  # a hostile one: it is a seed as it is
            continue
        if glb and len(glb) <= MOST_BYTES:
            (out / (path.parent.name + "-" + path.stem + ".glb")).write_bytes(glb)


if __name__ == "__main__":
    main()
