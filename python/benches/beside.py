"""Times of rain over pictures beside those of other libraries, in one run, and of a data set: `python benches/beside.py [--pairs N] [--check]`.

A table goes to standard output. Rain is drawn at 1280 x 720 over a photograph with depth, from the second call of a size on, with a thread for each core. Other
libraries draw white lines, without depth and light. With `--check` the exit status tells whether memory stays flat over the pairs.
"""

from __future__ import annotations

import argparse
import resource
import statistics
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from PIL import Image

import bansho

SIZE = (1280, 720)
CALLS = 25
FLAT_MEGABYTES = 64
ROOT = Path(__file__).resolve().parents[2]


def photograph(size: tuple[int, int]) -> np.ndarray:
    with Image.open(ROOT / "scenes" / "plates" / "court.jpg") as image:
        return np.asarray(image.convert("RGB").resize(size))


def depth(size: tuple[int, int]) -> np.ndarray:
    """From 40 m at the top to 3 m at the bottom, with the unevenness of a measured depth."""
    width, height = size
    rows = np.linspace(40, 3, height)[:, None]
    return (rows + np.random.default_rng(1).random((height, width))).astype(np.float32)


def milliseconds(call: Callable[[int], object]) -> float:
    """Median time of a call after the first, ms."""
    call(0)
    times = []
    for number in range(1, CALLS + 1):
        start = time.perf_counter()
        call(number)
        times.append(time.perf_counter() - start)
    return 1e3 * statistics.median(times)


def row(what: str, figure: str) -> None:
    print(f"| {what} | {figure} |", flush=True)


def rains() -> None:
    image, meters = photograph(SIZE), depth(SIZE)
    for rate in (20, 5):
        time_ms = milliseconds(lambda seed, rate=rate: bansho.rain(image, meters, rate_mm_per_h=rate, seed=seed, strength="physical"))
        row(f"`bansho.rain`, {rate} mm/h, with depth", f"{time_ms:.0f} ms")
    try:
        import albumentations
    except ImportError:
        row("albumentations `RandomRain`", "not installed")
    else:
        lines = albumentations.RandomRain(p=1.0)
        row(f"albumentations {albumentations.__version__} `RandomRain`", f"{milliseconds(lambda _: lines(image=image)):.0f} ms")
    try:
        import kornia
        import torch
    except ImportError:
        row("kornia `RandomRain`", "not installed")
    else:
        tensor = torch.from_numpy(image.copy()).permute(2, 0, 1)[None].float() / 255
        drops = kornia.augmentation.RandomRain(p=1.0, drop_height=(1, 20), drop_width=(-5, 5), number_of_drops=(100, 200))
        row(f"kornia {kornia.__version__} `RandomRain`", f"{milliseconds(lambda _: drops(tensor)):.0f} ms")


def megabytes() -> float:
    """Largest memory so far of this process, MB."""
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return peak / (1 << 20 if sys.platform == "darwin" else 1 << 10)


def pairs(count: int, truth: bool) -> float:
    """Makes pairs in two processes, and returns by how much the memory of this one grew after the first tenth, MB."""
    size = (640, 360)
    data = bansho.datasets.RainPairs([photograph(size)], [depth(size)], per_image=count, seed=1, truth=truth, rate_mm_per_h=(5, 50))
    start, before = time.perf_counter(), 0.0
    for number, _ in enumerate(bansho.datasets.iterate(data, workers=2)):
        if number == count // 10:
            before = megabytes()
    elapsed, grown = time.perf_counter() - start, megabytes() - before
    row(f"{count} pairs of 640 x 360, 5 to 50 mm/h, two processes{', with truth' if truth else ''}", f"{elapsed:.0f} s; memory grew by {grown:.0f} MB after the first tenth")
    return grown


def main() -> int:
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--pairs", type=int, default=1000, help="number of pairs")
    options.add_argument("--check", action="store_true", help="fail if memory grows")
    given = options.parse_args()
    print("| what | time |\n|---|---|")
    rains()
    grown = max(pairs(given.pairs, truth) for truth in (False, True))
    if given.check and grown > FLAT_MEGABYTES:
        print(f"memory grew by {grown:.0f} MB; allowed: {FLAT_MEGABYTES} MB", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
