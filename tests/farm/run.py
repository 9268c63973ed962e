#!/usr/bin/env python3
"""A shot on a real cluster of Slurm, on three nodes of this machine, and by `openjd run`: the bytes of one process, whatever fails on the way.

    run.py PROGRAM [--long] [--frames AURORA,RAIN] [--report FILE]

An aurora, which is simulated and so needs snapshots, runs undisturbed, and its CPU time is compared with that of one process; then one of its tasks is
killed. Rain loses a node in the middle of a chunk, one task is requeued, one node is drained, and the disk is full once. With --long there are as many
frames as take one process ten minutes of CPU time, and both shots are disturbed.
"""

import argparse
import collections
import collections.abc
import errno
import hashlib
import json
import math
import os
import pathlib
import resource
import shutil
import signal
import struct
import subprocess
import sys
import tempfile
import time
import zlib

from cluster import Cluster, why_not

PICTURE = "bansho = 2\n[picture]\nsize = [{width}, {height}]\nframes = {frames}\n"
AURORA = "[[aurora]]\npreroll_s = 0.1\nparticles = {{ count = {particles} }}\nfield = {{ cells = 63 }}\n"
RAIN = pathlib.Path(__file__).resolve().parent / "rain.toml"
RAIN_FRAMES = "frames = 240\n"
# CPU time of all tasks over that of one process, snapshots, checks and measuring included.
MAX_CPU_RATIO = 1.10
# CPU time that every process takes to start: building the scene, the check of the arithmetic, s. It matters only in short runs.
START_S = 0.3
# Free space that a full disk is left with, bytes.
LEFT_FREE = 200_000
DISK_MIB = {False: 1024, True: 10240}
# CPU time that one process takes for the frames of each shot of a long run, s.
LONG_SHOT_S = 310.0

failures: list[str] = []
report: list[str] = []


def say(text: str) -> None:
    """A line for the reader and the report."""
    print(text, flush=True)
    report.append(text)


def expect(condition: bool, what: str) -> None:
    """Notes what is not as it must be."""
    if not condition:
        failures.append(what)
        say(f"FAILED: {what}")


