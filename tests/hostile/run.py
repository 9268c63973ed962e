#!/usr/bin/env python3
"""Runs the hostile corpus against a program: exit codes, one located error each, no panic, no signal, nothing left behind.

    run.py PROGRAM [--only REGULAR EXPRESSION] [--jobs 2] [--stop-only | --no-stop] [--report FILE]

Each case runs with 2 GiB of memory for at most 10 s. Cases that wait, take long or are the first of their kind run a second time, to be
stopped by SIGTERM at a random moment: they must end within a second and leave nothing half-written.
"""

import argparse
import functools
import multiprocessing
import os
import random
import re
import shlex
import shutil
import subprocess
import sys
import tempfile
import time
from collections import defaultdict
from dataclasses import dataclass, field

import checks
import limits
from corpus.case import Case, make
from make import all_cases

# From here on a case is stopped too, since a user would not want to wait.
SLOW_SECONDS = 1.0


@dataclass(frozen=True)
class Result:
    """What came of a case."""

    faults: list[str] = field(default_factory=list)
    seconds: float = 0.0
    resident_bytes: int = 0
    stopping_seconds: float | None = None


def _made(case: Case, program: str, folder: str) -> None:
    """Makes the files of a case, in a process of its own where they are large: memory once taken counts for all that it begins."""
    if case.large and (child := os.fork()) != 0:
        _, status = os.waitpid(child, 0)
        if status != 0:
            raise RuntimeError(f"the files of {case.title!r} cannot be made")
        return
    status = 1
    try:
        make(case.files, folder)
        status = 0
    finally:
        if case.large:
            os._exit(status)
    for line in case.setup:
        done = subprocess.run([program, *line], cwd=folder, capture_output=True)
        if done.returncode != 0:
            raise RuntimeError(f"what comes before {case.title!r} fails: {done.stderr.decode()}")
    for name in case.damage:
        path = os.path.join(folder, name)
        if os.path.lexists(path):
            os.remove(path)
    make(case.damage, folder)


def carry_out(case: Case, program: str, within: str, stop_after: float | None) -> Result:
    """Runs a case in a folder of its own, which is removed afterward."""
    outer = tempfile.mkdtemp(dir=within)
    folder = os.path.join(outer, "case")
    os.mkdir(folder)
    try:
        _made(case, program, folder)
        before = checks.state(folder)
        ending = limits.run([program, *case.command], folder, case.environment, case.stdin, case.stdout, stop_after)
        after = checks.state(folder)
        check = checks.faults if stop_after is None else checks.faults_of_stopping
        return Result(check(case, ending, before, after, folder), ending.seconds, ending.resident_bytes, ending.stopping_seconds)
    except Exception as error:
        return Result([f"cannot be run: {error!r}"])
    finally:
        shutil.rmtree(outer, ignore_errors=True)


# The cases, which processes that are forked know too: functions among their files cannot be sent to them.
CASES: list[Case] = []


def _indexed(program: str, within: str, task: tuple[int, float | None]) -> tuple[int, Result]:
    index, stop_after = task
    return index, carry_out(CASES[index], program, within, stop_after)


def _to_stop(cases: list[Case], results: dict[int, Result]) -> list[int]:
    """Cases that are stopped: those that say so, those that take long, and the first of each kind."""
    kinds: set[str] = set()
    chosen = []
    for index, case in enumerate(cases):
        slow = index in results and results[index].seconds > SLOW_SECONDS
        if case.signaled or slow or case.kind not in kinds:
            chosen.append(index)
        kinds.add(case.kind)
    return chosen


def _run_all(cases: list[Case], asked: argparse.Namespace, within: str) -> tuple[dict[int, Result], dict[int, Result]]:
    CASES[:] = cases
    work = functools.partial(_indexed, asked.program, within)
    chance = random.Random(asked.seed)
    with multiprocessing.get_context("fork").Pool(asked.jobs) as pool:
        plain = [] if asked.stop_only else [(index, None) for index, case in enumerate(cases) if not case.endless]
        # The longest begin first, as far as that is known, so that none goes on alone at the end.
        plain.sort(key=lambda task: not cases[task[0]].signaled)
        results = dict(pool.imap_unordered(work, plain))
        chosen = [] if asked.no_stop else _to_stop(cases, results)
        stopped = dict(pool.imap_unordered(work, [(index, chance.uniform(0.05, 0.5)) for index in chosen]))
    return results, stopped


