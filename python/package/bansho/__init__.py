"""Fire, rain and aurora for pictures, as arrays.

>>> import bansho
>>> rainy = bansho.rain(photograph, depth, rate_mm_per_h=20, exposure_s=1 / 60, seed=7)
>>> frame = bansho.open("campfire.toml").render(17)
>>> frame.linear.shape
(720, 1280, 4)

| looked for | found in |
| --- | --- |
| rain and fog over a picture | `rain`, `rain_video`, `rain_stereo`, `fog` |
| scenes | `Scene`, and a builder for each table: `FlameSheet`, `Rain`, `Camera` |
| frames | `open`, `Shot`, `Frame` |
| what follows a program's time | `Effect` |
| augmentation, data sets, labels | `bansho.transforms`, `bansho.datasets`, `bansho.labels` |
| physics | `black_body`, `drop_sizes`, `streaks`, `aurora_emission`; curves in `bansho.plot` |
"""

from __future__ import annotations

from . import datasets, labels, plot, tables, transforms
from ._bansho import __version__
from .errors import InternalError, MissingNameError, PhysicalStrengthNotice, Problem, SceneError
from .frame import Aov, Figure, Frame, FrameCamera, FrameLight
from .live import Effect
from .physics import *
from .physics import __all__ as _physics
from .scene import Scene
from .shot import Shot, open
from .tables import *
from .weather import RainTruth, augment_strength, derived_seed, fog, rain, rain_scene, rain_stereo, rain_video

__all__ = [
    "Aov",
    "Effect",
    "Figure",
    "Frame",
    "FrameCamera",
    "FrameLight",
    "InternalError",
    "MissingNameError",
    "PhysicalStrengthNotice",
    "Problem",
    "RainTruth",
    "Scene",
    "SceneError",
    "Shot",
    "__version__",
    "augment_strength",
    "datasets",
    "derived_seed",
    "fog",
    "labels",
    "open",
    "plot",
    "rain",
    "rain_scene",
    "rain_stereo",
    "rain_video",
    "tables",
    "transforms",
    *_physics,
    *tables.__all__,
]
