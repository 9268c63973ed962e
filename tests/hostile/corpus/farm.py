"""Plans of tasks that are damaged, foreign or endless, and scripts that no shell should run."""

from .case import Case, Content, folder, link, pipe, sparse
from .scene_text import FLAME

OUT = ["scene.toml", "-o", "out/a.png"]
PLAN = ["farm", "slurm", *OUT, "--threads", "1", "--chunk", "1"]
FILE = "out/a.farm/plan.json"


def _plan(name: str, content: Content, code: int | tuple[int, ...] = (1, 2), **more) -> Case:
    return Case("plan", name, ["farm", "status", *OUT], code, r"^error: .*plan", {"scene.toml": FLAME}, setup=[PLAN], damage={FILE: content}, **more)


def _task(name: str, content: Content, **more) -> Case:
    """A token that is not that of the task: it waits for a minute, since shared file systems show files late, and is stopped before."""
    line = ["farm", "task", "out/a.farm", "--token", "0", "check"]
    return Case("plan", name, line, 1, r"^error: ", {"scene.toml": FLAME, "out/a.farm/token": content}, signaled=True, endless=True, **more)


def _refused(name: str, options: list[str], words: str) -> Case:
    return Case("plan", name, [*PLAN, *options], 2, rf"^error: .*({words})", {"scene.toml": FLAME}, leaves=["out/*"])


FARM_FILES = ("plan.json", "token", "jobs", "submit.sh", "check.sbatch", "snapshots.sbatch", "frames.sbatch", "finish.sbatch")
THERE = "somebody's own work\n"


def _kept(name: str, content: Content, says: str, command: list[str] = PLAN, file: str = "out/a.farm/token") -> Case:
    """What stands where the farm would write is kept."""
    return Case("plan", name, command, (1, 2), rf"^error: .*{says}", {"scene.toml": FLAME, file: content})


def _foreign() -> list[Case]:
    found = []
    for file in FARM_FILES:
        path = f"out/a.farm/{file}"
        found.append(_kept(f"a scene linked as {file}", link("../../scene.toml"), "is a link", file=path))
        found.append(_kept(f"a scene linked as {file}, with --overwrite", link("../../scene.toml"), "is a link", [*PLAN, "--overwrite"], file=path))
        found.append(_kept(f"somebody's {file}", THERE, "not made by Bansho", file=path))
    template = ["farm", "openjd", "scene.toml", "-o", "shot.yaml"]
    return [
        *found,
        _kept("somebody's template", "specificationVersion: jobtemplate-2023-09\n", "not made by Bansho", template, "shot.yaml"),
        _kept("a scene linked as a template", link("scene.toml"), "(is a file that the scene|not made by Bansho)", template, "shot.yaml"),
        Case("plan", "edited options", ["farm", "status", *OUT], (1, 2), r"^error: .*plan of tasks was changed", {"scene.toml": FLAME}, setup=[PLAN, ["render", "scene.toml", "-o", "out/a.png", "--frames", "0"]],
             damage={FILE: '{"format": 2, "arguments": ["--out=/elsewhere/a.png", "--", "scene.toml"],\n  "digest": "' + "0" * 64 + '"\n}\n'}),
    ]


def cases() -> list[Case]:
    fields = '"format": 1, "program": "Bansho 0.1.0", "token": "0", "arithmetic": "0", "folder": ".", "arguments": [], "frames": "0-9", "first_frame": 0'
    costs = '"costs": {"startup_s": 0, "step_s": 0, "draw_s": 0, "frame_bytes": 0, "snapshot_bytes": 0}'
    rest = '"snapshots": false, "film": null, "contact_sheet": null'
    return [
        _plan("empty", b""),
        _plan("garbage", bytes(range(256)) * 40),
        _plan("nested a hundred thousand times", "[" * 100_000),
        _plan("no tiles", f'{{{fields}, "chunk_frames": 10, "tiles": [0, 5], "digests": [""], {rest}, {costs}}}'),
        _plan("a million times a million tiles", f'{{{fields}, "chunk_frames": 10, "tiles": [1000000, 1000000], "digests": [""], {rest}, {costs}}}'),
        _plan("chunks of no frames", f'{{{fields}, "chunk_frames": 0, "tiles": [1, 1], "digests": [], {rest}, {costs}}}'),
        _plan("a pipe", pipe, signaled=True),
        _plan("endless", link("/dev/zero"), signaled=True),
        _plan("a folder", folder),
        _plan("a sparse file of 3.9 GB", sparse(3_900_000_000), signaled=True),
        *_foreign(),
        _task("an endless token", link("/dev/zero")),
        _task("a token that is a pipe", pipe),
        _refused("a partition with a line break", ["--partition", "a\n#SBATCH --uid=0"], "control characters"),
        _refused("an option with a line break", ["--sbatch=--comment=a\nrm -rf /"], "control characters"),
        _refused("chunks of nothing", ["--tiles", "0x0"], "COLUMNSxROWS"),
    ]
