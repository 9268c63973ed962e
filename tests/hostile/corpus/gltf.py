"""glTF files, right and wrong (glTF 2.0)."""

import base64
import copy
import json
import struct

TETRAHEDRON = struct.pack("<12f", 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1)
INDICES = struct.pack("<12H", 0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3)
BUFFER = TETRAHEDRON + INDICES


def data(contents: bytes) -> str:
    return "data:application/octet-stream;base64," + base64.b64encode(contents).decode()


WHOLE = {
    "asset": {"version": "2.0"},
    "scene": 0,
    "scenes": [{"nodes": [0]}],
    "nodes": [{"mesh": 0}],
    "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
    "accessors": [
        {"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 1]},
        {"bufferView": 1, "componentType": 5123, "count": 12, "type": "SCALAR"},
    ],
    "bufferViews": [{"buffer": 0, "byteOffset": 0, "byteLength": 48}, {"buffer": 0, "byteOffset": 48, "byteLength": 24}],
    "buffers": [{"byteLength": 72, "uri": data(BUFFER)}],
}


def changed(**values) -> str:
    """A tetrahedron with some of its parts replaced; `accessors_0_count=5` sets `accessors[0].count`."""
    whole = copy.deepcopy(WHOLE)
    for path, value in values.items():
        *steps, last = path.split("_")
        place = whole
        for step in steps:
            place = place[int(step) if step.isdigit() else step]
        place[int(last) if last.isdigit() else last] = value
    return json.dumps(whole)


def chunk(kind: bytes, contents: bytes, length: int | None = None) -> bytes:
    contents += b" " * (-len(contents) % 4) if kind == b"JSON" else bytes(-len(contents) % 4)
    return struct.pack("<I4s", len(contents) if length is None else length, kind) + contents


def binary(document: str | None = None, buffer: bytes = BUFFER, length: int | None = None, magic: bytes = b"glTF", version: int = 2,
           chunks: bytes | None = None) -> bytes:
    """A binary glTF, with whatever lies about itself is asked for."""
    if document is None:
        document = changed(buffers=[{"byteLength": len(BUFFER)}])
    if chunks is None:
        chunks = chunk(b"JSON", document.encode()) + chunk(b"BIN\0", buffer)
    return struct.pack("<4sII", magic, version, 12 + len(chunks) if length is None else length) + chunks
