"""Data sets: clean and rainy pairs with truth, and all-sky auroras. Every item follows from (seed, index) alone, in any process and in any order."""

from __future__ import annotations

import multiprocessing
import os
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, ProcessPoolExecutor
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import NDArray

from . import _checks, _workers, transforms, weather
from .scene import Scene
from .shot import open as open_shot

if TYPE_CHECKING:
    from torch.utils.data import Dataset
else:

    class Dataset:
        """In place of PyTorch's class, which type checkers want: a `DataLoader` asks for `__len__` and `__getitem__` alone, so PyTorch is not needed."""

        def __class_getitem__(cls, item):
            return cls


__all__ = ["AllSkyAurora", "RainPairs", "iterate"]


def read_image(path: str | os.PathLike[str]) -> NDArray[np.uint8]:
    """An image file as sRGB codes, read by Pillow."""
    from PIL import Image

    with Image.open(path) as picture:
        return np.asarray(picture.convert("RGB"))


def read_depth(path: str | os.PathLike[str]) -> NDArray[Any]:
    """A depth file: `.npy`, or a picture of integers read by Pillow."""
    if Path(path).suffix == ".npy":
        return np.load(path)
    from PIL import Image

    with Image.open(path) as picture:
        return np.asarray(picture)


class RainPairs(Dataset[Any]):
    """Pairs of a clean and a rainy picture: a map-style data set, which PyTorch's `DataLoader` takes.

    >>> pairs = bansho.datasets.RainPairs(images, depths, rate_mm_per_h=(5, 50), per_image=4, seed=7)
    >>> pairs[0]["rainy"].shape
    (480, 640, 3)
    """

    def __init__(
        self,
        images: Sequence[Any] | NDArray[Any],
        depths: Sequence[Any] | NDArray[Any] | None = None,
        *,
        per_image: int = 1,
        seed: int = 0,
        truth: bool = False,
        transform: Callable[[dict[str, Any]], Any] | None = None,
        **rain: Any,
    ) -> None:
        """`images` are arrays (H, W, 3) of `uint8`, or paths; `depths` arrays or paths (`.npy`, or integers with `depth_scale`), one for each image.

        Each image makes `per_image` pairs. With `truth` each item also has `streak_opacity`, `streak_depth`, `diameter_mm`, `transmission` and
        `medium_transmission`. `transform` changes an item before it is returned, such as to tensors. `rain` are the parameters of `bansho.transforms.Rain`
        other than `p`.
        """
        if len(images) == 0:
            raise ValueError("images: none; allowed: one or more")
        if depths is not None and len(depths) != len(images):
            raise ValueError(f"depths: {len(depths)} for {len(images)} images; allowed: one for each, or None")
        per_image = _checks.whole(per_image, "per_image", "1 or more")
        if per_image < 1:
            raise ValueError(f"per_image: {per_image}; allowed: 1 or more")
        if "p" in rain:
            raise TypeError("unknown option 'p': every pair has rain; allowed: the other parameters of bansho.transforms.Rain")
        self.images, self.depths = images, depths
        self.per_image, self.seed, self.truth, self.transform = per_image, _checks.seed(seed), truth, transform
        self.rain = transforms.Rain(**rain)

    def __len__(self) -> int:
        return len(self.images) * self.per_image

    def __getitem__(self, index: int) -> Any:
        if not 0 <= index < len(self):
            raise IndexError(f"item {index}; allowed: 0 to {len(self) - 1}")
        source = index // self.per_image
        clean = self.images[source]
        clean = read_image(clean) if isinstance(clean, (str, os.PathLike)) else np.asarray(clean)
        depth = None if self.depths is None else self.depths[source]
        depth = read_depth(depth) if isinstance(depth, (str, os.PathLike)) else depth
        parameters = self.rain.parameters(np.random.default_rng([self.seed, index]))
        options = {"threads": _workers.default_threads(), **self.rain.options, **parameters}
        item: dict[str, Any] = {"index": index, "clean": clean, **parameters}
        if self.truth:
            item["rainy"], values = weather.rain(clean, depth, truth=True, **options)
            for name in ("streak_opacity", "streak_depth", "diameter_mm", "transmission", "medium_transmission"):
                item[name] = getattr(values, name)
        else:
            item["rainy"] = weather.rain(clean, depth, **options)
        return item if self.transform is None else self.transform(item)


def _positive(value: Any, name: str) -> tuple[float, float]:
    """The ends of an interval of numbers above 0."""
    ends = transforms.interval(value, name)
    if ends[0] <= 0:
        raise ValueError(f"{name}: {value!r}; allowed: numbers above 0")
    return ends


