"""A frame as arrays, its camera and its data."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Generic, Literal, TypeVar

import numpy as np
from numpy.typing import NDArray

from . import _bansho, _png
from .errors import MissingNameError

if TYPE_CHECKING:
    from .shot import Shot

__all__ = ["Aov", "Figure", "Frame", "FrameCamera", "FrameLight"]

Space = Literal["acescg", "linear_srgb"]
Alpha = Literal["encoded", "linear"]


class Aov(np.ndarray):  # type: ignore[type-arg]
    """An array with the unit of its values and what they are."""

    unit: str
    doc: str

    def __new__(cls, values: NDArray[np.float32], unit: str, doc: str) -> Aov:
        """The values, which are not copied."""
        aov = np.asarray(values).view(cls)
        aov.unit, aov.doc = unit, doc
        return aov

    def __array_finalize__(self, source: Any) -> None:
        self.unit = getattr(source, "unit", "")
        self.doc = getattr(source, "doc", "")

    def __reduce__(self) -> tuple[Any, ...]:
        """An array that is pickled keeps what it measures, for instance on its way from a worker process."""
        return Aov, (np.asarray(self), self.unit, self.doc)


AnyArray = TypeVar("AnyArray", bound="NDArray[Any]")


class NamedArrays(Mapping[str, AnyArray], Generic[AnyArray]):
    """Arrays by name. The error of a name that is missing says which option of `bansho.open` is needed, and which names there are."""

    def __init__(self, arrays: dict[str, AnyArray], what: str, option: str, is_on: bool, available: Iterable[str]) -> None:
        """`what` they are, the `option` of `bansho.open` that asks for them, whether it is on, and the names that there are with it."""
        self._arrays, self._what, self._option, self._is_on, self._available = arrays, what, option, is_on, tuple(available)

    def __getitem__(self, name: str) -> AnyArray:
        if name in self._arrays:
            return self._arrays[name]
        listed = ", ".join(self._available)
        if not self._is_on:
            of_scene = f", with which this scene has {listed}" if listed else ""
            raise MissingNameError(f"there is no {self._what} {name!r}, since the frame has none; allowed: {self._option}=True of bansho.open{of_scene}")
        raise MissingNameError(f"there is no {self._what} {name!r}; allowed: {listed or 'none, since the scene has none'}")

    def __iter__(self) -> Iterator[str]:
        return iter(self._arrays)

    def __len__(self) -> int:
        return len(self._arrays)

    def __repr__(self) -> str:
        return f"<{self._what}s: {', '.join(self._arrays) or 'none'}>"


@dataclass(frozen=True)
class Figure:
    """A number that characterizes a frame, such as a rain rate."""

    phenomenon: str
    name: str
    unit: str
    value: float


@dataclass(frozen=True)
class FrameCamera:
    """The camera at the middle of an exposure. World coordinates are in m, with y up."""

    world_from_camera: NDArray[np.float64]
    """4 x 4: camera coordinates are right, up and backward (OpenGL, Blender)."""
    K: NDArray[np.float64]
    """3 x 3: intrinsic matrix of a perspective lens in pixels of `Frame.linear`, where the center of the upper left pixel is (0, 0) (OpenCV)."""
    lens: str
    """`"perspective"`, `"fisheye"` or `"panorama"`."""
    size: tuple[int, int]
    """Width and height of `Frame.linear`, pixels."""
    shutter: tuple[float, float]
    """When the shutter opens and closes, s."""

    @property
    def world_from_camera_opencv(self) -> NDArray[np.float64]:
        """4 x 4: camera coordinates are right, down and forward (OpenCV)."""
        return self.world_from_camera @ np.diag([1.0, -1.0, -1.0, 1.0])

    def project(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Pixels (x, y) and depth (m) of points (N, 3) of the world, seen through a perspective lens, in the coordinates of `K`."""
        if self.lens != "perspective":
            raise ValueError(f'a {self.lens} lens; allowed: "perspective"')
        local = (np.atleast_2d(points) - self.world_from_camera[:3, 3]) @ self.world_from_camera_opencv[:3, :3]
        pixels = local @ self.K.T
        return np.column_stack([pixels[:, :2] / pixels[:, 2:], local[:, 2]])


