"""Rain and fog over pictures of others: photographs, video, stereo pairs."""

from __future__ import annotations

import os
import sys
import threading
import warnings
from collections import OrderedDict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _arrays, _bansho, _camera
from .errors import PhysicalStrengthNotice
from .scene import Scene

__all__ = ["RainTruth", "augment_strength", "derived_seed", "fog", "rain", "rain_scene", "rain_stereo", "rain_video"]

DepthKind = _arrays.DepthKind

AUGMENT_OPACITY = 0.2
"""Opacity on its axis that the streak of a drop of 1.6 mm has with `visibility="augment"`."""
STRONGEST = 20.0
"""Largest strength."""
ASSUMED_EV100 = 12.0
"""Exposure value at ISO 100 that is assumed of a picture: that of a street under heavy clouds."""
REACH_M = 1000.0
"""How far from the camera it rains, m, unless `parameters` has another `airlight_distance`."""


@dataclass(frozen=True)
class RainTruth:
    """What was drawn over a picture, pixel by pixel, (H, W)."""

    streak_opacity: NDArray[np.float32]
    """Opacity of the streaks, summed; 0 where there are none."""
    streak_depth: NDArray[np.float32]
    """Depth of the nearest streak, m; 0 where there is none."""
    diameter_mm: NDArray[np.float32]
    """Diameter of the drop of the nearest streak, mm; 0 where there is none."""
    transmission: NDArray[np.float32]
    """Fraction of the light of the picture that passes streaks and the medium."""

    @property
    def streak_mask(self) -> NDArray[np.bool_]:
        """Where a streak covers at least 1 % of a pixel during the exposure."""
        return self.streak_opacity >= 0.01

    @property
    def medium_transmission(self) -> NDArray[np.float32]:
        """Fraction of the light that passes the medium: all drops that are not streaks."""
        return np.minimum(self.transmission / np.maximum(1 - self.streak_opacity, 1e-3), 1).astype(np.float32)


class _Cache:
    """The last shots by process, thread, size and number of threads: what they have built and their memory are used again."""

    MOST = 6

    def __init__(self) -> None:
        self._shots: OrderedDict[Any, _bansho.PlateShot] = OrderedDict()
        self._lock = threading.Lock()

    def shot(self, key: tuple[Any, ...], threads: int | None) -> _bansho.PlateShot:
        key = (os.getpid(), threading.get_ident(), threads, *key)
        with self._lock:
            shot = self._shots.pop(key, None) or _bansho.PlateShot(threads)
            self._shots[key] = shot
            if len(self._shots) > self.MOST:
                self._shots.popitem(last=False)
        return shot

    def after_fork(self) -> None:
        """In a child process: the shots of the parent are of no use, and its lock may be held by a thread that does not exist here."""
        self._shots, self._lock = OrderedDict(), threading.Lock()


_cache = _Cache()
if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_cache.after_fork)


def derived_seed(seed: int, *indices: int) -> int:
    """A seed for item `indices` of something that has a seed: the same everywhere, whatever was drawn before."""
    low, high = np.random.SeedSequence([seed, *indices]).generate_state(2)
    # A scene has seeds up to 9e15, which is beyond 52 bits.
    return int(low) | (int(high) & 0xFFFFF) << 32


def augment_strength(exposure_s: float) -> float:
    """The strength of `visibility="augment"`: that at which the streak of a drop of 1.6 mm has an opacity of 0.2, within 1 to 20.

    The streak of a drop becomes fainter the longer the exposure is, since it covers a point of its path for D / (v T) of the time.
    """
    (opacity,) = _bansho.streak_opacity([1.6], float(exposure_s))
    return float(np.clip(AUGMENT_OPACITY / opacity, 1.0, STRONGEST))


def _strength(strength: float | str | None, visibility: str | None, exposure_s: float) -> float:
    if visibility not in (None, "physical", "augment"):
        raise ValueError(f'visibility: {visibility!r}; allowed: "physical", "augment"')
    if visibility == "augment":
        if strength is not None:
            raise ValueError(f'strength: {strength!r} with visibility="augment", which chooses one; allowed: one of both')
        return augment_strength(exposure_s)
    if strength is None and visibility is None:
        _notice()
    if strength is None or strength == "physical":
        return 1.0
    if isinstance(strength, str) or not 0 < float(strength) <= STRONGEST:
        raise ValueError(f'strength: {strength!r}; allowed: "physical", or a number above 0 up to {STRONGEST:g}')
    return float(strength)


