# SPDX-License-Identifier: Apache-2.0
"""Steep starts: rates for responses such as exp(-sqrt t), which change on every scale of time.

Their rates are real and lie evenly on a logarithmic scale. They are found by least squares with
an even measure in log t, and polished on a grid that is graded towards the onset (`grids`).
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from scipy import linalg

from limit_surface_ros.decay.basis import as_rates
from limit_surface_ros.decay.grids import graded_start, time_of_change
from limit_surface_ros.decay.polish import polished_rates
from limit_surface_ros.decay.rates import RateChoice, judged
from limit_surface_ros.decay.varpro import Samples, VariableProjection
from limit_surface_ros.errors import SolverError

if TYPE_CHECKING:
    from limit_surface_ros.decay.targets import Target

METHOD = "steep"
# The slowest rate of a start over 1 / end, and its fastest over 1 / time of the first change.
SLOWEST, FASTEST = 0.5, (1.0, 0.1, 10.0, 1e-2, 1e-4)
EARLY_CHANGE = 1e-3
STEPS = 60
# Such responses may still be slow at the end.
LEAST_DECAYS = 0.05
# Errors of the least squares are told apart down to this part of the onset.
RESOLUTION = 1e-8
# Starts whose error is more than this many times that of the best are not polished.
MOST_BEHIND = 3.0


def steep_rates(response: Target, terms: int, end: float) -> RateChoice:
    """Return rates of a response with a steep start, polished on the graded grid.

    Args:
        response: The response, a function.
        terms: Number of real terms.
        end: End of the interval [s].

    Raises:
        SolverError: No start could be fitted, or the start is not steep.
    """
    times = graded_start(response, end)
    if len(times) == 0:
        raise SolverError("the start is not steep")
    values = response(times)
    # The measure d log t; the onset itself counts as the first time after it.
    weights = np.sqrt(np.gradient(np.log(np.append(0.5 * times[1], times[1:]))))
    samples = Samples(
        times,
        values,
        weights,
        RESOLUTION * abs(float(values[0])),
        float("inf"),
        least_decays=LEAST_DECAYS,
    )
    problem = VariableProjection(samples)
    first = time_of_change(response, end, EARLY_CHANGE)
    starts = []
    for factor in FASTEST:
        fastest = max(factor / first, 2.0 * SLOWEST / end)
        rates = as_rates(-np.geomspace(SLOWEST / end, fastest, terms))
        try:
            point = problem.improve(problem.project(problem.within_bounds(rates)), STEPS)
            starts.append(judged(point.rates, response, end, METHOD))
        except (linalg.LinAlgError, SolverError):
            continue
    if not starts:
        raise SolverError("no rates were found for the steep start")
    starts.sort(key=lambda start: start.error)
    polished = [
        polished_rates(response, end, start, least_decays=LEAST_DECAYS)
        for start in starts
        if start.error <= MOST_BEHIND * starts[0].error
    ]
    best = min(polished, key=lambda choice: choice.error)
    return RateChoice(best.rates, METHOD, best.error, None, best.parameters)
