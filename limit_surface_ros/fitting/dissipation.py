# SPDX-License-Identifier: Apache-2.0
"""Fits of dissipation models: on forces, on directions, or on both.

On directions the cost is that of `motion_cost`, the model's motion of each load against the
pair's. On forces it is the model's load at each motion against the pair's:

    J = sum_k m_k |grad D(v_k) - f_k|^2,   D(v) = sum_i sqrt(v' B_i v)

With s_i = sqrt(v' B_i v) and the residual r = grad D(v) - f,

    dJ/dB_i = sum_k m_k (2 r v' / s_i - (r' B_i v) v v' / s_i^3).

Where several pairs share one motion the load is no function of it: they lie on a facet. Of these
only the power is known, and m_k (D(v_k) - f_k . v_k)^2 takes the place of their residual.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from limit_surface_ros.checks import as_floats
from limit_surface_ros.errors import RangeError
from limit_surface_ros.fitting.factors import (
    PARAMETERS_PER_MATRIX,
    floored_gradient,
    floored_matrices,
    one_redrawn,
    random_factors,
)
from limit_surface_ros.fitting.motion_cost import MotionCost
from limit_surface_ros.fitting.objective import SumOfObjectives
from limit_surface_ros.fitting.pairs import check_support, scale_pairs
from limit_surface_ros.fitting.result import solve
from limit_surface_ros.fitting.search import Search
from limit_surface_ros.fitting.symmetric import images_of_terms, symmetric
from limit_surface_ros.surface.kinds.dissipation import Dissipation

if TYPE_CHECKING:
    from collections.abc import Sequence

    from limit_surface_ros.checks import Bools, Floats
    from limit_surface_ros.fitting.objective import Objective
    from limit_surface_ros.fitting.pairs import ScaledPairs
    from limit_surface_ros.fitting.result import FitResult
    from limit_surface_ros.surface.pairs import Pairs
    from limit_surface_ros.surface.scaling import Scaling

FITTED_ON = ("forces", "directions", "both")
# Keeps a term finite where it does not move at all.
_SLOWEST = 1e-9
# Decimals to which two unit motions agree that are one.
_SAME_MOTION = 9


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
    symmetry: Sequence[str] = (),
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
            fitted on directions; see `factors`.
        scaling: Characteristic length and friction force; chosen from the pairs if not given.
        search: Starts, seed, where and how to run.
        symmetry: Axes "x", "y" about which the surface is to be its own mirror image.

    Raises:
        RangeError: An argument is out of range.
        DataError: The pairs cannot determine such a surface.
        SolverError: No start led to a surface that passes through the loads.
    """
    if terms < 1:
        raise RangeError(f"terms must be at least 1, got {terms}")
    scaled = scale_pairs(pairs, scaling)
    images = images_of_terms(terms, symmetry, alike=True)
    check_support(scaled, images.shape[1])
    objective = dissipation_objective(
        scaled, terms, fitted_on, velocity_weight, robust_scale, floor
    )
    return solve(
        symmetric(objective, images),
        describe(fitted_on, velocity_weight),
        pairs,
        search or Search(),
    )


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
        return ForceObjective(pairs, terms)
    directions = DirectionObjective(pairs, terms, velocity_weight, robust_scale, floor)
    if fitted_on == "directions":
        return directions
    return SumOfObjectives(directions, ForceObjective(pairs, terms, floor))


def describe(fitted_on: str, velocity_weight: float) -> str:
    """Return an objective's name in words."""
    weight = "" if fitted_on == "forces" else f", velocity weight {velocity_weight:g}"
    return f"dissipation fitted on {fitted_on}{weight}"


