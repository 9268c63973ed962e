#!/usr/bin/env python3
"""What a whole show costs on 1 to 1000 nodes: a simulation of its tasks, from measured figures. Prints the tables of docs/src/guide/farm.md.

    farm_cost.py [--frames 108000] [--scenes 1] [--task-minutes 30]

A node takes the next task as soon as it is free. A frame takes as long as it takes to draw, or longer where all nodes together write more bytes or
ask for more metadata operations than the shared file system serves.
"""

import argparse
import heapq
import random
from dataclasses import dataclass

# Measured: `dome_night` at 8192 x 8192 and 60 frames per second on two cores of a server processor with AVX-512 at 2.5 GHz. CPU time, since other
# programs ran at the same time, shared among the two cores; the book's table of domes has 3 s of wall time for the same frame.
FRAME_S = 2.6  # 5.0 s of CPU time to prepare, draw and write, and a little that only one core does
STEP_S = 0.02  # to step over a frame
PREROLL_S = 3.0  # building the scene and its preroll, where no snapshot is restored
START_S = 0.3  # starting the program, building the scene, the fingerprints of the chunk, and the check of the arithmetic, though only the first task of a machine has it
FIRST_FRAME_S = 2.4  # what the first frame of a task takes longer, since it fills caches
FRAME_BYTES = 58.45e6
SNAPSHOT_BYTES = 6.7e6
METADATA_OPERATIONS = 19  # of a frame: 13 stat, 2 readlink, open, mkdir, rename, and a line of the journal; counted by strace
# Measured on three nodes of one machine: from the end of a job to the start of the one that depends on it, and from one task of an array to the next.
DEPENDENCY_S = 3.0
DISPATCH_S = 0.5
# Assumed: reading and restoring a snapshot, and how much frames of a shot differ (standard deviation of a frame's time).
RESTORE_S = 0.3
SPREAD = 0.1
# Assumed: a shared file system of an institute.
BANDWIDTH = 5e9  # bytes/s
METADATA_RATE = 20_000.0  # operations/s
READ_BANDWIDTH_OF_A_NODE = 1e9  # bytes/s, for the last job, which reads every frame
MAX_ARRAY_SIZE = 1001

NODES = (1, 3, 10, 30, 100, 300, 1000)


@dataclass
class Cost:
    """Where the time of a show goes, s."""

    wall: float
    snapshots: float
    frames: float
    finish: float
    # Node seconds: useful ones, and those lost to starting, to waiting at the end, and to the file system.
    useful: float
    starting: float
    idle: float
    file_system: float
    tasks: int
    chunk: int


def chunk_frames(frames: int, task_s: float) -> int:
    """As `bansho farm slurm` chooses them."""
    return max(1, int((task_s - START_S) / (FRAME_S + STEP_S)), -(-frames // (MAX_ARRAY_SIZE - 1)))


def simulate(nodes: int, frames: int, scenes: int, task_s: float) -> Cost:
    """The show as `scenes` scenes of equal length, all submitted at once."""
    generator = random.Random(1)
    of_scene = frames // scenes
    chunk = chunk_frames(of_scene, task_s)
    # The serial part: one job for each scene steps through all of it; scenes do so at the same time.
    at_once = -(-scenes // nodes)
    snapshots = (DEPENDENCY_S * 2 + PREROLL_S + of_scene * STEP_S) * at_once
    if of_scene <= 2 * chunk:
        snapshots = DEPENDENCY_S
    writers = min(nodes, -(-of_scene // chunk) * scenes)
    # How much longer a frame takes because the file system is shared.
    load = max(writers / FRAME_S * FRAME_BYTES / BANDWIDTH, writers / FRAME_S * METADATA_OPERATIONS / METADATA_RATE, 1.0)
    free, lost, useful, starting, tasks, last = [0.0] * nodes, 0.0, 0.0, 0.0, 0, 0.0
    heapq.heapify(free)
    for _ in range(scenes):
        for first in range(0, of_scene, chunk):
            count = min(chunk, of_scene - first)
            # A sum of many independent frames: its spread shrinks with the root of their number.
            work = count * FRAME_S * (1.0 + SPREAD * generator.gauss(0.0, 1.0) / count**0.5)
            begin = DISPATCH_S + START_S + RESTORE_S + FIRST_FRAME_S
            end = heapq.heappop(free) + begin + work * load + count * STEP_S
            heapq.heappush(free, end)
            useful, starting, lost, last, tasks = useful + work, starting + begin + count * STEP_S, lost + work * (load - 1.0), max(last, end), tasks + 1
    idle = sum(last - end for end in free) + nodes * snapshots
    finish = DEPENDENCY_S + of_scene * FRAME_BYTES / READ_BANDWIDTH_OF_A_NODE * at_once
    return Cost(snapshots + last + finish, snapshots, last, finish, useful, starting, idle, lost, tasks, chunk)


def hours(seconds: float) -> str:
    """Hours, with minutes where there are few."""
    return f"{seconds / 3600:.1f} h" if seconds >= 3600 else f"{seconds / 60:.0f} min"


def table(frames: int, scenes: int, task_s: float) -> None:
    """A row for each number of nodes."""
    print("| nodes | job `snapshots` | job `frames` | job `finish` | total time | speedup | tasks x frames | startup | idle | file system |")
    print("|---|---|---|---|---|---|---|---|---|---|")
    one = simulate(1, frames, scenes, task_s).wall
    for nodes in NODES:
        cost = simulate(nodes, frames, scenes, task_s)
        total = cost.useful + cost.starting + cost.idle + cost.file_system
        part = lambda seconds: f"{100 * seconds / total:.0f} %"
        print(
            f"| {nodes} | {hours(cost.snapshots)} | {hours(cost.frames)} | {hours(cost.finish)} | {hours(cost.wall)} | {one / cost.wall:.1f} | "
            f"{cost.tasks} x {cost.chunk} | {part(cost.starting)} | {part(cost.idle)} | {part(cost.file_system)} |"
        )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--frames", type=int, default=108_000)
    parser.add_argument("--scenes", type=int, default=1)
    parser.add_argument("--task-minutes", type=float, default=30.0)
    arguments = parser.parse_args()
    table(arguments.frames, arguments.scenes, 60.0 * arguments.task_minutes)


if __name__ == "__main__":
    main()
