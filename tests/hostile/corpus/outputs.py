"""Outputs that cannot be, that are somebody's, or that are inputs by another name."""

from . import plates, png
from .case import Case, Content, folder, hard_link, link, pipe, with_mode
from .scene_text import FLAME

ONE = ["--frames", "0", "--threads", "2"]
THERE = "somebody's own work\n"
INPUT = r"is a file that the scene is read from; allowed: "
GAS = "bansho = 2\n[picture]\nsize = [32, 24]\nframes = 3\n[[flame_particles]]\nparticles = 200\npreroll_s = 0.0\n"


def _out(name: str, path: str, code: int | tuple[int, ...], says: str, files: dict[str, Content] | None = None, **more) -> Case:
    return Case("output", name, ["render", "scene.toml", "-o", path, *ONE], code, says, {"scene.toml": FLAME, **(files or {})}, **more)


def _names() -> list[Case]:
    return [
        _out("no extension", "frame", 2, r"^error: frame: has no extension"),
        _out("empty name", "", 2, r"^error: .*(extension|value)"),
        _out("only an extension", ".png", 2, r"^error: \.png: has no extension"),
        _out("a folder's name", "out/", 2, r"^error: out/?: has no extension"),
        _out("the folder above", "..", 2, r"^error: \.\.: has no extension"),
        _out("an unknown extension", "a.tiff", 2, r"^error: a\.tiff: `\.tiff` is not supported"),
        _out("an extension of a megabyte's tenth", "a." + "b" * 100_000, 2, r"^error: "),
        _out("two numbers", "a.##.##.png", 2, r"^error: a\.##\.##\.png: more than one placeholder"),
        _out("a numbered film", "a.####.gif", 2, r"^error: a\.####\.gif: a \.gif file contains all frames"),
        _out("printf with a string", "a.%s.png", 2, r"^error: a\.%s\.png: `%`"),
        _out("printf with 99 digits", "a.%099d.png", 2, r"^error: a\.%099d\.png: `%`"),
        _out("printf with a number to write to", "a.%n.png", 2, r"^error: a\.%n\.png: `%`"),
        _out("100,000 digits", "a." + "#" * 100_000 + ".png", (1, 2), r"^error: "),
        _out("a name of 300 bytes", "a" * 300 + ".png", (1, 2), r"^error: frame 0: a+\.png: "),
        _out("a path of 5,000 bytes", "a/" * 2500 + "a.png", (1, 2), r"^error: [a/]+( \[\.\.\.\] [a/]+)?a\.png: "),
        _out("a name that is no UTF-8", b"\xff\xfe.png".decode("utf-8", "surrogateescape"), 2, r"^error: .*not a Unicode name"),
        _out("a newline", "a\nb.png", 0, ""),
        _out("a newline and an unknown extension", "a\nerror: b.tiff", 2, r"^error: "),
        _out("an escape sequence and an unknown extension", "\x1b[2J.tiff", 2, r"^error: "),
        _out("a name of a scene", "scene.toml", 2, r"^error: scene\.toml: `\.toml` is not supported"),
    ]