def cpu_seconds() -> float:
    """CPU time of all children that have ended."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


class Shot:
    """A scene, what one process makes of it, and its folder."""

    def __init__(self, program: str, name: str, text: str, chunk: int, folder: pathlib.Path):
        self.program, self.name, self.chunk, self.folder = program, name, chunk, folder
        folder.mkdir(parents=True)
        self.scene = folder / f"{name}.toml"
        self.scene.write_text(text)
        # Encoded by the task itself, whose CPU time its journal has.
        self.film = "film.apng"

    def render_alone(self) -> None:
        """One process for the frames, and one for their film."""
        begun, used = time.monotonic(), cpu_seconds()
        out = self.folder / "alone/a.####.png"
        options = [str(self.scene), "-o", str(out), "--threads", "1", "--progress", "none"]
        subprocess.run([self.program, "render", *options], check=True)
        subprocess.run([self.program, "farm", "finish", *options, "--film", str(out.parent / self.film)], check=True)
        self.alone_cpu, self.alone_wall = cpu_seconds() - used, time.monotonic() - begun
        self.expected = frames_of(out.parent)
        say(f"{self.name}: {len(self.expected)} frames by one process with one thread: {self.alone_cpu:.1f} s of CPU time, {self.alone_wall:.1f} s")

    def submit(self, cluster: Cluster, out: pathlib.Path) -> float:
        """Plans and submits what is missing; the CPU time that this took."""
        used = cpu_seconds()
        line = [self.program, "farm", "slurm", str(self.scene), "-o", str(out / "a.####.png"), "--threads", "1", "--chunk", str(self.chunk)]
        line += ["--film", str(out / self.film), "--submit"]
        subprocess.run(line, check=True, env=cluster.environment, stdout=subprocess.DEVNULL)
        return cpu_seconds() - used

    def status(self, out: pathlib.Path, cluster: Cluster | None = None) -> tuple[int, dict]:
        """Exit code and JSON of `farm status`, on a machine of the cluster or on one without Slurm."""
        line = [self.program, "farm", "status", str(self.scene), "-o", str(out / "a.####.png"), "--json"]
        environment = cluster.environment if cluster else {**os.environ, "PATH": ""}
        done = subprocess.run(line, capture_output=True, text=True, env=environment)
        return done.returncode, json.loads(done.stdout or "{}")

    def check(self, out: pathlib.Path, probed: int, lost: int) -> None:
        """The bytes are those of one process, each frame was drawn once, and the film plays."""
        expect(frames_of(out) == self.expected, f"{self.name}: the frames in {out} are those of one process")
        expect(not list(out.glob(".*.part")) or lost > 0, f"{self.name}: no unfinished file is left")
        drawn = journaled_frames(out)
        again = {number: count for number, count in drawn.items() if count > 1}
        expect(not again, f"{self.name}: no finished frame was drawn again: {again}")
        total = sum(drawn.values()) + probed
        expect(len(self.expected) - lost <= total <= len(self.expected), f"{self.name}: {total} frames were drawn of {len(self.expected)}")
        code, status = self.status(out)
        expect(code == 0 and status.get("complete") is True, f"{self.name}: all is whole: {status.get('frames')}")
        expect(plays(out / self.film, len(self.expected)), f"{self.name}: the film plays")


def frames_of(folder: pathlib.Path) -> dict[str, str]:
    """Digests of the frames in a folder."""
    return {path.name: hashlib.sha256(path.read_bytes()).hexdigest() for path in sorted(folder.glob("a.[0-9]*.png"))}


def count_frames(folder: pathlib.Path) -> int:
    """Number of frames in a folder."""
    return len(list(folder.glob("a.[0-9]*.png")))


def journal(out: pathlib.Path) -> list[dict]:
    """All lines of all journals."""
    lines = [line for path in (out / "a.farm/journal").glob("*.jsonl") for line in path.read_text().splitlines()]
    events = []
    for line in lines:
        try:
            events.append(json.loads(line))
        except ValueError:
            pass  # cut by a kill or a full disk
    return events


def journaled_frames(out: pathlib.Path) -> collections.Counter:
    """How often each frame was drawn."""
    return collections.Counter(event["number"] for event in journal(out) if event["event"] == "frame")


def plays(film: pathlib.Path, frames: int) -> bool:
    """Whether a film has all its frames: an APNG by its chunks, since ffprobe reads only the first 2 GiB of one; any other film is decoded."""
    if film.suffix == ".apng":
        return apng_frames(film) == frames
    line = ["ffprobe", "-v", "error", "-count_frames", "-select_streams", "v", "-show_entries", "stream=nb_read_frames", "-of", "csv=p=0", str(film)]
    return subprocess.run(line, capture_output=True, text=True).stdout.strip().rstrip(",") == str(frames)


def apng_frames(film: pathlib.Path) -> int | None:
    """Number of frames of an APNG; None if it is cut off, a checksum is wrong, or it states another number."""
    stated, found = None, 0
    with open(film, "rb") as file:
        if file.read(8) != b"\x89PNG\r\n\x1a\n":
            return None
        while len(header := file.read(8)) == 8:
            length, kind = struct.unpack(">I4s", header)
            data, check = file.read(length), file.read(4)
            if check != struct.pack(">I", zlib.crc32(data, zlib.crc32(kind))):
                return None
            if kind == b"acTL":
                stated = int.from_bytes(data[:4], "big")
            found += kind == b"fcTL"
            if kind == b"IEND":
                return found if found == stated and not file.read(1) else None
    return None


def undisturbed(shot: Shot, cluster: Cluster, is_strict: bool) -> None:
    """The array as it should be, and what it costs more than one process. Processor time grows where others use the same cores: what costs too much is measured
    a second time, both the array and the process."""
    if not has_low_cost(shot, cluster, is_strict):
        say(f"{shot.name}: measured again")
        shutil.rmtree(shot.folder / "alone")
        shot.render_alone()
        expect(has_low_cost(shot, cluster, is_strict), f"{shot.name}: CPU time of all tasks is at most {MAX_CPU_RATIO} of one process")


def has_low_cost(shot: Shot, cluster: Cluster, is_strict: bool) -> bool:
    """Runs and checks the array; whether it takes as little CPU time as it may."""
    out, begun = shot.folder / "calm", time.monotonic()
    used = shot.submit(cluster, out)
    probed = count_frames(out)
    cluster.wait("the jobs end", cluster.is_empty, 3600)
    wall = time.monotonic() - begun
    shot.check(out, probed, 0)
    events = journal(out)
    shutil.rmtree(out)
    ends = [event for event in events if event["event"] == "end"]
    cpu = used + sum(event["cpu_seconds"] for event in ends)
    parts = ", ".join(f"{event['cpu_seconds']:.1f}" for event in ends)
    say(f"{shot.name}: CPU seconds of each task: {parts}; of planning and measuring: {used:.1f}")
    say(f"{shot.name}: on three nodes: {cpu:.1f} s of CPU time in {len(ends)} tasks ({cpu / shot.alone_cpu:.3f} of one process), {wall:.1f} s, "
        f"with the queue of Slurm, on {os.cpu_count()} cores")
    allowed = MAX_CPU_RATIO * shot.alone_cpu + (0.0 if is_strict else START_S * (len(ends) + 1))
    return cpu <= allowed


def disturbed(shot: Shot, cluster: Cluster, disk: pathlib.Path) -> None:
    """A lost node, a requeued task, a drained node, a full disk; then the same command once more."""
    out = disk / shot.name
    out.mkdir()
    shot.film = "film.mp4" if shutil.which("ffmpeg") and shutil.which("ffprobe") else "film.apng"
    shot.submit(cluster, out)
    probed = count_frames(out)
    cluster.wait("frames are drawn", lambda: count_frames(out) >= probed + 3, 600)
    tasks = cluster.wait_for_tasks_on("n1", "n2", "n3")
    begun = time.monotonic()
    lost, requeued = tasks["n2"], tasks["n1"]
    say(f"{shot.name}: n2 is lost in the middle of task {lost}, task {requeued} is requeued, n1 and n3 are drained")
    # Drained nodes take no other task, so that frames are still missing when the disk is full.
    cluster.run("scontrol", "update", "nodename=n1,n3", "state=drain", "reason=test")
    cluster.run("scontrol", "requeue", requeued)
    cluster.kill_node("n2")
    # The lost task is queued again when its node is missed.
    cluster.wait("the lost task leaves its node", lambda: (lost, "n2") not in cluster.running(), 120)
    say(f"{shot.name}: the task of the lost node was queued again after {time.monotonic() - begun:.0f} s")
    state = state_of(shot.status(out, cluster)[1], lost)
    expect(state in ("waiting", "running", "done"), f"{shot.name}: the task that is queued again is not lost, but {state}")
    fill(disk)
    cluster.start_node("n2")
    cluster.run("scontrol", "update", "nodename=n1", "state=resume")
    cluster.wait("the jobs end for want of space", cluster.is_empty, 3600)
    code, status = shot.status(out)
    state = status.get("finish", {}).get("state")
    expect(code == 1 and state == "blocked", f"{shot.name}: the status says why the last job did not run: {status.get('finish')}")
    expect(frames_of(out).items() <= shot.expected.items(), f"{shot.name}: what is there when the disk is full is whole")
    say(f"{shot.name}: disk full: {status['frames']}; last job: {str(status.get('finish'))[:200]}")
    (disk / "filler").unlink()
    cluster.run("scontrol", "update", "nodename=n3", "state=resume")
    shot.submit(cluster, out)
    cluster.wait("the jobs end", cluster.is_empty, 3600)
    # At most one frame for each attempt that was killed is without a line in a journal.
    shot.check(out, probed, 2)
    shutil.rmtree(out)


def state_of(status: dict, job: str) -> str:
    """The state of a task in a status, by its job such as `12_3`."""
    return status["tasks"][int(job.split("_")[1])]["state"]


def killed(shot: Shot, cluster: Cluster) -> None:
    """A task is killed, which writes nothing more: its journal looks like that of one that runs, and only Slurm knows better."""
    out = shot.folder / "killed"
    shot.submit(cluster, out)
    probed = count_frames(out)
    cluster.wait("frames are drawn", lambda: len(cluster.running()) > 0 and count_frames(out) >= probed + 2, 600)
    job, node = cluster.running()[0]
    expect(state_of(shot.status(out, cluster)[1], job) == "running", f"{shot.name}: task {job} runs")
    # By the system: `scancel` sends a signal first that the program obeys, and says so in its journal.
    cluster.kill_program(node, shot.program)
    cluster.wait("the killed task is gone", lambda: job not in cluster.queued(), 60)
    found = [state_of(shot.status(out, machine)[1], job) for machine in (cluster, None)]
    expect(found == ["lost", "running"], f"{shot.name}: the killed task is lost, as far as Slurm can be asked: {found}")
    cluster.wait("the others end", cluster.is_empty, 600)
    code, status = shot.status(out, cluster)
    expect(code == 1 and status["finish"]["state"] == "lost", f"{shot.name}: nothing is queued any longer: {status['finish']}")
    shot.submit(cluster, out)
    cluster.wait("the jobs end", cluster.is_empty, 3600)
    shot.check(out, probed, 1)
    shutil.rmtree(out)
    say(f"{shot.name}: a task that was killed on {node} is told as lost, and drawn when the command is repeated")


def fill(disk: pathlib.Path) -> None:
    """Takes all but a little of the disk."""
    with open(disk / "filler", "wb") as filler:
        while True:
            try:
                os.posix_fallocate(filler.fileno(), 0, max(shutil.disk_usage(disk).free - LEFT_FREE, 1))
                return
            except OSError as error:
                # Frames are written at the same time.
                if error.errno != errno.ENOSPC:
                    raise


def by_openjd(shot: Shot, *options: str) -> None:
    """The same shot by the reference implementation of Open Job Description, with other options of the template."""
    if not shutil.which("openjd"):
        say("openjd: ignored: needs openjd-cli")
        return
    template, out = shot.folder / "template.yaml", shot.folder / "openjd"
    line = [shot.program, "farm", "openjd", str(shot.scene), "-o", str(template), "--frame-name", "a.####.png", "--chunk", str(shot.chunk)]
    line += ["--film", shot.film, "--contact-sheet", "4", *options]
    subprocess.run(line, check=True, stdout=subprocess.DEVNULL)
    subprocess.run(["openjd", "check", str(template)], check=True, stdout=subprocess.DEVNULL)
    begun = time.monotonic()
    line = ["openjd", "run", str(template), "-p", f"OutputFolder={out}", "-p", f"Program={shot.program}"]
    done = subprocess.run(line, capture_output=True, text=True)
    expect(done.returncode == 0, f"openjd run: {done.stdout[-500:]}{done.stderr[-500:]}")
    expect(frames_of(out) == shot.expected, f"{shot.name}: the frames of openjd are those of one process")
    expect(plays(out / shot.film, len(shot.expected)), f"{shot.name}: the film of openjd plays")
    expect((out / "a.sheet.png").is_file(), f"{shot.name}: openjd made the contact sheet")
    say(f"{shot.name}: by openjd run: the same bytes, {time.monotonic() - begun:.1f} s")


def in_tiles(program: str, folder: pathlib.Path) -> None:
    """A small shot by Open Job Description with tiles and a flipbook, which is that of the command."""
    text = PICTURE.format(width=96, height=64, frames=9) + AURORA.format(particles=300)
    shot = Shot(program, "tiles", text, 3, folder / "tiles")
    shot.render_alone()
    by_openjd(shot, "--tiles", "2x2", "--flipbook", "f.png", "--flipbook-grid", "2x2")
    if not shutil.which("openjd"):
        return
    flipbook = shot.folder / "flipbook/f.png"
    subprocess.run([program, "flipbook", str(shot.scene), "--grid", "2x2", "-o", str(flipbook), "--progress", "none"], check=True)
    for path in sorted(flipbook.parent.iterdir()):
        expect((shot.folder / "openjd" / path.name).read_bytes() == path.read_bytes(), f"{path.name} of openjd is that of `bansho flipbook`")


def seen_differently(shot: Shot, cluster: Cluster) -> None:
    """A node that has another folder at the path of the shared one: nothing is drawn."""
    out = shot.folder / "split"
    out.mkdir()
    cluster.stop_node("n3")
    cluster.start_node("n3", "unshare", "--mount", "--", "sh", "-c", f"mount -t tmpfs none {out} && exec \"$@\"", "sh")
    cluster.wait("n3 is back", lambda: "idle" in cluster.run("sinfo", "-h", "-n", "n3", "-o", "%T"), 60)
    shot.submit(cluster, out)
    probed = count_frames(out)
    cluster.wait("the jobs end", cluster.is_empty, 300)
    expect(count_frames(out) == probed, f"{shot.name}: nothing is drawn where a node sees another folder")
    words = "".join(path.read_text() for path in (out / "a.farm/log").glob("check-*.log"))
    expect("this machine sees no file" in words, f"{shot.name}: the check says what the node sees: {words}")
    cluster.stop_node("n3")
    cluster.start_node("n3")
    cluster.wait("n3 is back", lambda: "idle" in cluster.run("sinfo", "-h", "-n", "n3", "-o", "%T"), 60)
    say(f"{shot.name}: a node with another folder was found before any task ran")


def refused_by_slurm(shot: Shot, cluster: Cluster) -> None:
    """Slurm's own words about a partition that does not exist, before anything is drawn."""
    out = shot.folder / "refused"
    line = [shot.program, "farm", "slurm", str(shot.scene), "-o", str(out / "a.####.png"), "--partition", "nowhere", "--submit"]
    done = subprocess.run(line, capture_output=True, text=True, env=cluster.environment)
    expect(done.returncode == 1 and "invalid partition specified: nowhere" in done.stderr, f"a partition that does not exist: {done.stderr}")
    expect(not out.exists(), "nothing is drawn for a partition that does not exist")


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program")
    parser.add_argument("--long", action="store_true")
    parser.add_argument("--frames", type=lambda text: [int(number) for number in text.split(",")], help="number of frames of either shot")
    parser.add_argument("--report", type=pathlib.Path)
    arguments = parser.parse_args()
    # So that daemons and the disk are cleaned up.
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(143))
    reason = why_not()
    if reason:
        print(f"ignored: {reason}")
        return 0
    program = str(pathlib.Path(arguments.program).resolve())
    folder = pathlib.Path(tempfile.mkdtemp(prefix="farm-"))
    disk = folder / "disk"
    disk.mkdir()
    try:
        subprocess.run(["mount", "-t", "tmpfs", "-o", f"size={DISK_MIB[arguments.long]}m", "tmpfs", str(disk)], check=True)
        with Cluster(folder / "cluster") as cluster:
            prove(program, folder, disk, cluster, arguments)
    finally:
        subprocess.run(["umount", str(disk)], check=False)
        if not failures:
            shutil.rmtree(folder, ignore_errors=True)
    say(f"{len(failures)} failures" if failures else "every shot has the bytes of one process")
    if arguments.report:
        arguments.report.write_text("\n".join(report) + "\n")
    return int(bool(failures))


