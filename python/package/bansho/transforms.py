"""Augmentation in the style of albumentations: callables that take and return named arrays."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from typing import Any

import numpy as np

from . import _checks, _workers, weather

__all__ = ["Fog", "Rain"]

Interval = float | tuple[float, float]

MOST_RAIN_MM_PER_H = 300.0
"""Largest rain rate, mm/h."""


def interval(value: Any, name: str) -> tuple[float, float]:
    """A number, or the ends of an interval."""
    allowed = "a number, or (low, high)"
    ends = _checks.numbers(value, name, allowed)
    if ends.shape not in ((), (2,)) or not np.isfinite(ends).all():
        raise ValueError(f"{name}: {value!r}; allowed: {allowed}")
    low, high = (float(end) for end in np.broadcast_to(ends, 2))
    if low > high:
        raise ValueError(f"{name}: {value!r}; allowed: {allowed}")
    return low, high


def _known(options: dict[str, Any], function: Callable[..., Any], drawn: tuple[str, ...]) -> None:
    """Refuses options that a function does not have, and those that a transform draws or does not use."""
    keywords = [name for name, parameter in inspect.signature(function).parameters.items() if parameter.kind is inspect.Parameter.KEYWORD_ONLY]
    allowed = [name for name in keywords if name not in drawn]
    for name in options:
        if name not in allowed:
            raise TypeError(f"unknown option {name!r}; allowed: {', '.join(allowed)}")


class _Transform:
    """A transform that is applied with a probability, with one thread in a worker process.

    Its random numbers follow from `seed`, the number of the call and, in a worker process, from which worker this is: the seed that PyTorch's `DataLoader`
    gives the worker, another one in each epoch, else the name of the process. With `rng` of the call they follow from that alone.
    """

    def __init__(self, p: float, seed: int, options: dict[str, Any]) -> None:
        self.p = _checks.number(p, "p", "0 to 1")
        if not 0 <= self.p <= 1:
            raise ValueError(f"p: {p!r}; allowed: 0 to 1")
        self.seed = _checks.whole(seed, "seed", "a whole number, 0 or more")
        if self.seed < 0:
            raise ValueError(f"seed: {seed!r}; allowed: a whole number, 0 or more")
        self.options = options
        self._calls = 0

    def _generator(self, rng: np.random.Generator | None) -> np.random.Generator:
        if rng is not None:
            return rng
        self._calls += 1
        return np.random.default_rng([self.seed, self._calls - 1, *_workers.seed_words()])

    def __call__(self, *, image: Any, depth: Any = None, rng: np.random.Generator | None = None, **others: Any) -> dict[str, Any]:
        """The transformed `image`; everything else unchanged. `rng` makes a call reproducible, whatever was called before."""
        generator = self._generator(rng)
        if generator.random() < self.p:
            image = self.apply(image, depth, generator)
        result = {"image": image, **others}
        if depth is not None:
            result["depth"] = depth
        return result

    def apply(self, image: Any, depth: Any, generator: np.random.Generator) -> Any:
        """The image with weather, whose parameters are drawn from the generator."""
        raise NotImplementedError

    @property
    def available_keys(self) -> Any:
        """Asked for by `albumentations.Compose`, which takes transforms of its own kind only."""
        raise TypeError(f"{type(self).__name__} is no transform of albumentations; allowed: {type(self).__name__}(...).as_albumentations()")

    def as_albumentations(self) -> Any:
        """This transform as one of albumentations, for `albumentations.Compose`: `compose(image=image, depth=depth)`.

        With `Compose(..., additional_targets={"depth": "mask"})` the depth is flipped and cropped as the image is. Floats of albumentations are sRGB values
        from 0 to 1: they get what their codes of 8 bits would get. Random numbers follow from the seed of `Compose`, and from which worker process this is.
        """
        from . import _albumentations

        return _albumentations.WeatherTransform.of(self)


class Rain(_Transform):
    """Rain whose rate, wind and drops are random.

    >>> transform = bansho.transforms.Rain(rate_mm_per_h=(5, 50))
    >>> rainy = transform(image=image, depth=depth)["image"]
    """

    def __init__(
        self,
        rate_mm_per_h: Interval = (5.0, 50.0),
        *,
        wind_speed: Interval = (0.0, 5.0),
        exposure_s: Interval = (1 / 120, 1 / 30),
        visibility: str | None = "augment",
        strength: float | str | None = None,
        p: float = 1.0,
        seed: int = 0,
        **options: Any,
    ) -> None:
        """Intervals are (low, high), of which a value is drawn evenly; of the rate, whose logarithm is. `options` are those of `bansho.rain`.

        `visibility="augment"` is the default here, since physical rain by day is hardly seen; pass `visibility="physical"` for that.
        """
        _known(options, weather.rain, ("rate_mm_per_h", "wind", "exposure_s", "seed", "truth"))
        # `strength` alone says how strong it is.
        super().__init__(p, seed, {"visibility": visibility if strength is None else None, "strength": strength, **options})
        self.rate_mm_per_h = interval(rate_mm_per_h, "rate_mm_per_h")
        if not 0 < self.rate_mm_per_h[0] or not self.rate_mm_per_h[1] <= MOST_RAIN_MM_PER_H:
            raise ValueError(f"rate_mm_per_h: {rate_mm_per_h!r}; allowed: rates above 0, up to {MOST_RAIN_MM_PER_H:g}")
        self.wind_speed = interval(wind_speed, "wind_speed")
        self.exposure_s = interval(exposure_s, "exposure_s")
        if not self.exposure_s[0] > 0:
            raise ValueError(f"exposure_s: {exposure_s!r}; allowed: times above 0 s")
        # What is wrong is told now, not by the first call in a worker process. The camera belongs to the pictures, whose size is not known.
        others = {name: value for name, value in self.options.items() if name not in ("camera", "threads")}
        weather.rain_scene((64, 64), exposure_s=self.exposure_s[0], **others)
        _checks.threads(options.get("threads"))

    def parameters(self, generator: np.random.Generator) -> dict[str, Any]:
        """What `bansho.rain` is called with: drawn from the generator, always in the same order."""
        low, high = np.log(self.rate_mm_per_h)
        rate = float(np.exp(generator.uniform(low, high)))
        speed, direction = generator.uniform(*self.wind_speed), generator.uniform(0, 2 * np.pi)
        return {
            "rate_mm_per_h": min(max(rate, self.rate_mm_per_h[0]), self.rate_mm_per_h[1]),
            "wind": (float(speed * np.cos(direction)), 0.0, float(speed * np.sin(direction))),
            "exposure_s": float(generator.uniform(*self.exposure_s)),
            "seed": int(generator.integers(0, 2**52)),
        }

    def apply(self, image: Any, depth: Any, generator: np.random.Generator) -> Any:
        """The image with rain."""
        return weather.rain(image, depth, **{"threads": _workers.default_threads(), **self.options, **self.parameters(generator)})


class Fog(_Transform):
    """Fog of a random visibility; it needs the depth of the image."""

    def __init__(self, visibility_m: Interval = (50.0, 1000.0), *, p: float = 1.0, seed: int = 0, **options: Any) -> None:
        """The logarithm of the visibility is drawn evenly. `options` are those of `bansho.fog`."""
        _known(options, weather.fog, ("truth",))
        super().__init__(p, seed, options)
        _checks.threads(options.get("threads"))
        self.visibility_m = interval(visibility_m, "visibility_m")
        if self.visibility_m[0] <= 0:
            raise ValueError(f"visibility_m: {visibility_m!r}; allowed: distances above 0")

    def apply(self, image: Any, depth: Any, generator: np.random.Generator) -> Any:
        """The image in fog."""
        low, high = np.log(self.visibility_m)
        visibility_m = float(np.exp(generator.uniform(low, high)))
        return weather.fog(image, depth, visibility_m, **{"threads": _workers.default_threads(), **self.options})
