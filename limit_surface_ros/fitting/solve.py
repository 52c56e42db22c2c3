# SPDX-License-Identifier: Apache-2.0
"""From an objective to a result: descend, choose the best sound start, measure it."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

import numpy as np

from limit_surface_ros.errors import SolverError
from limit_surface_ros.fitting.result import FitResult, errors_on
from limit_surface_ros.fitting.search import descents

if TYPE_CHECKING:
    from limit_surface_ros.fitting.objective import Objective
    from limit_surface_ros.fitting.search import Descent, Search
    from limit_surface_ros.surface.pairs import Pairs
    from limit_surface_ros.surface.protocol import LimitSurface

# A surface on whose scale the median of the fitted loads is further out or in has lost them.
_SOUND = 3.0


def solve(objective: Objective, name: str, pairs: Pairs, search: Search) -> FitResult:
    """Minimise an objective and return the best surface that did not collapse.

    With a heavy weight on motions the loads may count so little that the surface shrinks to
    nothing or grows without bound; such starts are passed over.

    Args:
        objective: What to minimise.
        name: What it is, in words.
        pairs: The pairs behind it, for the errors of the result.
        search: Starts, seed, where and how to run.

    Raises:
        SolverError: No start led to a surface that passes through the loads.
    """
    begin = time.perf_counter()
    found = descents(objective, search)
    best, surface = _first_sound(objective, found, pairs)
    return FitResult(
        surface=surface,
        objective=name,
        cost=best.cost,
        start_costs=tuple(each.cost for each in found),
        iterations=best.iterations,
        gradient_norm=best.gradient_norm,
        converged=best.converged,
        wall_time=time.perf_counter() - begin,
        training=errors_on(surface, pairs),
    )


def is_sound(surface: LimitSurface, pairs: Pairs) -> bool:
    """Tell whether a surface has the scale of the pairs' loads and has not collapsed."""
    middle = float(np.median(surface.load_factor(pairs.wrenches)))
    return 1.0 / _SOUND < middle < _SOUND


def _first_sound(
    objective: Objective, found: list[Descent], pairs: Pairs
) -> tuple[Descent, LimitSurface]:
    for descent in found:
        surface = objective.surface(descent.parameters)
        if is_sound(surface, pairs):
            return descent, surface
    raise SolverError(
        "every start lost the scale of the loads: lower the velocity weight or take fewer terms"
    )
