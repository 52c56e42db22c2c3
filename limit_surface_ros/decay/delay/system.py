# SPDX-License-Identifier: Apache-2.0
"""Linear delay differential equations, retarded or neutral.

xdot(t) = sum_i d_i xdot(t - sigma_i) + sum_j c_j x(t - tau_j) + int p(tau) x(t - tau) dtau

Inserting x = exp(lambda t) gives the characteristic function h(lambda) =
lambda (1 - sum_i d_i exp(-lambda sigma_i)) - sum_j c_j exp(-lambda tau_j)
- int p(tau) exp(-lambda tau) dtau; its zeros, the characteristic roots, are the rates that
solutions can have. Without delayed derivatives (d = 0) the equation is retarded and has finitely
many roots to the right of any vertical line; chains of roots of a neutral one go up without end.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
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
        neutral_delays: Shape (l,), sigma_i > 0 [s], of delayed derivatives; none by default.
        neutral_strengths: Shape (l,), d_i, without a unit.

    Raises:
        ShapeError: Delays and strengths are not lists of one length.
        NotFiniteError: A number is NaN or infinite.
        RangeError: A delay is negative (of a derivative: not above 0), or there is no feedback.

    Example:
        >>> DelaySystem(delays=[6.0], strengths=[-0.1]).max_delay
        6.0
    """

    delays: Floats
    strengths: Floats
    pieces: PiecewisePolynomial | None = None
    neutral_delays: Floats = field(default_factory=lambda: np.zeros(0))
    neutral_strengths: Floats = field(default_factory=lambda: np.zeros(0))

    def __post_init__(self) -> None:
        """Check the delays and strengths and make them read-only."""
        for kind in ("", "neutral_"):
            delays = as_floats(f"{kind}delays", getattr(self, f"{kind}delays")).copy()
            strengths = as_floats(f"{kind}strengths", getattr(self, f"{kind}strengths")).copy()
            if delays.ndim != 1 or delays.shape != strengths.shape:
                raise ShapeError(
                    f"{kind}delays and {kind}strengths must have one shape (k,), "
                    f"got {delays.shape} and {strengths.shape}"
                )
            if (delays < 0.0).any():
                raise RangeError(f"{kind}delays must be at least 0, got {float(delays.min())}")
            delays.setflags(write=False)
            strengths.setflags(write=False)
            object.__setattr__(self, f"{kind}delays", delays)
            object.__setattr__(self, f"{kind}strengths", strengths)
        if (self.neutral_delays == 0.0).any():
            raise RangeError("neutral_delays must be above 0: a derivative cannot feed on itself")
        if not (self.strengths.any() or self.neutral_strengths.any()) and self.pieces is None:
            raise RangeError("a delay system needs a feedback: a strength or a polynomial")

    @property
    def max_delay(self) -> float:
        """Largest delay that acts, that is, whose strength is not 0 [s]."""
        acting = [
            self.delays[self.strengths != 0.0],
            self.neutral_delays[self.neutral_strengths != 0.0],
        ]
        if self.pieces is not None:
            acting.append(self.pieces.edges[1:][self.pieces.coefficients.any(axis=1)])
        return float(np.concatenate(acting).max(initial=0.0))

    def in_unit_of(self, unit: float) -> DelaySystem:
        """Return the same system with times counted in a unit of `unit` seconds.

        Its roots are these times the unit.
        """
        pieces = self.pieces
        if pieces is not None:
            pieces = PiecewisePolynomial(
                pieces.edges / unit, pieces.coefficients * unit**2, pieces.residual * unit**2
            )
        return DelaySystem(
            self.delays / unit,
            self.strengths * unit,
            pieces,
            self.neutral_delays / unit,
            self.neutral_strengths,
        )

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
        if len(self.neutral_delays):
            late = np.exp(np.multiply.outer(-rates, self.neutral_delays))
            share = late @ self.neutral_strengths
            value = value - rates * share
            slope = slope - share + rates * (late @ (self.neutral_strengths * self.neutral_delays))
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
        frequencies. A neutral system has such a radius only where sum |d| exp(-Re lambda sigma)
        is below 1, by whose distance from 1 the right side is divided; else it is infinite.
        """
        late = np.abs(self.neutral_strengths) @ np.exp(-real_part * self.neutral_delays)
        left = 1.0 - float(late)
        if left <= 0.0:
            return math.inf
        discrete = float(np.abs(self.strengths) @ np.exp(-real_part * self.delays)) / left
        if self.pieces is None:
            return discrete
        plain = discrete + self.pieces.absolute_transform(real_part) / left
        falling = self.pieces.variation_transform(real_part) / left
        return min(plain, 0.5 * (discrete + math.sqrt(discrete**2 + 4.0 * falling)))

    def magnitude(self, rates: Complexes) -> Floats:
        """Return the sum of the sizes of the terms of h, shape (n,), whose rounding it has."""
        size = np.abs(rates)
        size = size * (
            1.0
            + np.exp(np.multiply.outer(-rates.real, self.neutral_delays))
            @ np.abs(self.neutral_strengths)
        )
        size = size + np.exp(np.multiply.outer(-rates.real, self.delays)) @ np.abs(self.strengths)
        if self.pieces is not None:
            places, inverse = np.unique(np.round(rates.real, 2), return_inverse=True)
            parts = np.array([self.pieces.absolute_transform(place) for place in places.tolist()])
            size = size + parts[inverse]
        total: Floats = size
        return total


def quasi_polynomial(system: DelaySystem) -> tuple[Floats, Floats]:
    """Return the characteristic equation as it is printed, the inverse of `from_quasi_polynomial`.

    It is lambda^(d+2) = sum_k exp(-a_k lambda) sum_m rows[k, m] lambda^(d+1-m), with the degree d
    of the pieces; without pieces lambda = sum_k exp(-a_k lambda) rows[k, 0].

    Args:
        system: A retarded system.

    Returns:
        The delays a_k [s], shape (n,), increasing, and the rows, shape (n, d + 2); without
        pieces (n, 1).

    Raises:
        DataError: The system is neutral.
    """
    if len(system.neutral_delays):
        raise DataError("a neutral system has no equation of this form: its h has more terms")
    edges = np.zeros(0) if system.pieces is None else system.pieces.edges
    delays = np.unique(np.concatenate([system.delays, edges]))
    width = 1 if system.pieces is None else system.pieces.degree + 2
    rows = np.zeros((len(delays), width))
    np.add.at(rows[:, 0], np.searchsorted(delays, system.delays), system.strengths)
    if system.pieces is not None:
        rows[np.searchsorted(delays, edges), 1:] += system.pieces.jumps()
    return delays, rows


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