_noticed = False


def _notice() -> None:
    """Says once that physical rain may hardly be seen."""
    global _noticed
    if _noticed:
        return
    _noticed = True
    message = (
        'the rain is as strong as physics makes it: on a photograph by day 20 mm/h is hardly seen. For training data pass visibility="augment" or a '
        'strength above 1; strength="physical" is the default, and silences this notice'
    )
    # It is about the first line outside of this package.
    level, frame = 1, sys._getframe()
    while frame is not None and frame.f_globals.get("__name__", "").partition(".")[0] == "bansho":
        level, frame = level + 1, frame.f_back  # type: ignore[assignment]
    warnings.warn(message, PhysicalStrengthNotice, stacklevel=level)


def rain_scene(
    size: tuple[int, int],
    *,
    rate_mm_per_h: float = 20.0,
    camera: ArrayLike | None = None,
    pose: ArrayLike | Sequence[ArrayLike] | None = None,
    exposure_s: float = 1 / 60,
    wind: Sequence[float] = (0.0, 0.0, 0.0),
    gust: float = 0.0,
    seed: int = 1,
    strength: float | Literal["physical"] | None = "physical",
    visibility: Literal["physical", "augment"] | None = None,
    depth: bool = True,
    depth_kind: DepthKind = "axis",
    depth_scale: float | None = None,
    exposure_ev100: float = ASSUMED_EV100,
    splashes: float = 0.0,
    fps: float = 30.0,
    frames: int = 1,
    parameters: Mapping[str, Any] | None = None,
) -> Scene:
    """The scene that `bansho.rain` draws over a picture of `size` (height, width), whose plate is called `image` and its depth `depth`.

    The program draws the same pixels from it. See `bansho.rain` for the parameters.
    """
    height, width = size
    poses = _poses(pose)
    plate: dict[str, Any] = {"image": "image", "depth": "depth" if depth else None, "exposure_ev100": _float(exposure_ev100, "exposure_ev100")}
    if depth:
        plate |= {"depth_kind": depth_kind, "depth_scale": None if depth_scale is None else float(depth_scale)}
    given: dict[str, Any] = {
        "rate_mm_per_h": _float(rate_mm_per_h, "rate_mm_per_h"),
        "method": "drops",
        "opacity_gain": _strength(strength, visibility, exposure_s),
        "airlight_distance": REACH_M,
        "splashes": {"fraction": _float(splashes, "splashes")},
    }
    if not splashes:
        # What the picture shows ends the rain, not a level ground, of which nothing is known.
        given["ground_height"] = float(poses[0][1, 3]) - 1e4
    return Scene(
        {
            "picture": {"size": [width, height], "frames": frames, "fps": _rate(fps), "seed": _seed(seed)},
            "camera": {
                **_camera.pose_keys(poses, 1 / fps),
                **_camera.intrinsics(camera, size),
                "shutter_s": _float(exposure_s, "exposure_s"),
                # The lens of the picture has added its glare already.
                "glare": 0.0,
            },
            "plate": plate,
            "wind": {"velocity": [_float(component, "wind") for component in _vector(wind, "wind")], "gust": _float(gust, "gust")},
            "rain": [{**given, **(parameters or {})}],
        }
    )


def _poses(pose: Any) -> list[NDArray[np.float64]]:
    if pose is None:
        return [_camera.level_pose()]
    array = np.asarray(pose, dtype=np.float64)
    if array.ndim == 3:
        return [_camera.checked_pose(matrix, f"pose {index}") for index, matrix in enumerate(array)]
    return [_camera.checked_pose(array)]


def _float(value: Any, name: str) -> float:
    try:
        return float(value)
    except (TypeError, ValueError):
        raise ValueError(f"{name}: {value!r}; allowed: a number") from None