def camera_of(values: Mapping[str, Any], window: tuple[int, int, int, int]) -> FrameCamera:
    """The camera of what the compiled part says about it, for the pixels of a window of the picture: x, y, width and height."""
    matrix = np.eye(4)
    matrix[:3, :3] = np.array(values["rotation"]).T
    matrix[:3, 3] = values["position"]
    focal, (x, y) = values["focal_pixels"], values["principal_point"]
    intrinsic = np.array([[focal, 0.0, x - window[0] - 0.5], [0.0, focal, y - window[1] - 0.5], [0.0, 0.0, 1.0]])
    return FrameCamera(matrix, intrinsic, values["lens"], window[2:], tuple(values["shutter"]))


@dataclass(frozen=True)
class FrameLight:
    """A light with which a phenomenon lights others; not exposed."""

    phenomenon: str
    """Its name in the scene."""
    kind: str
    """`"point"`, `"spot"` or `"directional"`."""
    position: tuple[float, float, float] | None
    """m; `None` for a directional light."""
    toward: tuple[float, float, float] | None
    """Unit vector toward a directional light, or from the scene to a spot along its axis."""
    radius: float
    """Radius of a point, m."""
    color: tuple[float, float, float]
    """Linear sRGB from 0 to 1."""
    intensity: float
    """Factor of the color: candela, of a directional light lux."""
    acescg: tuple[float, float, float]
    """Color times intensity in ACEScg."""


def _light(values: Mapping[str, Any]) -> FrameLight:
    """The light of what the compiled part says about it: its vectors are lists."""
    fields: dict[str, Any] = {key: tuple(value) if isinstance(value, list) else value for key, value in values.items()}
    return FrameLight(**fields)


def structured(columns: Mapping[str, tuple[NDArray[Any], str]]) -> NDArray[Any]:
    """Columns as a structured array. The units are in the metadata of its type."""
    fields: list[tuple[Any, ...]] = []
    for name, (values, _) in columns.items():
        fields.append((name, values.dtype, values.shape[1:]) if values.ndim > 1 else (name, values.dtype))
    units = {name: unit for name, (_, unit) in columns.items()}
    count = len(next(iter(columns.values()))[0])
    array = np.zeros(count, np.dtype(np.dtype(fields), metadata={"units": units}))
    for name, (values, _) in columns.items():
        array[name] = values
    return array


