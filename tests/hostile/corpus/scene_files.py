"""Pipes, devices, folders and endless files wherever a scene or what it names is read."""

import os

from . import drawings, exr, gltf, meshes, plates, png
from .case import CLOSED, OPEN_PIPE, Case, Content, folder, link, parts, pipe, sparse, unix_socket, with_mode
from .scene_text import FLAME

# Kinds of what is not a regular file. A name for each, how it is made at the place of the file, and whether it could be waited for.
ODD: list[tuple[str, Content, bool]] = [
    ("a folder", folder, False),
    ("a pipe", pipe, True),
    ("a link to a pipe", link("pipe"), True),
    ("an endless device", link("/dev/zero"), True),
    ("an empty device", link("/dev/null"), False),
    ("a full device", link("/dev/full"), True),
    ("a device of random numbers", link("/dev/urandom"), True),
    ("a terminal that is not there", link("/dev/tty"), False),
    ("a socket", unix_socket, False),
    ("a link to itself", link("loop"), False),
    ("a link to nothing", link("gone"), False),
    ("a sparse file of 3.9 GB", sparse(3_900_000_000), True),
    ("a file of the system that has no length", link("/proc/self/maps"), False),
    ("memory of the process", link("/proc/self/mem"), False),
]


def _beside() -> dict[str, Content]:
    return {"pipe": pipe, "loop": link("loop")}


def _scenes() -> list[Case]:
    made = []
    for name, content, waits in ODD:
        if name == "a file of the system that has no length":
            continue
        says = r"^error: scene\.toml(:\d+:\d+)?: "
        files: dict[str, Content] = {**_beside(), "scene.toml": content}
        made.append(Case("scene file", name, ["check", "scene.toml"], 3, says, files, signaled=waits))
    for command in (["render", "scene.toml", "-o", "out/a.png"], ["flipbook", "scene.toml", "--grid", "2x2"], ["simulate", "scene.toml", "--particles", "a.ply"]):
        for name, content in (("a pipe", pipe), ("an endless device", link("/dev/zero"))):
            made.append(Case("scene file", f"{command[0]}: {name}", command, 3, r"^error: scene\.toml: ", {"scene.toml": content}, signaled=True))
    if os.geteuid() != 0:
        # Whoever is root may read everything.
        made.append(Case("scene file", "unreadable", ["check", "scene.toml"], 3, r"^error: scene\.toml: the scene cannot be read", {"scene.toml": with_mode(FLAME, 0)}))
    return [
        *made,
        Case("scene file", "missing", ["check", "gone.toml"], 3, r"^error: gone\.toml: the scene cannot be read"),
        Case("scene file", "in a folder that is a file", ["check", "scene.toml/scene.toml"], 3, r"^error: scene\.toml/scene\.toml: the scene cannot be read", {"scene.toml": FLAME}),
        Case("scene file", "name of 5,000 bytes", ["check", "a" * 5000 + ".toml"], 3, r"^error: a+( \[\.\.\.\] a+)?\.toml: the scene cannot be read"),
        Case("scene file", "empty name", ["check", ""], (2, 3), r"^error: "),
        Case("scene file", "name with a newline", ["check", "a\nerror: b.toml"], 3, r"^error: "),
        Case("scene file", "name with an escape sequence", ["check", "\x1b[2Ja.toml"], 3, r"^error: "),
        Case("scene file", "name that is no UTF-8", ["check", b"\xff\xfe.toml".decode("utf-8", "surrogateescape")], 3, r"^error: "),
        Case("scene file", "90 scenes that are missing", ["check", *(f"{index}.toml" for index in range(90))], 3, r"^error: \d+\.toml: the scene cannot be read", errors=90),
        Case("scene file", "one scene 1,000 times", ["check", *["scene.toml"] * 1000], 0, "", {"scene.toml": FLAME}),
        *_standard_input(),
    ]


