#!/usr/bin/env python3
"""Fails when a fast way is not as many times faster than its naive twin as .ci/ratios.txt asks.

Reads what criterion measured in the same run, so that the speed of the machine does not matter.
Usage: ratios.py CRITERION_DIR RATIOS_FILE
"""

import json
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


def main():
    measured = medians(Path(sys.argv[1]))
    failed = False
    for line in Path(sys.argv[2]).read_text().splitlines():
        line = line.split("#")[0].strip()
        if not line:
            continue
        fast, naive, floor = (part.strip() for part in line.split("|"))
        missing = [name for name in (fast, naive) if name not in measured]
        if missing:
            print(f"FAIL  no such benchmark: {', '.join(missing)}; measured: {', '.join(sorted(measured))}")
            failed = True
            continue
        ratio = measured[naive] / measured[fast]
        good = ratio >= float(floor)
        failed |= not good
        print(f"{'ok  ' if good else 'FAIL'}  {fast}: {measured[fast] / 1e6:.3f} ms, {ratio:.1f} times faster than "
              f"`{naive}` (at least {floor})")
    return failed


if __name__ == "__main__":
    sys.exit(main())
