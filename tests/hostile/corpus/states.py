"""Snapshots and frames that are there already: damaged, foreign, endless."""

from . import png
from .case import Case, Content, folder, link, pipe, sparse
from .outputs import GAS
from .scene_text import FLAME

RENDER = ["render", "scene.toml", "-o", "out/a.png", "--snapshots", "states", "--snapshot-every", "1", "--threads", "2"]
STATE = "states/state.1.bansho"
MAGIC = b"BANSHOSS"


def _state(name: str, content: Content, code: int | tuple[int, ...] = (0, 1, 2), **more) -> Case:
    """A state in place of one that would be gone on from: it is told and made anew, or, where it is no file of the program's, refused."""
    return Case("snapshot", name, [*RENDER, "--frames", "2"], code, r"^error: .*(states/state\.\d+\.bansho|overwrite)", {"scene.toml": GAS, STATE: content},
                leaves=["out/*", "states/*"], changes=[STATE], **more)


def _kept(name: str, damage: dict[str, Content], code: int | tuple[int, ...] = 0, **more) -> Case:
    """A state that the program wrote, damaged since."""
    return Case("snapshot", name, [*RENDER, "--frames", "2"], code, r"^error: ", {"scene.toml": GAS}, setup=[[*RENDER, "--frames", "0-1"]], damage=damage,
                leaves=["out/*", "states/*"], changes=["states/*"], **more)


def _snapshots() -> list[Case]:
    return [
        _state("empty", b""),
        _state("magic alone", MAGIC),
        _state("magic and garbage", MAGIC + bytes(range(256)) * 40),
        _state("garbage", bytes(range(256)) * 40),
        _state("a version of tomorrow", MAGIC + b"\xff\xff\xff\xff" + bytes(200)),
        _state("a pipe", pipe, signaled=True),
        _state("endless", link("/dev/zero"), signaled=True),
        _state("a folder", folder),
        _state("a link to itself", link("state.1.bansho")),
        _state("a sparse file of 3.9 GB", sparse(3_900_000_000), signaled=True),
        _state("magic and 3.9 GB", sparse(3_900_000_000, MAGIC), signaled=True),
        _kept("empty since", {"states/state.1.bansho": b"", "states/state.0.bansho": b""}),
        _kept("of another frame's name", {"states/state.99999999999999999999.bansho": b"x", "states/state.-1.bansho": b"x", "states/state..bansho": b"x"}, (0, 2)),
        _kept("of frames far ahead", {"states/state.9223372036854775807.bansho": MAGIC, "states/state.-9223372036854775808.bansho": MAGIC}, (0, 1, 2)),
        _kept("10,000 files of other names", {f"states/other.{index}": b"" for index in range(10_000)}),
        Case("snapshot", "a folder that is a file", [*RENDER[:5], "scene.toml", *RENDER[6:]], (1, 2), r"^error: .*scene\.toml", {"scene.toml": GAS}, leaves=["out/*"]),
        Case("snapshot", "a folder that is a device", [*RENDER[:5], "/dev/null", *RENDER[6:]], (1, 2), r"^error: .*/dev/null", {"scene.toml": GAS}, leaves=["out/*"]),
        Case("snapshot", "a folder that is a pipe", [*RENDER[:5], "pipe", *RENDER[6:]], (1, 2), r"^error: .*pipe", {"scene.toml": GAS, "pipe": pipe}, leaves=["out/*"], signaled=True),
        Case("snapshot", "of a scene without a state", [*RENDER, "--frames", "0"], 0, "", {"scene.toml": FLAME}),
    ]


def _resumed(name: str, frame: Content, code: int | tuple[int, ...] = (0, 2), **more) -> Case:
    line = ["render", "scene.toml", "-o", "out/a.png", "--threads", "2"]
    return Case("resume", name, [*line, "--resume"], code, r"^error: (out/a\.0001\.png: |.*out/a\.0001\.png)", {"scene.toml": FLAME}, setup=[[*line, "--frames", "0"]],
                damage={"out/a.0001.png": frame}, leaves=["out/a.0000.png"], changes=["out/a.0001.png"], **more)


def _resume() -> list[Case]:
    return [
        _resumed("an empty frame", b""),
        _resumed("a frame cut off", png.flat(32, 24)[:60]),
        _resumed("somebody's frame", png.flat(32, 24)),
        _resumed("a frame of text", "somebody's own work\n"),
        _resumed("a frame with 10,000 marks", png.flat(32, 24, extra=png.chunk(b"tEXt", b"bansho:fingerprint\0" + b"0" * 64) * 10_000)),
        _resumed("a pipe as a frame", pipe, (1, 2), signaled=True),
        _resumed("an endless frame", link("/dev/zero"), (1, 2), signaled=True),
        _resumed("a folder as a frame", folder, (1, 2)),
        _resumed("a frame of 3.9 GB", sparse(3_900_000_000), (0, 1, 2), signaled=True),
        _resumed("a frame of 3.9 GB that begins well", sparse(3_900_000_000, png.flat(32, 24)[:-12]), (0, 1, 2), signaled=True),
        _resumed("a frame that is a link to the scene", link("../scene.toml"), 2),
    ]


def cases() -> list[Case]:
    return _snapshots() + _resume()