class Frame:
    """A drawn frame. Its arrays belong to it alone."""

    def __init__(self, shot: Shot, values: Mapping[str, Any], space: Space) -> None:
        """Made by `Shot.render`."""
        self._shot = shot
        self._space = space
        self._acescg: NDArray[np.float32] = values["linear"]
        self._linear: NDArray[np.float32] | None = None
        self.number: int = values["number"]
        """Its number."""
        self.depth: NDArray[np.float32] = values["depth"]
        """Depth of the nearest object drawn, m, (H, W); infinity where there is none."""
        self.exposure_ev100: float = values["exposure_ev100"]
        """Exposure value at ISO 100."""
        self.white_balance_k: float | None = values["white_balance_k"]
        """Temperature of the black body whose light is displayed as white, K; `None` for D65. `linear` is not balanced."""
        self.exposure_s: float = values["exposure_s"]
        """Exposure time, s."""
        self.opaque: bool = values["opaque"]
        """Whether a plate fills the picture."""
        self._figures: tuple[Figure, ...] = tuple(Figure(*entry) for entry in values["figures"])
        described = {name: (unit, doc) for name, unit, doc in shot._shot.aovs}
        aovs: dict[str, Aov] = {}
        planes: dict[str, NDArray[np.float32]] = {}
        for name, (plane, is_color) in values["channels"].items():
            if is_color:
                planes[name] = plane
            else:
                aovs[name] = Aov(plane, *described.get(name, ("", "")))
        options = shot._options
        self.aovs: Mapping[str, Aov] = NamedArrays(aovs, "AOV", "aovs", options.get("aovs", False), aovs or described)
        """AOVs by name, such as `rain.streak_opacity`, (H, W), with `.unit` and `.doc`; with `aovs=True` of `bansho.open`."""
        layers = _layers(planes)
        self.layers: Mapping[str, NDArray[np.float32]] = NamedArrays(layers, "layer", "layers", options.get("layers", False), layers)
        """The layer of each phenomenon by name, (H, W, 4), premultiplied ACEScg; with `layers=True` of `bansho.open`."""

    @property
    def figures(self) -> tuple[Figure, ...]:
        """Numbers that characterize it; with `figures=True` of `bansho.open`, else a `ValueError`."""
        if not self._shot._options.get("figures", False):
            raise ValueError("the frame has no figures; allowed: figures=True of bansho.open")
        return self._figures

    @property
    def linear(self) -> NDArray[np.float32]:
        """Premultiplied light, (H, W, 4), exposed so that 1.0 is display white, in the space of the shot: ACEScg or linear sRGB."""
        if self._space == "acescg":
            return self._acescg
        if self._linear is None:
            self._linear = _bansho.linear_srgb_of_acescg(self._acescg)
        return self._linear

    def in_space(self, space: Space) -> NDArray[np.float32]:
        """The light in another space: `"acescg"` or `"linear_srgb"`."""
        if space == "acescg":
            return self._acescg
        if space == "linear_srgb":
            return _bansho.linear_srgb_of_acescg(self._acescg)
        raise ValueError(f'space: {space!r}; allowed: "acescg", "linear_srgb"')

    def display(self, *, alpha: Alpha | None = "encoded", bits: Literal[8, 16] = 8) -> NDArray[Any]:
        """Display codes: the pixels of the PNG that the program writes, with the glare of its camera.

        `alpha` names what straight alpha blends, `"encoded"` or `"linear"` values: (H, W, 4). With `None` the picture is laid over black: (H, W, 3).
        A shot of simulations that has gone on is simulated again for it, so ask for it before the next frame.
        """
        return self._shot.display(self.number, alpha=alpha, bits=bits)

    @property
    def time_s(self) -> float:
        """When it begins, s."""
        return self._shot._shot.time(self.number)

    @property
    def camera(self) -> FrameCamera:
        """The camera at the middle of its exposure."""
        return self._shot.camera(self.number)

    @property
    def particles(self) -> dict[str, NDArray[Any]]:
        """The particles of each phenomenon that has any, by its name, as structured arrays: `position` (m), `velocity` (m/s), and others such as
        `temperature`. The units are in `array.dtype.metadata["units"]`."""
        return {name: structured(columns) for name, columns in self._shot._shot.particles(self.number)}

    @property
    def drops(self) -> NDArray[Any]:
        """The drops of all rain that are drawn as streaks: `position` (m), `velocity` (m/s), `diameter_mm`, `opacity` of the streak on its axis."""
        clouds = [cloud for cloud in self.particles.values() if "diameter_mm" in (cloud.dtype.names or ())]
        if not clouds:
            raise ValueError("the scene has no rain; allowed: a scene with [[rain]]")
        return clouds[0] if len(clouds) == 1 else np.concatenate(clouds)

    @property
    def lights(self) -> list[FrameLight]:
        """The lights with which phenomena light each other: of a flame the points that approximate its emission."""
        return [_light(values) for values in self._shot._shot.lights(self.number)]

    def _repr_png_(self) -> bytes:
        return _png.encode(self.display(alpha="encoded"))

    def __repr__(self) -> str:
        height, width = self._acescg.shape[:2]
        return f"<Frame {self.number}: {width} x {height}, EV {self.exposure_ev100:.1f}>"


def _layers(planes: Mapping[str, NDArray[np.float32]]) -> dict[str, NDArray[np.float32]]:
    """Channels `NAME.R`, `.G`, `.B`, `.A` as pictures by name."""
    names = dict.fromkeys(name.rpartition(".")[0] for name in planes)
    layers = {}
    for name in names:
        channels = [planes.get(f"{name}.{component}") for component in "RGBA"]
        if all(channel is not None for channel in channels):
            layers[name] = np.stack(channels, axis=-1)  # type: ignore[arg-type]
    return layers
