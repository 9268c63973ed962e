"""Builds the wheel: maturin, with the program `bansho` among its scripts, plates of the example scenes, and the notices of all crates.

| variable | what it sets |
| --- | --- |
| `BANSHO_PROGRAM` | a program that is built already, in place of building one |
| `BANSHO_PROFILE` | the profile of cargo, `release` by default |
"""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
from pathlib import Path

import maturin
from bansho_notices import write_notices
from maturin import (
    get_requires_for_build_editable,
    get_requires_for_build_sdist,
    get_requires_for_build_wheel,
)

ROOT = Path(__file__).resolve().parents[1]
# Folders of a wheel: what maturin installs among the scripts, and under the prefix of the environment.
SCRIPTS = ROOT / "program" / "scripts"
SCENES = ROOT / "program" / "data" / "share" / "bansho" / "scenes"


def _add_program() -> None:
    """Puts the program where maturin takes scripts from."""
    profile = os.environ.get("BANSHO_PROFILE", "release")
    name = "bansho.exe" if os.name == "nt" else "bansho"
    given = os.environ.get("BANSHO_PROGRAM")
    if given is None:
        workspace = ROOT.parent
        command = ["cargo", "build", "--locked", "--profile", profile, "--package", "bansho-cli", "--message-format", "json"]
        built = subprocess.run(command, cwd=workspace, check=True, stdout=subprocess.PIPE, text=True)
        messages = (json.loads(line) for line in built.stdout.splitlines())
        given = next(message["executable"] for message in messages if message.get("executable"))
    SCRIPTS.mkdir(parents=True, exist_ok=True)
    shutil.copy2(given, SCRIPTS / name)


def _add_plates() -> None:
    """Puts plates where the program looks for them: with those of auroras, or of the street, a wheel would be larger than 20 MB."""
    shutil.rmtree(SCENES, ignore_errors=True)
    scenes = ROOT.parent / "scenes"
    for scene in sorted([*scenes.glob("*.toml"), *scenes.glob("papers/*/*.toml")]):
        text = scene.read_text(encoding="utf-8")
        if "[[aurora]]" in text or "plates/street" in text:
            continue
        for name in re.findall(r'^(?:image|depth|albedo|normal) = "(plates/[^"]+)"', text, re.MULTILINE):
            copy = SCENES / scene.parent.relative_to(scenes) / name
            copy.parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(scene.parent / name, copy)


def _prepare() -> None:
    _add_program()
    _add_plates()
    write_notices()
    profile = os.environ.get("BANSHO_PROFILE")
    if profile:
        os.environ["MATURIN_PEP517_ARGS"] = f"{os.environ.get('MATURIN_PEP517_ARGS', '')} --profile={profile}".strip()


def prepare_metadata_for_build_wheel(metadata_directory, config_settings=None):
    write_notices()
    SCRIPTS.mkdir(parents=True, exist_ok=True)
    return maturin.prepare_metadata_for_build_wheel(metadata_directory, config_settings)


def build_wheel(wheel_directory, config_settings=None, metadata_directory=None):
    _prepare()
    return maturin.build_wheel(wheel_directory, config_settings, metadata_directory)


def build_editable(wheel_directory, config_settings=None, metadata_directory=None):
    _prepare()
    return maturin.build_editable(wheel_directory, config_settings, metadata_directory)


def build_sdist(sdist_directory, config_settings=None):
    # The crates beside this folder are not part of it, so that a source distribution could not be built.
    raise RuntimeError("there is no source distribution: install from a checkout of the repository, or a wheel")
