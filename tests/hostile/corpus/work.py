"""Work that goes on for long: only run to be stopped by a signal."""

from .case import Case, parts
from .scene_text import FLAME

LONG = FLAME.replace("[32, 24]", "[160, 120]").replace("frames = 2", "frames = 1000000")
SHORT = LONG.replace("1000000", "4000")
GAS = "bansho = 2\n[picture]\nsize = [160, 120]\nframes = 1000000\n[[flame_particles]]\n"
RAIN = "bansho = 2\n[picture]\nsize = [160, 120]\nframes = 1000000\n[[rain]]\n"
AURORA = "bansho = 2\n[picture]\nsize = [160, 90]\nframes = 1000000\n[[aurora]]\n"


def _work(name: str, command: list[str], scene: str = LONG) -> Case:
    return Case("work", name, command, 143, r"^error: .*stopped", {"scene.toml": scene}, signaled=True, endless=True, leaves=["out/*.png", "out/*.exr", "out/*.ply", "out/*.json", "states/*.bansho"])


def cases() -> list[Case]:
    render = ["render", "scene.toml", "--threads", "2", "--progress", "none", "-o"]
    return [
        *[_work(f"a sheet as .{extension}", [*render, f"out/a.{extension}"]) for extension in ("png", "exr")],
        *[_work(f"a sheet as .{extension}", [*render, f"out/a.{extension}"], SHORT) for extension in ("apng", "gif")],
        _work("layers and AOVs", [*render, "out/a.exr", "--layers", "--aovs"]),
        _work("figures", [*render, "out/a.png", "--metadata"]),
        _work("gas", [*render, "out/a.png", "--snapshots", "states", "--snapshot-every", "1"], GAS),
        _work("rain", [*render, "out/a.png"], RAIN),
        _work("an aurora", [*render, "out/a.png"], AURORA),
        _work("large pictures", [*render, "out/a.png", "--size", "2048x2048"]),
        _work("a large film", [*render, "out/a.apng", "--size", "1024x1024"], SHORT),
        # Of gas, since 1024 frames of a small sheet are drawn within a second.
        _work("a contact sheet", [*render, "a.png", "--contact-sheet", "1024"], GAS),
        _work("a loop", [*render, "out/a.png", "--loop", "3600"]),
        _work("a flipbook", ["flipbook", "scene.toml", "--grid", "32x32", "--size", "200x200", "-o", "a.png"]),
        _work("particles", ["simulate", "scene.toml", "--particles", "out/a.ply", "--progress", "none"], GAS),
        _work("particles of an aurora", ["simulate", "scene.toml", "--particles", "out/a.ply", "--progress", "none"], AURORA),
        Case("work", "streaks", ["streaks", "-o", "out", "--size", "2048", "--variants", "1000", "--progress", "none"], 143, r"^error: .*stopped", signaled=True, endless=True, leaves=["out/*.png"]),
        Case("work", "check of 100,000 sheets", ["check", "scene.toml"], (0, 3, 143), "", {"scene.toml": parts(("bansho = 2\n", 1), ("[[flame_sheet]]\n", 100_000))}, signaled=True, endless=True),
        Case("work", "check of 10,000 auroras", ["check", "scene.toml"], (0, 3, 143), "", {"scene.toml": parts(("bansho = 2\n", 1), ("[[aurora]]\n", 10_000))}, signaled=True, endless=True),
        Case("work", "check of 1,000 meshes' distances", ["check", "scene.toml"], (0, 3, 143), "", {"scene.toml": parts((FLAME, 1), ("[[obstacle]]\n", 100_000))}, signaled=True, endless=True),
        Case("work", "calibrate", ["calibrate"], (0, 143), "", signaled=True, endless=True),
    ]
