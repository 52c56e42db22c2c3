# SPDX-License-Identifier: Apache-2.0
"""Fits of power sums: the thesis's J1 and J2 with their gradient (thesis 3.5 to 3.10).

    J = sum_k m_k ((H(f_k) - 1)^2 + w rho(|v_k - v^(f_k)|)),   H(f) = sum_i (f' A_i f)^(p_i)

where v^ is the unit gradient of H, w the velocity weight and m_k the pair's own, 1 unless given.
rho is the square (see `motion_cost`): then w = 0 is J1 of the thesis and w = 1 its J2. With
q_i = f' A_i f, c_i = 2 p_i q_i^(p_i - 1), the gradient of H is g = sum_i c_i A_i f. Let s = dJ/dg,
which is along v - (v . v^) v^; then

    dJ/dA_i = sum_k a_ik f f' + c_ik s f',   a_ik = c_ik (m (H - 1) + (p_i - 1) (s' A_i f) / q_i)

so that cost and gradient are a few matrix products of the matrices' entries with f f' and s f'.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from limit_surface_ros.checks import as_floats, as_number
from limit_surface_ros.errors import RangeError, ShapeError
from limit_surface_ros.fitting.factors import (
    PARAMETERS_PER_MATRIX,
    factors_of,
    matrices_of,
    one_redrawn,
    parameter_gradient,
    parameters_of,
    two_exchanged,
)
from limit_surface_ros.fitting.motion_cost import direction_loss
from limit_surface_ros.fitting.pairs import check_support, scale_pairs
from limit_surface_ros.fitting.result import solve
from limit_surface_ros.fitting.search import Search
from limit_surface_ros.fitting.symmetric import images_of_terms, symmetric
from limit_surface_ros.surface.kinds.power_sum import PowerSum

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import ArrayLike

    from limit_surface_ros.checks import Floats
    from limit_surface_ros.fitting.pairs import ScaledPairs
    from limit_surface_ros.fitting.result import FitResult
    from limit_surface_ros.surface.pairs import Pairs
    from limit_surface_ros.surface.scaling import Scaling

# Keeps powers and logarithms of a quadratic form finite where a matrix has lost the load's
# direction; in scaled variables it is far below anything that a fit can see.
_TINY = 1e-100
# Logarithmic spread of the axes of random terms.
_START_SPREAD = 1.5
# Pairs that are worked through at a time: what is computed of them stays in the cache.
_BLOCK = 3072


def fit_power_sum(
    pairs: Pairs,
    exponents: ArrayLike,
    *,
    velocity_weight: float = 1.0,
    scaling: Scaling | None = None,
    search: Search | None = None,
    symmetry: Sequence[str] = (),
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
        symmetry: Axes "x", "y" about which the surface is to be its own mirror image.

    Raises:
        ShapeError: `exponents` is not a list of numbers.
        RangeError: An exponent is outside (0, 1], the weight negative, or an axis not known.
        DataError: The pairs cannot determine such a surface.
        SolverError: No start led to a surface that passes through the loads.
    """
    powers = as_floats("exponents", exponents)
    if powers.ndim != 1 or powers.size == 0:
        raise ShapeError(f"exponents must have shape (m,) with m >= 1, got {powers.shape}")
    if not ((powers > 0.0) & (powers <= 1.0)).all():
        raise RangeError(f"exponents must lie in (0, 1], got {powers.tolist()}")
    weight = as_number("velocity_weight", velocity_weight)
    if weight < 0.0:
        raise RangeError(f"velocity_weight must not be negative, got {weight}")
    scaled = scale_pairs(pairs, scaling)
    images = images_of_terms(powers.size, symmetry, alike=bool(np.ptp(powers) == 0.0))
    check_support(scaled, images.shape[1])
    objective = symmetric(PowerSumObjective(scaled, powers, weight), images)
    name = "J1" if weight == 0.0 else f"J2, velocity weight {weight:g}"
    return solve(objective, name, pairs, search or Search())


