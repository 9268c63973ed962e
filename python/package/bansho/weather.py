"""Rain and fog over pictures of others: photographs, video, stereo pairs."""

from __future__ import annotations

import itertools
import os
import sys
import threading
import warnings
from collections import OrderedDict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _arrays, _bansho, _camera, _checks, _workers
from .errors import PhysicalStrengthNotice
from .frame import FrameCamera
from .scene import Scene

__all__ = ["RainTruth", "augment_strength", "derived_seed", "fog", "rain", "rain_scene", "rain_stereo", "rain_video"]

DepthKind = _arrays.DepthKind

AUGMENT_OPACITY = 0.2
"""Opacity on its axis that the streak of a drop of 1.6 mm has with `visibility="augment"`."""
STRONGEST = 20.0
"""Largest strength."""
ASSUMED_EV100 = 12.0
"""Exposure value at ISO 100 that is assumed of a picture: that of a street under heavy clouds."""
MOST_FRAMES = 100_000
"""Frames of the scene of a video whose length is not known."""
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
    medium_transmission: NDArray[np.float32]
    """Fraction of the light of the picture that passes the medium: all drops that are not streaks."""

    @property
    def streak_mask(self) -> NDArray[np.bool_]:
        """Where a streak covers at least 1 % of a pixel during the exposure."""
        return self.streak_opacity >= 0.01


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

    def forget(self, shot: _bansho.PlateShot) -> None:
        """Does not use a shot again."""
        with self._lock:
            for key in [key for key, cached in self._shots.items() if cached is shot]:
                del self._shots[key]

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
    exposure = _checks.number(exposure_s, "exposure_s", "a number of seconds above 0")
    if exposure <= 0:
        raise ValueError(f"exposure_s: {exposure_s!r}; allowed: a number of seconds above 0")
    (opacity,) = _bansho.streak_opacity([1.6], exposure)
    return float(np.clip(AUGMENT_OPACITY / opacity, 1.0, STRONGEST))


