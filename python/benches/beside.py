"""Times of rain over pictures beside those of other libraries, in one run, and of a data set: `python benches/beside.py [--pairs N] [--check]`.

A table goes to standard output. Rain is drawn at 1280 x 720 over a photograph with depth, from the second call of a size on, with a thread for each core. Other
libraries draw white lines, without depth and light. With `--check` the exit status tells whether rain and pairs are within their times, and whether memory stays
flat over the pairs. The allowed times are those of a machine on which `RandomRain` of albumentations takes 3 ms; where it takes longer, they are longer by
the same factor.
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
# What is asked of two cores: milliseconds of a call by rain rate in mm/h, and of a pair.
MOST_MILLISECONDS = {20: 40.0, 5: 20.0}
MOST_MILLISECONDS_PER_PAIR = 40.0
# What `RandomRain` of albumentations takes on the machine for which these are asked, ms.
ALBUMENTATIONS_MILLISECONDS = 3.0
# Rain that takes longer is timed again, since other programs may have taken its cores.
TRIES = 3
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


def albumentations_milliseconds(image: np.ndarray) -> float | None:
    """Time of white lines over a picture, if albumentations is installed, ms."""
    try:
        import albumentations
    except ImportError:
        row("albumentations `RandomRain`", "not installed")
        return None
    lines = albumentations.RandomRain(p=1.0)
    time_ms = milliseconds(lambda _: lines(image=image))
    row(f"albumentations {albumentations.__version__} `RandomRain`", f"{time_ms:.0f} ms")
    return time_ms


def slowness() -> float:
    """How many times longer than the machine for which times are asked this one takes, at least 1."""
    time_ms = albumentations_milliseconds(photograph(SIZE))
    return 1.0 if time_ms is None else max(1.0, time_ms / ALBUMENTATIONS_MILLISECONDS)


def rains(slower: float) -> list[str]:
    """Times of rain over a picture. Returns what took longer than it may."""
    image, meters = photograph(SIZE), depth(SIZE)
    slow = []
    for rate, asked in MOST_MILLISECONDS.items():
        most = asked * slower
        for _ in range(TRIES):
            time_ms = milliseconds(lambda seed, rate=rate: bansho.rain(image, meters, rate_mm_per_h=rate, seed=seed, strength="physical"))
            if time_ms <= most:
                break
        else:
            slow.append(f"{rate} mm/h took {time_ms:.0f} ms; allowed: {most:.0f} ms")
        row(f"`bansho.rain`, {rate} mm/h, with depth", f"{time_ms:.0f} ms")
    try:
        import kornia
        import torch
    except ImportError:
        row("kornia `RandomRain`", "not installed")
    else:
        tensor = torch.from_numpy(image.copy()).permute(2, 0, 1)[None].float() / 255
        drops = kornia.augmentation.RandomRain(p=1.0, drop_height=(1, 20), drop_width=(-5, 5), number_of_drops=(100, 200))
        row(f"kornia {kornia.__version__} `RandomRain`", f"{milliseconds(lambda _: drops(tensor)):.0f} ms")
    return slow


def peaks() -> np.ndarray:
    """Largest memory so far of this process, and of any process that it has started and that has ended, MB."""
    whole = 1 << 20 if sys.platform == "darwin" else 1 << 10
    return np.array([resource.getrusage(who).ru_maxrss / whole for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)])


def pairs(count: int, truth: bool, slower: float) -> list[str]:
    """Makes pairs in two processes. Returns what took longer than it may, or more memory than a tenth of the pairs."""
    size = (640, 360)
    data = bansho.datasets.RainPairs([photograph(size)], [depth(size)], per_image=count, seed=1, truth=truth, rate_mm_per_h=(5, 50))
    for _ in bansho.datasets.iterate(data, workers=2, indices=range(count // 10)):
        pass
    before, start = peaks(), time.perf_counter()
    for _ in bansho.datasets.iterate(data, workers=2):
        pass
    elapsed, grown = time.perf_counter() - start, (peaks() - before).max()
    what = f"{count} pairs{' with truth' if truth else ''}"
    row(f"{count} pairs of 640 x 360, 5 to 50 mm/h, two processes{', with truth' if truth else ''}", f"{elapsed:.0f} s; peak memory {grown:.0f} MB above that of a tenth of the pairs")
    problems = []
    if grown > FLAT_MEGABYTES:
        problems.append(f"{what}: peak memory {grown:.0f} MB above that of a tenth of them; allowed: {FLAT_MEGABYTES} MB")
    most = 1e-3 * MOST_MILLISECONDS_PER_PAIR * count * slower
    if elapsed > most:
        problems.append(f"{what} took {elapsed:.0f} s; allowed: {most:.0f} s")
    return problems


def main() -> int:
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--pairs", type=int, default=1000, help="number of pairs")
    options.add_argument("--check", action="store_true", help="fail if times or memory are above what is asked")
    given = options.parse_args()
    print("| what | time |\n|---|---|")
    slower = slowness()
    problems = [*rains(slower), *pairs(given.pairs, truth=False, slower=slower), *pairs(given.pairs, truth=True, slower=slower)]
    if not given.check:
        return 0
    for problem in problems:
        print(problem, file=sys.stderr)
    return int(bool(problems))


if __name__ == "__main__":
    sys.exit(main())
