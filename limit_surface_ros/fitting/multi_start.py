"""Descents from several seeded starts: in parallel, in a fixed order, stopped when they agree.

Fits of limit surfaces have many local minima. Start number k draws from a generator of its own,
seeded by (seed, k), and starts are judged in their order; so the outcome is the same whatever the
number of workers.
"""

from __future__ import annotations

import math
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from limit_surface_ros.errors import RangeError, SolverError
from limit_surface_ros.fitting.bfgs import minimise
from limit_surface_ros.fitting.worker_processes import worker_processes

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from concurrent.futures import Executor

    from limit_surface_ros.checks import Floats
    from limit_surface_ros.fitting.objective import Objective

    Progress = Callable[[int, int], None]

# Relative difference of cost within which two starts have found the same minimum.
AGREEMENT = 1e-3
PRECISION = 1e-10
_MOST_ITERATIONS = 2000
# On a part of the pairs the minimum is only approached.
_COARSE_PRECISION = 1e-6


@dataclass(frozen=True)
class Search:
    """How a minimum is looked for, the same for every kind.

    Attributes:
        starts: How many random starts at most.
        seed: The same seed gives the same starts.
        executor: Where starts run; here and one by one if not given. `process_pool` makes one, a
            dask client's `get_executor()` is another.
        progress: Called with (starts done, starts at most) after each.
        stop_early: Whether half of them that agree on the best are enough.

    Raises:
        RangeError: There is no start, or the seed is negative.
    """

    starts: int = 16
    seed: int = 0
    executor: Executor | None = None
    progress: Progress | None = None
    stop_early: bool = True

    def __post_init__(self) -> None:
        """Check the counts."""
        if self.starts < 1:
            raise RangeError(f"starts must be at least 1, got {self.starts}")
        if self.seed < 0:
            raise RangeError(f"seed must not be negative, got {self.seed}")


@dataclass(frozen=True)
class Descent:
    """Where one start led.

    Attributes:
        cost: The cost there.
        parameters: Shape (size,).
        iterations: Steps taken, those on a part of the pairs included.
        evaluations: Times that cost and gradient were computed, likewise.
        gradient_norm: Largest component of the gradient there.
        converged: Whether the descent ended because nothing more was to be gained.
    """

    cost: float
    parameters: Floats
    iterations: int
    evaluations: int
    gradient_norm: float
    converged: bool


def descend(objective: Objective, start: Floats, precision: float = PRECISION) -> Descent:
    """Minimise by BFGS from `start`, first on a part of the pairs where there are very many.

    Args:
        objective: What to minimise.
        start: Shape (size,).
        precision: Relative gain of a step below which nothing more is to be gained.
    """
    coarse, inverse, iterations, evaluations = objective.coarse(), None, 0, 0
    if coarse is not None:
        near = minimise(coarse.cost_and_gradient, start, _COARSE_PRECISION, _MOST_ITERATIONS)
        start, inverse = near.parameters, near.inverse
        iterations, evaluations = near.iterations, near.evaluations
    found = minimise(objective.cost_and_gradient, start, precision, _MOST_ITERATIONS, inverse)
    return Descent(
        cost=found.cost,
        parameters=found.parameters,
        iterations=iterations + found.iterations,
        evaluations=evaluations + found.evaluations,
        gradient_norm=float(np.abs(found.gradient).max()),
        converged=found.converged,
    )


def descend_from_seed(
    objective: Objective, seed: int, index: int, precision: float = PRECISION
) -> Descent:
    """Minimise from start number `index` of `seed`."""
    return descend(objective, objective.start(np.random.default_rng([seed, index])), precision)


def descents(objective: Objective, search: Search) -> list[Descent]:
    """Minimise from several starts, in their order, until half of them agree on the best.

    Returns:
        One descent for each start that was needed, the best first, equals in their order.

    Raises:
        SolverError: No start led to a finite cost.
    """
    enough = max(2, math.ceil(search.starts / 2)) if search.stop_early else search.starts
    done: list[Descent] = []
    for descent in _in_order(objective, search):
        done.append(descent)
        if search.progress is not None:
            search.progress(len(done), search.starts)
        best = min(each.cost for each in done)
        agreeing = sum(each.cost <= best * (1.0 + AGREEMENT) for each in done)
        if agreeing >= enough:
            break
    if not any(math.isfinite(each.cost) for each in done):
        raise SolverError(f"none of {search.starts} starts led to a finite cost")
    return sorted(done, key=lambda each: each.cost)


@contextmanager
def process_pool(workers: int) -> Iterator[Executor | None]:
    """Give an executor of `workers` processes (see `worker_processes`), or None for one.

    With None, work runs here, one start after the other. Interrupted, the executor leaves no
    process behind and its processes print nothing.

    Raises:
        RangeError: `workers` is below 1.
    """
    if workers == 1:
        yield None
        return
    with worker_processes(workers) as pool:
        yield pool


def _in_order(objective: Objective, search: Search) -> Iterator[Descent]:
    starts, seed, executor = range(search.starts), search.seed, search.executor
    if executor is None:
        for index in starts:
            yield descend_from_seed(objective, seed, index)
        return
    futures = [executor.submit(descend_from_seed, objective, seed, index) for index in starts]
    try:
        for future in futures:
            yield future.result()
    finally:
        for future in futures:
            future.cancel()