def _vector(value: Any, name: str) -> Sequence[Any]:
    if np.shape(value) != (3,):
        raise ValueError(f"{name}: an array of shape {np.shape(value)}; allowed: (x, y, z)")
    return list(value)


def _seed(seed: Any) -> int:
    try:
        whole = int(seed.__index__())
    except AttributeError:
        raise ValueError(f"seed: {seed!r}; allowed: a whole number from 0 to 9e15") from None
    return whole


def _rate(fps: float) -> float | int:
    if not fps > 0:
        raise ValueError(f"fps: {fps!r}; allowed: a number above 0")
    return int(fps) if float(fps).is_integer() else float(fps)


def _draw(
    scene: Scene,
    image: NDArray[Any],
    is_linear: bool,
    depth: NDArray[np.float32] | None,
    number: int,
    truth: bool,
    threads: int | None,
) -> tuple[NDArray[Any], RainTruth | None]:
    """Draws a frame of a scene over an image."""
    shot = _cache.shot((*image.shape, depth is None), threads)
    encoding = "linear_srgb" if is_linear else "srgb"
    # Codes of 16 bits are floats that are encoded: their light is drawn, and encoded again.
    drawn, values = shot.draw(scene.to_toml(), image, encoding, depth, number, truth)
    result = drawn if drawn.shape[2] == 3 else np.ascontiguousarray(drawn[..., : image.shape[2]])
    if image.dtype == np.uint8 and image.shape[2] == 4:
        result = np.dstack([result, image[..., 3]])
    return result, _truth_of(values) if truth and values is not None else None


def _truth_of(values: Mapping[str, Any]) -> RainTruth:
    """What a frame with AOVs and layers says about its rain."""
    channels = {name: plane for name, (plane, _) in values["channels"].items()}
    return RainTruth(
        streak_opacity=channels["rain.streak_opacity"],
        streak_depth=channels["rain.streak_depth"],
        diameter_mm=channels["rain.diameter_mm"],
        transmission=(1 - channels["rain.A"]).astype(np.float32),
    )


def rain(
    image: ArrayLike,
    depth: ArrayLike | None = None,
    *,
    rate_mm_per_h: float | Sequence[float] = 20.0,
    camera: ArrayLike | None = None,
    pose: ArrayLike | None = None,
    exposure_s: float = 1 / 60,
    wind: Sequence[float] = (0.0, 0.0, 0.0),
    gust: float = 0.0,
    seed: int = 1,
    strength: float | Literal["physical"] | None = None,
    visibility: Literal["physical", "augment"] | None = None,
    truth: bool = False,
    depth_kind: DepthKind = "axis",
    depth_scale: float | None = None,
    exposure_ev100: float = ASSUMED_EV100,
    splashes: float = 0.0,
    threads: int | None = None,
    parameters: Mapping[str, Any] | None = None,
) -> Any:
    """Rain over a picture: streaks of drops whose number, speed, opacity and light follow from physics, and the airlight of those that are far.

    :param image: (H, W, 3 or 4) `uint8` (sRGB) or floats (linear sRGB); or a batch (N, H, W, 3), each of which gets rain of its own.
    :param depth: (H, W) in m, or integers with `depth_scale`; it hides what is behind, and sets how much airlight is in front. `None` for infinitely far.
    :param rate_mm_per_h: rain rate, 0 to 300: 1 drizzle, 5 rain, 20 heavy, 70 a downpour; of a batch also one for each.
    :param camera: matrix K (3 x 3, OpenCV) in pixels; `None` for a lens of 28 mm on 24 mm of sensor height.
    :param pose: 4 x 4, world from camera (right, up, backward; y up; m); `None` for a level camera 1.6 m above the ground.
    :param exposure_s: exposure time, which is how long streaks are.
    :param wind: its velocity in m/s: x to the right, y up, z toward the viewer of a camera that is not rotated.
    :param gust: standard deviation of the speed of the wind divided by its mean.
    :param seed: of the drops. The same arguments give the same bytes.
    :param strength: `"physical"`, or a factor of the opacity of streaks and airlight up to 20.
    :param visibility: `"augment"` for the strength at which streaks are seen by day, `augment_strength(exposure_s)`.
    :param truth: whether a `RainTruth` comes with the picture (of a batch a list of them).
    :param depth_kind: `"axis"`, `"distance"` or `"inverse"`, which needs `depth_scale`.
    :param depth_scale: meters for each unit of the depth.
    :param exposure_ev100: exposure value of the picture at ISO 100; it matters only to lamps and fires.
    :param splashes: fraction of the drops that splash on a level ground 1.6 m below the camera.
    :param threads: `None` for one for each core.
    :param parameters: further keys of `[[rain]]`, such as ``{"distance": 9.0}``. Streaks are drawn within 5 m, and it rains within 1 km.
    """
    pixels = _arrays.as_numpy(image, "image")
    options: dict[str, Any] = {
        "camera": camera,
        "pose": pose,
        "exposure_s": exposure_s,
        "wind": wind,
        "gust": gust,
        "strength": strength,
        "visibility": visibility,
        "depth_kind": depth_kind,
        "depth_scale": depth_scale,
        "exposure_ev100": exposure_ev100,
        "splashes": splashes,
        "parameters": parameters,
    }
    if pixels.ndim != 4:
        return _rain_one(pixels, depth, {**options, "rate_mm_per_h": rate_mm_per_h, "seed": seed}, 0, truth, threads)
    rates = np.broadcast_to(np.asarray(rate_mm_per_h, dtype=np.float64), (len(pixels),))
    depths = _each(depth, len(pixels))
    drawn = []
    for index, (picture, plane, rate) in enumerate(zip(pixels, depths, rates, strict=True)):
        own = {**options, "rate_mm_per_h": rate, "seed": derived_seed(seed, index)}
        drawn.append(_rain_one(picture, plane, own, 0, truth, threads))
    if not truth:
        return np.stack(drawn) if drawn else pixels.copy()
    return np.stack([picture for picture, _ in drawn]), [values for _, values in drawn]


