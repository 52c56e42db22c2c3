"""J1 and J2 of a power sum, with their gradient by matrix calculus (thesis 3.5 to 3.10).

    J = sum_k m_k ((H(f_k) - 1)^2 + w rho(|v_k - v^(f_k)|)),   H(f) = sum_i (f' A_i f)^(p_i)

where v^ is the unit gradient of H, w the velocity weight and m_k the pair's own, 1 unless given.
rho is the square (see `direction_loss`): then w = 0 is J1 of the thesis and w = 1 its J2. With
q_i = f' A_i f, c_i = 2 p_i q_i^(p_i - 1), the gradient of H is g = sum_i c_i A_i f. Let s = dJ/dg,
which is along v - (v . v^) v^; then

    dJ/dA_i = sum_k a_ik f f' + c_ik s f',   a_ik = c_ik (m (H - 1) + (p_i - 1) (s' A_i f) / q_i)

so that the gradient of all terms is one matrix product over the pairs, about twice the work of
the cost alone.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from limit_surface_ros.fitting.cholesky import (
    PARAMETERS_PER_MATRIX,
    factors_of,
    matrices_of,
    parameter_gradient,
    parameters_of,
)
from limit_surface_ros.fitting.direction_loss import direction_loss
from limit_surface_ros.surface.power_sum import PowerSum

if TYPE_CHECKING:
    from limit_surface_ros.checks import Floats
    from limit_surface_ros.fitting.scaled_pairs import ScaledPairs

# Keeps powers and logarithms of a quadratic form finite where a matrix has lost the load's
# direction; in scaled variables it is far below anything that a fit can see.
_TINY = 1e-100
# Logarithmic spread of the axes of random terms.
_START_SPREAD = 1.5


class PowerSumObjective:
    """J1 or J2 of a power sum over scaled pairs."""

    def __init__(
        self,
        pairs: ScaledPairs,
        exponents: Floats,
        velocity_weight: float,
        robust_scale: float | None = None,
    ) -> None:
        """Hold the pairs, one column each, and the work arrays.

        Args:
            pairs: What to fit.
            exponents: p_i, shape (m,).
            velocity_weight: w; 0 gives J1.
            robust_scale: See `direction_loss`.
        """
        self._pairs = pairs
        self._arguments = (pairs, exponents, velocity_weight, robust_scale)
        self._exponents = exponents
        self._velocity_weight = velocity_weight
        self._robust_scale = robust_scale
        self._scaling = pairs.scaling
        self._weights = pairs.weights
        self._loads = np.ascontiguousarray(pairs.wrenches.T)
        self._directions = np.ascontiguousarray(pairs.directions.T)
        self._powers = exponents[:, None]
        self._allocate(exponents.size, len(pairs))

    def _allocate(self, terms: int, pairs: int) -> None:
        # A step allocates nothing of the pairs' size: memory that goes back to the system at
        # each step costs three times the arithmetic.
        self._products = np.empty((terms, 3, pairs))
        self._weighted = np.empty((terms, 3, pairs))
        self._forms = np.empty((terms, pairs))
        self._values = np.empty((terms, pairs))
        self._slopes = np.empty((terms, pairs))
        self._bends = np.empty((terms, pairs))
        self._normals = np.empty((3, pairs))

    def __reduce__(self) -> tuple[Any, ...]:
        """Travel to other processes without the work arrays."""
        return type(self), self._arguments

    @property
    def size(self) -> int:
        """Number of parameters: six for each term."""
        return PARAMETERS_PER_MATRIX * self._exponents.size

    def cost(self, parameters: Floats) -> float:
        """Return the cost alone."""
        matrices = matrices_of(factors_of(parameters))
        residual = self._evaluate(matrices)
        cost = self._weights @ residual**2
        if self._velocity_weight > 0.0:
            loss, _ = direction_loss(self._normalise()[1], self._robust_scale)
            cost += self._velocity_weight * (self._weights @ loss)
        return float(cost)

    def cost_and_gradient(self, parameters: Floats) -> tuple[float, Floats]:
        """Return the cost and its gradient, shape (6 m,)."""
        factors = factors_of(parameters)
        residual = self._evaluate(matrices_of(factors))
        cost = self._weights @ residual**2
        residual *= self._weights
        loads, bends, slopes = self._loads, self._bends, self._slopes
        if self._velocity_weight > 0.0:
            norms, cosines = self._normalise()
            loss, slope = direction_loss(cosines, self._robust_scale)
            cost += self._velocity_weight * (self._weights @ loss)
            pull = self._normals
            pull *= -cosines
            pull += self._directions
            pull *= slope * (self._velocity_weight * self._weights / norms)
            np.einsum("mcn,cn->mn", self._products, pull, out=bends)
            bends *= self._powers - 1.0
            bends /= self._forms
            bends += residual
            bends *= slopes
            weighted = np.multiply(slopes[:, None], pull, out=self._weighted)
            # The products A_i f are no longer needed: their array takes the other half.
            weighted += np.multiply(bends[:, None], loads, out=self._products)
        else:
            np.multiply(slopes, residual, out=bends)
            weighted = np.multiply(bends[:, None], loads, out=self._weighted)
        gradient = weighted.reshape(-1, loads.shape[1]) @ loads.T
        return float(cost), parameter_gradient(gradient.reshape(-1, 3, 3), factors)

    def start(self, rng: np.random.Generator) -> Floats:
        """Return random factors, whitened by the loads, with every term 1/m on average."""
        spread = self._loads @ self._loads.T / self._loads.shape[1]
        spread += 1e-9 * np.trace(spread) * np.eye(3)
        whitener = np.linalg.inv(np.linalg.cholesky(spread)).T
        factors = np.tril(rng.normal(size=(self._exponents.size, 3, 3)))
        matrices = whitener @ matrices_of(factors) @ whitener.T
        factors = np.linalg.cholesky(
            matrices + 1e-9 * np.trace(matrices, axis1=1, axis2=2)[:, None, None] * np.eye(3)
        )
        # Terms of very different shape: starts of like terms miss the deepest minima.
        factors *= np.exp(_START_SPREAD * rng.normal(size=(self._exponents.size, 3, 1)))
        self._evaluate(matrices_of(factors))
        scale: Floats = self._values.mean(axis=1) * self._exponents.size
        return parameters_of(factors * (scale ** (-0.5 / self._exponents))[:, None, None])

    def coarse(self) -> PowerSumObjective | None:
        """Return the same fit to a part of the pairs, if they are very many."""
        part = self._pairs.coarse(self.size)
        return None if part is None else PowerSumObjective(part, *self._arguments[1:])

    def surface(self, parameters: Floats) -> PowerSum:
        """Return the power sum of `parameters`."""
        return PowerSum(matrices_of(factors_of(parameters)), self._exponents, self._scaling)

    def _evaluate(self, matrices: Floats) -> Floats:
        """Fill products A_i f, forms q_i, values q_i^p_i and slopes c_i; return H - 1."""
        loads, forms, values, slopes = self._loads, self._forms, self._values, self._slopes
        np.matmul(matrices.reshape(-1, 3), loads, out=self._products.reshape(-1, loads.shape[1]))
        np.einsum("mcn,cn->mn", self._products, loads, out=forms)
        np.maximum(forms, _TINY, out=forms)
        np.log(forms, out=values)
        values *= self._powers
        np.exp(values, out=values)
        np.divide(values, forms, out=slopes)
        slopes *= 2.0 * self._powers
        residual: Floats = values.sum(axis=0) - 1.0
        return residual

    def _normalise(self) -> tuple[Floats, Floats]:
        """Fill the unit normals; return the gradients' norms and v . v^."""
        normals = np.einsum("mn,mcn->cn", self._slopes, self._products, out=self._normals)
        norms = np.sqrt(np.einsum("cn,cn->n", normals, normals))
        np.maximum(norms, _TINY, out=norms)
        normals /= norms
        return norms, np.einsum("cn,cn->n", normals, self._directions)
