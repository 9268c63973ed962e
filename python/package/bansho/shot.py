"""Shots: scenes that are drawn, frame by frame, to arrays and to files."""

from __future__ import annotations

import importlib
import os
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from . import _arrays, _bansho, _checks
from .frame import Alpha, Frame, FrameCamera, Space, camera_of
from .scene import Scene
from .tables import SceneTable

__all__ = ["Shot", "open"]

View = Literal["display", "neutral", "agx", "standard", "raw"]
Progress = Callable[[int, int], Any]


def as_scene(scene: Scene | SceneTable | str | os.PathLike[str] | Mapping[str, Any] | Sequence[SceneTable]) -> Scene:
    """A scene, the path of its file, or its tables: as a dict, or as builders."""
    if isinstance(scene, Scene):
        return scene
    if isinstance(scene, (str, os.PathLike)):
        return Scene.load(scene)
    return Scene(scene)


def stored_arrays(scene: Scene, arrays: Mapping[str, Any] | None) -> _bansho.Arrays:
    """The arrays that stand for files that a scene names: of an image (H, W), or (H, W, 1, 3 or 4), of a depth (H, W), or a list with one for each frame."""
    stored = _bansho.Arrays(scene.folder, int(scene["picture.first_frame"]))
    named = set(scene.asset_paths)
    if arrays is not None and not isinstance(arrays, Mapping):
        raise ValueError(f"arrays: a {type(arrays).__name__}; allowed: a dict of arrays by the name of the file that they stand for")
    for name, given in (arrays or {}).items():
        if name not in named:
            raise ValueError(f"arrays: the scene names no file {name!r}; allowed: {', '.join(sorted(named)) or 'none, since it names no files'}")
        frames = list(given) if isinstance(given, (list, tuple)) else [given]
        if not frames:
            raise ValueError(f"arrays: {name!r} has no frames; allowed: an array, or a list with one for each frame")
        planes = [_arrays.as_numpy(frame, name) for frame in frames]
        if name == scene["plate.depth"] and name != scene["plate.image"]:
            # An inverse depth may have no scale: the program fits it to known distances or to the ground.
            kind, scale = scene["plate.depth_kind"], scene["plate.depth_scale"]
            stored.set_depths(name, [_arrays.depth_plane(plane, scale is not None or kind == "inverse", name) for plane in planes])
            continue
        images = [_arrays.image(_arrays.with_channels(plane), name) for plane in planes]
        if all(image.dtype == np.uint8 for image, _ in images):
            stored.set_codes(name, [image for image, _ in images])
        elif len({is_linear for _, is_linear in images}) == 1 and all(image.dtype == np.float32 for image, _ in images):
            stored.set_floats(name, [image for image, _ in images], "linear_srgb" if images[0][1] else "srgb")
        else:
            raise ValueError(f"{name}: frames of different types; allowed: one type for all")
    return stored


def open(
    scene: Scene | SceneTable | str | os.PathLike[str] | Mapping[str, Any] | Sequence[SceneTable],
    *,
    size: tuple[int, int] | None = None,
    threads: int | None = None,
    seed: int | None = None,
    loop_s: float | None = None,
    crop: tuple[int, int, int, int] | None = None,
    backdrop: bool = True,
    layers: bool = False,
    aovs: bool = False,
    figures: bool = False,
    overscan: bool = True,
    view: View | None = None,
    space: Space = "acescg",
    arrays: Mapping[str, Any] | None = None,
) -> Shot:
    """Opens a scene, which builds its phenomena, and plans its shot.

    :param scene: a `Scene`, the path of a scene file, a dict of tables, or tables such as `bansho.FlameSheet()`.
    :param size: width and height in place of those of the scene, pixels.
    :param threads: how many threads draw; `None` for one for each core. The bytes are the same for any number.
    :param seed: another seed of all random numbers.
    :param loop_s: makes a seamless loop of this length, s.
    :param crop: x, y, width and height of the region that is drawn, pixels.
    :param backdrop: whether sky, ground and lamps that the scene does not state, and its phenomena imply, are visible.
    :param layers: whether each phenomenon is also drawn into a layer of its own.
    :param aovs: whether phenomena write their AOVs, such as temperature or opacity of streaks.
    :param figures: whether frames have the numbers that characterize them.
    :param overscan: whether light has the overscan of the scene.
    :param view: view transform of display codes in place of that of the scene.
    :param space: of `Frame.linear`, `"acescg"` or `"linear_srgb"`.
    :param arrays: arrays by the name of the file that they stand for, ``{"plate.png": image}``. Nothing touches the disk.
    """
    return Shot(
        as_scene(scene),
        size=size,
        threads=threads,
        seed=seed,
        loop_s=loop_s,
        crop=crop,
        backdrop=backdrop,
        layers=layers,
        aovs=aovs,
        figures=figures,
        overscan=overscan,
        view=view,
        space=space,
        arrays=arrays,
    )


