# SPDX-License-Identifier: Apache-2.0
"""Jobs of a catalogue: a bad one fails alone, whatever it does, and every other one is done."""

import functools
import multiprocessing
import signal
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager

import pytest

from limit_surface_ros.errors import ClusterError, RangeError
from limit_surface_ros.fitting.catalogue import outcomes
from limit_surface_ros.fitting.workers import available_cores, worker_processes

# An error that does not survive the way between processes.
MISSING = "from limit_surface_ros.errors import *; raise MissingExtraError(\\'sage\\', \\'none\\')"


def found(jobs):
    """Evaluate Python expressions in two processes, four at a time."""
    done = list(outcomes(jobs, eval, functools.partial(worker_processes, 2), in_flight=4))
    assert sorted(each.job for each in done) == sorted(jobs), "each job ends exactly once"
    return {each.job: each for each in done}


def test_a_job_that_raises_fails_alone_with_its_message():
    checks = "__import__('limit_surface_ros.checks').checks"
    refused, absent = f"{checks}.as_positive('length', -1)", f"exec('{MISSING}')"
    done = found(["6*7", "1/0", refused, absent, "2+2", "3+3"])
    assert {job for job, each in done.items() if each.error} == {"1/0", refused, absent}
    assert done["1/0"].error == "ZeroDivisionError: division by zero"
    assert done[refused].error.startswith("length must be a finite number above 0")
    assert done[absent].error.startswith("sage is needed here and is not installed")
    assert (done["6*7"].value, done["3+3"].value) == (42, 6)


def test_a_job_that_kills_its_process_fails_alone():
    killed = f"__import__('os').kill(__import__('os').getpid(), {signal.SIGKILL:d})"
    deadly = {killed, "__import__('os')._exit(3)"}
    harmless = {f"{i}+{i}" for i in range(7)}
    done = found([*sorted(harmless)[:3], *sorted(deadly), *sorted(harmless)[3:]])
    assert {job for job, each in done.items() if each.error} == deadly
    assert all("its worker process died" in done[job].error for job in deadly)
    assert {done[job].value for job in harmless} == set(range(0, 14, 2))


def test_few_jobs_are_handed_over_at_a_time():
    drawn = []

    def jobs():
        for number in range(50):
            drawn.append(number)
            yield number

    pool = functools.partial(ThreadPoolExecutor, 2)
    for count, _ in enumerate(outcomes(jobs(), abs, pool, in_flight=3), start=1):
        assert len(drawn) <= count + 3
    assert len(drawn) == 50


def test_jobs_that_a_cluster_drops_are_an_error_and_not_a_loss():
    @contextmanager
    def dropping():
        class Dropping(ThreadPoolExecutor):
            def submit(self, *_):
                future = Future()
                future.cancel()
                future.set_running_or_notify_cancel()
                return future

        yield Dropping(1)

    with pytest.raises(ClusterError, match="dropped its jobs"):
        list(outcomes(range(3), abs, dropping, in_flight=2))


def test_fewer_than_one_worker_is_refused():
    with pytest.raises(RangeError, match="workers must be at least 1, got 0"):
        list(outcomes(range(3), abs, functools.partial(worker_processes, 0), 2))


def test_an_absurd_number_of_workers_does_not_fill_the_machine():
    with worker_processes(100_000) as executor:
        assert executor.submit(abs, -3).result() == 3
        assert len(multiprocessing.active_children()) <= 4 * available_cores()
