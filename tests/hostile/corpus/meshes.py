"""Meshes: glTF files with cycles, lies and bombs."""

import dataclasses
import json
import re
import struct

from . import gltf
from .case import Case, Content, built, lines, parts

SCENE = 'bansho = 2\n[picture]\nsize = [32, 24]\nframes = 2\n[[flame_sheet]]\n[[obstacle]]\nshape = "mesh"\nfile = "{}"\n'
MEGA = 1_000_000


def _mesh(name: str, extension: str, content: Content, code: int | tuple[int, ...] = 3, words: str = "", extra: dict[str, Content] | None = None, **more) -> Case:
    file = f"mesh.{extension}"
    says = rf"^error: scene\.toml:8:8: obstacle\.0\.file.*: .*mesh\.{extension}.*({words})"
    return Case(extension, name, ["check", "scene.toml"], code, says, {"scene.toml": SCENE.format(file), file: content, **(extra or {})}, **more)


def _text(name: str, content: Content, code: int | tuple[int, ...] = 3, words: str = "", **more) -> Case:
    return _mesh(name, "gltf", content, code, words, **more)


def _nodes() -> list[Case]:
    def nodes(name, listed, words="", code=3, **values):
        return _text(name, gltf.changed(nodes=listed, **values), code, words)

    head, tail = _around("nodes")
    halves = [{"children": [index + 1, index + 1]} for index in range(40)] + [{"mesh": 0}]
    return [
        _text("whole", gltf.changed(), 0),
        nodes("a child named 3,000 times", [{"children": [1] * 3000}, {"mesh": 0}], "child|parent"),
        nodes("a node in itself", [{"children": [0], "mesh": 0}], "contain|parent|child"),
        nodes("two nodes in each other", [{"children": [1], "mesh": 0}, {"children": [0]}], "contain|parent|child"),
        nodes("a cycle that no scene shows", [{"mesh": 0}, {"children": [2]}, {"children": [1]}], "contain|parent"),
        nodes("each node twice in the one before: 2^40", halves, "child|parent"),
        nodes("a node of two parents", [{"children": [2]}, {"children": [2]}, {"mesh": 0}], "child|parent"),
        nodes("a scene that names a node twice", [{"mesh": 0}], "twice", scenes_0_nodes=[0, 0]),
        nodes("a scene that names a child", [{"children": [1]}, {"mesh": 0}], "parent", scenes_0_nodes=[0, 1]),
        nodes("a child beyond the nodes", [{"children": [7]}], "children"),
        nodes("a child before the nodes", [{"children": [-1]}], "children"),
        nodes("a child that is no number", [{"children": ["a"]}], "children"),
        nodes("a mesh beyond the meshes", [{"mesh": 5}], "mesh"),
        nodes("no nodes", [], "", 3),
        nodes("a matrix of 15 numbers", [{"mesh": 0, "matrix": [1] * 15}], "matrix"),
        nodes("a matrix of huge numbers", [{"mesh": 0, "matrix": [1e308] * 16}], ""),
        nodes("a matrix of zeros", [{"mesh": 0, "matrix": [0] * 16}], ""),
        nodes("a scale of 1e30", [{"mesh": 0, "scale": [1e30] * 3}], "", (0, 3)),
        nodes("a scale of 1e-30", [{"mesh": 0, "scale": [1e-30] * 3}], "", (0, 3)),
        nodes("a rotation of no length", [{"mesh": 0, "rotation": [0, 0, 0, 0]}], "", (0, 3)),
        _text("100,000 nodes deep", lines(99_999, lambda index: f'{{"children": [{index + 1}]}},', head, '{"mesh": 0}' + tail), (0, 3), "nodes", signaled=True),
        _text("200,000 nodes", parts((head, 1), ("{},", 199_999), ('{"mesh": 0}' + tail, 1)), 3, "nodes"),
        _text("3,000,000 nodes", parts((head, 1), ("{},", 2_999_999), ('{"mesh": 0}' + tail, 1)), 3, "nodes|values", signaled=True, large=True),
    ]


def _around(key: str) -> tuple[str, str]:
    """What stands before and after the items of a list of a whole glTF."""
    mark = "what goes here"
    before, after = gltf.changed(**{key: mark}).split(f'"{mark}"')
    return before + "[", "]" + after


