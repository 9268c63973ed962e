"""Checks of arguments: each raises a `ValueError` that says what was given and what is allowed."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray


def number(value: Any, name: str, allowed: str = "a number") -> float:
    """A finite number."""
    try:
        # A one-element array converts to a number too, but it is no number.
        result = math.nan if isinstance(value, (str, bytes)) or np.ndim(value) != 0 else float(value)
    except (TypeError, ValueError, OverflowError):
        result = math.nan
    if not math.isfinite(result):
        raise ValueError(f"{name}: {value!r}; allowed: {allowed}")
    return result


def whole(value: Any, name: str, allowed: str = "a whole number", least: int = -(2**53), most: int = 2**53) -> int:
    """A whole number from `least` to `most`: `int`, or an integer of numpy."""
    try:
        result = int(value.__index__())
    except (AttributeError, TypeError):
        result = None
    if result is None or not least <= result <= most:
        raise ValueError(f"{name}: {shortened(value)}; allowed: {allowed}")
    return result


def seed(value: Any) -> int:
    """A seed of random numbers."""
    return whole(value, "seed", "a whole number from 0 to 9e15", 0, 9_000_000_000_000_000)


def vector(value: Any, name: str) -> list[float]:
    """Three numbers: x, y, z."""
    values = numbers(value, name, "(x, y, z)")
    if values.shape != (3,):
        raise ValueError(f"{name}: an array of shape {values.shape}; allowed: (x, y, z)")
    return [number(component, name) for component in values.tolist()]


def numbers(value: Any, name: str, allowed: str) -> NDArray[np.float64]:
    """An array of numbers of one shape, of any number of axes."""
    try:
        values = np.asarray(value)
        if values.dtype.kind not in "biuf":
            raise TypeError
        return values.astype(np.float64)
    except (TypeError, ValueError, RuntimeError, BufferError):
        raise ValueError(f"{name}: {shortened(value)}; allowed: {allowed}") from None


def sides(given: Any, name: str) -> tuple[int, ...] | None:
    """Numbers of pixels, none below 0: two of a size, four of a crop; or `None`."""
    if given is None:
        return None
    count = 2 if name == "size" else 4
    allowed = f"{count} whole numbers of pixels, none below 0"
    if isinstance(given, (str, bytes)) or not isinstance(given, (Sequence, np.ndarray)):
        raise ValueError(f"{name}: {given!r}; allowed: {allowed}")
    pixels = tuple(whole(side, name, allowed) for side in given)
    if len(pixels) != count or min(pixels) < 0:
        raise ValueError(f"{name}: {given!r}; allowed: {allowed}")
    return pixels


def bits(given: Any) -> int:
    """Bits of a display code."""
    if isinstance(given, bool) or given not in (8, 16):
        raise ValueError(f"bits: {shortened(given)}; allowed: 8, 16")
    return int(given)


def threads(given: Any) -> int | None:
    """A number of threads, or `None` for one for each core."""
    return None if given is None else whole(given, "threads", "1 to 1024, or None for one for each core")


def frames_in_flight(given: Any) -> int | None:
    """How many frames are drawn at once, or `None` for as many as the program would draw."""
    return None if given is None else whole(given, "frames_in_flight", "None, or a number of frames of at least 1", 1)


def shortened(value: Any) -> str:
    """What a message shows of a value that may be long."""
    text = repr(value)
    return text if len(text) <= 60 else f"{text[:57]}..."
