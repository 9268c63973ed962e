#!/usr/bin/env python3
"""Replays how shots of scenes are drawn on more cores than this machine has, from stage times that are measured with one and two threads.

Every stage of a frame is split into a serial and a parallel part: with one thread it takes s + p, with two the thread that reports it works s + p / 2. The replay
is a schedule: the serial part is one task, the parallel part is cut into as many tasks as a picture has strips, and each free core takes the first task that
waits, of the oldest frame first. A frame begins when there are fewer than the allowed number in flight; where that is one, or frames follow from each other, it
is drawn when the one before it is, and only writing overlaps. What the first frame takes more than others, to fill caches, each frame in flight takes once. Cores are as fast
together as alone: memory bandwidth and clock rates are left out, so that the numbers for many cores are upper bounds.

Usage: replay_frames.py PROGRAM [--frames N] [--size WxH] [--shot N] [SCENE...]
"""

import argparse
import heapq
import json
import subprocess
import sys
import tempfile

STAGES = ["load", "advance", "prepare", "draw", "view", "write"]
CORES = [4, 8, 16, 32, 64]
STRIP_ROWS = 8
# As the program chooses the frames in flight by itself (crates/bansho/src/job/checks/memory.rs): none below 8 threads, one for each thread up to 16, and no
# more than a sixteenth of the shot.
MIN_THREADS, MAX_IN_FLIGHT, FRAMES_FOR_EACH = 8, 16, 16


def statistics(program, scene, size, frames, threads, in_flight=1):
    """The event `stats` of a run that draws and writes the first frames of a scene."""
    with tempfile.TemporaryDirectory() as folder:
        command = [program, "render", f"scenes/{scene}.toml", "--size", size, "--frames", f"0-{frames - 1}", "--threads", str(threads),
                   "--frames-in-flight", str(in_flight), "--stats", "--progress", "json", "--out", f"{folder}/f.####.png"]
        done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode != 0:
        sys.exit(f"{' '.join(command)}: {done.stderr}")
    return next(event for event in map(json.loads, done.stdout.splitlines()) if event["event"] == "stats")


def stage_times(program, scene, size, frames, threads):
    """Processor time of each stage of a frame after the first, and what the first takes more, s: from runs of different length."""
    short, long = (statistics(program, scene, size, count, threads)["stages_cpu_s"] for count in (frames, 3 * frames))
    later = {stage: max(long[stage] - short[stage], 0.0) / (2 * frames) for stage in STAGES}
    first = {stage: max(short[stage] - frames * later[stage], 0.0) for stage in STAGES}
    return later, first


def parts(one, two):
    """Serial and parallel part of each stage, s, from its times with one and two threads."""
    split = []
    for stage in STAGES:
        parallel = min(max(2 * (one[stage] - two[stage]), 0.0), one[stage])
        split.append((one[stage] - parallel, parallel))
    return split


class Schedule:
    """Frames on cores."""

    def __init__(self, later, first, tasks, follows):
        # A stage is a list of serial and parallel parts; the last stage, writing, needs no frame before it.
        self.later, self.first, self.tasks, self.follows = later, first, tasks, follows

    def seconds(self, cores, frames, in_flight):
        """When the last of `frames` is written."""
        free, now, finished, begun, drawn = cores, 0.0, 0, 0, 0
        # Frames are drawn one after the other, while up to one for each core are written.
        one_by_one = self.follows or in_flight == 1
        window = cores + 1 if one_by_one else in_flight
        running, waiting = [], []  # (end, frame) and (frame, order, duration)
        position, remaining = {}, {}
        order = 0

        def start_phase(frame):
            # Serial and parallel part of each stage in turn; phases without work are passed over. False once the frame is done.
            nonlocal order
            while position[frame] < 2 * len(STAGES):
                stage, is_parallel = divmod(position[frame], 2)
                duration = self.later[stage][is_parallel]
                # Each of the first frames fills caches of its own.
                duration += self.first[stage][is_parallel] if frame < in_flight else 0.0
                count = self.tasks if is_parallel else 1
                if duration > 0.0:
                    remaining[frame] = count
                    for _ in range(count):
                        heapq.heappush(waiting, (frame, order, duration / count))
                        order += 1
                    return True
                position[frame] += 1
            return False

        def write_begins(frame):
            return position[frame] >= 2 * STAGES.index("write")

        while finished < frames:
            # Frames that may begin.
            while begun < frames and begun - finished < window and (not one_by_one or drawn == begun):
                position[begun] = 0
                if not start_phase(begun):
                    finished, drawn = finished + 1, drawn + 1
                begun += 1
            while free and waiting:
                frame, _, duration = heapq.heappop(waiting)
                heapq.heappush(running, (now + duration, frame))
                free -= 1
            now, frame = heapq.heappop(running)
            free += 1
            remaining[frame] -= 1
            if remaining[frame] == 0:
                was_drawn = write_begins(frame)
                position[frame] += 1
                continues = start_phase(frame)
                drawn += not was_drawn and write_begins(frame)
                finished += not continues
        return now


def frames_in_flight(cores, shot, follows):
    """How many the program draws at once."""
    if follows or cores < MIN_THREADS:
        return 1
    return max(min(cores, MAX_IN_FLIGHT, shot // FRAMES_FOR_EACH), 1)


def replay(program, scene, arguments):
    """The row of a scene."""
    one, first_one = stage_times(program, scene, arguments.size, arguments.frames, 1)
    two, first_two = stage_times(program, scene, arguments.size, arguments.frames, 2)
    tasks = -(-int(arguments.size.split("x")[1]) // STRIP_ROWS)
    # A program that was asked for two frames in flight and draws one has frames that follow from each other.
    follows = statistics(program, scene, arguments.size, 2, 2, in_flight=2)["frames_in_flight"] == 1
    schedule = Schedule(parts(one, two), parts(first_one, first_two), tasks, follows)
    rate = {cores: arguments.shot / schedule.seconds(cores, arguments.shot, frames_in_flight(cores, arguments.shot, follows)) for cores in [1, 2, *CORES]}
    serial = sum(serial for serial, _ in schedule.later) / max(sum(one.values()), 1e-9)
    in_flight = frames_in_flight(CORES[-1], arguments.shot, follows)
    memory = statistics(program, scene, arguments.size, max(in_flight, 2), 16, in_flight)["peak_memory_mib"]
    numbers = " | ".join(f"{rate[cores]:.1f}" for cores in [1, 2, *CORES])
    return f"| `{scene}` | {100 * serial:.0f} % | {numbers} | {in_flight} | {memory} |"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program")
    parser.add_argument("scenes", nargs="*", metavar="SCENE")
    parser.add_argument("--frames", type=int, default=8, help="frames of the shorter of two runs that are measured; the longer has three times as many")
    parser.add_argument("--size", default="1280x720")
    parser.add_argument("--shot", type=int, default=256, help="frames of the shot that is replayed")
    arguments = parser.parse_intermixed_args()
    heads = " | ".join(f"{cores} {'core' if cores == 1 else 'cores'}" for cores in [1, 2, *CORES])
    print(f"| scene, {arguments.shot} frames of {arguments.size} | serial | {heads} | frames in flight with {CORES[-1]} | MiB |")
    print("|---" * (len(CORES) + 6) + "|")
    for scene in arguments.scenes or ["campfire", "headlights", "street_lamp", "hearth", "bonfire", "sekiguchi_1"]:
        print(replay(arguments.program, scene, arguments), flush=True)


if __name__ == "__main__":
    main()
