"""Effects that follow a program's time, and write into its arrays."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from . import _bansho, _checks
from .frame import Alpha, Space, structured
from .scene import Scene
from .shot import View, as_scene, stored_arrays
from .tables import SceneTable

__all__ = ["Effect"]


class Effect:
    """Fire, rain and aurora that a program steps in its own time, and may change at any time.

    >>> torch = bansho.Effect(bansho.FlameSheet(width=0.4), size=(64, 64))
    >>> torch.set_wind((0.5, 0, 0), gust=0.8)
    >>> torch.advance(1 / 60)
    0.0
    >>> pixels = torch.linear()
    """

    def __init__(
        self,
        scene: Scene | SceneTable | str | os.PathLike[str] | Mapping[str, Any] | Sequence[SceneTable],
        *,
        size: tuple[int, int] | None = None,
        seed: int | None = None,
        loop_s: float | None = None,
        backdrop: bool = False,
        layers: bool = False,
        aovs: bool = False,
        shutter_s: float | None = None,
        max_steps: int | None = None,
        threads: int | None = None,
        arrays: Mapping[str, Any] | None = None,
    ) -> None:
        """Opens a scene, or tables such as `bansho.FlameSheet()`, at time 0.

        `max_steps` is the number of simulation steps of one `advance`, 60 by default; see `bansho.open` for the others.
        """
        described = as_scene(scene)
        self._effect = _bansho.Effect(
            described.to_toml(),
            described.name,
            stored_arrays(described, arrays),
            size=_checks.sides(size, "size"),
            seed=None if seed is None else _checks.seed(seed),
            loop_s=None if loop_s is None else _checks.number(loop_s, "loop_s", "a number of seconds"),
            backdrop=backdrop,
            layers=layers,
            aovs=aovs,
            shutter_s=None if shutter_s is None else _checks.number(shutter_s, "shutter_s", "a number of seconds"),
            max_steps=None if max_steps is None else _checks.whole(max_steps, "max_steps", "a whole number above 0", 1, 1_000_000_000),
            threads=_checks.threads(threads),
        )

    def advance(self, dt: float) -> float:
        """Lets `dt` seconds pass and draws. Returns the time that simulations did not reach within their steps, s: pass it with the next `dt`, or drop it."""
        return self._effect.advance(_time(dt, "dt"))

    def at(self, seconds: float) -> None:
        """Goes to a time and draws. Simulations cannot go back; see `restart`."""
        self._effect.at(_time(seconds, "seconds"))

    def restart(self) -> None:
        """Begins again at time 0."""
        self._effect.restart()

    def set_wind(self, velocity: Sequence[float], gust: float = 0.0) -> None:
        """Sets the mean wind, m/s, and its turbulence intensity, which are reached within 0.25 s."""
        self._effect.set_wind(_checks.vector(velocity, "velocity"), _checks.number(gust, "gust"))

    def set_camera(self, **keys: Any) -> None:
        """Sets keys of the camera, such as `position`, from the next picture on; the others stay."""
        self._effect.set_camera(keys)

    def set_size(self, width: int, height: int) -> None:
        """Sets the size of the picture, pixels."""
        allowed = "a whole number from 1 to 65536"
        self._effect.set_size(_checks.whole(width, "width", allowed, 1, 65536), _checks.whole(height, "height", allowed, 1, 65536))

    def set_exposure_ev100(self, exposure_ev100: float) -> None:
        """Sets the exposure value at ISO 100."""
        self._effect.set_exposure_ev100(_checks.number(exposure_ev100, "exposure_ev100"))

    def set_rain_rate(self, rate_mm_per_h: float, name: str = "rain") -> None:
        """Sets the rate of a rain, which is reached within 0.25 s."""
        self._effect.set_rain_rate(name, _checks.number(rate_mm_per_h, "rate_mm_per_h"))

    def ignite(self, name: str) -> None:
        """Lights a flame, which grows within half a second."""
        self._effect.ignite(name)

    def extinguish(self, name: str) -> None:
        """Puts a flame out within half a second."""
        self._effect.extinguish(name)

    def set_flow(self, name: str, flow: float) -> None:
        """Sets the gas flow of a flame as a fraction of full flow."""
        self._effect.set_flow(name, _checks.number(flow, "flow"))

    def move_to(self, name: str, position: Sequence[float], seconds: float = 0.0) -> None:
        """Moves a flame to a position, m, within `seconds`."""
        self._effect.move_to(name, _checks.vector(position, "position"), _checks.number(seconds, "seconds"))

    def linear(self, out: Any = None, *, space: Space = "linear_srgb") -> NDArray[np.float32]:
        """The picture as premultiplied light, (H, W, 4), into `out` if it is given: an array of numpy, or a buffer that numpy can write to."""
        pixels = self._buffer(out, np.float32, (4,))
        self._effect.write_floats(pixels, space)
        return pixels

    def display(self, out: Any = None, *, view: View = "display", alpha: Alpha = "encoded", premultiplied: bool = False) -> NDArray[np.uint8]:
        """The picture as display codes, (H, W, 4), into `out` if it is given."""
        pixels = self._buffer(out, np.uint8, (4,))
        self._effect.write_codes(pixels, view, alpha, premultiplied)
        return pixels

    def depth(self, out: Any = None) -> NDArray[np.float32]:
        """The depth of the nearest object, m, (H, W), into `out` if it is given; infinity where there is none."""
        plane = self._buffer(out, np.float32, ())
        self._effect.write_depth(plane)
        return plane

    def aov(self, name: str, out: Any = None) -> NDArray[np.float32]:
        """An AOV or a channel of a layer, (H, W), into `out` if it is given; with `aovs=True` or `layers=True`."""
        plane = self._buffer(out, np.float32, ())
        self._effect.write_channel(name, plane)
        return plane

    def _buffer(self, out: Any, dtype: Any, channels: tuple[Literal[4], ...]) -> Any:
        """`out` as an array that shares its memory, or a new one."""
        width, height = self.size
        if out is None:
            return np.empty((height, width, *channels), dtype)
        try:
            if isinstance(out, np.ndarray):
                buffer = out
            elif hasattr(out, "__dlpack__"):
                buffer = np.from_dlpack(out)
            else:
                # Bytes, or numbers without a shape.
                buffer = np.asarray(memoryview(out))
                if buffer.ndim == 1 and buffer.size == height * width * (4 if channels else 1):
                    buffer = buffer.reshape(height, width, *channels)
        except (BufferError, RuntimeError, TypeError, ValueError) as reason:
            allowed = f"an array (height, width{', 4' if channels else ''}) of {np.dtype(dtype)} in main memory, such as one of numpy"
            raise ValueError(f"out: a {type(out).__name__} ({reason}); allowed: {allowed}") from None
        if buffer.dtype != dtype:
            raise ValueError(f"out: an array of {buffer.dtype}; allowed: {np.dtype(dtype)}")
        if buffer.shape != (height, width, *channels):
            raise ValueError(f"out: an array of shape {list(buffer.shape)}; allowed: {(height, width, *channels)}")
        if not buffer.flags["C"]:
            raise ValueError("out: pixels that are not one after the other, row by row; allowed: an array in C order without gaps")
        if not buffer.flags["W"]:
            raise ValueError("out: cannot be written; allowed: a writable array in main memory (by DLPack with numpy 2.1 or later)")
        return buffer

    @property
    def particles(self) -> NDArray[Any]:
        """The particles of all phenomena as a structured array."""
        return structured(self._effect.particles())

    @property
    def time_s(self) -> float:
        """Time of the current picture, s."""
        return self._effect.time

    @property
    def owed_s(self) -> float:
        """Time that the last call did not reach, s."""
        return self._effect.owed_s

    @property
    def size(self) -> tuple[int, int]:
        """Width and height, pixels."""
        width, height = self._effect.size
        return width, height

    @property
    def wind(self) -> tuple[tuple[float, float, float], float]:
        """Mean wind at the current time, m/s, and its turbulence intensity."""
        (x, y, z), gust = self._effect.wind
        return (x, y, z), gust

    @property
    def is_simulated(self) -> bool:
        """Whether anything in it is simulated in steps."""
        return self._effect.is_simulated

    def __repr__(self) -> str:
        width, height = self.size
        return f"<Effect at {self.time_s:.3f} s: {width} x {height}>"


def _time(value: Any, name: str) -> float:
    """A time, s; whether it is finite is checked where what is allowed is known."""
    if isinstance(value, float):
        return value
    return _checks.number(value, name, "a number of seconds")
