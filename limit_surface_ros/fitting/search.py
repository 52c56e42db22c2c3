# SPDX-License-Identifier: Apache-2.0
"""Descents from several seeded starts: in parallel, in a fixed order, stopped when they agree.

Fits of limit surfaces have many local minima, and the deepest may attract one random start in
fifty. So only the first half of the starts are random. The others begin near the best so far, with
a term drawn anew or two exchanged: a few at a time, so that each time knows of the one before
(basin hopping; Wales and Doye 1997, doi:10.1021/jp970984n).

Start number k draws from a generator of its own, seeded by (seed, k), and starts are judged in
their order; so the outcome is the same whatever the number of workers.
"""

from __future__ import annotations

import math
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from limit_surface_ros.errors import RangeError, SolverError
from limit_surface_ros.fitting.bfgs import Minimum, minimise
from limit_surface_ros.fitting.workers import worker_processes

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
# Starts near the best that are made at a time.
_ROUND = 4
# On a part of the pairs the minimum is only approached.
_COARSE_PRECISION = 1e-6


@dataclass(frozen=True)
class Search:
    """How a minimum is looked for, the same for every kind.

    Attributes:
        starts: How many starts at most, half of them random.
        seed: The same seed gives the same starts.
        executor: Where starts run; here and one by one if not given. `process_pool` makes one, a
            dask client's `get_executor()` is another.
        progress: Called with (starts done, starts at most) after each.
        stop_early: Whether it is enough that all random ones found the same minimum and the first
            near it nothing better.

    Raises:
        RangeError: There is no start, or the seed is negative.
    """

    starts: int = 32
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
    """Minimise by BFGS from `start`, first on a part of the pairs where there are many.

    Args:
        objective: What to minimise.
        start: Shape (size,).
        precision: Relative gain of a step below which nothing more is to be gained.
    """
    found = _minimum(objective, start, precision)
    return Descent(
        # NaN compares with nothing: it would win or hide among other starts.
        cost=found.cost if math.isfinite(found.cost) else math.inf,
        parameters=found.parameters,
        iterations=found.iterations,
        evaluations=found.evaluations,
        gradient_norm=float(np.abs(found.gradient).max()),
        converged=found.converged,
    )


def _minimum(objective: Objective, start: Floats, precision: float) -> Minimum:
    """Minimise; the part of the pairs has a part of its own where they are very many."""
    coarse = objective.coarse()
    if coarse is None:
        return minimise(objective.cost_and_gradient, start, precision, _MOST_ITERATIONS)
    near = _minimum(coarse, start, _COARSE_PRECISION)
    found = minimise(
        objective.cost_and_gradient, near.parameters, precision, _MOST_ITERATIONS, near.inverse
    )
    return replace(
        found,
        iterations=near.iterations + found.iterations,
        evaluations=near.evaluations + found.evaluations,
    )


def descend_from_seed(
    objective: Objective,
    seed: int,
    index: int,
    precision: float = PRECISION,
    near: Floats | None = None,
) -> Descent:
    """Minimise from start number `index` of `seed`, which is random or near given parameters."""
    rng = np.random.default_rng([seed, index])
    start = objective.start(rng) if near is None else objective.start_near(near, rng)
    return descend(objective, start, precision)


def descents(objective: Objective, search: Search) -> list[Descent]:
    """Minimise from random starts and then from starts near the best of all before.

    Returns:
        One descent for each start that was needed, the best first, equals in their order.

    Raises:
        SolverError: No start led to a finite cost.
    """
    done: list[Descent] = []
    random = math.ceil(search.starts / 2)
    for first in (0, *range(random, search.starts, _ROUND)):
        last = min(first + _ROUND, search.starts) if done else random
        best = min(done, key=lambda each: each.cost, default=None)
        near = None if best is None else best.parameters
        for descent in _in_order(objective, search, range(first, last), near):
            done.append(descent)
            if search.progress is not None:
                search.progress(len(done), search.starts)
        if not any(math.isfinite(each.cost) for each in done):
            raise SolverError(f"none of {len(done)} starts led to a finite cost")
        if search.stop_early and best is not None and _agree(done, random):
            break
    return sorted(done, key=lambda each: each.cost)


def _agree(done: list[Descent], random: int) -> bool:
    """Tell whether all random starts found the best minimum of all that is known."""
    most = max(each.cost for each in done[:random])
    return most <= min(each.cost for each in done) * (1.0 + AGREEMENT)


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


def _in_order(
    objective: Objective, search: Search, indices: range, near: Floats | None
) -> Iterator[Descent]:
    tasks = [(objective, search.seed, index, PRECISION, near) for index in indices]
    if search.executor is None:
        for task in tasks:
            yield descend_from_seed(*task)
        return
    futures = [search.executor.submit(descend_from_seed, *task) for task in tasks]
    try:
        for future in futures:
            yield future.result()
    finally:
        for future in futures:
            future.cancel()
