# SPDX-License-Identifier: Apache-2.0
"""Pools of processes that an interrupt ends at once and that never outlive their parent."""

from __future__ import annotations

import multiprocessing
import os
import select
import signal
import threading
import time
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager, suppress
from multiprocessing.context import ForkContext, ForkProcess, SpawnContext, SpawnProcess
from pathlib import Path
from typing import TYPE_CHECKING

from limit_surface_ros.errors import RangeError

if TYPE_CHECKING:
    from collections.abc import Iterator
    from concurrent.futures import Executor

# Processes for each core from which on more of them only cost memory, and time to begin.
_MOST_PER_CORE = 4
# Time in which the pool's thread, on the busiest machine, drops what waits [s].
_PATIENCE = 60.0
# What a terminal sends to all processes of a program: at Ctrl-C, and when it is closed.
_OF_TERMINALS = (signal.SIGINT, signal.SIGHUP)
# Of a pipe's content that is taken out at once [bytes], and time between looks at its user [ms].
_PIECE = 2**16
_LOOK = 50
# One entry for each thread of this process, those that Python does not know of included.
_THREADS = Path("/proc/self/task")


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
    others = set(multiprocessing.active_children())
    size = min(workers, _MOST_PER_CORE * available_cores())
    context = _Fork() if _may_fork() else _Spawn()
    # The first pool starts a process that keeps count of semaphores: it has this thread's mask.
    with _interrupts_blocked():
        pool = ProcessPoolExecutor(size, mp_context=context, initializer=_begin)
    try:
        yield pool
    except BaseException:
        # A pool that was told to shut down no longer knows either.
        drain = _Drain(pool)
        _forget_what_waits(pool)
        for process in set(multiprocessing.active_children()) - others:
            # One that was stopped would keep any other signal for later.
            process.kill()
        drain.run_until_pool_has_ended()
        raise
    finally:
        pool.shutdown(cancel_futures=True)


def _may_fork() -> bool:
    """Tell whether forking is safe, as it is instant: no other thread may hold a lock meanwhile.

    A process with a node has a dozen threads of its middleware, of which `threading` knows none.
    """
    try:
        threads = sum(1 for _ in _THREADS.iterdir())
    except OSError:
        return False
    return threads == 1 and "fork" in multiprocessing.get_all_start_methods()


@contextmanager
def _interrupts_blocked() -> Iterator[None]:
    """Block what terminals send in this thread, and so in what is started here until `_begin`."""
    before = signal.pthread_sigmask(signal.SIG_BLOCK, _OF_TERMINALS)
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


class _ForkedWorker(ForkProcess):
    """A worker that no interrupt meets before it leaves interrupts to its parent."""

    def start(self) -> None:
        with _interrupts_blocked():
            super().start()


class _SpawnedWorker(SpawnProcess):
    """A worker that no interrupt meets before it leaves interrupts to its parent."""

    def start(self) -> None:
        with _interrupts_blocked():
            super().start()


class _Fork(ForkContext):
    Process = _ForkedWorker


class _Spawn(SpawnContext):
    Process = _SpawnedWorker


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


class _Drain:
    """Takes out of the pipe to a pool's workers what they will not take any more.

    A thread of the pool that hands out a task larger than the pipe would wait for a reader, and
    hold the program's end, for ever: newer versions of Python see to that themselves (gh-94777).
    Closing the pipe's end is not for us: that thread closes it, too, at any moment.
    """

    def __init__(self, pool: ProcessPoolExecutor) -> None:
        """Note the pool's thread and the pipe while the pool still knows them."""
        self._manager = getattr(pool, "_executor_manager_thread", None)
        reader = getattr(getattr(pool, "_call_queue", None), "_reader", None)
        self._end: int | None = None
        # A pool whose workers have died closes the pipe by itself.
        with suppress(OSError):
            if self._manager is not None and reader is not None:
                self._end = os.dup(reader.fileno())

    def run_until_pool_has_ended(self) -> None:
        """Drain in a thread, which goes on if another interrupt ends this wait."""
        if self._end is not None:
            thread = threading.Thread(target=self._run, daemon=True)
            thread.start()
            thread.join()

    def _run(self) -> None:
        assert self._manager is not None
        assert self._end is not None
        try:
            pipe = select.poll()
            pipe.register(self._end, select.POLLIN)
            while self._manager.is_alive():
                if pipe.poll(_LOOK) and not os.read(self._end, _PIECE):
                    self._manager.join()
        finally:
            os.close(self._end)


def _begin() -> None:
    # A terminal tells the whole group: what becomes of the workers is the parent's to say.
    for number in _OF_TERMINALS:
        signal.signal(number, signal.SIG_IGN)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, _OF_TERMINALS)
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)
