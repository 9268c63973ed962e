#!/usr/bin/env python3
"""Kills, full disks, thousands of frames and two programs at once: what is there in the end is what an undisturbed run gives, byte for byte.

    endurance.py PROGRAM [--kills 200] [--disks 20] [--pairs 36] [--frames 10000] [--seed N] [--report FILE]

Prints one table. A file under its final name must at any time be the one of the undisturbed run; only hidden `.part` files may stay after
SIGKILL, and none after anything else.
"""

import argparse
import json
import os
import random
import shutil
import subprocess
import sys
import tempfile
import time
from collections import Counter
from dataclasses import dataclass, field

PICTURE = "bansho = 2\n[picture]\nsize = [96, 64]\nframes = {frames}\n"
SCENES = {
    "flame_sheet": "[[flame_sheet]]\n",
    "flame_particles": "[[flame_particles]]\nparticles = 400\npreroll_s = 0.1\n",
    "rain": "[[rain]]\nrate_mm_per_h = 10\n",
    "aurora": "[[aurora]]\npreroll_s = 0.1\nparticles = { count = 1000 }\nfield = { cells = 63 }\n",
}
STATED = ("flame_particles", "aurora")
FILMS = ("apng", "gif", "mp4", "mov", "webm")
BY_FFMPEG = ("mp4", "mov", "webm")
FRAMES = 24
# How much more memory the second half of a long run may take than the first: what threads keep for themselves settles late.
GROWTH_BYTES = 8 << 20
TINY = {"flame_sheet": "png", "flame_particles": "ply", "rain": "exr", "aurora": "png"}


@dataclass(frozen=True)
class Work:
    """A phenomenon and what is written of it."""

    phenomenon: str
    form: str

    def scene(self, frames: int) -> str:
        return PICTURE.format(frames=frames) + SCENES[self.phenomenon]

    def line(self, program: str, again: bool = False) -> list[str]:
        """What is run; `again` where an earlier run was disturbed."""
        if self.form == "ply":
            return [program, "simulate", "../scene.toml", "--particles", "a.####.ply"]
        if self.form == "flipbook":
            return [program, "flipbook", "../scene.toml", "--grid", "6x4", "--size", "64x48", "-o", "a.png"]
        line = [program, "render", "../scene.toml", "-o", f"a.{'png' if self.form == 'snapshots' else self.form}"]
        line += ["--layers", "--aovs"] * (self.form == "exr") + ["--snapshots", "states", "--snapshot-every", "3"] * (self.form == "snapshots")
        return line + ["--resume"] * (again and self.form not in FILMS)


def works() -> list[Work]:
    """Every phenomenon in every form that it has and that this machine can make."""
    forms = ["png", "exr", "flipbook", *FILMS, "ply", "snapshots"]
    if not shutil.which("ffmpeg"):
        print("no ffmpeg: .mp4, .mov and .webm are left out")
        forms = [form for form in forms if form not in BY_FFMPEG]
    return [Work(name, form) for name in SCENES for form in forms if name in STATED or form not in ("ply", "snapshots")]


@dataclass
class Tally:
    """What came of the runs of one row."""

    runs: int = 0
    # Runs that were disturbed before their end.
    disturbed: int = 0
    # Files under final names that are not those of the undisturbed run, right after the disturbance and in the end.
    broken: int = 0
    unequal: int = 0
    # Temporary files where none may be, exit codes and words that are not as promised.
    wrong: int = 0
    notes: list[str] = field(default_factory=list)

    def fault(self, told: str) -> None:
        self.wrong += 1
        self.notes.append(told)

    @property
    def is_bad(self) -> bool:
        return bool(self.broken or self.unequal or self.wrong)


def contents(folder: str) -> dict[str, bytes]:
    """Every file of a folder."""
    found = {}
    for place, _, files in os.walk(folder):
        for name in files:
            path = os.path.join(place, name)
            with open(path, "rb") as file:
                found[os.path.relpath(path, folder)] = file.read()
    return found


def finished(folder: str) -> dict[str, bytes]:
    return {name: bytes_ for name, bytes_ in contents(folder).items() if not name.endswith(".part")}


def parts(folder: str) -> list[str]:
    return [name for name in contents(folder) if name.endswith(".part")]


