"""What must hold of every run of a hostile case."""

import fnmatch
import hashlib
import json
import os
import re
import stat

from corpus.case import Case
from limits import MEMORY_BYTES, SECONDS, Ending

STOPPED = 143
STOP_SECONDS = 1.0
# Faults that are spelled out; the others are only counted.
SHOWN = 100
# Most that a terminal is filled with, whatever the fault.
STDERR_BYTES = 400_000
CONTROL = re.compile(rb"[\x00-\x08\x0b-\x1f\x7f]|\xc2[\x80-\x9f]")

State = dict[str, str]


def state(folder: str) -> State:
    """What lies in a folder: of ordinary files a digest, of others their kind."""
    found: State = {}
    for place, folders, files in os.walk(folder):
        for name in files + [one for one in folders if os.path.islink(os.path.join(place, one))]:
            path = os.path.join(place, name)
            found[os.path.relpath(path, folder)] = _digest(path)
    return found


def _digest(path: str) -> str:
    about = os.lstat(path)
    if stat.S_ISLNK(about.st_mode):
        return f"link to {os.readlink(path)}"
    if not stat.S_ISREG(about.st_mode):
        return stat.filemode(about.st_mode)[0]
    if about.st_blocks * 512 < about.st_size // 2:
        # A sparse file of gigabytes: its end and its time say as much.
        return f"{about.st_size} bytes, {about.st_mtime_ns}"
    with open(path, "rb") as file:
        return hashlib.file_digest(file, "blake2b").hexdigest() if hasattr(hashlib, "file_digest") else hashlib.blake2b(file.read()).hexdigest()


def faults(case: Case, ending: Ending, before: State, after: State, folder: str) -> list[str]:
    """What is wrong with a run that was left alone."""
    found = _common(ending)
    if ending.timed_out:
        found.append(f"does not end within {SECONDS:.0f} s")
    elif ending.code not in case.codes:
        found.append(f"exit code {ending.code}, not {' or '.join(map(str, case.codes))}: {_first_line(ending)}")
    else:
        found += _told(case, ending)
    return found + _files(case, before, after, folder, ending.code != 0, case.leaves)


def faults_of_stopping(case: Case, ending: Ending, before: State, after: State, folder: str) -> list[str]:
    """What is wrong with a run that was asked to stop."""
    found = _common(ending)
    if ending.stopping_seconds is None:
        if ending.code not in case.codes and not ending.timed_out:
            found.append(f"ends by itself with exit code {ending.code}: {_first_line(ending)}")
    elif ending.timed_out or ending.stopping_seconds > STOP_SECONDS:
        found.append("SIGTERM is ignored" if ending.timed_out else f"stops only {ending.stopping_seconds:.2f} s after SIGTERM")
    elif ending.code not in {STOPPED, *case.codes}:
        found.append(f"exit code {ending.code} after SIGTERM, not {STOPPED}: {_first_line(ending)}")
    return found + _files(case, before, after, folder, True, [*case.leaves, *case.changes, "out/*", "states/*", "a.*", "s/*", "p/*", "b/*"])


def _common(ending: Ending) -> list[str]:
    found = []
    if b"panicked" in ending.stderr:
        found.append("panics")
    if ending.code in (134, 137, 139) and not ending.timed_out:
        found.append(f"is ended by signal {ending.code - 128}")
    if ending.resident_bytes > MEMORY_BYTES:
        found.append(f"takes {ending.resident_bytes / (1 << 30):.1f} GiB")
    if len(ending.stderr) > STDERR_BYTES:
        found.append(f"writes {len(ending.stderr)} bytes to stderr")
    control = CONTROL.search(ending.stderr)
    if control:
        found.append(f"writes the control character {control.group()!r} to stderr")
    if ending.orphans:
        found.append("leaves a process behind")
    return found


def _told(case: Case, ending: Ending) -> list[str]:
    """Whether the errors are those that there must be."""
    stderr = ending.stderr.decode("utf-8", "replace")
    lines = [line for line in stderr.split("\n") if line.startswith("error: ")]
    if ending.code == 0:
        return ["errors with exit code 0"] if lines else []
    found, count = [], len(lines)
    if case.errors < 0:
        if count < 1:
            found.append("no error")
    elif case.errors <= SHOWN:
        if count != case.errors:
            found.append(f"{count} errors, not {case.errors}")
    elif not SHOWN <= count <= SHOWN + 1 or not re.search(rf"\b{case.errors - SHOWN} more\b", stderr):
        found.append(f"{count} errors, not {SHOWN} and that there are {case.errors - SHOWN} more")
    if case.says:
        # The line that counts the others has no place.
        placed = [line for line in lines if case.errors <= SHOWN or not re.search(r"\d more\b", line)]
        found += [f"says {line[:200]!r}, not {case.says!r}" for line in placed if not re.search(case.says, line)][:2]
    return found + [f"does not say {place!r}" for place in case.places if not re.search(place, stderr)][:2]


def _first_line(ending: Ending) -> str:
    return ending.stderr.decode("utf-8", "replace").strip().split("\n")[0][:200] or "nothing said"


def _matches(name: str, patterns) -> bool:
    return any(fnmatch.fnmatch(name, pattern) for pattern in patterns)


def _files(case: Case, before: State, after: State, folder: str, failed: bool, leaves) -> list[str]:
    """Whether no source has changed, and nothing stays that should not."""
    found = []
    for name, digest in before.items():
        if after.get(name) != digest and not _matches(name, case.changes):
            found.append(f"{name!r} is {'changed' if name in after else 'removed'}")
    for name in after.keys() - before.keys():
        if name.endswith(".part"):
            found.append(f"leaves {name!r}")
        elif failed and not _matches(name, leaves):
            found.append(f"leaves {name!r}")
        elif not is_whole(os.path.join(folder, name)):
            found.append(f"leaves {name!r} half-written")
    return found


def is_whole(path: str) -> bool:
    """Whether a file that the program wrote is there to its end."""
    if not os.path.isfile(path) or os.path.islink(path):
        return True
    with open(path, "rb") as file:
        contents = file.read()
    extension = path.rsplit(".", 1)[-1]
    if extension in ("png", "apng"):
        return contents.endswith(b"IEND\xaeB`\x82")
    if extension == "gif":
        return contents.endswith(b";")
    if extension == "json":
        try:
            json.loads(contents)
        except ValueError:
            return False
        return True
    if extension == "ply":
        head, _, body = contents.partition(b"end_header\n")
        count = re.search(rb"element vertex (\d+)", head)
        return count is not None and len(body) == 4 * int(count[1]) * head.count(b"\nproperty float ")
    return bool(contents)