def _bombs() -> list[Case]:
    views, strings = _around("bufferViews"), gltf.changed(buffers_0_uri="HERE").split("HERE")
    view, buffer = {"buffer": 0, "byteLength": 12 * MEGA}, {"byteLength": 12 * MEGA, "uri": "zeros.bin"}
    zeros = {"zeros.bin": parts((bytes(1000), 12_000))}
    shown = [{"mesh": 0}] * 2000

    def big(**values) -> str:
        whole = json.loads(gltf.changed())
        whole.update({"bufferViews": [view], "buffers": [buffer], "accessors": [{"bufferView": 0, "componentType": 5126, "count": MEGA, "type": "VEC3"}]}, **values)
        return json.dumps(whole)

    all_nodes = [{"nodes": list(range(2000))}]
    return [
        _text("1,000,000 points on 2,000 nodes", big(meshes=[{"primitives": [{"attributes": {"POSITION": 0}, "mode": 0}]}], nodes=shown, scenes=all_nodes), 3, "triangles", extra=zeros, signaled=True),
        _text("1,000,000 vertices on 2,000 nodes", big(meshes=[{"primitives": [{"attributes": {"POSITION": 0}}]}], nodes=shown, scenes=all_nodes), 3, "triangles|vertices", extra=zeros, signaled=True),
        _text("1,000,000 vertices", big(meshes=[{"primitives": [{"attributes": {"POSITION": 0}}]}]), (0, 3), "triangles", extra=zeros, signaled=True),
        _text("1,000,000 strips on one accessor", big(meshes=[{"primitives": [{"attributes": {"POSITION": 0}, "mode": 5}] * 2000}]), 3, "triangles|vertices", extra=zeros, signaled=True),
        _text("2,000 buffers of one file", gltf.changed(buffers=[buffer] * 2000, bufferViews_0_buffer=1999), 3, "", extra=zeros, signaled=True),
        _text("2,000 buffers of one file by 2,000 names", built(lambda: gltf.changed(buffers=[{"byteLength": 12 * MEGA, "uri": "./" * index + "zeros.bin"} for index in range(2000)]).encode()), 3, "bytes|allowed|memory", extra=zeros, signaled=True),
        _text("a buffer of 12 MB, in each of 100 nodes", big(nodes=[{"mesh": index} for index in range(100)], meshes=[{"primitives": [{"attributes": {"POSITION": 0}}]}] * 100, scenes=[{"nodes": list(range(100))}]), 3, "triangles|vertices", extra=zeros, signaled=True),
        _text("bufferViews of 2,000,000 elements", parts((views[0], 1), ("{},", 1_999_000), ("{}" + views[1], 1)), 3, "", signaled=True, large=True),
        _text("lists 100,000 deep", "[" * 100_000 + "]" * 100_000, 3, "JSON"),
        _text("objects 100,000 deep", '{"a":' * 100_000 + "1" + "}" * 100_000, 3, "JSON"),
        _text("15 MB of spaces", parts((gltf.changed(), 1), (" ", 15 * MEGA)), 0, signaled=True, large=True),
        _text("a base64 buffer of 15 MB", parts((strings[0] + "data:;base64,", 1), ("AAAA", 4 * MEGA), (strings[1], 1)), 3, "", signaled=True, large=True),
        _text("an unknown extension of 2,000,000 keys", lines(1_900_000, lambda index: f'"{index}":0,', gltf.changed()[:-1] + ', "extras": {', '"a":0}}'), 0, signaled=True, large=True),
    ]


