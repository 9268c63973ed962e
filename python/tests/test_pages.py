"""The pages of the book, and the notebook, do what they show."""

import importlib.util
import inspect
import re
import shutil
import subprocess
import sys
import sysconfig
import warnings
from pathlib import Path

import pytest

import bansho
from bansho import reference

GUIDE = Path(__file__).parents[2] / "docs" / "src" / "guide"
NOTEBOOK = GUIDE.parents[1] / "notebooks" / "weather.ipynb"
OPTIONAL = ("albumentations", "torch")
"""Libraries without which the blocks that import them are left out."""
PAGES = ("python.md", "python-datasets.md", "python-arrays.md")


@pytest.mark.parametrize("page", PAGES)
def test_the_code_of_a_page_runs(page, tmp_path, monkeypatch):
    (tmp_path / "scenes").symlink_to(GUIDE.parents[2] / "scenes", target_is_directory=True)
    monkeypatch.chdir(tmp_path)
    run_blocks(page, tmp_path)


def test_the_quick_start_needs_no_checkout(program, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    # As the page has it, with the plates of the package; without an installed package the program and the plates of the repository.
    if shutil.which("bansho", path=sysconfig.get_path("scripts")):
        monkeypatch.delenv("BANSHO_SCENES", raising=False)
        program = [sys.executable, "-m", "bansho"]
    else:
        monkeypatch.setenv("BANSHO_SCENES", str(GUIDE.parents[2] / "scenes"))
    commands = re.findall(r"^python -m bansho (new [^#\n]+)", (GUIDE / "python.md").read_text(encoding="utf-8"), re.MULTILINE)
    assert len(commands) == 2
    for command in commands:
        subprocess.run([*program, *command.split()], check=True, capture_output=True)
    run_blocks("python.md", tmp_path)


def run_blocks(page, tmp_path):
    """Runs the code of a page, one block after the other, in the working folder `tmp_path`."""
    blocks = re.findall(r"^```python\n(.*?)^```$", (GUIDE / page).read_text(encoding="utf-8"), re.MULTILINE | re.DOTALL)
    assert blocks
    namespace = {"__name__": "page"}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        for number, block in enumerate(blocks, start=1):
            imported = re.findall(r"^import (\w+)", block, re.MULTILINE)
            if any(importlib.util.find_spec(name) is None for name in imported if name in OPTIONAL):
                continue
            if "__main__" in block:
                # Worker processes import the script, so it is a file.
                script = tmp_path / f"block_{number}.py"
                script.write_text(block, encoding="utf-8")
                ran = subprocess.run([sys.executable, script], capture_output=True, text=True, timeout=120)
                assert ran.returncode == 0, f"{page}, block {number}: {ran.stderr}"
                continue
            exec(compile(block, f"{page}, block {number}", "exec"), namespace)


def test_the_reference_is_that_of_the_package():
    page = GUIDE / "python-reference.md"
    assert page.read_text(encoding="utf-8") == reference.page(), "run `python -m bansho.reference docs/src/guide/python-reference.md`"


def test_the_reference_has_all_that_is_public():
    page = reference.page()
    for name in bansho.__all__:
        if not inspect.ismodule(getattr(bansho, name)) and name not in ("__version__", "tables"):
            assert f"`bansho.{name}`" in page, name


def test_the_notebook_runs():
    nbclient = pytest.importorskip("nbclient")
    nbformat = pytest.importorskip("nbformat")
    notebook = nbformat.read(NOTEBOOK, as_version=4)
    cells = [cell for cell in notebook.cells if cell.cell_type == "code"]
    assert len(cells) >= 8 and not any(cell.outputs for cell in cells), "it is kept without its outputs"
    nbclient.NotebookClient(notebook, timeout=120, resources={"metadata": {"path": NOTEBOOK.parent}}).execute()
    pictures = [output for cell in cells for output in cell.outputs if "image/png" in output.get("data", {})]
    assert len(pictures) == 4
