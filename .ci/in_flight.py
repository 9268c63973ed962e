#!/usr/bin/env python3
"""Fails when two frames in flight on two threads are not as many times faster than one frame after the other on two threads as .ci/in_flight_ratios.txt asks.

Both are measured in turn, by the clock, so that the speed of the machine does not matter, and the median of the times of each counts: single runs of a second
scatter by a tenth, so that the ratio of a pair says little. A scene that is not fast enough is measured again, up to five times, and all its runs count.
Usage: in_flight.py PROGRAM RATIOS_FILE [SCENE...]
"""

import json
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

RUNS = 5
ROUNDS = 5
THREADS = 2


def rows(path, wanted):
    """Scene, size, number of frames, and how many times faster two frames in flight must be."""
    for line in Path(path).read_text().splitlines():
        line = line.split("#")[0].strip()
        if line:
            scene, size, frames, floor = (part.strip() for part in line.split("|"))
            if not wanted or scene in wanted:
                yield scene, size, int(frames), float(floor)


def seconds(program, scene, size, frames, in_flight, folder):
    """How long the program takes to draw and write the frames, by its own statistics."""
    command = [program, "render", f"scenes/{scene}.toml", "--size", size, "--frames", f"0-{frames - 1}", "--threads", str(THREADS),
               "--frames-in-flight", str(in_flight), "--stats", "--progress", "json", "--overwrite", "--out", f"{folder}/f.####.png"]
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode != 0:
        sys.exit(f"{' '.join(command)}: {done.stderr}")
    events = [json.loads(line) for line in done.stdout.splitlines()]
    stats = next(event for event in events if event["event"] == "stats")
    if stats["frames"] != frames:
        sys.exit(f"{scene}: {stats['frames']} of {frames} frames were drawn")
    return stats["elapsed_s"]


def holds(program, path, wanted):
    """Whether two frames in flight are fast enough for every scene of the file."""
    good, measured = True, 0
    for scene, size, frames, floor in rows(path, wanted):
        times = {1: [], 2: []}
        with tempfile.TemporaryDirectory() as folder:
            for run in range(ROUNDS * RUNS):
                # Which comes first alternates, since what runs first may find a colder machine.
                for count in (1, 2) if run % 2 == 0 else (2, 1):
                    times[count].append(seconds(program, scene, size, frames, count, folder))
                ratio = statistics.median(times[1]) / statistics.median(times[2])
                if (run + 1) % RUNS == 0 and ratio >= floor:
                    break
        good &= ratio >= floor
        measured += 1
        told = [", ".join(f"{time:.2f}" for time in sorted(times[count])) for count in (1, 2)]
        print(f"{'ok  ' if ratio >= floor else 'FAIL'}  {scene}, {frames} frames of {size}: two in flight are {ratio:.2f} times as fast as one after the other "
              f"(at least {floor:g}; {told[0]} s against {told[1]} s)")
    if measured == 0:
        sys.exit(f"no scene of {path} is selected")
    return good


if __name__ == "__main__":
    sys.exit(not holds(sys.argv[1], sys.argv[2], sys.argv[3:]))