def _numbers() -> list[Case]:
    def changed(name, words="", code=3, **values):
        return _text(name, gltf.changed(**values), code, words)

    def missing(name, buffer):
        # The buffer is named, not the file that names it.
        case = changed(name, buffers_0_uri=buffer)
        return dataclasses.replace(case, says=rf"^error: scene\.toml:8:8: obstacle\.0\.file.*: {re.escape(buffer)}: .*(no such file|root|allowed)")

    not_a_number = struct.pack("<f", float("nan")) * 12 + gltf.INDICES
    infinite = struct.pack("<f", float("inf")) * 12 + gltf.INDICES
    far = gltf.TETRAHEDRON + struct.pack("<12H", *[0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 9])
    return [
        changed("an accessor of 2^53 elements", "count", accessors_0_count=2**53),
        changed("an accessor of 2^64 - 1 elements", "count", accessors_0_count=2**64 - 1),
        changed("an accessor of -1 elements", "count", accessors_0_count=-1),
        changed("an accessor of 1e30 elements", "count", accessors_0_count=1e30),
        changed("an accessor of half an element", "count", accessors_0_count=0.5),
        changed("an accessor of no element", "triangles", accessors_0_count=0, accessors_1_count=0),
        changed("an accessor beyond its view", "count", accessors_0_count=5),
        changed("an accessor that begins at 2^63", "count|Offset", accessors_0_byteOffset=2**63),
        changed("an accessor of doubles", "type|5126", accessors_0_componentType=5130),
        changed("an accessor of matrices", "type|VEC3", accessors_0_type="MAT4"),
        changed("indices of floats", "type|SCALAR", accessors_1_componentType=5126),
        changed("a sparse accessor", "sparse", accessors_0_sparse={"count": 2**40, "indices": {}, "values": {}}),
        changed("a sparse accessor of 2^40 elements", "sparse.count", accessors_0_sparse={"count": 2**40, "indices": {"bufferView": 1, "componentType": 5123}, "values": {"bufferView": 0}}),
        changed("sparse elements that are not there", "sparse.indices", accessors_0_sparse={"count": 1, "indices": {"bufferView": 1, "byteOffset": 2, "componentType": 5125}, "values": {"bufferView": 0}}),
        changed("2^40 sparse vertices of nothing", "vertices", accessors_0={"componentType": 5126, "type": "VEC3", "count": 2**40, "sparse": {"count": 1, "indices": {"bufferView": 1, "componentType": 5123}, "values": {"bufferView": 0}}}),
        changed("an accessor of no view", "bufferView", accessors_0_bufferView=None),
        changed("a view beyond its buffer", "byteLength", bufferViews_0_byteLength=73),
        changed("a view that begins at 2^64 - 1", "byteLength|Offset", bufferViews_0_byteOffset=2**64 - 1),
        changed("a stride of 2^62", "count", bufferViews_0_byteStride=2**62),
        changed("a stride of 0", "", (0, 3), bufferViews_0_byteStride=0),
        changed("a stride of 1", "", (0, 3), bufferViews_0_byteStride=1),
        changed("a buffer longer than it is", "byteLength", buffers_0_byteLength=2**50),
        missing("a buffer that is missing", "gone.bin"),
        missing("a buffer above its folder", "../../../../gone.bin"),
        missing("a buffer on the web", "https://example.org/a.bin"),
        changed("a buffer of broken base64", "base64", buffers_0_uri="data:application/octet-stream;base64,@@@@"),
        changed("a buffer cut within base64", "byteLength", buffers_0_uri=gltf.data(gltf.BUFFER)[:-30]),
        changed("a buffer of data that is no base64", "base64", buffers_0_uri="data:text/plain,hello"),
        changed("positions that are no numbers", "", buffers_0_uri=gltf.data(not_a_number)),
        changed("positions infinitely far", "", buffers_0_uri=gltf.data(infinite)),
        changed("a vertex beyond the vertices", "vertex", buffers_0_uri=gltf.data(far)),
        changed("all vertices at one place", "triangles|area", buffers_0_uri=gltf.data(bytes(48) + gltf.INDICES)),
        changed("mode 99", "mode", meshes_0_primitives=[{"attributes": {"POSITION": 0}, "mode": 99}]),
        changed("attributes that are a list", "attributes", meshes_0_primitives=[{"attributes": []}]),
        changed("primitives that are a number", "primitives", meshes_0_primitives=7),
        changed("scene 99", "scene", scene=99),
        changed("version 1.0", "version", asset={"version": "1.0"}),
        changed("a required extension", "extension", extensionsRequired=["KHR_draco_mesh_compression"]),
        changed("an asset that is a number", "asset", asset=3),
    ]