def _places() -> list[Case]:
    no_file = r"^error: {}: (is not a regular file|.*allowed)"
    return [
        _out("/dev/null", "/dev/null", 2, r"^error: /dev/null: has no extension"),
        _out("/dev/full", "/dev/full", 2, r"^error: /dev/full: has no extension"),
        _out("a link to /dev/null", "a.png", (1, 2), no_file.format(r"a\.png"), {"a.png": link("/dev/null")}),
        _out("a link to /dev/full", "a.png", (1, 2), no_file.format(r"a\.png"), {"a.png": link("/dev/full")}),
        _out("a link to /dev/zero", "a.png", (1, 2), no_file.format(r"a\.png"), {"a.png": link("/dev/zero")}),
        _out("a pipe", "a.png", (1, 2), no_file.format(r"a\.png"), {"a.png": pipe}, signaled=True),
        _out("a pipe as a film", "a.gif", (1, 2), no_file.format(r"a\.gif"), {"a.gif": pipe}, signaled=True),
        _out("a folder", "a.png", (1, 2), r"^error: a\.png: is a folder", {"a.png": folder}),
        _out("a folder that is a file", "scene.toml/a.png", (1, 2), r"^error: scene\.toml/a\.png: "),
        _out("a link to itself", "a.png", (1, 2), r"^error: a\.png: ", {"a.png": link("a.png")}),
        _out("a folder that is a link to itself", "l/a.png", (1, 2), r"^error: l/a\.png: ", {"l": link("l")}),
        _out("a folder that is a link to nothing", "l/a.png", (0, 1, 2), r"^error: l/a\.png: ", {"l": link("gone")}),
        _out("/proc", "/proc/a.png", (1, 2), r"^error: /proc/a\.png: (cannot be written|no permission)"),
        _out("/sys", "/sys/a.png", (1, 2), r"^error: /sys/a\.png: (cannot be written|no permission)"),
        _out("a file of the kernel", "/proc/self/a/a.png", (1, 2), r"^error: /proc/self/a/a\.png: "),
        Case("output", "a folder that is full", ["render", "scene.toml", "-o", "/dev/stdin/a.png", *ONE], (1, 2), r"^error: /dev/stdin/a\.png: ", {"scene.toml": FLAME}),
        Case("output", "a film without ffmpeg", ["render", "scene.toml", "-o", "a.mp4", *ONE], 1, r"^error: a\.mp4: needs the program `ffmpeg`", {"scene.toml": FLAME}, environment={"PATH": "/nowhere"}),
        Case("output", "a film by an ffmpeg that fails", ["render", "scene.toml", "-o", "a.mp4", *ONE], 1, r"^error: (frame \d+: )?a\.mp4: ffmpeg failed", {"scene.toml": FLAME, "bin/ffmpeg": with_mode("#!/bin/sh\nexit 3\n", 0o755)}, environment={"PATH": "bin:/nowhere"}),
        Case("output", "a film by an ffmpeg that reads nothing", ["render", "scene.toml", "-o", "a.mp4", "--threads", "2"], (0, 1), r"^error: (frame \d+: )?a\.mp4: ", {"scene.toml": FLAME, "bin/ffmpeg": with_mode("#!/bin/sh\nexit 0\n", 0o755)}, environment={"PATH": "bin:/nowhere"}),
        Case("output", "a film by an ffmpeg that never ends", ["render", "scene.toml", "-o", "a.mp4", "--threads", "2"], 143, "", {"scene.toml": FLAME, "bin/ffmpeg": with_mode("#!/bin/sh\nexec sleep 30\n", 0o755)},
             environment={"PATH": "bin:/usr/bin:/bin"}, signaled=True, endless=True),
        Case("output", "no home", ["render", "scene.toml", "-o", "a.png", *ONE], 0, "", {"scene.toml": FLAME}, environment={"HOME": None, "XDG_CONFIG_HOME": None, "TMPDIR": "/nowhere"}),
        Case("output", "an empty environment", ["render", "scene.toml", "-o", "a.png", *ONE], 0, "", {"scene.toml": FLAME}, environment={"PATH": None, "HOME": None, "LANG": None, "TERM": None}),
        Case("output", "a locale that is not there", ["check", "scene.toml"], 0, "", {"scene.toml": FLAME}, environment={"LANG": "xx_XX.nothing", "LC_ALL": "xx"}),
    ]


def _inputs() -> list[Case]:
    """Whatever is written, the scene and all that it names stay as they are, with and without `--overwrite`."""
    flat = png.flat(32, 24)
    scene: dict[str, Content] = {"scene.toml": plates.SCENE.format("plate.png"), "plate.png": flat}

    def over(name: str, path: str, extra: dict[str, Content] | None = None, command: list[str] | None = None) -> list[Case]:
        line = command or ["render", "scene.toml", "-o", path, *ONE]
        return [Case("over an input", name + suffix, [*line, *flags], 2, "^error: .*" + INPUT, {**scene, **(extra or {})}) for suffix, flags in (("", []), (", --overwrite", ["--overwrite"]))]

    return [
        *over("by its name", "plate.png"),
        *over("by a dot", "./././plate.png"),
        *over("by a folder that is not there", "./x/../plate.png"),
        *over("by two folders that are not there", "x/y/../../plate.png"),
        *over("by a folder that is there", "sub/../plate.png", {"sub/a": ""}),
        *over("by a symbolic link", "link.png", {"link.png": link("plate.png")}),
        *over("by a link to a link", "link.png", {"link.png": link("other.png"), "other.png": link("plate.png")}),
        *over("by a linked folder", "sub/plate.png", {"sub": link(".")}),
        *over("by a hard link", "hard.png", {"hard.png": hard_link("plate.png")}),
        *over("as a contact sheet", "", None, ["render", "scene.toml", "--contact-sheet", "2", "-o", "x/../plate.png"]),
        *over("as a color sheet", "", {"scene.toml": plates.SCENE.format("a_color.png"), "a_color.png": flat}, ["flipbook", "scene.toml", "--grid", "1x2", "-o", "x/../a.png"]),
        *over("as a motion sheet, by a link", "", {"a_motion.png": link("plate.png")}, ["flipbook", "scene.toml", "--grid", "1x2", "-o", "a.png"]),
        *over("as figures, by a link", "", {"a.json": link("scene.toml"), "a.0000.json": link("scene.toml")}, ["render", "scene.toml", "--metadata", "-o", "a.png", *ONE]),
        *over("as a frame that is one of many", "", {"scene.toml": plates.SCENE.format("plate.####.png"), "plate.0000.png": flat, "plate.0001.png": flat}, ["render", "scene.toml", "-o", "plate.####.png"]),
        Case("over an input", "particles over a scene, by a link", ["simulate", "scene.toml", "--particles", "a.ply", "--frames", "0"], 2, "^error: .*" + INPUT, {"scene.toml": GAS, "a.ply": link("scene.toml")}),
        Case("over an input", "a snapshot over a scene, by a link", ["render", "scene.toml", "-o", "out/a.png", "--snapshots", "states", "--snapshot-every", "1", "--threads", "2"], (0, 1, 2), r"^error: ",
             {"scene.toml": GAS, "states/state.0.bansho": link("../scene.toml")}, leaves=["out/*", "states/*"]),
        Case("over an input", "a new scene over a scene", ["new", "scene"], (1, 2), r"^error: scene\.toml: already exists", {"scene.toml": FLAME}),
        Case("over an input", "a new scene over a link to nothing", ["new", "scene"], (0, 1, 2), r"^error: scene\.toml", {"scene.toml": link("gone.toml")}),
        Case("over an input", "a new scene in a pipe", ["new", "scene"], (1, 2), r"^error: scene\.toml: ", {"scene.toml": pipe}),
        Case("over an input", "manual pages in a file", ["man", "scene.toml"], (1, 2), r"^error: scene\.toml", {"scene.toml": FLAME}),
    ]


