# SPDX-License-Identifier: Apache-2.0
"""Pools of processes that an interrupt ends at once and that never outlive their parent."""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
import time
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from typing import TYPE_CHECKING

from limit_surface_ros.errors import RangeError

if TYPE_CHECKING:
    from collections.abc import Iterator
    from concurrent.futures import Executor
    from multiprocessing.connection import Connection

# Processes for each core from which on more of them only cost memory, and time to begin.
_MOST_PER_CORE = 4
# Time that the pool's thread gets to drop what waits [s].
_PATIENCE = 1.0


def available_cores() -> int:
    """Return the number of cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


@contextmanager
def worker_processes(workers: int) -> Iterator[Executor]:
    """Give an executor of `workers` processes, but of no more than four for each core.

    On an error or an interrupt the processes are ended, whatever they are doing, and print
    nothing.

    Raises:
        RangeError: `workers` is below 1.
    """
    if workers < 1:
        raise RangeError(f"workers must be at least 1, got {workers}")
    # Forking is instant and safe while there are no threads; otherwise workers start afresh.
    alone = threading.active_count() == 1 and "fork" in multiprocessing.get_all_start_methods()
    context = multiprocessing.get_context("fork" if alone else "spawn")
    others = set(multiprocessing.active_children())
    size = min(workers, _MOST_PER_CORE * available_cores())
    pool = ProcessPoolExecutor(size, mp_context=context, initializer=_begin)
    try:
        yield pool
    except BaseException:
        # After shutdown the pool no longer knows this pipe.
        reader = _end_of_tasks(pool)
        _forget_what_waits(pool)
        for process in set(multiprocessing.active_children()) - others:
            process.terminate()
        if reader is not None:
            reader.close()
        raise
    finally:
        pool.shutdown(cancel_futures=True)


def _forget_what_waits(pool: ProcessPoolExecutor) -> None:
    """Have the pool's thread drop the tasks that wait.

    When workers end it would tell each waiting task so, and print a traceback about one that was
    cancelled already.
    """
    try:
        last = pool.submit(int)
    except RuntimeError:
        # The pool is broken or at its end: nothing waits.
        return
    pool.shutdown(wait=False, cancel_futures=True)
    end = time.monotonic() + _PATIENCE
    while not (last.running() or last.done()) and time.monotonic() < end:
        time.sleep(0.001)


def _end_of_tasks(pool: ProcessPoolExecutor) -> Connection | None:
    """Return this process's copy of the end at which workers take their tasks, if there is one.

    Once they are gone it must be closed: a thread that hands out a task larger than a pipe would
    wait for a reader, and hold the program's end, for ever. Python itself does so from 3.11.5 on
    (gh-94777).
    """
    return getattr(getattr(pool, "_call_queue", None), "_reader", None)


def _begin() -> None:
    # A terminal interrupts the whole group: what becomes of the workers is the parent's to say.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)
