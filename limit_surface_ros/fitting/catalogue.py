# SPDX-License-Identifier: Apache-2.0
"""Many independent jobs on any executor: each fails alone, and none is lost with a worker.

The executor is a `concurrent.futures.Executor`: processes of this machine or, by a Dask client's
`get_executor()`, a cluster. Only a bounded number of jobs is handed over at a time, so that a
catalogue of a million objects needs no more memory than one of a hundred.
"""

from __future__ import annotations

from collections import deque
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, CancelledError, Future, wait
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from limit_surface_ros.errors import ClusterError, LimitSurfaceError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator
    from concurrent.futures import Executor
    from contextlib import AbstractContextManager

Job = TypeVar("Job")


@dataclass(frozen=True)
class Outcome(Generic[Job]):
    """What became of a job.

    Attributes:
        job: The job.
        value: What the work returned; None if it failed.
        error: Why it failed, in one line; empty if it did not.
    """

    job: Job
    value: Any = None
    error: str = ""


def outcomes(
    jobs: Iterable[Job],
    work: Callable[[Job], Any],
    open_executor: Callable[[], AbstractContextManager[Executor]],
    in_flight: int,
) -> Iterator[Outcome[Job]]:
    """Do `work` on each job and yield what became of it, in the order in which jobs end.

    When a process of a local pool dies, the pool is lost with all that it was doing. Those jobs
    are then done again, one at a time in new pools, so that one that kills its process fails
    alone. (A Dask cluster does so by itself.)

    Args:
        jobs: Anything that can be pickled.
        work: A function of a module, or a `functools.partial` of one.
        open_executor: Makes an executor; called again when one has broken.
        in_flight: How many jobs are handed over at a time, at least one.

    Raises:
        ClusterError: The executor dropped its jobs: the connection to a cluster is lost.
    """
    waiting, suspects = iter(jobs), deque[Job]()
    while True:
        running: dict[Future[Outcome[Job]], Job] = {}
        alone = bool(suspects)
        source = iter([suspects.popleft()]) if alone else waiting
        with open_executor() as executor:
            try:
                yield from _done(executor, work, source, running, 1 if alone else in_flight)
            except BrokenExecutor:
                if alone:
                    (job,) = running.values()
                    yield Outcome(job, error="its worker process died, killed or out of memory")
                else:
                    suspects.extend(running.values())
            finally:
                for future in running:
                    future.cancel()
        if not alone and not suspects:
            return


def _done(
    executor: Executor,
    work: Callable[[Job], Any],
    source: Iterator[Job],
    running: dict[Future[Outcome[Job]], Job],
    in_flight: int,
) -> Iterator[Outcome[Job]]:
    """Yield outcomes; when the executor breaks, `running` holds the jobs that are undone."""
    while True:
        for job in source:
            running[_submitted(executor, work, job)] = job
            if len(running) >= in_flight:
                break
        if not running:
            return
        # Results that arrived before the executor broke are good; they come first.
        done = wait(running, return_when=FIRST_COMPLETED).done
        for future in sorted(done, key=_is_broken):
            outcome = _outcome(future, running[future])
            del running[future]
            yield outcome


def _submitted(executor: Executor, work: Callable[[Job], Any], job: Job) -> Future[Outcome[Job]]:
    """Hand a job over; an executor that is broken already answers like one that breaks later."""
    try:
        return executor.submit(attempt, work, job)
    except BrokenExecutor as error:
        broken: Future[Outcome[Job]] = Future()
        broken.set_exception(error)
        return broken


def _is_broken(future: Future[Any]) -> bool:
    return not future.cancelled() and isinstance(future.exception(), BrokenExecutor)


def _outcome(future: Future[Outcome[Job]], job: Job) -> Outcome[Job]:
    try:
        return future.result()
    except BrokenExecutor:
        raise
    except CancelledError:
        raise ClusterError("the cluster dropped its jobs: is its scheduler still there?") from None
    except Exception as error:
        # Whatever else a scheduler reports, such as a job that killed several workers.
        return Outcome(job, error=_line(error))


def attempt(work: Callable[[Job], Any], job: Job) -> Outcome[Job]:
    """Do `work` on one job where it was sent to.

    An error is returned as text: not every exception survives the way back between processes.
    """
    try:
        return Outcome(job, work(job))
    except LimitSurfaceError as error:
        return Outcome(job, error=str(error))
    except Exception as error:
        return Outcome(job, error=_line(error))


def _line(error: Exception) -> str:
    return " ".join(f"{type(error).__name__}: {error}".split())
