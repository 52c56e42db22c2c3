# SPDX-License-Identifier: Apache-2.0
"""Linear delay differential equations: xdot(t) = sum_j c_j x(t - tau_j) + int p(tau) x(t - tau).

Inserting x = exp(lambda t) gives the characteristic function
h(lambda) = lambda - sum_j c_j exp(-lambda tau_j) - int p(tau) exp(-lambda tau) dtau;
its zeros, the characteristic roots, are the rates that solutions can have.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from limit_surface_ros.checks import as_floats
from limit_surface_ros.decay.delay.pieces import PiecewisePolynomial
from limit_surface_ros.errors import DataError, RangeError, ShapeError

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from limit_surface_ros.checks import Floats
    from limit_surface_ros.decay.basis import Complexes

# Rates that are evaluated at a time: their waves fit into the cache.
BLOCK = 4096


@dataclass(frozen=True, eq=False)
class DelaySystem:
    """A scalar linear delay differential equation with discrete and distributed delays.

    Attributes:
        delays: Shape (k,), tau_j >= 0 [s].
        strengths: Shape (k,), c_j [1/s].
        pieces: The distributed feedback p [1/s^2], or None.

    Raises:
        ShapeError: Delays and strengths are not lists of one length.
        NotFiniteError: A number is NaN or infinite.
        RangeError: A delay is negative, or there is no feedback at all.

    Example:
        >>> DelaySystem(delays=[6.0], strengths=[-0.1]).max_delay
        6.0
    """

    delays: Floats
    strengths: Floats
    pieces: PiecewisePolynomial | None = None

    def __post_init__(self) -> None:
        """Check the delays and strengths and make them read-only."""
        delays = as_floats("delays", self.delays).copy()
        strengths = as_floats("strengths", self.strengths).copy()
        if delays.ndim != 1 or delays.shape != strengths.shape:
            raise ShapeError(
                f"delays and strengths must have one shape (k,), "
                f"got {delays.shape} and {strengths.shape}"
            )
        if (delays < 0.0).any():
            raise RangeError(f"delays must be at least 0, got {float(delays.min())}")
        if not strengths.any() and self.pieces is None:
            raise RangeError("a delay system needs a feedback: a strength or a polynomial")
        delays.setflags(write=False)
        strengths.setflags(write=False)
        object.__setattr__(self, "delays", delays)
        object.__setattr__(self, "strengths", strengths)

    @property
    def max_delay(self) -> float:
        """Largest delay that acts [s]."""
        discrete = float(self.delays.max(initial=0.0))
        return discrete if self.pieces is None else max(discrete, float(self.pieces.edges[-1]))

    def characteristic(self, rates: ArrayLike) -> Complexes:
        """Return h(lambda) [1/s] for rates lambda [1/s] of any shape."""
        return self.characteristic_and_derivative(rates)[0]

    def characteristic_and_derivative(self, rates: ArrayLike) -> tuple[Complexes, Complexes]:
        """Return h(lambda) [1/s] and h'(lambda) [1] for rates lambda [1/s] of any shape."""
        given = np.asarray(rates, dtype=np.complex128)
        flat = given.ravel()
        value = np.empty(flat.shape, dtype=np.complex128)
        slope = np.empty(flat.shape, dtype=np.complex128)
        for start in range(0, len(flat), BLOCK):
            block = slice(start, start + BLOCK)
            value[block], slope[block] = self._evaluate(flat[block])
        return value.reshape(given.shape), slope.reshape(given.shape)

    def _evaluate(self, rates: Complexes) -> tuple[Complexes, Complexes]:
        echoes = np.exp(np.multiply.outer(-rates, self.delays))
        value: Complexes = rates - echoes @ self.strengths
        slope: Complexes = echoes @ (self.strengths * self.delays) + np.complex128(1.0)
        if self.pieces is not None:
            distributed, distributed_slope = self.pieces.transform(rates)
            value = value - distributed
            slope = slope - distributed_slope
        return value, slope

    def root_bound(self, real_part: float) -> float:
        """Return a radius [1/s] within which all roots with Re lambda >= `real_part` lie.

        For them |lambda| = |sum c exp(-lambda tau) + int p exp(-lambda t)|, and the right side is
        at most the same with absolute values at Re lambda = `real_part`. Integrated by parts
        the second term falls as 1 / |lambda|, which makes the far smaller bound at high
        frequencies.
        """
        discrete = float(np.abs(self.strengths) @ np.exp(-real_part * self.delays))
        if self.pieces is None:
            return discrete
        plain = discrete + self.pieces.absolute_transform(real_part)
        falling = self.pieces.variation_transform(real_part)
        return min(plain, 0.5 * (discrete + math.sqrt(discrete**2 + 4.0 * falling)))


def from_quasi_polynomial(rows: ArrayLike, cell: float = 1.0) -> DelaySystem:
    """Recover the delay system from a printed characteristic equation.

    The equation is lambda^(d+2) = sum_k exp(-k T lambda) sum_m rows[k, m] lambda^(d+1-m), with
    the polynomial pieces of degree d on cells of one width T. The coefficient of lambda^(d-m) in
    row k is the jump of the m-th derivative at t = k T, so that the pieces follow cell by cell,
    and all jumps after the last delay must cancel. Written like that the equation has a
    root of multiplicity d + 1 at 0 that the system does not have.

    Args:
        rows: Shape (cells + 1, d + 2), highest power of lambda first.
        cell: Width T of a cell [s].

    Raises:
        ShapeError: The rows have not the shape above.
        NotFiniteError: A number is NaN or infinite.
        DataError: The pieces do not close to zero after the last delay.
    """
    table = as_floats("rows", rows)
    if table.ndim != 2 or table.shape[0] < 2 or table.shape[1] < 2:
        raise ShapeError(f"rows must have shape (cells + 1, degree + 2), got {table.shape}")
    cells, degree = table.shape[0] - 1, table.shape[1] - 2
    scale = np.array([1.0 / math.factorial(m) for m in range(degree + 1)])
    shift = np.polynomial.Polynomial([cell, 1.0])
    # Taylor coefficients about the cell's left edge, lowest power first.
    taylor = np.zeros(degree + 1)
    centred = []
    for k in range(cells + 1):
        taylor = taylor + table[k, 1:] * scale
        centred.append(taylor)
        moved = np.polynomial.Polynomial(taylor)(shift).coef
        taylor = np.pad(moved, (0, degree + 1 - len(moved)))
    leftover = float(np.abs(centred.pop()).max())
    if leftover > 1e-9 * float(np.abs(table).max()):
        raise DataError(
            f"the printed polynomials do not end at the last delay: they leave {leftover:g} there"
        )
    half = np.polynomial.Polynomial([0.5 * cell, 0.5 * cell])
    series = [
        np.polynomial.legendre.poly2leg(np.polynomial.Polynomial(row)(half).coef)
        for row in centred
    ]
    coefficients = np.array([np.pad(row, (0, degree + 1 - len(row))) for row in series])
    pieces = PiecewisePolynomial(cell * np.arange(cells + 1), coefficients)
    acting = np.flatnonzero(table[:, 0])
    return DelaySystem(as_floats("delays", cell * acting), table[acting, 0], pieces)