class Shot:
    """A scene that is drawn. `bansho.open` makes one. It may be used from several threads, which wait for each other."""

    def __init__(self, scene: Scene, *, space: Space = "acescg", arrays: Mapping[str, Any] | None = None, **options: Any) -> None:
        """See `bansho.open`."""
        if space not in ("acescg", "linear_srgb"):
            raise ValueError(f'space: {space!r}; allowed: "acescg", "linear_srgb"')
        for name in ("size", "crop"):
            options[name] = _checks.sides(options.get(name), name)
        options["threads"] = _checks.threads(options.get("threads"))
        if options.get("seed") is not None:
            options["seed"] = _checks.seed(options["seed"])
        if options.get("loop_s") is not None:
            options["loop_s"] = _checks.number(options["loop_s"], "loop_s", "a number of seconds")
        self.scene = scene.copy()
        """The scene that is drawn."""
        self._space: Space = space
        self._options = options
        self._arrays = stored_arrays(scene, arrays)
        self._shot = _bansho.Shot(scene.to_toml(), scene.name, self._arrays, **options)

    def render(self, number: int = 0) -> Frame:
        """Draws a frame as light. Simulations are stepped to it, and begin again for an earlier one."""
        return Frame(self, self._shot.draw_light(_whole(number)), self._space)

    def display(self, number: int = 0, *, alpha: Alpha | None = "encoded", bits: Literal[8, 16] = 8) -> NDArray[Any]:
        """Draws a frame as display codes, without keeping its light: the pixels of the PNG that the program writes. See `Frame.display`."""
        codes = self._shot.draw_display(_whole(number), _checks.bits(bits), alpha)
        return np.ascontiguousarray(codes[..., :3]) if alpha is None else codes

    def frames(
        self,
        first: int | None = None,
        end: int | None = None,
        *,
        step: int = 1,
        progress: bool | Progress = False,
        frames_in_flight: int | None = None,
    ) -> Iterator[Frame]:
        """Draws the frames from `first` up to, but without, `end`: by default all of the shot.

        `progress` is called with the number of frames that are done and of all; `True` shows a bar of tqdm, if that is installed. `frames_in_flight` is how many
        frames are drawn at once and kept until they are taken; `None` for one with fewer than 8 threads or over a plate, else up to one for each thread. The
        bytes are the same for any number. Simulations are always drawn one frame after the other.
        """
        begin, stop = self.range
        numbers = range(begin if first is None else _whole(first), stop if end is None else _whole(end), step)
        return self._drawn(numbers, progress, self._shot.frames_in_flight(len(numbers), _checks.frames_in_flight(frames_in_flight)))

    def _drawn(self, numbers: range, progress: bool | Progress, in_flight: int) -> Iterator[Frame]:
        """Draws frames, of which `in_flight` at once."""
        with _reporter(progress, len(numbers)) as report:
            if in_flight == 1:
                for done, number in enumerate(numbers, start=1):
                    yield self.render(number)
                    report(done, len(numbers))
                return
            stream = self._shot.frame_stream(numbers.start, numbers.step, len(numbers), in_flight)
            try:
                for done, drawn in enumerate(stream, start=1):
                    yield Frame(self, drawn, self._space)
                    report(done, len(numbers))
            finally:
                # Frames that are drawn ahead are of no use if the iteration ends early.
                stream.close()

    def write(
        self,
        out: str | os.PathLike[str],
        *,
        frames: int | Sequence[int] | range | None = None,
        metadata: bool = False,
        glare: bool = False,
        bits: Literal[8, 16] = 8,
        alpha: Alpha | None = None,
        overwrite: bool = False,
        resume: bool = False,
        progress: bool | Progress = False,
    ) -> Path:
        """Writes frames to files, as the program's `render` does: `out` is ``f.####.exr``, ``f.####.png``, ``film.mp4`` and others.

        Returns the file of the first frame. What the program would warn of is a `UserWarning`.
        """
        if not self._arrays.is_empty():
            raise ValueError("write: the scene has arrays in place of files; allowed: files, since those who read a scene file need them")
        if frames is None:
            numbers = None
        else:
            numbers = [_whole(number) for number in ([frames] if hasattr(frames, "__index__") else frames)]
        begin, stop = self.range
        options = {key: value for key, value in self._options.items() if key not in ("figures", "overscan")}
        with _reporter(progress, stop - begin if numbers is None else len(numbers)) as report:
            first, remarks = _bansho.write_files(
                self.scene.to_toml(),
                self.scene.name,
                self.scene.folder,
                Path(out),
                frames=numbers,
                metadata=metadata,
                glare=glare,
                bits=bits,
                alpha=alpha,
                overwrite=overwrite,
                resume=resume,
                progress=None if progress is False else report,
                **options,
            )
        for remark in remarks:
            warnings.warn(remark, UserWarning, stacklevel=2)
        return Path(first)

    def camera(self, number: int = 0) -> FrameCamera:
        """The camera at the middle of the exposure of a frame, for the pixels of `Frame.linear`: of the crop, or of the picture with its overscan."""
        return camera_of(self._shot.camera(_whole(number)), self._window())

    def _window(self) -> tuple[int, int, int, int]:
        """The pixels of `Frame.linear` in the picture: x, y, width and height."""
        crop = self._options.get("crop")
        if crop is not None:
            return tuple(crop)  # type: ignore[return-value]
        width, height = self.size
        overscan = int(self.scene["picture.overscan"]) if self._options.get("overscan", True) else 0
        return -overscan, -overscan, width + 2 * overscan, height + 2 * overscan

    def time_of(self, number: int) -> float:
        """Time at which a frame begins, s."""
        return self._shot.time(_whole(number))

    @property
    def range(self) -> tuple[int, int]:
        """The first frame, and the one after the last."""
        return self._shot.range

    @property
    def size(self) -> tuple[int, int]:
        """Width and height, pixels."""
        width, height = self._shot.size
        return width, height

    @property
    def fps(self) -> float:
        """Frames per second."""
        frames, seconds = self._shot.fps
        return frames / seconds

    @property
    def exposure_ev100(self) -> float:
        """Exposure value at ISO 100, chosen once for the shot."""
        return self._shot.exposure_ev100

    @property
    def is_simulated(self) -> bool:
        """Whether frames follow from those before."""
        return self._shot.is_stepped

    @property
    def threads(self) -> int:
        """How many threads draw."""
        return self._shot.threads

    def _repr_png_(self) -> bytes:
        return self.render(self.range[0])._repr_png_()

    def __repr__(self) -> str:
        width, height = self.size
        begin, end = self.range
        return f"<Shot of {self.scene.name}: {width} x {height}, frames {begin} to {end - 1}>"


def _whole(number: Any) -> int:
    """A frame number."""
    return _checks.whole(number, "a frame number")


@contextmanager
def _reporter(progress: bool | Progress, count: int) -> Iterator[Progress]:
    """What is called with the number of frames that are done and of all. A bar is closed however the work ends."""
    if callable(progress):
        yield progress
        return
    try:
        # A library that is missing is found when it is asked for, not by the work within.
        bar_class = importlib.import_module("tqdm.auto").tqdm if progress else None
    except ImportError:
        bar_class = None
    if bar_class is None:
        yield lambda done, total: None
        return
    with bar_class(total=count, unit="frame") as bar:

        def report(done: int, total: int) -> None:
            bar.total = total
            bar.update(done - bar.n)

        yield report