def _others() -> list[Case]:
    """Files that the program did not make stay without `--overwrite`, and are replaced with it."""
    there = "^error: .*{}.*(overwrite|allowed)"

    def other(name: str, command: list[str], file: str, content: Content = THERE, scene: str = FLAME) -> list[Case]:
        files: dict[str, Content] = {"scene.toml": scene, file: content}
        place = file.replace(".", r"\.")
        return [
            Case("somebody's file", name, command, 2, there.format(place), files),
            Case("somebody's file", f"{name}, --overwrite", [*command, "--overwrite"], 0, "", files, changes=[file]),
        ]

    def render(path: str, *more: str) -> list[str]:
        return ["render", "scene.toml", "-o", path, *more, *ONE]

    return [
        *[case for extension in ("png", "exr", "apng", "gif") for case in other(f"a .{extension}", render(f"a.{extension}"), f"a.{extension}")],
        *other("a picture of somebody", render("a.png"), "a.png", png.flat(32, 24)),
        *other("one frame of two", ["render", "scene.toml", "-o", "a.png", "--threads", "2"], "a.0001.png"),
        *other("figures", render("a.png", "--metadata"), "a.json"),
        *other("a contact sheet", ["render", "scene.toml", "--contact-sheet", "2", "-o", "a.png", "--threads", "2"], "a.png"),
        *other("a flipbook's JSON", ["flipbook", "scene.toml", "--grid", "1x2", "--size", "8x8", "-o", "a.png"], "a.json"),
        *other("a flipbook's motion", ["flipbook", "scene.toml", "--grid", "1x2", "--size", "8x8", "-o", "a.png"], "a_motion.png"),
        *other("particles", ["simulate", "scene.toml", "--particles", "a.ply", "--frames", "0"], "a.ply", THERE, GAS),
        *other("an index of streaks", ["streaks", "--rates", "5", "--diameters", "2", "--size", "8", "--cube-size", "0.1", "-o", "s"], "s/streaks.json"),
        *other("with --resume", render("a.png", "--resume"), "a.png"),
        # Nobody's work is in it: it may be replaced or kept.
        Case("somebody's file", "an empty file", render("a.png"), (0, 2), r"^error: .*a\.png", {"scene.toml": FLAME, "a.png": ""}, changes=["a.png"]),
        Case("somebody's file", "a second time over one's own", render("a.png"), 0, "", {"scene.toml": FLAME}, setup=[render("a.png")], changes=["a.png"]),
        Case("somebody's file", "a second film over one's own", render("a.gif"), 0, "", {"scene.toml": FLAME}, setup=[render("a.gif")], changes=["a.gif"]),
        Case("somebody's file", "one's own cut off", render("a.png"), (0, 2), r"^error: .*a\.png", {"scene.toml": FLAME}, setup=[render("a.png")], damage={"a.png": png.SIGNATURE}, changes=["a.png"]),
    ]


def cases() -> list[Case]:
    return _names() + _places() + _inputs() + _others()
