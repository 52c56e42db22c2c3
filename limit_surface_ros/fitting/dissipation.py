# SPDX-License-Identifier: Apache-2.0
"""Fits of dissipation models: on forces, on directions, on both, or held near support points."""

from __future__ import annotations

from typing import TYPE_CHECKING

from limit_surface_ros.checks import as_floats
from limit_surface_ros.errors import RangeError
from limit_surface_ros.fitting.cholesky import PARAMETERS_PER_MATRIX
from limit_surface_ros.fitting.combined_objectives import SumOfObjectives
from limit_surface_ros.fitting.dissipation_direction_objective import (
    DissipationDirectionObjective,
)
from limit_surface_ros.fitting.dissipation_force_objective import DissipationForceObjective
from limit_surface_ros.fitting.pairs import check_support, scale_pairs
from limit_surface_ros.fitting.search import Search
from limit_surface_ros.fitting.solve import solve

if TYPE_CHECKING:
    from limit_surface_ros.fitting.objective import Objective
    from limit_surface_ros.fitting.pairs import ScaledPairs
    from limit_surface_ros.fitting.result import FitResult
    from limit_surface_ros.surface.pairs import Pairs
    from limit_surface_ros.surface.scaling import Scaling

FITTED_ON = ("forces", "directions", "both")


def fit_dissipation(
    pairs: Pairs,
    terms: int,
    *,
    fitted_on: str = "forces",
    velocity_weight: float = 1.0,
    robust_scale: float | None = None,
    floor: float = 1e-3,
    scaling: Scaling | None = None,
    search: Search | None = None,
) -> FitResult:
    """Fit D(v) = sum_k sqrt(v' B_k v), of which the load is the gradient.

    Args:
        pairs: Loads on the surface and the motions they cause; one pair per parameter at least.
        terms: How many terms; k support points are exactly k terms.
        fitted_on: "forces" compares the loads of the pairs' motions and is the quickest, for
            simulated data; "directions" the motions and the load factors of the pairs' loads, for
            recorded pushes; "both" adds the two.
        velocity_weight: Weight of the motions when fitted on directions.
        robust_scale: Chord between unit motions beyond which its cost grows only linearly; None
            squares all.
        floor: Share of each term that is added to it as a sphere, which keeps D smooth, when
            fitted on directions; see `dissipation_parameters`.
        scaling: Characteristic length and friction force; chosen from the pairs if not given.
        search: Starts, seed, where and how to run.

    Raises:
        RangeError: An argument is out of range.
        DataError: The pairs cannot determine such a surface.
        SolverError: No start led to a surface that passes through the loads.
    """
    if terms < 1:
        raise RangeError(f"terms must be at least 1, got {terms}")
    scaled = scale_pairs(pairs, scaling)
    check_support(scaled, PARAMETERS_PER_MATRIX * terms)
    objective = dissipation_objective(
        scaled, terms, fitted_on, velocity_weight, robust_scale, floor
    )
    return solve(objective, describe(fitted_on, velocity_weight), pairs, search or Search())


def dissipation_objective(
    pairs: ScaledPairs,
    terms: int,
    fitted_on: str,
    velocity_weight: float,
    robust_scale: float | None,
    floor: float,
) -> Objective:
    """Return the objective of a fit; see `fit_dissipation`.

    Raises:
        RangeError: An argument is out of range.
    """
    if fitted_on not in FITTED_ON:
        raise RangeError(f"fitted_on must be one of {', '.join(FITTED_ON)}; got {fitted_on!r}")
    numbers = as_floats("velocity_weight, floor", [velocity_weight, floor])
    if not (numbers > 0.0).all() or (robust_scale is not None and not robust_scale > 0.0):
        raise RangeError(
            "velocity_weight, floor and robust_scale must be above 0, "
            f"got {velocity_weight}, {floor} and {robust_scale}"
        )
    if fitted_on == "forces":
        return DissipationForceObjective(pairs, terms)
    directions = DissipationDirectionObjective(pairs, terms, velocity_weight, robust_scale, floor)
    if fitted_on == "directions":
        return directions
    return SumOfObjectives(directions, DissipationForceObjective(pairs, terms, floor))


def describe(fitted_on: str, velocity_weight: float) -> str:
    """Return an objective's name in words."""
    weight = "" if fitted_on == "forces" else f", velocity weight {velocity_weight:g}"
    return f"dissipation fitted on {fitted_on}{weight}"