class PowerSumObjective:
    """J1 or J2 of a power sum over scaled pairs."""

    def __init__(
        self,
        pairs: ScaledPairs,
        exponents: Floats,
        velocity_weight: float,
        robust_scale: float | None = None,
    ) -> None:
        """Hold the pairs in blocks.

        Args:
            pairs: What to fit.
            exponents: p_i, shape (m,).
            velocity_weight: w; 0 gives J1.
            robust_scale: See `motion_cost`.
        """
        self._pairs = pairs
        self._arguments = (pairs, exponents, velocity_weight, robust_scale)
        self._exponents = exponents
        self._scaling = pairs.scaling
        parts = np.array_split(np.arange(len(pairs)), -(-len(pairs) // _BLOCK))
        work = np.empty((6 * exponents.size + 12, len(parts[0])))
        self._blocks = [
            _Block(pairs, slice(part[0], part[-1] + 1), self._arguments[1:], work)
            for part in parts
        ]

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle the arguments alone: other processes rebuild what follows from them."""
        return type(self), self._arguments

    @property
    def size(self) -> int:
        """Number of parameters: six for each term."""
        return PARAMETERS_PER_MATRIX * self._exponents.size

    def cost(self, parameters: Floats) -> float:
        """Return the cost alone."""
        entries = matrices_of(factors_of(parameters)).reshape(-1, 9)
        return sum(block.cost(entries) for block in self._blocks)

    def cost_and_gradient(self, parameters: Floats) -> tuple[float, Floats]:
        """Return the cost and its gradient, shape (6 m,)."""
        factors = factors_of(parameters)
        entries = (factors @ factors.transpose(0, 2, 1)).reshape(-1, 9)
        cost, gradient = 0.0, np.zeros_like(entries)
        for block in self._blocks:
            cost += block.cost(entries, gradient)
        return cost, parameter_gradient(gradient.reshape(-1, 3, 3), factors)

    def start(self, rng: np.random.Generator) -> Floats:
        """Return random factors, whitened by the loads, with every term 1/m on average."""
        loads = self._pairs.wrenches
        spread = loads.T @ loads / len(loads)
        spread += 1e-9 * np.trace(spread) * np.eye(3)
        whitener = np.linalg.inv(np.linalg.cholesky(spread)).T
        factors = np.tril(rng.normal(size=(self._exponents.size, 3, 3)))
        matrices = whitener @ matrices_of(factors) @ whitener.T
        factors = np.linalg.cholesky(
            matrices + 1e-9 * np.trace(matrices, axis1=1, axis2=2)[:, None, None] * np.eye(3)
        )
        # Terms of very different shape: starts of like terms miss the deepest minima.
        factors *= np.exp(_START_SPREAD * rng.normal(size=(self._exponents.size, 3, 1)))
        forms = np.stack([np.sum((loads @ factor) ** 2, axis=1) for factor in factors])
        sizes: Floats = np.mean(forms ** self._exponents[:, None], axis=1) * self._exponents.size
        return parameters_of(factors * (sizes ** (-0.5 / self._exponents))[:, None, None])

    def start_near(self, parameters: Floats, rng: np.random.Generator) -> Floats:
        """Return `parameters` with a term drawn anew, or two of unlike exponents exchanged."""
        if np.ptp(self._exponents) > 0.0 and rng.random() < 0.5:
            return two_exchanged(parameters, rng)
        return one_redrawn(parameters, self.start(rng), rng)

    def coarse(self) -> PowerSumObjective | None:
        """Return the same fit to a part of the pairs, if they are very many."""
        part = self._pairs.coarse(self.size)
        return None if part is None else PowerSumObjective(part, *self._arguments[1:])

    def surface(self, parameters: Floats) -> PowerSum:
        """Return the power sum of `parameters`."""
        return PowerSum(matrices_of(factors_of(parameters)), self._exponents, self._scaling)


class _Block:
    """A part of the pairs, one column each, and the work arrays that blocks share in turn.

    A step allocates nothing but rows: memory that goes back to the system at each step costs
    more than the arithmetic.
    """

    def __init__(
        self,
        pairs: ScaledPairs,
        part: slice,
        arguments: tuple[Floats, float, float | None],
        work: Floats,
    ) -> None:
        exponents, self._velocity_weight, self._robust_scale = arguments
        self._powers = exponents.tolist()
        self._weights = pairs.weights[part]
        self._motion_weights = self._velocity_weight * self._weights
        self._loads = np.ascontiguousarray(pairs.wrenches[part].T)
        self._directions = np.ascontiguousarray(pairs.directions[part].T)
        self._squares = (self._loads[:, None] * self._loads).reshape(9, -1)
        terms, size = len(self._powers), self._weights.size
        work = work.ravel()[: len(work) * size].reshape(-1, size)
        ends = np.cumsum([terms, terms, terms, 3 * terms, 9])
        self._forms, self._values, self._slopes, self._products, self._outer, self._normals = (
            np.split(work, ends)
        )

    def cost(self, entries: Floats, gradient: Floats | None = None) -> float:
        """Return the cost; add its gradient with respect to the matrices' entries.

        Args:
            entries: Of the matrices A_i, shape (m, 9).
            gradient: What the gradient is added to, shape (m, 9).
        """
        slopes, changes = self._slopes, self._values
        residual = self._evaluate(entries)
        weighted = residual * self._weights
        cost = weighted @ residual
        if self._velocity_weight > 0.0:
            norms, cosines = self._normals_of(entries)
            loss, slope = direction_loss(cosines, self._robust_scale)
            cost += self._motion_weights @ loss
            if gradient is not None:
                outer = self._gradient_part(slope, norms, cosines)
                np.matmul(entries, outer, out=changes)
                gradient += slopes @ outer.T
                for change, form, power in zip(changes, self._forms, self._powers, strict=True):
                    change *= power - 1.0
                    change /= form
                    change += weighted
                changes *= slopes
        elif gradient is not None:
            np.multiply(slopes, weighted, out=changes)
        if gradient is not None:
            gradient += changes @ self._squares.T
        return float(cost)

    def _evaluate(self, entries: Floats) -> Floats:
        """Fill forms q_i, values q_i^p_i and slopes c_i; return H - 1."""
        forms = np.matmul(entries, self._squares, out=self._forms)
        np.maximum(forms, _TINY, out=forms)
        residual = np.full(self._weights.size, -1.0)
        # Term by term: along rows, numbers multiply twice as fast as along columns.
        for form, value, slope, power in zip(
            forms, self._values, self._slopes, self._powers, strict=True
        ):
            if power == 1.0:
                residual += form
                slope.fill(2.0)
                continue
            if power == 0.5:
                np.sqrt(form, out=value)
            else:
                np.log(form, out=value)
                value *= power
                np.exp(value, out=value)
            residual += value
            np.divide(value, form, out=slope)
            slope *= 2.0 * power
        return residual

    def _normals_of(self, entries: Floats) -> tuple[Floats, Floats]:
        """Fill the gradients of H; return their norms and v . v^."""
        np.matmul(entries.reshape(-1, 3), self._loads, out=self._products)
        products = self._products.reshape(-1, 3, self._weights.size)
        normals = np.einsum("mn,mcn->cn", self._slopes, products, out=self._normals)
        norms = np.sqrt(np.einsum("cn,cn->n", normals, normals))
        np.maximum(norms, _TINY, out=norms)
        cosines = np.einsum("cn,cn->n", normals, self._directions)
        cosines /= norms
        return norms, cosines

    def _gradient_part(self, slope: Floats, norms: Floats, cosines: Floats) -> Floats:
        """Return s f', shape (9, n), from the loss's slope along the cosine."""
        slope *= self._motion_weights
        slope /= norms
        part = self._normals
        part *= -cosines / norms
        part += self._directions
        part *= slope
        np.multiply(part[:, None], self._loads, out=self._outer.reshape(3, 3, -1))
        return self._outer
