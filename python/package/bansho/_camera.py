"""Cameras of others (K, poses) as the camera of a scene."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from . import _checks
from .frame import FrameCamera

DEFAULT_FOV_DEG = math.degrees(2 * math.atan(12 / 28))
"""Vertical field of view that is assumed without a camera: that of a lens of 28 mm on a sensor 24 mm high."""

ALLOWED_POSE = "4 x 4, world from camera, whose axes are right, up and backward, with y up in the world"

EYE_HEIGHT_M = 1.6
"""Height of the camera above the ground that is assumed without a pose."""


def intrinsics(camera: Any, size: tuple[int, int]) -> dict[str, Any]:
    """Field of view and lens shift of a camera: `None`, a matrix K (3 x 3, OpenCV), or the camera of a frame."""
    height = size[0]
    if camera is None:
        return {"vertical_fov_deg": DEFAULT_FOV_DEG}
    if isinstance(camera, FrameCamera):
        if camera.lens != "perspective":
            raise ValueError(f'camera: a {camera.lens} lens; allowed: "perspective"')
        camera = camera.K
    allowed = "a matrix K [[f, 0, cx], [0, f, cy], [0, 0, 1]] in pixels"
    matrix = _checks.numbers(camera, "camera", allowed)
    if matrix.shape != (3, 3):
        raise ValueError(f"camera: an array of shape {matrix.shape}; allowed: {allowed}")
    if not np.isfinite(matrix).all():
        raise ValueError(f"camera: K with a value that is not finite; allowed: {allowed}")
    fx, fy = matrix[0, 0], matrix[1, 1]
    if fx <= 0 or fy <= 0 or not np.allclose(matrix[2], [0, 0, 1], atol=1e-9):
        raise ValueError(f"camera: {matrix.tolist()} is no camera; allowed: {allowed}, with f above 0")
    if abs(matrix[0, 1]) > 1e-6 * fx or abs(matrix[1, 0]) > 1e-6 * fx:
        raise ValueError(f"camera: K with a skew of {matrix[0, 1]:g}; allowed: 0")
    if abs(fx / fy - 1) > 5e-3:
        raise ValueError(f"camera: focal lengths of {fx:g} and {fy:g} pixels; allowed: equal ones (square pixels), within 0.5 %")
    # The center of the upper left pixel is (0.5, 0.5) in a scene.
    shift = [(0.5 * size[1] - (matrix[0, 2] + 0.5)) / height, ((matrix[1, 2] + 0.5) - 0.5 * height) / height]
    fov = math.degrees(2 * math.atan(0.5 * height / fy))
    if not 0.1 <= fov <= 170:
        raise ValueError(f"camera: a focal length of {fy:g} pixels is a vertical field of view of {fov:.3g} degrees; allowed: 0.1 to 170")
    if max(abs(shift[0]), abs(shift[1])) > 10:
        raise ValueError(f"camera: the principal point ({matrix[0, 2]:g}, {matrix[1, 2]:g}) is far outside of the picture; allowed: up to 10 picture heights")
    return {"vertical_fov_deg": fov, "shift": shift}


def checked_pose(pose: Any, name: str = "pose") -> NDArray[np.float64]:
    """A pose as a matrix 4 x 4, world from camera: right, up, backward, in m, y up."""
    allowed = ALLOWED_POSE
    matrix = _checks.numbers(pose, name, allowed)
    if matrix.shape != (4, 4):
        raise ValueError(f"{name}: an array of shape {matrix.shape}; allowed: {allowed}")
    if not np.isfinite(matrix).all():
        raise ValueError(f"{name}: a matrix with a value that is not finite; allowed: {allowed}")
    rotation = matrix[:3, :3]
    if not np.allclose(rotation.T @ rotation, np.eye(3), atol=1e-3) or np.linalg.det(rotation) < 0 or not np.allclose(matrix[3], [0, 0, 0, 1]):
        raise ValueError(f"{name}: {matrix.tolist()} is no rotation with a translation; allowed: {allowed}")
    return matrix


def level_pose() -> NDArray[np.float64]:
    """A level camera at the height of the eye, which looks along -z."""
    pose = np.eye(4)
    pose[1, 3] = EYE_HEIGHT_M
    return pose


def pose_keys(poses: list[NDArray[np.float64]], frame_s: float = 1.0, exposure_s: float = 0.0) -> dict[str, Any]:
    """Position, target and up of a camera that has these poses, one for each frame, at the middle of the exposures, which begin every `frame_s` (s).

    A pose before the first and one after the last go on as the camera moves between the two that are nearest, so that it moves during each whole exposure.
    """
    if len(poses) == 1:
        return {key: value for key, value in zip(_KEYS, _place(poses[0]), strict=True)}
    middle = 0.5 * exposure_s
    times = [index * frame_s + middle for index in range(len(poses))]
    # Frames from the middle of an exposure to its end: 1 unless exposures overlap.
    beyond = max(1, math.ceil(middle / frame_s))
    times = [times[0] - beyond * frame_s, *times, times[-1] + beyond * frame_s]
    poses = [_continued(poses[1], poses[0], beyond), *poses, _continued(poses[-2], poses[-1], beyond)]
    values: dict[str, list[Any]] = {key: [] for key in _KEYS}
    for time, pose in zip(times, poses, strict=True):
        for key, value in zip(_KEYS, _place(pose), strict=True):
            values[key].append([time, value])
    return {key: {"keys": keys, "interpolation": "linear"} for key, keys in values.items()}


_KEYS = ("position", "target", "up")


def _place(pose: NDArray[np.float64]) -> list[list[float]]:
    """Position, target and up of a pose."""
    position = pose[:3, 3]
    # The target is far enough that rounding does not turn the camera.
    return [position.tolist(), (position - 10.0 * pose[:3, 2]).tolist(), pose[:3, 1].tolist()]


def _continued(before: NDArray[np.float64], pose: NDArray[np.float64], frames: int) -> NDArray[np.float64]:
    """The pose some frames after `pose`, if the camera goes on moving and turning as it did from `before` to it."""
    continued = pose.copy()
    continued[:3, 3] += frames * (pose[:3, 3] - before[:3, 3])
    turn = pose[:3, :3] @ before[:3, :3].T
    continued[:3, :3] = np.linalg.matrix_power(turn, frames) @ pose[:3, :3]
    return continued