def _each(depth: Any, count: int) -> list[Any]:
    """A depth for each picture of a batch."""
    if depth is None:
        return [None] * count
    if isinstance(depth, (list, tuple)):
        depths: Any = list(depth)
    else:
        depths = _arrays.as_numpy(depth, "depth")
        if depths.ndim == 2:
            return [depths] * count
    if len(depths) != count:
        raise ValueError(f"depth: {len(depths)} of them for {count} images; allowed: one, or one for each")
    return list(depths)


def _rain_one(pixels: Any, depth: Any, options: dict[str, Any], number: int, truth: bool, threads: int | None, scene: Scene | None = None) -> Any:
    """Rain over one picture; with `truth` a tuple."""
    checked, is_linear = _arrays.image(pixels)
    if checked.dtype == np.float32 and not is_linear:
        raise ValueError("image: an array of uint16; allowed: uint8 (sRGB), or floats (linear sRGB)")
    size = (checked.shape[0], checked.shape[1])
    plane = None if depth is None else _arrays.depth(depth, size, options["depth_kind"], options["depth_scale"])
    if scene is None:
        scene = rain_scene(size, depth=plane is not None, **options)
    result, values = _draw(scene, checked, is_linear, plane, number, truth, threads)
    return (result, values) if truth else result


def rain_video(
    images: Sequence[ArrayLike] | ArrayLike,
    depths: Sequence[ArrayLike] | ArrayLike | None = None,
    *,
    fps: float,
    poses: ArrayLike | None = None,
    truth: bool = False,
    threads: int | None = None,
    rate_mm_per_h: float = 20.0,
    camera: ArrayLike | None = None,
    exposure_s: float | None = None,
    wind: Sequence[float] = (0.0, 0.0, 0.0),
    gust: float = 0.0,
    seed: int = 1,
    strength: float | Literal["physical"] | None = None,
    visibility: Literal["physical", "augment"] | None = None,
    depth_kind: DepthKind = "axis",
    depth_scale: float | None = None,
    exposure_ev100: float = ASSUMED_EV100,
    splashes: float = 0.0,
    parameters: Mapping[str, Any] | None = None,
) -> Any:
    """The same rain over the frames of a video: drops go on falling from frame to frame, and the camera moves between them.

    `poses` (N, 4, 4) are those of the camera, one for each frame; without, it stands still. The exposure is half a frame by default. An iterator of pictures,
    with `truth` of pairs: nothing is kept in memory.
    """
    count = len(images)
    if count == 0:
        raise ValueError("images: none; allowed: one or more")
    first, _ = _arrays.image(images[0], "images")
    if poses is not None and np.shape(poses) != (count, 4, 4):
        raise ValueError(f"poses: an array of shape {np.shape(poses)}; allowed: ({count}, 4, 4), one for each image")
    options: dict[str, Any] = {"depth_kind": depth_kind, "depth_scale": depth_scale}
    each = _each(depths, count)
    scene = rain_scene(
        (first.shape[0], first.shape[1]),
        rate_mm_per_h=rate_mm_per_h,
        camera=camera,
        pose=poses,
        exposure_s=0.5 / fps if exposure_s is None else exposure_s,
        wind=wind,
        gust=gust,
        seed=seed,
        strength=strength,
        visibility=visibility,
        depth=each[0] is not None,
        exposure_ev100=exposure_ev100,
        splashes=splashes,
        fps=fps,
        frames=count,
        parameters=parameters,
        **options,
    )
    return (_rain_one(images[number], each[number], options, number, truth, threads, scene) for number in range(count))


