#!/usr/bin/env python3
"""Fails when a fast way is not as many times faster than its naive implementation as .ci/ratios.txt asks.

Reads what criterion measured in the same run, so that the speed of the machine does not matter.
Usage: ratios.py CRITERION_DIR RATIOS_FILE [NAME]
       ratios.py --select RATIOS_FILE [NAME]       which benchmarks to run for that
NAME selects the pairs of which a name contains it.
"""

import json
import re
import sys
from pathlib import Path


def medians(folder):
    """Median time of every benchmark in nanoseconds, by its full name."""
    found = {}
    for described in folder.glob("**/new/benchmark.json"):
        name = json.loads(described.read_text())["full_id"]
        estimates = json.loads((described.parent / "estimates.json").read_text())
        found[name] = estimates["median"]["point_estimate"]
    return found


def pairs(path, wanted):
    """What the file asks: names of the fast and the naive way, and how many times faster the one must be."""
    for line in Path(path).read_text().splitlines():
        line = line.split("#")[0].strip()
        if line:
            fast, naive, floor = (part.strip() for part in line.split("|"))
            if wanted in fast or wanted in naive:
                yield fast, naive, float(floor)


def selection(path, wanted):
    """A regular expression for exactly the benchmarks that the file names."""
    selected = list(pairs(path, wanted))
    if not selected:
        sys.exit(f"no pair of {path} has a name that contains `{wanted}`")
    names = {re.escape(name) for fast, naive, _ in selected for name in (fast, naive)}
    return f"^({'|'.join(sorted(names))})$"


def holds(folder, path, wanted):
    """Whether every pair of the file holds in what was measured."""
    measured = medians(Path(folder))
    good = True
    for fast, naive, floor in pairs(path, wanted):
        missing = [name for name in (fast, naive) if name not in measured]
        if missing:
            print(f"FAIL  no such benchmark: {', '.join(missing)}; measured: {', '.join(sorted(measured))}")
            good = False
            continue
        ratio = measured[naive] / measured[fast]
        good &= ratio >= floor
        print(f"{'ok  ' if ratio >= floor else 'FAIL'}  {fast}: {measured[fast] / 1e6:.3f} ms, {ratio:.1f} times faster than "
              f"`{naive}` (at least {floor:g})")
    return good


if __name__ == "__main__":
    wanted = sys.argv[3] if len(sys.argv) > 3 else ""
    if sys.argv[1] == "--select":
        print(selection(sys.argv[2], wanted))
    else:
        sys.exit(not holds(sys.argv[1], sys.argv[2], wanted))
