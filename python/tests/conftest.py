"""What the tests share: scenes, pictures, and the program if there is one."""

from __future__ import annotations

import os
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

import bansho

SCENES = Path(__file__).parents[2] / "scenes"


@pytest.fixture(scope="session")
def photograph() -> np.ndarray:
    """A picture of 320 x 180 pixels with every code of 8 bits."""
    y, x = np.mgrid[:180, :320]
    return np.stack([x * 255 // 319, y * 255 // 179, (x + y) % 256], axis=-1).astype(np.uint8)


@pytest.fixture(scope="session")
def torch_scene() -> bansho.Scene:
    """A small flame."""
    return bansho.Scene([bansho.Picture(size=(96, 64), frames=4), bansho.FlameSheet(width=0.5, height=0.9)])


@pytest.fixture(scope="session")
def program() -> list[str]:
    """The command of the program: that of the environment, or the one of the package."""
    given = os.environ.get("BANSHO_PROGRAM") or shutil.which("bansho")
    if not given:
        pytest.skip("there is no program: set BANSHO_PROGRAM")
    subprocess.run([given, "--version"], check=True, capture_output=True)
    return [given]
