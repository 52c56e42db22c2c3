# SPDX-License-Identifier: Apache-2.0
"""Piecewise polynomials on [0, T]: the distributed part of a memory kernel.

Each cell holds a Legendre series. Its transform is integrated by Gauss-Legendre quadrature, which
has no singularity at 0; the closed form in powers of 1 / lambda loses every digit there.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
from numpy.polynomial import legendre

from limit_surface_ros.checks import as_floats
from limit_surface_ros.errors import DataError, RangeError, ShapeError

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import ArrayLike

    from limit_surface_ros.checks import Floats
    from limit_surface_ros.decay.basis import Complexes


@dataclass(frozen=True, eq=False)
class PiecewisePolynomial:
    """A function of t that is a polynomial on each cell and zero outside of all.

    Attributes:
        edges: Shape (n + 1,), increasing [s]; cell i is [edges[i], edges[i + 1]).
        coefficients: Shape (n, degree + 1), Legendre coefficients on each cell mapped to [-1, 1],
            constant first.
        residual: Largest distance from the samples that the pieces were fitted to; 0 if exact.

    Raises:
        ShapeError: The arrays do not belong together.
        NotFiniteError: A number is NaN or infinite.
        RangeError: The edges start below 0 or do not increase.
    """

    edges: Floats
    coefficients: Floats
    residual: float = 0.0

    def __post_init__(self) -> None:
        """Check both arrays and that they belong together, and make them read-only."""
        edges = as_edges(self.edges)
        coefficients = as_floats("coefficients", self.coefficients).copy()
        if coefficients.ndim != 2 or coefficients.shape[1] == 0:
            raise ShapeError(
                f"coefficients must have shape (cells, degree + 1), got {coefficients.shape}"
            )
        if len(coefficients) != len(edges) - 1:
            raise ShapeError(
                f"{len(edges)} edges need {len(edges) - 1} rows of coefficients, "
                f"got {len(coefficients)}"
            )
        coefficients.setflags(write=False)
        object.__setattr__(self, "edges", edges)
        object.__setattr__(self, "coefficients", coefficients)

    @classmethod
    def from_samples(
        cls,
        times: ArrayLike,
        values: ArrayLike,
        edges: ArrayLike,
        degree: int,
        spread: float = 0.0,
    ) -> PiecewisePolynomial:
        """Fit each cell to the samples strictly inside it, in the 2-norm.

        Args:
            times: Shape (n,) [s].
            values: Shape (n,).
            edges: Shape (cells + 1,) [s], where the function may jump or have a kink.
            degree: Degree of each polynomial.
            spread: Samples closer than this to an edge [s] are left out: what happens at the
                edge is spread over them.

        Raises:
            ShapeError: An array has the wrong shape.
            NotFiniteError: A number is NaN or infinite.
            RangeError: The edges do not increase, or the degree is negative.
            DataError: A cell holds fewer samples than a polynomial has coefficients.
        """
        t, y = as_floats("times", times), as_floats("values", values)
        if t.ndim != 1 or t.shape != y.shape:
            raise ShapeError(
                f"times and values must have one shape (n,), got {t.shape}, {y.shape}"
            )
        bounds = as_edges(edges)
        _check_degree(degree)
        rows = []
        residual = 0.0
        for left, right in pairwise(bounds):
            # A sample on an edge belongs to neither side: the function may jump there.
            margin = 1e-9 * (right - left)
            reach = max(spread - margin, margin)
            inside = (t >= left + reach) & (t <= right - reach)
            if np.count_nonzero(inside) <= degree:
                raise DataError(
                    f"the cell from {left:g} s to {right:g} s holds {np.count_nonzero(inside)} "
                    f"samples; a polynomial of degree {degree} needs at least {degree + 1}"
                )
            v = (2.0 * t[inside] - left - right) / (right - left)
            row = legendre.legfit(v, y[inside], degree)
            residual = max(residual, float(np.abs(legendre.legval(v, row) - y[inside]).max()))
            rows.append(row)
        return cls(bounds, np.array(rows), residual)

    @classmethod
    def from_function(
        cls, function: Callable[[Floats], Floats], edges: ArrayLike, degree: int
    ) -> PiecewisePolynomial:
        """Project a function that is smooth inside each cell onto polynomials.

        Args:
            function: Takes times [s] of any shape.
            edges: Shape (cells + 1,) [s].
            degree: Degree of each polynomial.

        Raises:
            ShapeError: The edges are no list of numbers.
            NotFiniteError: A number is NaN or infinite.
            RangeError: The edges do not increase, or the degree is negative.
        """
        bounds = as_edges(edges)
        _check_degree(degree)
        nodes, weights = gauss_legendre(degree + 17)
        centres, halves = 0.5 * (bounds[1:] + bounds[:-1]), 0.5 * np.diff(bounds)
        values = as_floats("values", function(centres[:, None] + halves[:, None] * nodes))
        basis = legendre.legvander(nodes, degree)
        rows = (values * weights) @ basis * (np.arange(degree + 1) + 0.5)
        residual = float(np.abs(rows @ basis.T - values).max())
        return cls(bounds, rows, residual)

    @classmethod
    def from_monomials(cls, edges: ArrayLike, rows: ArrayLike) -> PiecewisePolynomial:
        """Take polynomials in t as they are printed, highest power first.

        Args:
            edges: Shape (cells + 1,) [s].
            rows: One list of coefficients for each cell, all of one length: those of
                t^d, ..., t, 1, with t from the origin and not from the cell's edge.

        Raises:
            ShapeError: The lists do not belong together.
            NotFiniteError: A number is NaN or infinite.
            RangeError: The edges do not increase.
        """
        bounds = as_edges(edges)
        table = as_floats("rows", rows)
        if table.ndim != 2 or len(table) != len(bounds) - 1:
            raise ShapeError(
                f"{len(bounds) - 1} cells need as many rows of one length, got {table.shape}"
            )
        halves, centres = 0.5 * np.diff(bounds), 0.5 * (bounds[1:] + bounds[:-1])
        converted = [
            legendre.poly2leg(np.polynomial.Polynomial(row[::-1])(line).coef)
            for row, line in (
                (row, np.polynomial.Polynomial([centre, half]))
                for row, centre, half in zip(table, centres, halves, strict=True)
            )
        ]
        width = table.shape[1]
        return cls(bounds, np.array([np.pad(row, (0, width - len(row))) for row in converted]))

    @property
    def degree(self) -> int:
        """Degree of the polynomials."""
        return int(self.coefficients.shape[1]) - 1

    def __call__(self, times: ArrayLike) -> Floats:
        """Return the function at times [s] of any shape; zero outside the cells."""
        t = as_floats("times", times)
        cell = np.clip(np.searchsorted(self.edges, t, side="right") - 1, 0, len(self.edges) - 2)
        left, right = self.edges[cell], self.edges[cell + 1]
        v = (2.0 * t - left - right) / (right - left)
        values = legendre.legval(v, self.coefficients[cell].transpose(-1, *range(t.ndim)), False)
        inside = (t >= self.edges[0]) & (t <= self.edges[-1])
        result: Floats = np.where(inside, values, 0.0)
        return result

    def transform(self, rates: Complexes) -> tuple[Complexes, Complexes]:
        """Return the integral of p(t) exp(-lambda t) and its derivative in lambda.

        Args:
            rates: Shape (n,), lambda [1/s].

        Returns:
            Two arrays of shape (n,).
        """
        halves = 0.5 * np.diff(self.edges)
        starts = self.edges[:-1]
        value: Complexes = np.zeros(len(rates), dtype=np.complex128)
        slope: Complexes = np.zeros(len(rates), dtype=np.complex128)
        # Cells of one width share the wave inside the cell.
        kinds = np.round(halves / halves.max(), 12)
        for kind in np.unique(kinds):
            cells = np.flatnonzero(kinds == kind)
            half = float(halves[cells[0]])
            reach = float(np.abs(rates).max()) * half
            # A wave exp(-z v) on [-1, 1] needs about 0.7 |z| nodes, and then each a new digit.
            nodes, weights = gauss_legendre(int(0.75 * reach + 0.5 * self.degree) + 18)
            # Counted from the cell's start: neither factor overflows where the product does not.
            ages = half * (1.0 + nodes)
            waves = np.exp(np.multiply.outer(-rates, ages))
            shifts = np.exp(np.multiply.outer(-rates, starts[cells]))
            samples = legendre.legval(nodes, self.coefficients[cells].T) * weights * half
            inner = waves @ samples.T
            moment = waves @ (samples * ages).T + inner * starts[cells]
            value += (inner * shifts).sum(axis=1)
            slope -= (moment * shifts).sum(axis=1)
        return value, slope

    def monomials(self) -> Floats:
        """Return the polynomials in t as they are printed, shape (cells, degree + 1).

        Highest power first, with t from the origin as in `from_monomials`; cells far from the
        origin cancel, so that printed digits are worth less there.
        """
        rows = np.zeros_like(self.coefficients)
        halves = 0.5 * np.diff(self.edges)
        centres = self.edges[:-1] + halves
        for row, series, centre, half in zip(
            rows, self.coefficients, centres.tolist(), halves.tolist(), strict=True
        ):
            line = np.polynomial.Polynomial([-centre / half, 1.0 / half])
            powers = np.polynomial.Polynomial(legendre.leg2poly(series))(line).coef
            row[self.degree + 1 - len(powers) :] = powers[::-1]
        return rows

    def jumps(self) -> Floats:
        """Return by how much each derivative jumps at each edge, shape (edges, degree + 1).

        Column m is the m-th derivative; the function is zero outside of the cells.
        """
        halves = 0.5 * np.diff(self.edges)
        jumps = np.zeros((len(self.edges), self.degree + 1))
        series = self.coefficients
        for order in range(self.degree + 1):
            ends = series.sum(axis=1)
            starts = series @ (-1.0) ** np.arange(series.shape[1])
            jumps[:, order] = np.append(starts, 0.0) - np.append(0.0, ends)
            if order < self.degree:
                series = legendre.legder(series, axis=1) / halves[:, np.newaxis]
        return jumps

    def absolute_transform(self, rate: float) -> float:
        """Return an upper bound on the integral of |p(t)| exp(-rate t), for a real rate."""
        halves = 0.5 * np.diff(self.edges)
        squares = (self.coefficients**2 / (np.arange(self.degree + 1) + 0.5)).sum(axis=1)
        # Cauchy-Schwarz on each cell, with the exponential's largest value there.
        sizes = halves * np.sqrt(2.0 * squares)
        largest = np.exp(np.maximum(-rate * self.edges[:-1], -rate * self.edges[1:]))
        return float(sizes @ largest)

    def variation_transform(self, rate: float) -> float:
        """Return an upper bound on |lambda| |transform(lambda)| for Re lambda = rate.

        Integration by parts: the jumps at the edges and the derivative inside the cells, each
        with its absolute value.
        """
        halves = 0.5 * np.diff(self.edges)
        ends = self.coefficients.sum(axis=1)
        starts = self.coefficients @ (-1.0) ** np.arange(self.degree + 1)
        jumps = np.abs(np.append(starts, 0.0) - np.append(0.0, ends))
        bound = float(jumps @ np.exp(-rate * self.edges))
        if self.degree:
            slopes = legendre.legder(self.coefficients, axis=1) / halves[:, np.newaxis]
            bound += PiecewisePolynomial(self.edges, slopes).absolute_transform(rate)
        return bound


@lru_cache(maxsize=256)
def gauss_legendre(count: int) -> tuple[Floats, Floats]:
    """Return nodes in [-1, 1] and weights of the Gauss-Legendre rule, each of shape (count,)."""
    nodes, weights = legendre.leggauss(count)
    return nodes, weights


def as_edges(edges: ArrayLike) -> Floats:
    """Return edges of cells as a read-only array.

    Raises:
        ShapeError: They are no list of at least two numbers.
        NotFiniteError: A number is NaN or infinite.
        RangeError: They start below 0 or do not increase.
    """
    array: Floats = as_floats("edges", edges).copy()
    if array.ndim != 1 or len(array) < 2:
        raise ShapeError(f"edges must have shape (cells + 1,), cells >= 1, got {array.shape}")
    if array[0] < 0.0 or not (np.diff(array) > 0.0).all():
        raise RangeError("edges must start at 0 or later and increase")
    array.setflags(write=False)
    return array


def _check_degree(degree: int) -> None:
    if degree < 0:
        raise RangeError(f"degree must be at least 0, got {degree}")
