"""Arrays of others as arrays that the compiled part reads: checked, contiguous, of a type that it knows."""

from __future__ import annotations

from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from . import _checks

DepthKind = Literal["axis", "distance", "inverse"]


def as_numpy(array: Any, name: str) -> NDArray[Any]:
    """Any array as one of numpy: what numpy reads, or by DLPack (PyTorch, JAX, CuPy on the host)."""
    if isinstance(array, np.ndarray):
        return array
    if hasattr(array, "__dlpack__") and not hasattr(array, "__array_interface__"):
        try:
            return np.from_dlpack(array)
        except (BufferError, RuntimeError, TypeError) as reason:
            raise ValueError(f"{name}: cannot be read by DLPack ({reason}); allowed: an array in main memory") from None
    try:
        result = np.asarray(array)
    except (TypeError, ValueError, RuntimeError) as reason:
        raise ValueError(f"{name}: a {type(array).__name__} ({reason}); allowed: an array of numbers of one shape") from None
    if result.dtype.kind in "OSU":
        raise ValueError(f"{name}: a {type(array).__name__}; allowed: an array of numbers of one shape")
    return result


def image(array: Any, name: str = "image", has_uint16: bool = True) -> tuple[NDArray[Any], bool]:
    """An image as codes (`uint8`) or floats, and whether floats stand for linear light; codes of 16 bits become encoded floats, unless they are not allowed."""
    pixels = as_numpy(array, name)
    if pixels.ndim != 3 or pixels.shape[2] not in (3, 4) or 0 in pixels.shape:
        raise ValueError(f"{name}: an array of shape {pixels.shape}; allowed: (height, width, 3) or (height, width, 4)")
    # Of any byte order.
    kind = (pixels.dtype.kind, pixels.dtype.itemsize)
    if kind == ("u", 1):
        return np.ascontiguousarray(pixels), False
    if kind == ("u", 2) and has_uint16:
        return np.ascontiguousarray(pixels, dtype=np.float32) / np.float32(65535), False
    if kind in (("f", 2), ("f", 4), ("f", 8)):
        return np.ascontiguousarray(pixels, dtype=np.float32), True
    codes = "uint8 or uint16" if has_uint16 else "uint8"
    raise ValueError(f"{name}: an array of {pixels.dtype}; allowed: {codes} (sRGB), float16, float32 or float64 (linear)")


def with_channels(array: NDArray[Any]) -> NDArray[Any]:
    """A gray image, (H, W) or (H, W, 1), with three channels; any other as it is."""
    if array.ndim == 2:
        array = array[..., None]
    return np.repeat(array, 3, axis=2) if array.ndim == 3 and array.shape[2] == 1 else array


def depth_plane(array: NDArray[Any], is_scaled: bool, name: str) -> NDArray[np.float32]:
    """A depth, (H, W) or (H, W, 1), as floats. Integers need a scale."""
    plane = array[..., 0] if array.ndim == 3 and array.shape[2] == 1 else array
    if plane.ndim != 2 or 0 in plane.shape:
        raise ValueError(f"{name}: an array of shape {array.shape}; allowed: (height, width)")
    if plane.dtype.kind not in "fui":
        raise ValueError(f"{name}: an array of {plane.dtype}; allowed: floats in meters, or integers with depth_scale")
    if plane.dtype.kind in "ui" and not is_scaled:
        raise ValueError(f"{name}: an array of {plane.dtype} without depth_scale; allowed: plate.depth_scale in meters for each unit, such as 0.001 for millimeters")
    return np.ascontiguousarray(plane, dtype=np.float32)


def check_depth_kind(kind: Any) -> None:
    """Refuses what is no kind of depth."""
    if kind not in ("axis", "distance", "inverse"):
        raise ValueError(f'depth_kind: {kind!r}; allowed: "axis", "distance", "inverse"')


def depth(array: Any, size: tuple[int, int], kind: str, scale: float | None, name: str = "depth") -> NDArray[np.float32]:
    """A depth as floats. Integers, and inverse depths, need a scale."""
    check_depth_kind(kind)
    values = as_numpy(array, name)
    if values.ndim == 3 and values.shape[2] == 1:
        values = values[..., 0]
    if values.ndim != 2 or 0 in values.shape:
        raise ValueError(f"{name}: an array of shape {values.shape}; allowed: (height, width), here {size}")
    if values.shape[0] * size[1] != values.shape[1] * size[0]:
        raise ValueError(f"{name}: {values.shape[0]} x {values.shape[1]} pixels have another shape than the image, {size[0]} x {size[1]}; allowed: the image's aspect ratio")
    if scale is not None:
        scale = _checks.number(scale, "depth_scale", "a number of meters for each unit of the depth, or None")
    if np.issubdtype(values.dtype, np.integer):
        if scale is None:
            raise ValueError(f"{name}: an array of {values.dtype} without depth_scale; allowed: depth_scale in meters for each unit, such as 0.001 for millimeters")
    elif not np.issubdtype(values.dtype, np.floating):
        raise ValueError(f"{name}: an array of {values.dtype}; allowed: floats in meters, or integers with depth_scale")
    if kind == "inverse" and scale is None:
        raise ValueError(f"{name}: an inverse depth without depth_scale; allowed: depth_scale, such that the distance is depth_scale / value")
    return np.ascontiguousarray(values, dtype=np.float32)
