"""What a type checker says: of the package, of the code of the pages, and of calls that are wrong."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
from test_pages import GUIDE, PAGES

PACKAGE = Path(__file__).parents[1] / "package"

RIGHT = """
import bansho
import numpy as np

shot = bansho.open(bansho.Scene({"rain": [{}]}))
photographs = np.zeros((2, 90, 160, 3), np.uint8)
bansho.rain(photographs, rate_mm_per_h=np.array([5.0, 20.0]), camera=shot.camera(0))
bansho.rain(photographs[0], np.full((90, 160), 9.0), rate_mm_per_h=5, camera=np.eye(3), visibility="augment")
bansho.fog(photographs[0], np.full((90, 160), 9.0), camera=shot.camera(0))
width, height = shot.size
"""

# Checked where PyTorch is installed.
LOADED = """
import bansho
import numpy as np
from torch.utils.data import DataLoader

photographs = np.zeros((2, 90, 160, 3), np.uint8)
DataLoader(bansho.datasets.RainPairs(photographs, rate_mm_per_h=5), batch_size=2)
DataLoader(bansho.datasets.AllSkyAurora(count=2, size=64), batch_size=2)
"""

WRONG = """
import bansho

bansho.rain([[[0, 0, 0]]], rate=20)
bansho.rain([[[0, 0, 0]]], visibility="more")
bansho.FlameSheet(breadth=0.4)
bansho.Effect(bansho.FlameSheet()).advance("a second")
"""


@pytest.fixture(scope="module")
def checked(tmp_path_factory):
    """What mypy says of files in a folder, line by line. It is told where the package lies, so that an installed one is not needed."""
    pytest.importorskip("mypy")
    cache = tmp_path_factory.mktemp("mypy")

    def lines(folder, *arguments):
        command = [sys.executable, "-m", "mypy", "--cache-dir", str(cache), "--ignore-missing-imports", "--no-error-summary", *arguments]
        ran = subprocess.run(command, cwd=folder, env={**os.environ, "MYPYPATH": str(PACKAGE)}, capture_output=True, text=True)
        assert ran.returncode in (0, 1), ran.stderr
        return ran.stdout.splitlines()

    return lines


def test_the_package_has_no_wrong_types(checked, tmp_path):
    assert checked(tmp_path, "--package", "bansho") == []


def test_the_code_of_the_pages_has_no_wrong_types(checked, tmp_path):
    files = []
    for page in PAGES:
        blocks = re.findall(r"^```python\n(.*?)^```$", (GUIDE / page).read_text(encoding="utf-8"), re.MULTILINE | re.DOTALL)
        files.append(f"{Path(page).stem.replace('-', '_')}_page.py")
        (tmp_path / files[-1]).write_text("\n".join(blocks), encoding="utf-8")
    (tmp_path / "right.py").write_text(RIGHT, encoding="utf-8")
    assert checked(tmp_path, *files, "right.py") == []


def test_data_sets_are_those_of_pytorch(checked, tmp_path):
    pytest.importorskip("torch")
    (tmp_path / "loaded.py").write_text(LOADED, encoding="utf-8")
    assert checked(tmp_path, "loaded.py") == []


def test_wrong_calls_are_found(checked, tmp_path):
    (tmp_path / "wrong.py").write_text(WRONG, encoding="utf-8")
    found = [re.match(r"wrong\.py:(\d+): error:.*\[([a-z-]+)\]$", line) for line in checked(tmp_path, "wrong.py")]
    errors = [(int(match[1]), match[2]) for match in found if match]
    assert errors == [(4, "call-arg"), (5, "arg-type"), (6, "call-arg"), (7, "arg-type")]
