# SPDX-License-Identifier: Apache-2.0
"""Fits of power sums: the thesis's J1 and J2, with a weight on the error of motion."""

from __future__ import annotations

from typing import TYPE_CHECKING

from limit_surface_ros.checks import as_floats
from limit_surface_ros.errors import RangeError, ShapeError
from limit_surface_ros.fitting.cholesky import PARAMETERS_PER_MATRIX
from limit_surface_ros.fitting.pairs import check_support, scale_pairs
from limit_surface_ros.fitting.power_sum_objective import PowerSumObjective
from limit_surface_ros.fitting.search import Search
from limit_surface_ros.fitting.solve import solve

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from limit_surface_ros.fitting.result import FitResult
    from limit_surface_ros.surface.pairs import Pairs
    from limit_surface_ros.surface.scaling import Scaling


def fit_power_sum(
    pairs: Pairs,
    exponents: ArrayLike,
    *,
    velocity_weight: float = 1.0,
    scaling: Scaling | None = None,
    search: Search | None = None,
) -> FitResult:
    """Fit H(f) = sum_i (f' A_i f)^p_i = 1 to loads and motions.

    The cost is sum_k (H(f_k) - 1)^2 + w |v_k - v^_k|^2 in scaled variables, minimised by BFGS over
    Cholesky factors of the matrices from several starts.

    Args:
        pairs: Loads on the surface and the motions they cause; one pair per parameter at least.
        exponents: p_i in (0, 1], shape (m,): `surface.kinds.power_sum.thesis_exponents(m)`, or 1/2
            for all m terms, a sum of norms.
        velocity_weight: w; 0 is J1 of the thesis and 1 its J2.
        scaling: Characteristic length and friction force; chosen from the pairs if not given.
        search: Starts, seed, where and how to run.

    Raises:
        ShapeError: `exponents` is not a list of numbers.
        RangeError: An exponent is outside (0, 1] or the weight negative.
        DataError: The pairs cannot determine such a surface.
        SolverError: No start led to a surface that passes through the loads.
    """
    powers = as_floats("exponents", exponents)
    if powers.ndim != 1 or powers.size == 0:
        raise ShapeError(f"exponents must have shape (m,) with m >= 1, got {powers.shape}")
    if not ((powers > 0.0) & (powers <= 1.0)).all():
        raise RangeError(f"exponents must lie in (0, 1], got {powers.tolist()}")
    weight = float(as_floats("velocity_weight", velocity_weight))
    if weight < 0.0:
        raise RangeError(f"velocity_weight must not be negative, got {weight}")
    scaled = scale_pairs(pairs, scaling)
    check_support(scaled, PARAMETERS_PER_MATRIX * powers.size)
    objective = PowerSumObjective(scaled, powers, weight)
    name = "J1" if weight == 0.0 else f"J2, velocity weight {weight:g}"
    return solve(objective, name, pairs, search or Search())
