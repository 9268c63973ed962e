"""Where the binary of the program is."""

from __future__ import annotations

import os
import shutil
import sysconfig
from pathlib import Path


def program() -> Path:
    """The binary of the program: beside Python's scripts, else on the path."""
    name = "bansho.exe" if os.name == "nt" else "bansho"
    schemes = {sysconfig.get_path("scripts"), sysconfig.get_path("scripts", f"{os.name}_user")}
    for folder in (path for path in schemes if path):
        if (binary := Path(folder) / name).is_file():
            return binary
    found = shutil.which("bansho")
    if found is None:
        raise FileNotFoundError("bansho: the program is not installed with this package; install a wheel that has it, or the program itself")
    return Path(found)