def _standard_input() -> list[Case]:
    def read(name: str, content: Content | None, code: int | tuple[int, ...], says: str = "", stdin: str = "scene", **more) -> Case:
        files: dict[str, Content] = {} if content is None else {"scene": content}
        return Case("standard input", name, ["check", "-"], code, says, files, stdin=stdin, **more)

    place = r"^error: (-|stdin|<stdin>|standard input)(:\d+(:\d+)?)?: "
    return [
        read("a scene", FLAME, 0),
        read("a fault", FLAME + "height = -1\n", 3, r"^error: .*:6:10: "),
        read("nothing", "", 3, place),
        read("no UTF-8", b"\xff\xfe", 3, place),
        read("17 MB", parts((FLAME, 1), ("#" * 99 + "\n", 180_000)), 3, place + r".*(16(\.0)? MiB|16777216|allowed)", large=True),
        read("endless", link("/dev/zero"), 3, place + r".*(16(\.0)? MiB|16777216|allowed|UTF-8)", signaled=True),
        read("closed", None, 3, place, CLOSED),
        read("a folder", folder, 3, place),
        read("a pipe that nobody writes to", None, 3, place, OPEN_PIPE, endless=True, signaled=True),
        Case("standard input", "two scenes from it", ["check", "-", "-"], (0, 2, 3), r"^error: ", {"scene": FLAME}, stdin="scene"),
        Case("standard input", "render", ["render", "-", "-o", "out/a.png", "--frames", "0", "--threads", "2"], 0, "", {"scene": FLAME}, stdin="scene"),
        Case("standard input", "a plate beside it that is missing", ["check", "-"], 3, r"^error: .*:6:9: plate\.image: .*gone\.png: no such file", {"scene": plates.SCENE.format("gone.png")}, stdin="scene"),
    ]


def _assets() -> list[Case]:
    """The same at the place of each file that a scene names."""
    wanted: list[tuple[str, str, str, dict[str, Content]]] = [
        ("plate", "plate.png", r"scene\.toml:6:9: plate\.image: ", {"scene.toml": plates.SCENE.format("plate.png")}),
        ("plate", "plate.jpg", r"scene\.toml:6:9: plate\.image: ", {"scene.toml": plates.SCENE.format("plate.jpg")}),
        ("plate", "plate.exr", r"scene\.toml:6:9: plate\.image: ", {"scene.toml": plates.SCENE.format("plate.exr")}),
        ("depth", "depth.exr", r"scene\.toml:7:9: plate\.depth: ", {"scene.toml": plates.DEPTH.format("depth.exr"), "flat.png": png.flat(32, 24)}),
        ("sequence", "plate.0000.png", r"scene\.toml:6:9: plate\.image: ", {"scene.toml": plates.SCENE.format("plate.####.png"), "plate.0001.png": png.flat(32, 24)}),
        ("sequence", "plate.0001.png", r"scene\.toml:6:9: plate\.image: ", {"scene.toml": plates.SCENE.format("plate.####.png"), "plate.0000.png": png.flat(32, 24)}),
        ("mesh", "mesh.gltf", r"scene\.toml:8:8: obstacle\.0\.file.*: ", {"scene.toml": meshes.SCENE.format("mesh.gltf")}),
        ("mesh", "mesh.glb", r"scene\.toml:8:8: obstacle\.0\.file.*: ", {"scene.toml": meshes.SCENE.format("mesh.glb")}),
        ("buffer", "a.bin", r"scene\.toml:8:8: obstacle\.0\.file.*: ", {"scene.toml": meshes.SCENE.format("mesh.gltf"), "mesh.gltf": gltf.changed(buffers_0_uri="a.bin")}),
        ("drawing", "drawing.svg", r"scene\.toml:8:12: aurora\.0\.shapes\.0\.sheets\.0\.svg_file .*", {"scene.toml": drawings.SCENE}),
    ]
    made = []
    for what, file, place, files in wanted:
        for name, content, waits in ODD:
            # What ends in an error soon is the same for all; only pipes and what has no end are tried everywhere.
            # Of frames after the first, a check looks only whether they are there.
            code = (0, 3) if file == "plate.0001.png" and callable(content) and name.startswith("a sparse") else 3
            if waits or file in ("plate.png", "mesh.gltf", "drawing.svg", "a.bin"):
                made.append(Case(f"{what} file", f"{file}: {name}", ["check", "scene.toml"], code, rf"^error: {place}", {**_beside(), **files, file: content}, signaled=waits))
    return made