def _strength(strength: float | str | None, visibility: str | None, exposure_s: float) -> float:
    if not (visibility is None or isinstance(visibility, str) and visibility in ("physical", "augment")):
        raise ValueError(f'visibility: {visibility!r}; allowed: "physical", "augment"')
    if visibility == "augment":
        if strength is not None:
            raise ValueError(f'strength: {strength!r} with visibility="augment", which chooses one; allowed: one of both')
        return augment_strength(exposure_s)
    if strength is None and visibility is None:
        _notice()
    if strength is None or isinstance(strength, str) and strength == "physical":
        return 1.0
    allowed = f'"physical", or a number above 0 up to {STRONGEST:g}'
    factor = _checks.number(strength, "strength", allowed)
    if not 0 < factor <= STRONGEST:
        raise ValueError(f"strength: {strength!r}; allowed: {allowed}")
    return factor


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
    camera: ArrayLike | FrameCamera | None = None,
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

    The program draws the same pixels from it. `pose` may be a sequence with one for each frame: the pose at the middle of its exposure. See `bansho.rain` for
    the other parameters.
    """
    sides = _checks.sides(size, "size")
    if sides is None:
        raise ValueError("size: None; allowed: (height, width)")
    height, width = sides
    rate = _rate(fps)
    exposure = _checks.number(exposure_s, "exposure_s")
    if parameters is not None and not isinstance(parameters, Mapping):
        raise ValueError(f"parameters: {_checks.shortened(parameters)}; allowed: a dict of keys of [[rain]]")
    _arrays.check_depth_kind(depth_kind)
    scale = _depth_scale(depth_scale)
    poses = _poses(pose)
    plate: dict[str, Any] = {"image": "image", "depth": "depth" if depth else None, "exposure_ev100": _checks.number(exposure_ev100, "exposure_ev100")}
    if depth:
        plate |= {"depth_kind": depth_kind, "depth_scale": scale}
    given: dict[str, Any] = {
        "rate_mm_per_h": _checks.number(rate_mm_per_h, "rate_mm_per_h"),
        "method": "drops",
        "opacity_gain": _strength(strength, visibility, exposure),
        "airlight_distance": REACH_M,
        "splashes": {"fraction": _checks.number(splashes, "splashes")},
    }
    if not splashes:
        # What the picture shows ends the rain, not a level ground, of which nothing is known.
        given["ground_height"] = float(poses[0][1, 3]) - 1e4
    view: dict[str, Any] = {
        **_camera.pose_keys(poses, 1 / rate, exposure),
        **_camera.intrinsics(camera, (height, width)),
        "shutter_s": exposure,
        # The lens of the picture has added its glare already.
        "glare": 0.0,
    }
    return Scene(
        {
            "picture": {"size": [width, height], "frames": frames, "fps": rate, "seed": _checks.whole(seed, "seed", "a whole number from 0 to 9e15")},
            "camera": view,
            "plate": plate,
            "wind": {"velocity": _checks.vector(wind, "wind"), "gust": _checks.number(gust, "gust")},
            "rain": [{**given, **(parameters or {})}],
        }
    )


def _poses(pose: Any) -> list[NDArray[np.float64]]:
    if pose is None:
        return [_camera.level_pose()]
    array = _checks.numbers(pose, "pose", _camera.ALLOWED_POSE)
    if array.ndim == 3 and len(array) > 0:
        return [_camera.checked_pose(matrix, f"pose {index}") for index, matrix in enumerate(array)]
    return [_camera.checked_pose(array)]


def _depth_scale(scale: Any) -> float | None:
    return None if scale is None else _checks.number(scale, "depth_scale", "a number of meters for each unit of the depth, or None")


def _rate(fps: Any) -> float | int:
    """Frames per second: a whole number where it is one, as a scene has it."""
    rate = _checks.number(fps, "fps", "a number above 0")
    if rate <= 0:
        raise ValueError(f"fps: {fps!r}; allowed: a number above 0")
    return int(rate) if rate.is_integer() else rate


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
    threads = _workers.default_threads() if threads is None else _checks.threads(threads)
    shot = _cache.shot((*image.shape, depth is None), threads)
    encoding = "linear_srgb" if is_linear else "srgb"
    # Codes of 16 bits are floats that are encoded: their light is drawn, and encoded again.
    try:
        drawn, values = shot.draw(scene.to_toml(), image, encoding, depth, number, truth)
    except ValueError:
        # What was given is wrong; the shot is as it was.
        raise
    except BaseException:
        # After an `InternalError` a shot refuses every later call, and other exceptions may leave it half changed.
        _cache.forget(shot)
        raise
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
        medium_transmission=np.exp(-channels["rain.airlight_optical_depth"]).astype(np.float32),
    )


def rain(
    image: ArrayLike,
    depth: ArrayLike | None = None,
    *,
    rate_mm_per_h: ArrayLike = 20.0,
    camera: ArrayLike | FrameCamera | None = None,
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
    :param rate_mm_per_h: rain rate, 0 to 300: 1 drizzle, 5 rain, 20 heavy, 70 a downpour; of a batch also (N,), one for each.
    :param camera: matrix K (3 x 3, OpenCV) in pixels, or the camera of a frame; `None` for a lens of 28 mm on 24 mm of sensor height.
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
    :param threads: `None` for one for each core, and for one in a worker process.
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
    seed, rates = _checks.seed(seed), _rates(rate_mm_per_h, len(pixels))
    depths = _each(depth, len(pixels))
    drawn = []
    for index, (picture, plane, rate) in enumerate(zip(pixels, depths, rates, strict=True)):
        own = {**options, "rate_mm_per_h": rate, "seed": derived_seed(seed, index)}
        drawn.append(_rain_one(picture, plane, own, 0, truth, threads))
    if not drawn:
        return (pixels.copy(), []) if truth else pixels.copy()
    if not truth:
        return np.stack(drawn)
    return np.stack([picture for picture, _ in drawn]), [values for _, values in drawn]


def _rates(rate_mm_per_h: Any, count: int) -> list[float]:
    """A rain rate for each picture of a batch."""
    allowed = "a number, or one for each image"
    rates = _checks.numbers(rate_mm_per_h, "rate_mm_per_h", allowed)
    if rates.shape not in ((), (count,)):
        raise ValueError(f"rate_mm_per_h: an array of shape {rates.shape} for {count} images; allowed: {allowed}")
    return np.broadcast_to(rates, (count,)).tolist()


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
    checked, is_linear = _arrays.image(pixels, has_uint16=False)
    size = (checked.shape[0], checked.shape[1])
    plane = None if depth is None else _arrays.depth(depth, size, options["depth_kind"], options["depth_scale"])
    if scene is None:
        scene = rain_scene(size, depth=plane is not None, **options)
    result, values = _draw(scene, checked, is_linear, plane, number, truth, threads)
    return (result, values) if truth else result


def rain_video(
    images: Iterable[ArrayLike] | ArrayLike,
    depths: Iterable[ArrayLike] | ArrayLike | None = None,
    *,
    fps: float,
    poses: Iterable[ArrayLike] | ArrayLike | None = None,
    truth: bool = False,
    threads: int | None = None,
    rate_mm_per_h: float = 20.0,
    camera: ArrayLike | FrameCamera | None = None,
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
) -> Iterator[Any]:
    """The same rain over the frames of a video: drops go on falling from frame to frame, and the camera moves between them.

    :param images: pictures of one shape: a sequence, an array (N, H, W, 3), or an iterator, of which no more than one picture is in memory.
    :param depths: one for each image, as a sequence or an iterator; or one array (H, W) for all.
    :param poses: (N, 4, 4) or an iterator of 4 x 4, one for each image: that of the camera at the middle of the exposure. Between them it moves evenly, and before
        the first and after the last as between those two that are nearest. `None` for a camera that stands still.
    :param exposure_s: half a frame by default.

    Returns an iterator of pictures, with `truth` of pairs. See `bansho.rain` for the other parameters.
    """
    rate = _rate(fps)
    # The camera of the scene needs all poses; images and depths are taken one by one.
    matrices = None if poses is None else _checks.numbers(list(poses) if isinstance(poses, Iterator) else poses, "poses", "an array (N, 4, 4), one for each image")
    count = _length(images)
    if count is None and matrices is not None:
        count = len(matrices) if matrices.ndim else 0
    if matrices is not None and (matrices.shape != (count, 4, 4) or count == 0):
        raise ValueError(f"poses: an array of shape {matrices.shape}; allowed: ({count or 'N'}, 4, 4), one for each image")
    pictures = _in_order(images)
    first_picture = next(pictures, None)
    if first_picture is None:
        raise ValueError("images: none; allowed: one or more")
    first, _ = _arrays.image(first_picture, "images")
    planes = _planes(depths, count)
    try:
        first_plane = next(planes)
    except StopIteration:
        raise ValueError("depths: none; allowed: one for each image, or None") from None
    options: dict[str, Any] = {"depth_kind": depth_kind, "depth_scale": depth_scale}
    size = (first.shape[0], first.shape[1])
    scene = rain_scene(
        size,
        rate_mm_per_h=rate_mm_per_h,
        camera=camera,
        pose=matrices,
        exposure_s=0.5 / rate if exposure_s is None else exposure_s,
        wind=wind,
        gust=gust,
        seed=seed,
        strength=strength,
        visibility=visibility,
        depth=first_plane is not None,
        exposure_ev100=exposure_ev100,
        splashes=splashes,
        fps=fps,
        frames=MOST_FRAMES if count is None else count,
        parameters=parameters,
        **options,
    )
    frames = _frames_of_video(itertools.chain([first_picture], pictures), itertools.chain([first_plane], planes), size, count)
    return (_rain_one(picture, plane, options, number, truth, threads, scene) for number, (picture, plane) in enumerate(frames))


def _length(values: Any) -> int | None:
    """How many there are; `None` of an iterator."""
    try:
        return len(values)
    except TypeError:
        return None


def _in_order(images: Any) -> Iterator[Any]:
    """The images, each of which is asked for when it is drawn."""
    count = _length(images)
    if count is not None:
        return (images[number] for number in range(count))
    if not isinstance(images, Iterable):
        raise ValueError(f"images: a {type(images).__name__}; allowed: a sequence, an array (N, height, width, 3), or an iterator of images")
    return iter(images)


def _planes(depths: Any, count: int | None) -> Iterator[Any]:
    """The depths, each of which is asked for when it is drawn."""
    if depths is None:
        return itertools.repeat(None)
    if isinstance(depths, Iterator):
        return depths
    if count is not None:
        return iter(_each(depths, count))
    if isinstance(depths, (list, tuple)):
        return iter(depths)
    planes = _arrays.as_numpy(depths, "depths")
    return itertools.repeat(planes) if planes.ndim == 2 else iter(planes)


def _frames_of_video(pictures: Iterator[Any], planes: Iterator[Any], size: tuple[int, int], count: int | None) -> Iterator[tuple[Any, Any]]:
    """Each picture with its depth. That they are as the first ones is checked."""
    drawn, has_depth = 0, True
    for number, picture in enumerate(pictures):
        if count is not None and number >= count:
            raise ValueError(f"images: more than {count}; allowed: one for each pose")
        shape = _arrays.as_numpy(picture, f"image {number}").shape
        if shape[:2] != size:
            raise ValueError(f"images: image {number} has the shape {shape}; allowed: {size[0]} x {size[1]} pixels, as the first")
        try:
            plane = next(planes)
        except StopIteration:
            raise ValueError(f"depths: {number} of them, and more images; allowed: one for each image") from None
        has_depth = plane is not None if number == 0 else has_depth
        if (plane is not None) != has_depth:
            raise ValueError(f"depths: image {number} is {'without' if has_depth else 'with'} one, unlike the first; allowed: one for each image, or none")
        yield picture, plane
        drawn = number + 1
    if count is not None and drawn < count:
        raise ValueError(f"images: {drawn} for {count} poses; allowed: one for each pose")


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
    pose_right[:3, 3] += _checks.number(baseline_m, "baseline_m") * pose_left[:3, 0]
    common = {"strength": strength, "visibility": visibility, "truth": truth, "threads": threads, **options}
    return rain(left, depth_left, pose=pose_left, **common), rain(right, depth_right, pose=pose_right, **common)


def fog(
    image: ArrayLike,
    depth: ArrayLike,
    visibility_m: float = 500.0,
    *,
    camera: ArrayLike | FrameCamera | None = None,
    pose: ArrayLike | None = None,
    depth_kind: DepthKind = "axis",
    depth_scale: float | None = None,
    threads: int | None = None,
) -> NDArray[Any]:
    """Fog over a picture with depth: it dims what is far, and is lit by the light that the picture shows.

    `visibility_m` is the meteorological visibility, at which a black object has 2 % contrast: below 1000 fog, up to 5000 mist. See `bansho.rain` for the others.
    """
    checked, is_linear = _arrays.image(image, has_uint16=False)
    if depth is None:
        raise ValueError("depth: None; allowed: an array (height, width), since fog is in front of what has a distance")
    size = (checked.shape[0], checked.shape[1])
    plane = _arrays.depth(depth, size, depth_kind, depth_scale)
    scale = _depth_scale(depth_scale)
    scene = Scene(
        {
            "picture": {"size": [size[1], size[0]], "frames": 1},
            "camera": {**_camera.pose_keys(_poses(pose)[:1]), **_camera.intrinsics(camera, size), "glare": 0.0},
            "plate": {"image": "image", "depth": "depth", "depth_kind": depth_kind, "depth_scale": scale, "exposure_ev100": ASSUMED_EV100},
            "fog": {"visibility_m": _checks.number(visibility_m, "visibility_m")},
        }
    )
    return _draw(scene, checked, is_linear, plane, 0, False, threads)[0]