class DirectionObjective:
    """The error of motion and of load factor at the pairs' loads, for a number of terms."""

    def __init__(
        self,
        pairs: ScaledPairs,
        terms: int,
        velocity_weight: float,
        robust_scale: float | None = None,
        floor: float = 1e-3,
    ) -> None:
        """Hold the pairs and the planes of their loads.

        Args:
            pairs: What to fit.
            terms: How many terms.
            velocity_weight: w of `motion_cost`.
            robust_scale: See `motion_cost`.
            floor: Above zero; see `factors`.
        """
        self._arguments = (pairs, terms, velocity_weight, robust_scale, floor)
        self._pairs = pairs
        self._terms = terms
        self._floor = floor
        self._cost = MotionCost(pairs, velocity_weight, robust_scale)

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle the arguments alone: other processes rebuild what follows from them."""
        return type(self), self._arguments

    @property
    def size(self) -> int:
        """Number of parameters: six for each term."""
        return PARAMETERS_PER_MATRIX * self._terms

    def cost_and_gradient(self, parameters: Floats) -> tuple[float, Floats]:
        """Return the cost and its gradient, shape (6 k,)."""
        matrices, factors = floored_matrices(parameters, self._floor)
        cost, gradient = self._cost.of(matrices)
        return cost, floored_gradient(gradient, factors, self._floor)

    def start(self, rng: np.random.Generator) -> Floats:
        """Return random terms that together resist loads of the pairs' size."""
        return random_factors(np.asarray(self._pairs.wrenches.T), self._terms, rng)

    def start_near(self, parameters: Floats, rng: np.random.Generator) -> Floats:
        """Return `parameters` with one term drawn anew."""
        return one_redrawn(parameters, self.start(rng), rng)

    def coarse(self) -> DirectionObjective | None:
        """Return the same fit to a part of the pairs, if they are very many."""
        part = self._pairs.coarse(self.size)
        return None if part is None else DirectionObjective(part, *self._arguments[1:])

    def surface(self, parameters: Floats) -> Dissipation:
        """Return the dissipation model of `parameters`."""
        matrices, _ = floored_matrices(parameters, self._floor)
        return Dissipation(matrices, self._pairs.scaling)


class ForceObjective:
    """The error of load at the pairs' motions, for a number of terms."""

    def __init__(self, pairs: ScaledPairs, terms: int, floor: float = 0.0) -> None:
        """Hold the pairs, one column each.

        Args:
            pairs: What to fit.
            terms: How many terms.
            floor: See `factors`.
        """
        self._pairs = pairs
        self._terms = terms
        self._floor = floor
        self._loads = np.ascontiguousarray(pairs.wrenches.T)
        self._motions = np.ascontiguousarray(pairs.directions.T)
        self._powers = np.einsum("cn,cn->n", self._loads, self._motions)
        facet = on_facets(pairs.directions)
        self._of_load = np.where(facet, 0.0, pairs.weights)
        self._of_power = np.where(facet, pairs.weights, 0.0)

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle the arguments alone: other processes rebuild what follows from them."""
        return type(self), (self._pairs, self._terms, self._floor)

    @property
    def size(self) -> int:
        """Number of parameters: six for each term."""
        return PARAMETERS_PER_MATRIX * self._terms

    def cost_and_gradient(self, parameters: Floats) -> tuple[float, Floats]:
        """Return the cost and its gradient, shape (6 k,)."""
        matrices, factors = floored_matrices(parameters, self._floor)
        motions = self._motions
        count = motions.shape[1]
        products = (matrices.reshape(-1, 3) @ motions).reshape(-1, 3, count)
        speeds = np.sqrt(np.maximum(np.einsum("kcn,cn->kn", products, motions), _SLOWEST**2))
        residual = (products / speeds[:, None]).sum(axis=0)
        residual -= self._loads
        excess = speeds.sum(axis=0) - self._powers
        cost = self._of_load @ np.einsum("cn,cn->n", residual, residual)
        cost += self._of_power @ excess**2
        residual *= self._of_load
        excess *= self._of_power
        along = np.einsum("kcn,cn->kn", products, residual)
        changes = excess / speeds - along / speeds**3
        products = np.multiply(changes[:, None], motions, out=products)
        products += (2.0 / speeds)[:, None] * residual
        gradient = products.reshape(-1, count) @ motions.T
        return float(cost), floored_gradient(gradient.reshape(-1, 3, 3), factors, self._floor)

    def start(self, rng: np.random.Generator) -> Floats:
        """Return random terms that together resist loads of the pairs' size."""
        return random_factors(self._loads, self._terms, rng)

    def start_near(self, parameters: Floats, rng: np.random.Generator) -> Floats:
        """Return `parameters` with one term drawn anew."""
        return one_redrawn(parameters, self.start(rng), rng)

    def coarse(self) -> ForceObjective | None:
        """Return the same fit to a part of the pairs, if they are very many."""
        part = self._pairs.coarse(self.size)
        return None if part is None else ForceObjective(part, self._terms, self._floor)

    def surface(self, parameters: Floats) -> Dissipation:
        """Return the dissipation model of `parameters`."""
        matrices, _ = floored_matrices(parameters, self._floor)
        return Dissipation(matrices, self._pairs.scaling)


def on_facets(directions: Floats) -> Bools:
    """Tell which pairs share their motion with another, shape (n,)."""
    _, group, sizes = np.unique(
        np.round(directions, _SAME_MOTION), axis=0, return_inverse=True, return_counts=True
    )
    return np.asarray(sizes[group.ravel()] > 1)