class Trial:
    """A folder with a scene and an undisturbed run of it."""

    def __init__(self, work: Work, program: str, within: str):
        self.work, self.program = work, program
        self.folder = tempfile.mkdtemp(dir=within)
        with open(os.path.join(self.folder, "scene.toml"), "w", encoding="utf-8") as scene:
            scene.write(work.scene(FRAMES))
        started = time.monotonic()
        code, told = self.run(self.place("whole"))
        self.seconds = time.monotonic() - started
        if code != 0:
            raise RuntimeError(f"{work}: the undisturbed run fails: {told}")
        self.whole = finished(self.place("whole"))

    def place(self, name: str) -> str:
        path = os.path.join(self.folder, name)
        os.makedirs(path, exist_ok=True)
        return path

    def start(self, folder: str, again: bool = False) -> subprocess.Popen:
        return subprocess.Popen(self.work.line(self.program, again), cwd=folder, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)

    def run(self, folder: str, again: bool = False) -> tuple[int, str]:
        process = self.start(folder, again)
        _, told = process.communicate()
        return process.returncode, told.decode("utf-8", "replace").strip()

    def broken(self, folder: str) -> list[str]:
        """Files under final names that are not those of the undisturbed run."""
        return [name for name, bytes_ in finished(folder).items() if self.whole.get(name) != bytes_]

    def compare(self, folder: str, tally: Tally) -> None:
        """Whether everything is as an undisturbed run leaves it."""
        found = finished(folder)
        if found != self.whole:
            tally.unequal += 1
            names = sorted(name for name in found.keys() | self.whole.keys() if found.get(name) != self.whole.get(name))
            tally.notes.append(f"unequal: {', '.join(names[:5])}")


def _again(trial: Trial, folder: str, tally: Tally) -> None:
    """Runs once more where a run was disturbed."""
    code, told = trial.run(folder, again=True)
    if code != 0:
        tally.fault(f"the second run: exit code {code}: {told[:200]}")
    trial.compare(folder, tally)


def kill(trial: Trial, folder: str, chance: random.Random, tally: Tally) -> None:
    """SIGKILL at a random moment before the end, then another run."""
    tally.runs += 1
    for _ in range(20):
        started = time.monotonic()
        process = trial.start(folder)
        try:
            process.wait(chance.uniform(0, trial.seconds))
        except subprocess.TimeoutExpired:
            process.kill()
            process.communicate()
            tally.disturbed += 1
            break
        # It ended before, so it is faster than it was when it was undisturbed.
        process.communicate()
        trial.seconds = min(trial.seconds, time.monotonic() - started)
        shutil.rmtree(folder)
        os.makedirs(folder)
    broken = trial.broken(folder)
    tally.broken += len(broken)
    tally.notes += [f"not whole after SIGKILL: {name}" for name in broken[:3]]
    _again(trial, folder, tally)


def fill_disk(trial: Trial, folder: str, chance: random.Random, tally: Tally) -> None:
    """A file system that is full at a random byte, then one with room."""
    tally.runs += 1
    needed = sum(len(bytes_) for bytes_ in trial.whole.values())
    size = chance.randrange(4096, int(1.1 * needed) + 8192)
    subprocess.run(["mount", "-t", "tmpfs", "-o", f"size={size}", "tmpfs", folder], check=True)
    try:
        code, told = trial.run(folder)
        tally.disturbed += code != 0
        if code not in (0, 1) or (code == 1 and "disk is full" not in told and "No space left" not in told):
            tally.fault(f"a disk of {size} bytes: exit code {code}: {told[:200]}")
        if parts(folder):
            tally.fault(f"a disk of {size} bytes: {parts(folder)[0]} stays")
        tally.broken += len(trial.broken(folder))
        subprocess.run(["mount", "-o", "remount,size=256m", folder], check=True)
        _again(trial, folder, tally)
    finally:
        subprocess.run(["umount", folder], check=True)


def pair(trial: Trial, folder: str, chance: random.Random, tally: Tally) -> None:
    """Two programs that do the same work in the same folder, one a little later."""
    tally.runs += 1
    first = trial.start(folder)
    time.sleep(chance.uniform(0, 0.5 * trial.seconds))
    tally.disturbed += first.poll() is None
    second = trial.start(folder)
    for process in (first, second):
        _, told = process.communicate()
        if process.returncode != 0:
            tally.fault(f"exit code {process.returncode}: {told.decode('utf-8', 'replace')[:200]}")
    if parts(folder):
        tally.fault(f"{parts(folder)[0]} stays")
    trial.compare(folder, tally)


def repeat(what, count: int, trials: list[Trial], chance: random.Random) -> dict[tuple[str, str], Tally]:
    """So many times, all works in turn."""
    tallies: dict[tuple[str, str], Tally] = {}
    for index in range(count):
        trial = trials[index % len(trials)]
        tally = tallies.setdefault((trial.work.phenomenon, trial.work.form), Tally())
        folder = trial.place("disturbed")
        what(trial, folder, chance, tally)
        shutil.rmtree(folder)
    return tallies


def resident_bytes(process: int) -> int:
    with open(f"/proc/{process}/statm", encoding="ascii") as file:
        return int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE")