def aurora_of(frames: int) -> str:
    """The scene of an aurora, which is simulated."""
    return PICTURE.format(width=1280, height=720, frames=frames) + AURORA.format(particles=1500)


def rain_of(frames: int) -> str:
    """The scene of rain, which is not."""
    return RAIN.read_text().replace(RAIN_FRAMES, f"frames = {frames}\n")


def frames_for_cpu_time(program: str, folder: pathlib.Path, scene: collections.abc.Callable[[int], str], seconds: float) -> int:
    """How many frames of a scene take one process that much CPU time, extrapolated from a few."""
    measured = 60
    folder.mkdir()
    (folder / "scene.toml").write_text(scene(measured))
    used = cpu_seconds()
    line = [program, "render", str(folder / "scene.toml"), "-o", str(folder / "a.####.png"), "--threads", "1", "--progress", "none"]
    subprocess.run(line, check=True)
    frames = math.ceil(measured * seconds / (cpu_seconds() - used))
    shutil.rmtree(folder)
    return frames


def prove(program: str, folder: pathlib.Path, disk: pathlib.Path, cluster: Cluster, arguments: argparse.Namespace) -> None:
    """All shots."""
    is_long = arguments.long
    scenes = {"aurora": aurora_of, "rain": rain_of}
    frames = arguments.frames or (160, 64)
    if is_long and not arguments.frames:
        frames = [frames_for_cpu_time(program, folder / f"measure-{name}", scene, LONG_SHOT_S) for name, scene in scenes.items()]
    shots = [
        Shot(program, name, scene(count), max(count // chunks, 1), folder / name)
        for (name, scene), count, chunks in zip(scenes.items(), frames, (4, 8))
    ]
    for shot in shots:
        shot.render_alone()
    refused_by_slurm(shots[0], cluster)
    for shot in shots if is_long else shots[:1]:
        undisturbed(shot, cluster, is_long and not arguments.frames)
    killed(shots[0], cluster)
    for shot in shots if is_long else shots[1:]:
        disturbed(shot, cluster, disk)
    by_openjd(shots[0])
    in_tiles(program, folder)
    if is_long:
        seen_differently(shots[0], cluster)


if __name__ == "__main__":
    sys.exit(main())
