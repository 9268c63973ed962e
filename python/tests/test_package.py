"""What the installed package has besides its modules."""

import subprocess
import sys
from importlib.metadata import PackageNotFoundError, distribution

import pytest


def test_the_program_runs_as_a_module_without_a_warning(program):
    done = subprocess.run([sys.executable, "-W", "error", "-m", "bansho", "--version"], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.startswith("bansho ")


def test_the_notices_have_the_crates_of_the_extension_and_of_the_program():
    try:
        files = distribution("bansho").files or []
    except PackageNotFoundError:
        pytest.skip("the package is not installed")
    (notices,) = (file for file in files if file.name == "THIRD-PARTY-NOTICES.txt")
    text = notices.read_text(encoding="utf-8")
    # pyo3 is in the extension alone, clap and the fonts are in the program alone.
    for crate in ("pyo3", "numpy", "clap", "tiny-skia", "epaint_default_fonts", "rayon"):
        assert f"\n{crate} " in text, crate
    assert "SIL OPEN FONT LICENSE" in text
    parts = text.split("=" * 80)[1:]
    assert len(parts) > 120
    without = [part.split(":")[0].strip() for part in parts if "\n--- " not in part]
    assert not without, f"without a license text: {without}"