def _confined() -> list[Case]:
    """Files that a scene may not name where its folder is its root."""
    flat = png.flat(32, 24)

    def confined(name: str, path: str, extra: dict[str, Content] | None = None, code: int = 3) -> Case:
        files: dict[str, Content] = {"inside/scene.toml": plates.SCENE.format(path), "outside.png": flat, "inside/here.png": flat, **(extra or {})}
        return Case("root", name, ["check", "--asset-root", "inside", "inside/scene.toml"], code, r"^error: inside/scene\.toml:6:9: plate\.image: ", files)

    mesh = {"inside/scene.toml": meshes.SCENE.format("mesh.gltf"), "inside/mesh.gltf": gltf.changed(buffers_0_uri="../a.bin"), "a.bin": gltf.BUFFER}
    return [
        confined("a file inside", "here.png", code=0),
        confined("a file inside by a way around", "../inside/here.png", code=0),
        confined("a file outside", "../outside.png"),
        confined("an absolute path", "/etc/passwd.png"),
        confined("a link to a file outside", "link.png", {"inside/link.png": link("../outside.png")}),
        confined("a link to a folder outside", "link/outside.png", {"inside/link": link("..")}),
        confined("a chain of links", "one/two.png", {"inside/one": link("."), "inside/two.png": link("three.png"), "inside/three.png": link("../outside.png")}),
        confined("a folder that is not there", "gone/../../outside.png"),
        confined("a sequence of links", "l.#.png", {"inside/l.0.png": link("here.png"), "inside/l.1.png": link("../outside.png")}),
        confined("a folder of a like name", "../inside2/a.png", {"inside2/a.png": flat}),
        Case("root", "a buffer outside", ["check", "--asset-root", "inside", "inside/scene.toml"], 3, r"^error: inside/scene\.toml:8:8: obstacle\.0\.file", mesh),
        Case("root", "a drawing outside", ["check", "--asset-root", "inside", "inside/scene.toml"], 3, r"^error: inside/scene\.toml:8:12: aurora\.0\.shapes\.0\.sheets\.0\.svg_file ",
             {"inside/scene.toml": drawings.SCENE.replace("drawing.svg", "../drawing.svg"), "drawing.svg": '<svg><path d="M0 0L1 1"/></svg>'}),
        Case("root", "rendered", ["render", "--asset-root", "inside", "inside/scene.toml", "-o", "out/a.png", "--frames", "0"], 3, r"^error: inside/scene\.toml:6:9: plate\.image: ",
             {"inside/scene.toml": plates.SCENE.format("../outside.png"), "outside.png": flat}),
        Case("root", "a root that is not there", ["check", "--asset-root", "gone", "scene.toml"], (1, 2, 3), r"^error: .*gone", {"scene.toml": FLAME}),
        Case("root", "a root that is a file", ["check", "--asset-root", "scene.toml", "scene.toml"], (1, 2, 3), r"^error: ", {"scene.toml": plates.SCENE.format("here.png"), "here.png": flat}),
    ]


def _lengths() -> list[Case]:
    """Ordinary files that begin well and then have no end worth waiting for."""
    long = 3_900_000_000
    return [
        Case("plate file", "a whole PNG and 3.9 GB behind it", ["check", "scene.toml"], (0, 3), r"^error: scene\.toml:6:9: ", {"scene.toml": plates.SCENE.format("plate.png"), "plate.png": sparse(long, png.flat(32, 24))}, signaled=True),
        Case("plate file", "a whole EXR and 3.9 GB behind it", ["check", "scene.toml"], (0, 3), r"^error: scene\.toml:6:9: ", {"scene.toml": plates.SCENE.format("plate.exr"), "plate.exr": sparse(long, exr.black(24, 16))}, signaled=True),
        Case("mesh file", "a whole binary glTF and 3.9 GB behind it", ["check", "scene.toml"], (0, 3), r"^error: scene\.toml:8:8: ", {"scene.toml": meshes.SCENE.format("mesh.glb"), "mesh.glb": sparse(long, gltf.binary())}, signaled=True),
        Case("buffer file", "a buffer and 3.9 GB behind it", ["check", "scene.toml"], (0, 3), r"^error: scene\.toml:8:8: ",
             {"scene.toml": meshes.SCENE.format("mesh.gltf"), "mesh.gltf": gltf.changed(buffers_0_uri="a.bin"), "a.bin": sparse(long, gltf.BUFFER)}, signaled=True),
        Case("scene file", "a scene and 3.9 GB behind it", ["check", "scene.toml"], 3, r"^error: scene\.toml: .*(16(\.0)? MiB|16777216|allowed)", {"scene.toml": sparse(long, FLAME.encode())}, signaled=True),
    ]


def cases() -> list[Case]:
    return _scenes() + _assets() + _confined() + _lengths()
