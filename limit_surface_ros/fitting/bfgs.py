# SPDX-License-Identifier: Apache-2.0
"""BFGS for a few dozen parameters that can continue from a known inverse Hessian.

scipy's minimisers spend more time around a cost of 0.1 ms than in it, their BLAS threads wait for
each other in small products, and none takes an inverse Hessian to begin with. Two BLAS routines
update the inverse Hessian in place.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy.linalg.blas import dsymv, dsyr2

if TYPE_CHECKING:
    from collections.abc import Callable

    from limit_surface_ros.checks import Floats

# Conditions of Wolfe: a step gains this share of what the slope promises, and flattens the slope
# to that share.
_DECREASE, _CURVATURE = 1e-4, 0.9
_MOST_TRIALS = 30
# Steps in a row that gain less than the precision, after which nothing more is to be gained.
_PATIENCE = 2


@dataclass(frozen=True)
class Minimum:
    """Where BFGS ended.

    Attributes:
        parameters: Shape (n,).
        cost: The cost there.
        gradient: Shape (n,).
        inverse: The estimate of the inverse Hessian, shape (n, n).
        iterations: Steps taken.
        evaluations: Times that cost and gradient were computed.
        converged: Whether it ended because nothing more was to be gained.
    """

    parameters: Floats
    cost: float
    gradient: Floats
    inverse: Floats
    iterations: int
    evaluations: int
    converged: bool


def minimise(
    cost_and_gradient: Callable[[Floats], tuple[float, Floats]],
    start: Floats,
    precision: float,
    most_iterations: int,
    inverse: Floats | None = None,
) -> Minimum:
    """Minimise a smooth cost.

    Args:
        cost_and_gradient: The cost and its gradient, shape (n,).
        start: Shape (n,).
        precision: Relative gain of a step below which there is nothing more to be gained.
        most_iterations: Steps at most.
        inverse: Inverse Hessian to begin with, shape (n, n); unknown if not given.
    """
    here, (cost, slope) = start, cost_and_gradient(start)
    steps, evaluations, patience, converged = 0, 1, _PATIENCE, False
    scaled = inverse is not None
    metric = inverse
    if metric is None:
        metric = np.eye(start.size) / max(float(np.linalg.norm(slope)), 1e-300)
    # Of the symmetric metric only the upper triangle is used and kept.
    metric = np.array(metric, order="F")
    for steps in range(1, most_iterations + 1):  # noqa: B007
        direction = dsymv(-1.0, metric, slope)
        descent = float(direction @ slope)
        if not descent < 0.0:
            converged = True
            break
        step, low, high = 1.0, 0.0, np.inf
        for _ in range(_MOST_TRIALS):
            there = here + step * direction
            trial, trial_slope = cost_and_gradient(there)
            evaluations += 1
            if not trial <= cost + _DECREASE * step * descent:
                high = step
            elif direction @ trial_slope < _CURVATURE * descent:
                low = step
            else:
                break
            step = 0.5 * (low + high) if high < np.inf else 2.0 * low
        if not trial < cost:
            # Rounding: no step along a direction of descent gains anything.
            converged = True
            break
        gain, moved, turned = cost - trial, there - here, trial_slope - slope
        here, cost, slope = there, trial, trial_slope
        along = float(moved @ turned)
        if along > 0.0:
            if not scaled:
                metric = np.asfortranarray(np.eye(start.size) * (along / float(turned @ turned)))
                scaled = True
            _update(metric, moved, turned, along)
        patience = _PATIENCE if gain > precision * cost else patience - 1
        if not patience or not cost > 0.0:
            converged = True
            break
    whole = np.triu(metric) + np.triu(metric, 1).T
    return Minimum(here, float(cost), slope, whole, steps, evaluations, converged)


def _update(metric: Floats, moved: Floats, turned: Floats, along: float) -> None:
    """Change the inverse Hessian in place to one that also maps `turned` to `moved`."""
    image = dsymv(1.0, metric, turned)
    scale = (1.0 + float(turned @ image) / along) / along
    image *= -1.0 / along
    image += 0.5 * scale * moved
    dsyr2(1.0, moved, image, a=metric, overwrite_a=1)
