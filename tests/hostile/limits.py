"""Runs a program under limits and says how it ended."""

import os
import select
import signal
import subprocess
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from corpus.case import CLOSED, OPEN_PIPE

MEMORY_BYTES = 2 << 30
SECONDS = 10.0
# After so many seconds a program that was asked to stop is ended.
STOP_SECONDS = 5.0


@dataclass(frozen=True)
class Ending:
    """How a run ended."""

    # As a shell would say it: 128 and the signal for a program that a signal ended.
    code: int
    seconds: float
    # The largest resident size; no less than that of the process that began it.
    resident_bytes: int
    stdout: bytes
    stderr: bytes
    timed_out: bool = False
    # How long it took from the signal on; none where it had ended before.
    stopping_seconds: float | None = None
    # Whether a process that it began goes on.
    orphans: bool = False


def run(
    line: Sequence[str],
    folder: str,
    environment: Mapping[str, str | None],
    stdin: str = "",
    stdout: str = "",
    stop_after: float | None = None,
) -> Ending:
    """Runs `line` in `folder` with 2 GiB of address space, and for 10 s at most; sends SIGTERM after `stop_after` seconds."""
    script = f"ulimit -v {MEMORY_BYTES >> 10}; ulimit -c 0;"
    script += " exec <&-;" * (stdin == CLOSED) + " exec >&-;" * (stdout == CLOSED) + ' exec "$0" "$@"'
    variables = {name: value for name, value in {**os.environ, **environment}.items() if value is not None}
    with open(os.path.join(folder, "..", "stdout"), "w+b") as out, open(os.path.join(folder, "..", "stderr"), "w+b") as errors:
        reading, writing = os.pipe() if stdin == OPEN_PIPE else (-1, -1)
        source = _source(stdin, folder, reading)
        target = open(stdout, "wb") if stdout not in ("", CLOSED) else out
        started = time.monotonic()
        process = subprocess.Popen(
            ["/bin/sh", "-c", script, *line], cwd=folder, env=variables, stdin=source, stdout=target, stderr=errors, start_new_session=True
        )
        try:
            ending = _wait(process, started, stop_after)
        finally:
            for descriptor in {source, reading, writing} - {subprocess.DEVNULL, -1}:
                os.close(descriptor)
            if target is not out:
                target.close()
        out.seek(0)
        errors.seek(0)
        return Ending(stdout=out.read(1 << 20), stderr=errors.read(32 << 20), **ending)


def _source(stdin: str, folder: str, reading: int) -> int:
    if stdin == OPEN_PIPE:
        return reading
    if stdin in ("", CLOSED):
        return subprocess.DEVNULL
    return os.open(os.path.join(folder, stdin), os.O_RDONLY)


def _wait(process: subprocess.Popen, started: float, stop_after: float | None) -> dict:
    """Waits for the end, within the limits."""
    descriptor = os.pidfd_open(process.pid)
    poll = select.poll()
    poll.register(descriptor, select.POLLIN)
    signaled, timed_out = None, False
    if stop_after is not None and not poll.poll(1000 * stop_after):
        signaled = time.monotonic()
        process.send_signal(signal.SIGTERM)
    limit = SECONDS if signaled is None else STOP_SECONDS
    if not poll.poll(1000 * limit):
        timed_out = True
        process.kill()
    _, status, usage = os.wait4(process.pid, 0)
    ended = time.monotonic()
    os.close(descriptor)
    process.returncode = os.waitstatus_to_exitcode(status)
    code = process.returncode if process.returncode >= 0 else 128 - process.returncode
    return {
        "code": code,
        "seconds": ended - started,
        "resident_bytes": usage.ru_maxrss << 10,
        "timed_out": timed_out,
        "stopping_seconds": None if signaled is None else ended - signaled,
        "orphans": _end_group(process.pid),
    }


def _end_group(group: int) -> bool:
    """Ends what a program left running; whether there was something."""
    try:
        os.killpg(group, signal.SIGKILL)
    except ProcessLookupError:
        return False
    return True
