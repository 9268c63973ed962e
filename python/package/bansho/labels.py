"""Labels of what is in a frame: masks at a stated threshold, boxes, and the records of COCO and YOLO."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from . import _arrays, _checks
from .frame import Frame

__all__ = ["Box", "Category", "aurora_mask", "boxes", "coco", "fire_mask", "luminance_mask", "mask", "rain_mask", "rle", "smoke_mask", "yolo"]

Category = Literal["fire", "smoke", "rain", "aurora"]

THRESHOLDS: Mapping[str, float] = {"fire": 800.0, "smoke": 0.1, "rain": 0.01, "aurora": 1.0}
"""Default thresholds: fire, temperature of soot in K; smoke, optical depth; rain, opacity of streaks; aurora, brightness of the green line in kR."""

LUMINANCE_RATIO = 0.02
"""Default threshold against the background, luminance of a layer divided by that of the rest of the frame: 2 %, the contrast at which an object is seen by
the definition of the meteorological visibility (Koschmieder)."""

MEASURES: Mapping[str, str] = {"fire": "temperature_k", "smoke": "optical_depth", "rain": "streak_opacity", "aurora": "kilorayleigh_557"}
"""The AOV of each category, after the name of the phenomenon."""

LUMINANCE = np.array([0.2722287, 0.6740818, 0.0536895], np.float32)
"""Weights of ACEScg components in the luminance (Academy S-2014-004)."""


def _plane(frame: Frame, suffix: str, what: str) -> NDArray[np.float32]:
    """The largest value of all phenomena that have an AOV."""
    planes = [np.asarray(aov) for name, aov in frame.aovs.items() if name.rpartition(".")[2] == suffix]
    if not planes:
        raise ValueError(f"the frame has no AOV of {what}; allowed: a frame of a scene with it, with aovs=True of bansho.open")
    return np.maximum.reduce(planes)


def fire_mask(frame: Frame, temperature_k: float = THRESHOLDS["fire"]) -> NDArray[np.bool_]:
    """Where soot is at least that hot, (H, W)."""
    return _plane(frame, "temperature_k", "fire") >= temperature_k


def smoke_mask(frame: Frame, optical_depth: float = THRESHOLDS["smoke"], temperature_k: float = THRESHOLDS["fire"]) -> NDArray[np.bool_]:
    """Where soot or smoke is at least that dense and does not glow, (H, W)."""
    return (_plane(frame, "optical_depth", "smoke") >= optical_depth) & ~fire_mask(frame, temperature_k)


def rain_mask(frame: Frame, opacity: float = THRESHOLDS["rain"]) -> NDArray[np.bool_]:
    """Where streaks are at least that opaque, (H, W)."""
    return _plane(frame, "streak_opacity", "rain") >= opacity


def aurora_mask(frame: Frame, kilorayleigh: float = THRESHOLDS["aurora"]) -> NDArray[np.bool_]:
    """Where the green line, 557.7 nm, is at least that bright, (H, W). A moonless sky has 0.25 kR of it, a faint visible arc 1 kR."""
    return _plane(frame, "kilorayleigh_557", "aurora") >= kilorayleigh


def luminance_mask(frame: Frame, layers: str | Sequence[str], ratio: float = LUMINANCE_RATIO) -> NDArray[np.bool_]:
    """Where layers together are at least `ratio` times as bright as the rest of the frame, (H, W): what is seen against the background.

    `layers` are the names of one or more of `frame.layers`. The luminances are those of the light, without glare. In front of black any light is seen. All
    that a phenomenon adds to the picture counts, such as the airlight of rain.
    """
    least = _checks.number(ratio, "ratio", "a number above 0")
    if least <= 0:
        raise ValueError(f"ratio: {ratio!r}; allowed: a number above 0")
    names = [layers] if isinstance(layers, str) else list(layers)
    if not names:
        raise ValueError("layers: none; allowed: one or more names of frame.layers")
    added = np.sum([frame.layers[name][..., :3] for name in names], axis=0) @ LUMINANCE
    # Layers are what is added to the picture, as it is seen from the camera.
    rest = np.maximum(frame.in_space("acescg")[..., :3] @ LUMINANCE - added, 0)
    return (added > 0) & (added >= least * rest)


def _layers_of(frame: Frame, category: Category) -> list[str]:
    """The names of the phenomena of a category: those that have its AOV."""
    if category == "smoke":
        raise ValueError("by: 'luminance' of smoke, which is in the layer of its fire; allowed: 'fire', 'rain', 'aurora'")
    phenomena = [name.rpartition(".")[0] for name, *_ in frame._shot._shot.aovs if name.rpartition(".")[2] == MEASURES[category]]
    if not phenomena:
        raise ValueError(f"the frame has no {category}; allowed: a frame of a scene with it")
    return phenomena


def mask(frame: Frame, category: Category, threshold: float | None = None, *, by: Literal["measure", "luminance"] = "measure") -> NDArray[np.bool_]:
    """The mask of a category at a threshold, (H, W).

    By its measure the threshold is a physical one, by default that of `THRESHOLDS`; the frame needs `aovs=True`. By luminance it is that of the category's layers
    divided by that of the rest of the frame, by default `LUMINANCE_RATIO`; the frame needs `layers=True`, and smoke has none.
    """
    masks: dict[str, Callable[[Frame, float], NDArray[np.bool_]]] = {"fire": fire_mask, "smoke": smoke_mask, "rain": rain_mask, "aurora": aurora_mask}
    if category not in masks:
        raise ValueError(f"category: {category!r}; allowed: {', '.join(map(repr, masks))}")
    if by == "luminance":
        return luminance_mask(frame, _layers_of(frame, category), LUMINANCE_RATIO if threshold is None else threshold)
    if by != "measure":
        raise ValueError(f"by: {by!r}; allowed: 'measure', 'luminance'")
    least = THRESHOLDS[category] if threshold is None else _checks.number(threshold, "threshold")
    return masks[category](frame, least)


@dataclass(frozen=True)
class Box:
    """A connected part of a mask: its bounding box and its number of pixels."""

    x: int
    y: int
    width: int
    height: int
    area: int


def boxes(mask: NDArray[np.bool_], *, min_area: int = 1) -> list[Box]:
    """The bounding boxes of the connected parts (also over corners) of a mask, the largest part first."""
    return [box for box, _ in _parts(mask, min_area)]


def _checked(mask: Any) -> NDArray[np.bool_]:
    """A mask as an array (height, width) of truth values."""
    array = _arrays.as_numpy(mask, "mask")
    if array.ndim != 2:
        raise ValueError(f"mask: an array of shape {array.shape}; allowed: (height, width)")
    return array.astype(bool, copy=False)


def _parts(mask: NDArray[np.bool_], min_area: int) -> list[tuple[Box, NDArray[np.int64]]]:
    """The connected parts of a mask, the largest first, each with its runs."""
    mask = _checked(mask)
    runs = _runs(mask)
    if len(runs) == 0:
        return []
    roots = _connected(runs, mask.shape[0])
    parts = []
    for root in np.unique(roots):
        own = runs[roots == root]
        rows, starts, ends = own.T
        area = int((ends - starts).sum())
        if area >= min_area:
            x, y = int(starts.min()), int(rows.min())
            parts.append((Box(x, y, int(ends.max()) - x, int(rows.max()) - y + 1, area), own))
    return sorted(parts, key=lambda part: (-part[0].area, part[0].y, part[0].x))


def _runs(mask: NDArray[np.bool_]) -> NDArray[np.int64]:
    """Row, start and end of every run of a mask, row after row."""
    padded = np.zeros((mask.shape[0], mask.shape[1] + 2), np.int8)
    padded[:, 1:-1] = mask
    steps = np.diff(padded, axis=1)
    rows, starts = np.nonzero(steps == 1)
    return np.column_stack([rows, starts, np.nonzero(steps == -1)[1]])


def _connected(runs: NDArray[np.int64], height: int) -> NDArray[np.int64]:
    """The first run of the part that each run belongs to: union-find over runs of neighboring rows that touch."""
    parents = list(range(len(runs)))

    def root(run: int) -> int:
        while parents[run] != run:
            parents[run] = parents[parents[run]]
            run = parents[run]
        return run

    first = np.searchsorted(runs[:, 0], np.arange(height + 1)).tolist()
    table = runs.tolist()
    for row in range(1, height):
        above, below = first[row - 1], first[row]
        while above < first[row] and below < first[row + 1]:
            # Runs that touch at a corner are connected.
            if table[above][1] <= table[below][2] and table[below][1] <= table[above][2]:
                a, b = root(above), root(below)
                parents[max(a, b)] = min(a, b)
            if table[above][2] < table[below][2]:
                above += 1
            else:
                below += 1
    return np.array([root(run) for run in range(len(runs))])


def rle(mask: NDArray[np.bool_]) -> dict[str, Any]:
    """A mask as the uncompressed run lengths of COCO: counts of 0 and 1 in turn, column after column."""
    mask = _checked(mask)
    values = mask.astype(np.int8).ravel(order="F")
    ends = np.flatnonzero(np.diff(values)) + 1
    counts = np.diff(np.concatenate([[0], ends, [values.size]])).tolist()
    if values.size and values[0]:
        counts = [0, *counts]
    return {"size": list(mask.shape), "counts": counts}


def coco(masks: Iterable[tuple[str, Mapping[str, NDArray[np.bool_]]]], categories: Sequence[str] = ("fire", "smoke", "rain", "aurora"), *, min_area: int = 1) -> dict[str, Any]:
    """A COCO data set of pictures: of each its file name, and its masks by category. Every connected part is an annotation of an object (`iscrowd` 0) with its box
    and its run lengths, which pycocotools and torchvision read as they do polygons.
    """
    images: list[dict[str, Any]] = []
    annotations: list[dict[str, Any]] = []
    for number, (name, by_category) in enumerate(masks, start=1):
        if not by_category:
            raise ValueError(f"masks of {name!r}: none; allowed: one or more, which may be empty, since they have the size of the picture")
        for category, part in by_category.items():
            if category not in categories:
                raise ValueError(f"category: {category!r}; allowed: {', '.join(map(repr, categories))}")
            part = _checked(part)
            for box, runs in _parts(part, min_area):
                within = np.zeros_like(part)
                for row, start, end in runs.tolist():
                    within[row, start:end] = True
                annotations.append(
                    {
                        "id": len(annotations) + 1,
                        "image_id": number,
                        "category_id": categories.index(category) + 1,
                        "bbox": [box.x, box.y, box.width, box.height],
                        "area": box.area,
                        "iscrowd": 0,
                        "segmentation": rle(within),
                    }
                )
        height, width = _checked(next(iter(by_category.values()))).shape
        images.append({"id": number, "file_name": name, "width": width, "height": height})
    listed = [{"id": index, "name": category} for index, category in enumerate(categories, start=1)]
    return {"images": images, "annotations": annotations, "categories": listed}


def yolo(masks: Mapping[str, NDArray[np.bool_]], categories: Sequence[str] = ("fire", "smoke", "rain", "aurora"), *, min_area: int = 1) -> str:
    """The text file of YOLO for a picture: in each line a category's number, and center and size of a box as fractions of the picture."""
    lines = []
    for category, part in masks.items():
        if category not in categories:
            raise ValueError(f"category: {category!r}; allowed: {', '.join(map(repr, categories))}")
        part = _checked(part)
        height, width = part.shape
        for box in boxes(part, min_area=min_area):
            x, y = (box.x + 0.5 * box.width) / width, (box.y + 0.5 * box.height) / height
            lines.append(f"{categories.index(category)} {x:.6f} {y:.6f} {box.width / width:.6f} {box.height / height:.6f}\n")
    return "".join(lines)
