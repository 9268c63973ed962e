#!/usr/bin/env python3
"""Makes the hostile corpus in a folder, one folder a case, to look at or to try by hand.

    make.py PROGRAM FOLDER [REGULAR EXPRESSION]

Cases are those whose title the expression finds. `run.py` makes the same files by itself, and removes them after each case.
"""

import argparse
import json
import os
import re
import shlex
import subprocess

import corpus
from corpus.case import Case, make


def all_cases(program: str) -> list[Case]:
    """Every case, those from the program's own schema among them."""
    schema = subprocess.run([program, "schema"], check=True, capture_output=True).stdout
    return corpus.cases(json.loads(schema))


def folder_name(case: Case) -> str:
    """A name of a folder for a case, with nothing in it that a shell would read."""
    return re.sub(r"[^a-zA-Z0-9]+", "-", case.title).strip("-")[:100]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("program", type=os.path.abspath)
    parser.add_argument("folder")
    parser.add_argument("which", nargs="?", default="")
    asked = parser.parse_args()
    for case in all_cases(asked.program):
        if re.search(asked.which, case.title):
            folder = os.path.join(asked.folder, folder_name(case))
            os.makedirs(folder)
            make(case.files, folder)
            setup = [shlex.join([asked.program, *line]) for line in case.setup]
            print(f"{case.title}: (cd {shlex.quote(folder)} && {' && '.join([*setup, shlex.join([asked.program, *case.command])])[:300]})")


if __name__ == "__main__":
    main()
