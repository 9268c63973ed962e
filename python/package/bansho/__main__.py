"""`python -m bansho` is the program `bansho`, whose binary lies among the scripts of the wheel."""

from __future__ import annotations

import os
import subprocess
import sys

from ._program import program


def main() -> int:
    """Runs the program with the arguments of Python."""
    try:
        command = [str(program()), *sys.argv[1:]]
    except FileNotFoundError as missing:
        sys.exit(str(missing))
    if os.name == "nt":
        return subprocess.call(command)
    os.execv(command[0], command)
    return 0


if __name__ == "__main__":
    sys.exit(main())
