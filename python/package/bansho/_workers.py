"""Worker processes: how many threads draw in one, and which one this is."""

from __future__ import annotations

import multiprocessing
import sys


def in_worker() -> bool:
    """Whether this is a worker process, in which one thread draws: there is a process for each core already."""
    return multiprocessing.parent_process() is not None


def default_threads() -> int | None:
    """The number of threads where none is given: 1 in a worker process, else `None` for one for each core."""
    return 1 if in_worker() else None


def seed_words() -> tuple[int, ...]:
    """What tells the random numbers of this worker process from those of others; nothing in the main process.

    In a worker of PyTorch's `DataLoader` it is the seed that PyTorch gives the worker. It follows from `torch.manual_seed`, and is another one in each
    epoch. In another process of `multiprocessing` it is the name of the process, which has a number by default, such as `SpawnProcess-2`.
    """
    if not in_worker():
        return ()
    # Only a process that has loaded PyTorch is a worker of its.
    data = sys.modules.get("torch.utils.data")
    worker = None if data is None else data.get_worker_info()
    if worker is not None:
        return (int(worker.seed),)
    return (int.from_bytes(multiprocessing.current_process().name.encode(), "little"),)