def many_frames(program: str, within: str, phenomenon: str, form: str, frames: int) -> tuple[str, bool]:
    """Very many tiny frames; whether the second half takes no more memory than the first."""
    folder = tempfile.mkdtemp(dir=within)
    with open(os.path.join(folder, "scene.toml"), "w", encoding="utf-8") as scene:
        scene.write(Work(phenomenon, form).scene(frames).replace("[96, 64]", "[8, 8]"))
    line = [program, "simulate", "scene.toml", "--particles", "out/a.ply"] if form == "ply" else [program, "render", "scene.toml", "-o", f"out/a.{form}"]
    started, sizes = time.monotonic(), []
    process = subprocess.Popen([*line, "--progress", "json"], cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL)
    assert process.stdout is not None
    for told in process.stdout:
        if json.loads(told).get("event") == "frame" and len(sizes) < frames:
            try:
                sizes.append(resident_bytes(process.pid))
            except (FileNotFoundError, IndexError):
                break
    code = process.wait()
    there = len(os.listdir(os.path.join(folder, "out")))
    shutil.rmtree(folder)
    # What is taken once and kept settles in the first tenth.
    first, second = (max(half, default=0) for half in (sizes[len(sizes) // 10 : len(sizes) // 2], sizes[len(sizes) // 2 :]))
    is_good = code == 0 and there == frames and second - first <= GROWTH_BYTES and second > 0
    mebibytes = 1 / (1 << 20)
    row = f"{frames} frames of {phenomenon} as .{form}: {there} there, exit code {code}, resident {first * mebibytes:.1f} MiB, then {second * mebibytes:.1f} MiB, {time.monotonic() - started:.0f} s"
    return row, is_good


def can_mount(within: str) -> bool:
    place = tempfile.mkdtemp(dir=within)
    if subprocess.run(["mount", "-t", "tmpfs", "-o", "size=64k", "tmpfs", place], capture_output=True).returncode != 0:
        return False
    subprocess.run(["umount", place], check=True)
    return True


def table(name: str, tallies: dict[tuple[str, str], Tally]) -> list[str]:
    lines = [f"{name:32} {'runs':>5} {'disturbed':>9} {'not whole':>9} {'unequal':>8} {'wrong':>6}"]
    total: Counter = Counter()
    for (phenomenon, form), tally in sorted(tallies.items()):
        lines.append(f"  {phenomenon:18} {form:11} {tally.runs:5} {tally.disturbed:9} {tally.broken:9} {tally.unequal:8} {tally.wrong:6}")
        total.update(runs=tally.runs, disturbed=tally.disturbed, broken=tally.broken, unequal=tally.unequal, wrong=tally.wrong)
        lines += [f"      {note}" for note in tally.notes[:5]]
    lines.append(f"  {'all':30} {total['runs']:5} {total['disturbed']:9} {total['broken']:9} {total['unequal']:8} {total['wrong']:6}")
    return [*lines, ""]


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("program", type=os.path.abspath)
    parser.add_argument("--kills", type=int, default=200, help="SIGKILLs")
    parser.add_argument("--disks", type=int, default=20, help="full disks")
    parser.add_argument("--pairs", type=int, default=36, help="pairs of programs on one folder")
    parser.add_argument("--frames", type=int, default=10_000, help="frames of each long run; 0 for none")
    parser.add_argument("--only", default="", help="only works whose phenomenon or form is this")
    parser.add_argument("--seed", type=int, default=int(time.time()), help="of moments and sizes; by the clock unless given")
    parser.add_argument("--report", help="a file for what is printed")
    asked = parser.parse_args()
    started, chance, lines, is_good = time.monotonic(), random.Random(asked.seed), [], True
    with tempfile.TemporaryDirectory(prefix="endurance-") as within:
        chosen = [work for work in works() if asked.only in ("", work.phenomenon, work.form)]
        chance.shuffle(chosen)
        trials = [Trial(work, asked.program, within) for work in chosen[: max(asked.kills, asked.disks, asked.pairs)]]
        for name, what, count in (("SIGKILL, then another run", kill, asked.kills), ("two programs on one folder", pair, asked.pairs), ("a full disk, then room", fill_disk, asked.disks)):
            if what is fill_disk and count and not can_mount(within):
                lines += ["full disks: ignored, since no file system may be mounted here", ""]
                continue
            tallies = repeat(what, count, trials, chance)
            lines += table(name, tallies) if tallies else []
            is_good &= not any(tally.is_bad for tally in tallies.values())
        for phenomenon, form in TINY.items() if asked.frames else ():
            row, flat = many_frames(asked.program, within, phenomenon, form, asked.frames)
            lines.append(row + ("" if flat else "  FAILED"))
            is_good &= flat
    lines.append(f"seed {asked.seed}, {time.monotonic() - started:.0f} s: {'all as promised' if is_good else 'FAILED'}")
    print("\n".join(lines))
    if asked.report:
        with open(asked.report, "w", encoding="utf-8") as report:
            report.write("\n".join(lines) + "\n")
    return 0 if is_good else 1


if __name__ == "__main__":
    sys.exit(main())