def rain_stereo(
    left: ArrayLike,
    right: ArrayLike,
    depth_left: ArrayLike | None = None,
    depth_right: ArrayLike | None = None,
    *,
    baseline_m: float,
    pose: ArrayLike | None = None,
    truth: bool = False,
    strength: float | Literal["physical"] | None = None,
    visibility: Literal["physical", "augment"] | None = None,
    threads: int | None = None,
    **options: Any,
) -> tuple[Any, Any]:
    """The same drops over both pictures of a rectified stereo pair, whose right camera is `baseline_m` to the right of the left one.

    `pose` is that of the left camera; see `bansho.rain` for the other options.
    """
    pose_left = _camera.level_pose() if pose is None else _camera.checked_pose(pose)
    pose_right = pose_left.copy()
    pose_right[:3, 3] += _float(baseline_m, "baseline_m") * pose_left[:3, 0]
    common = {"strength": strength, "visibility": visibility, "truth": truth, "threads": threads, **options}
    return rain(left, depth_left, pose=pose_left, **common), rain(right, depth_right, pose=pose_right, **common)


def fog(
    image: ArrayLike,
    depth: ArrayLike,
    visibility_m: float = 500.0,
    *,
    camera: ArrayLike | None = None,
    pose: ArrayLike | None = None,
    depth_kind: DepthKind = "axis",
    depth_scale: float | None = None,
    threads: int | None = None,
) -> NDArray[Any]:
    """Fog over a picture with depth: it dims what is far, and is lit by the light that the picture shows.

    `visibility_m` is the meteorological visibility, at which a black object has 2 % contrast: below 1000 fog, up to 5000 mist. See `bansho.rain` for the others.
    """
    checked, is_linear = _arrays.image(image)
    if checked.dtype == np.float32 and not is_linear:
        raise ValueError("image: an array of uint16; allowed: uint8 (sRGB), or floats (linear sRGB)")
    if depth is None:
        raise ValueError("depth: None; allowed: an array (height, width), since fog is in front of what has a distance")
    size = (checked.shape[0], checked.shape[1])
    plane = _arrays.depth(depth, size, depth_kind, depth_scale)
    scale = None if depth_scale is None else float(depth_scale)
    scene = Scene(
        {
            "picture": {"size": [size[1], size[0]], "frames": 1},
            "camera": {**_camera.pose_keys(_poses(pose), 1.0), **_camera.intrinsics(camera, size), "glare": 0.0},
            "plate": {"image": "image", "depth": "depth", "depth_kind": depth_kind, "depth_scale": scale, "exposure_ev100": ASSUMED_EV100},
            "fog": {"visibility_m": _float(visibility_m, "visibility_m")},
        }
    )
    return _draw(scene, checked, is_linear, plane, 0, False, threads)[0]