def _files() -> list[Case]:
    whole, glb = gltf.changed(), gltf.binary()
    cuts = range(0, len(glb) - 4, 40)
    files: dict[str, Content] = {}
    for place in cuts:
        files |= {f"{place}.toml": SCENE.format(f"{place}.glb"), f"{place}.glb": glb[:place]}
    return [
        _text("empty", "", 3, "JSON"),
        _text("cut off", whole[: len(whole) // 2], 3, "JSON"),
        _text("no UTF-8", b'{"asset": "\xff\xfe"}', 3, "JSON"),
        _text("UTF-16", whole.encode("utf-16"), 3, "JSON"),
        _text("byte order mark", "\ufeff" + whole, (0, 3), "JSON"),
        _text("a list", "[]", 3, "JSON"),
        _text("null", "null", 3, "JSON"),
        _text("all parts null", "{" + ",".join(f'"{key}":null' for key in gltf.WHOLE) + "}", 3, "asset"),
        _text("duplicate keys", whole[:-1] + ', "nodes": [{}]}', 3, ""),
        _text("text", "no mesh\n", 3, "JSON"),
        _mesh("whole", "glb", glb, 0),
        Case("glb", f"cut off at {len(cuts)} places", ["check", *(f"{place}.toml" for place in cuts)], 3, r"^error: \d+\.toml:8:8: obstacle\.0\.file.*: \d+\.glb: ", files, errors=len(cuts)),
        _mesh("wrong magic", "glb", gltf.binary(magic=b"glTG"), 3, "binary glTF"),
        _mesh("version 1", "glb", gltf.binary(version=1), 3, "version 1"),
        _mesh("length of 2^32 - 1", "glb", gltf.binary(length=2**32 - 1), 3, "truncated"),
        _mesh("length of 0", "glb", gltf.binary(length=0), 3, "JSON"),
        _mesh("chunk of 2^32 - 1 bytes", "glb", gltf.binary(chunks=gltf.chunk(b"JSON", b"{}", 2**32 - 1)), 3, "truncated"),
        _mesh("binary chunk of 2^32 - 1 bytes", "glb", gltf.binary(chunks=gltf.chunk(b"JSON", b"{}") + gltf.chunk(b"BIN\0", b"", 2**32 - 1)), 3, "truncated"),
        _mesh("no chunk", "glb", gltf.binary(chunks=b""), 3, "JSON"),
        _mesh("binary chunk first", "glb", gltf.binary(chunks=gltf.chunk(b"BIN\0", gltf.BUFFER)), 3, "JSON"),
        _mesh("1,000,000 empty chunks", "glb", built(lambda: gltf.binary(chunks=gltf.chunk(b"JSON", gltf.changed().encode()) + gltf.chunk(b"ABCD", b"") * MEGA)), 0, large=True),
        _mesh("buffer shorter than it says", "glb", gltf.binary(buffer=gltf.BUFFER[:40]), 3, "byteLength"),
        _mesh("text by the name of a binary", "glb", whole, 3, "binary glTF"),
        _mesh("binary by the name of a text", "gltf", glb, 3, "JSON"),
        Case("gltf", "burner without triangles", ["check", "scene.toml"], 3, r"^error: scene\.toml:5:8: flame_particles\.0\.burners\.0\.file.*mesh\.gltf",
             {"scene.toml": 'bansho = 2\n[[flame_particles]]\n[[flame_particles.burners]]\nshape = "mesh"\nfile = "mesh.gltf"\n', "mesh.gltf": gltf.changed(nodes=[])}),
        Case("gltf", "a mesh of an unknown kind", ["check", "scene.toml"], 3, r"^error: scene\.toml:8:8: obstacle\.0\.file.*mesh\.obj.*not a supported mesh format", {"scene.toml": SCENE.format("mesh.obj"), "mesh.obj": "v 0 0 0\n"}),
        Case("gltf", "a mesh without a file", ["check", "scene.toml"], 3, r"^error: scene\.toml:\d+:\d+: obstacle\.0\.", {"scene.toml": SCENE.replace('file = "{}"\n', "")}),
    ]


def cases() -> list[Case]:
    return _nodes() + _bombs() + _numbers() + _files()