class AllSkyAurora(Dataset[dict[str, Any]]):
    """All-sky pictures of auroras with the brightness of their lines in kilorayleighs: a map-style data set.

    An item has `image` (size, size, 4; `uint8`), `kilorayleigh_557`, `kilorayleigh_630`, `kilorayleigh_427` (size, size), and the parameters of the aurora.
    """

    LINES = ("kilorayleigh_557", "kilorayleigh_630", "kilorayleigh_427")
    FORMS: tuple[Literal["arc"], Literal["band"], Literal["s_shape"]] = ("arc", "band", "s_shape")

    def __init__(
        self,
        count: int,
        *,
        size: int = 256,
        seed: int = 0,
        energy_ev: transforms.Interval = (1000.0, 10_000.0),
        flux_mw_per_m2: transforms.Interval = (1.0, 50.0),
        particles: int = 20_000,
        exposure_ev100: float | None = None,
    ) -> None:
        """Energies and energy fluxes are numbers, or intervals (low, high) of which values are drawn evenly in their logarithms."""
        count = _checks.whole(count, "count", "1 or more")
        if count < 1:
            raise ValueError(f"count: {count}; allowed: 1 or more")
        self.count, self.size, self.seed, self.particles = count, size, _checks.seed(seed), particles
        self.energy_ev, self.flux_mw_per_m2 = _positive(energy_ev, "energy_ev"), _positive(flux_mw_per_m2, "flux_mw_per_m2")
        self.exposure_ev100 = exposure_ev100

    def __len__(self) -> int:
        return self.count

    def scene(self, index: int) -> Scene:
        """The scene of an item."""
        generator = np.random.default_rng([self.seed, index])
        energy, flux = (float(np.exp(generator.uniform(*np.log(ends)))) for ends in (self.energy_ev, self.flux_mw_per_m2))
        sheet = {
            "form": str(generator.choice(self.FORMS)),
            "length_km": float(generator.uniform(300, 800)),
            "position_km": [float(generator.uniform(-80, 80)), float(generator.uniform(-200, 60))],
        }
        return Scene(
            {
                "picture": {
                    "size": [self.size, self.size],
                    "frames": 1,
                    "seed": int(generator.integers(0, 2**52)),
                    "white_balance_k": 4000.0,
                    "exposure_ev100": "auto" if self.exposure_ev100 is None else self.exposure_ev100,
                },
                "camera": {"lens": "fisheye", "position": [0.0, 1.7, 0.0], "target": [0.0, 60.0, 0.0]},
                "aurora": [
                    {
                        "name": "aurora",
                        "extent_km": 900.0,
                        "energy_ev": energy,
                        "flux_mw_per_m2": flux,
                        "particles": {"count": self.particles},
                        "shapes": [{"sheets": [sheet]}],
                    }
                ],
            }
        )

    def __getitem__(self, index: int) -> dict[str, Any]:
        if not 0 <= index < self.count:
            raise IndexError(f"item {index}; allowed: 0 to {self.count - 1}")
        scene = self.scene(index)
        shot = open_shot(scene, aovs=True, backdrop=False, threads=_workers.default_threads())
        frame = shot.render(0)
        item: dict[str, Any] = {"index": index, "image": frame.display(), "scene": scene.to_toml()}
        item |= {key: scene[f"aurora.{key}"] for key in ("energy_ev", "flux_mw_per_m2")}
        return item | {line: np.asarray(frame.aovs[f"aurora.{line}"]) for line in self.LINES}


_dataset: Any = None


def _adopt(dataset: Any) -> None:
    """In a worker process: the data set of which it makes items."""
    global _dataset
    _dataset = dataset


def _item(index: int) -> Any:
    return _dataset[index]


def iterate(dataset: Any, *, workers: int | None = None, indices: Sequence[int] | None = None) -> Iterator[Any]:
    """The items of a data set in order, made by worker processes, one thread each; `workers=0` makes them in this process.

    The items are the same for any number of workers. At most three items for each worker are in memory. The workers are started anew and import the script
    that is running, so a script calls this below ``if __name__ == "__main__":``.
    """
    numbers = range(len(dataset)) if indices is None else indices
    workers = len(os.sched_getaffinity(0)) if workers is None and hasattr(os, "sched_getaffinity") else workers
    workers = (os.cpu_count() or 1) if workers is None else _checks.whole(workers, "workers", "0 or more")
    if workers < 0:
        raise ValueError(f"workers: {workers}; allowed: 0 or more")
    if workers == 0:
        yield from (dataset[index] for index in numbers)
        return
    # A process that is forked may find a lock held by a thread that it does not have.
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(workers, context, _adopt, (dataset,)) as pool:
        pending: deque[Future[Any]] = deque()
        for index in numbers:
            pending.append(pool.submit(_item, index))
            if len(pending) >= 3 * workers:
                yield pending.popleft().result()
        while pending:
            yield pending.popleft().result()
