"""Transforms of Bansho within albumentations. The module is imported only where that library is used; its class is of the module, so that it is pickled."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import albumentations
import numpy as np
from numpy.typing import NDArray

from . import _workers

if TYPE_CHECKING:
    from .transforms import _Transform


class WeatherTransform(albumentations.ImageOnlyTransform):
    """A transform of Bansho as one of albumentations. It changes the image alone; the depth is read from the data of the call."""

    transform: _Transform

    @classmethod
    def of(cls, transform: _Transform) -> WeatherTransform:
        """That transform, applied with its probability."""
        # The metaclass of albumentations checks the arguments of __init__ against a schema, which knows `p` alone.
        weather = cls(p=transform.p)
        weather.transform = transform
        return weather

    @property
    def targets_as_params(self) -> list[str]:
        """Nothing that must be in the data: the depth is optional."""
        return []

    def get_params_dependent_on_data(self, params: dict[str, Any], data: dict[str, Any]) -> dict[str, Any]:
        """The depth, if there is one, and the seed of a call."""
        # Albumentations draws the same numbers in each worker process, so that the worker's own are added.
        return {"depth": data.get("depth"), "words": [self.py_random.getrandbits(63), *_workers.seed_words()]}

    def apply(self, img: NDArray[Any], depth: Any = None, words: Any = (0,), **params: Any) -> NDArray[Any]:
        """The image with weather."""
        generator = np.random.default_rng(list(words))
        if img.dtype == np.uint8:
            return self.transform.apply(img, depth, generator)
        # Floats of albumentations are sRGB values from 0 to 1, those of `bansho.rain` are linear light. Their nearest codes are drawn over, so that an image has
        # the same weather in both types; what the codes change is added, so that the image is rounded nowhere.
        codes = np.rint(255 * np.clip(img, 0, 1)).astype(np.uint8)
        drawn = self.transform.apply(codes, depth, generator)
        change = (drawn.astype(np.float32) - codes) / np.float32(255)
        return np.clip(img + change, 0, 1).astype(img.dtype)

    def get_transform_init_args_names(self) -> tuple[str, ...]:
        """None that a text could hold."""
        return ()