def _told(cases: list[Case], results: dict[int, Result], which: str, repeat: str) -> list[str]:
    lines = []
    for index in sorted(results):
        case = cases[index]
        if results[index].faults:
            needs = f" [needs {', '.join(case.needs)}]" if case.needs else ""
            only = shlex.quote(f"^{re.escape(case.title)}$")
            lines.append(f"FAIL {case.title}{which}{needs}: {'; '.join(results[index].faults)}\n     {repeat} --only {only}")
    return lines


def _table(cases: list[Case], results: dict[int, Result], stopped: dict[int, Result]) -> list[str]:
    by_kind: dict[str, list[int]] = defaultdict(list)
    for index, case in enumerate(cases):
        by_kind[case.kind].append(index)
    lines = [f"{'kind':18} {'cases':>5} {'stopped':>7} {'failed':>6} {'slowest':>8} {'memory':>9} {'to stop':>8}"]
    for kind, indices in by_kind.items():
        of, ends = [results[i] for i in indices if i in results], [stopped[i] for i in indices if i in stopped]
        failed = sum(bool(result.faults) for result in of + ends)
        slowest = max((result.seconds for result in of), default=0.0)
        memory = max((result.resident_bytes for result in of + ends), default=0) / (1 << 20)
        to_stop = max((result.stopping_seconds or 0.0 for result in ends), default=0.0)
        lines.append(f"{kind:18} {len(indices):5} {len(ends):7} {failed:6} {slowest:6.2f} s {memory:5.0f} MiB {to_stop:6.2f} s")
    for what, of, key, unit in (
        ("slowest", results, lambda result: result.seconds, "s"),
        ("largest", {**stopped, **results}, lambda result: result.resident_bytes / (1 << 20), "MiB"),
        ("slowest to stop", stopped, lambda result: result.stopping_seconds or 0.0, "s"),
    ):
        lines.append(f"\n{what}:")
        lines += [f"  {key(of[index]):8.2f} {unit} {cases[index].title}" for index in sorted(of, key=lambda index: -key(of[index]))[:8]]
    return lines


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("program", type=os.path.abspath)
    parser.add_argument("--only", default="", metavar="REGULAR EXPRESSION", help="only cases whose title it finds")
    parser.add_argument("--jobs", type=int, default=2, help="cases at a time")
    parser.add_argument("--seed", type=int, default=int(time.time()), help="when to send signals; by the clock unless given")
    parser.add_argument("--stop-only", action="store_true", help="only runs that are stopped")
    parser.add_argument("--no-stop", action="store_true", help="no runs that are stopped")
    parser.add_argument("--report", help="a file for what is printed")
    asked = parser.parse_args()
    started = time.monotonic()
    # The program sees two processors, so that what threads take is the same everywhere.
    os.sched_setaffinity(0, sorted(os.sched_getaffinity(0))[:2])
    cases = [case for case in all_cases(asked.program) if re.search(asked.only, case.title)]
    with tempfile.TemporaryDirectory(prefix="hostile-") as within:
        results, stopped = _run_all(cases, asked, within)
    repeat = f"{sys.argv[0]} {asked.program}"
    failures = _told(cases, results, "", repeat + " --no-stop") + _told(cases, stopped, " (stopped)", f"{repeat} --seed {asked.seed} --stop-only")
    lines = [*failures, *([""] if failures else []), *_table(cases, results, stopped), ""]
    lines.append(f"{len(cases)} cases, {len(stopped)} of them stopped too (seed {asked.seed}), {len(failures)} failures, {time.monotonic() - started:.0f} s")
    print("\n".join(lines))
    if asked.report:
        with open(asked.report, "w", encoding="utf-8") as report:
            report.write("\n".join(lines) + "\n")
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
