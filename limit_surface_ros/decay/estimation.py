# SPDX-License-Identifier: Apache-2.0
"""Coefficients re-estimated while samples of a response come in; the rates stay as they are.

Fixed rates make a decay model linear in its coefficients, so that recursive least squares
corrects it at a cost per sample that never grows. The estimate minimises

    sum_k forgetting^(n - k) (y_k - x(t_k))^2 / noise^2  +  (w - w0)' P0^-1 (w - w0)

over the weights w of `real_basis`; the second term ties it to the model that was fitted offline
(w0) and is never forgotten. The usual recursion lets the covariance grow without end once the
terms have died away ("wind-up"); here it never exceeds P0. The triangular root of the information
matrix is carried by orthogonal transformations (G. J. Bierman, Factorization Methods for Discrete
Sequential Estimation, 1977), which keeps it definite whatever the samples are.

This module imports numpy only, so that a node may load it at start-up.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from limit_surface_ros.checks import as_floats, as_positive
from limit_surface_ros.decay.basis import real_basis
from limit_surface_ros.decay.exponential_sum import ExponentialSum
from limit_surface_ros.errors import RangeError

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from limit_surface_ros.checks import Floats


@dataclass(frozen=True)
class EstimationOptions:
    """How far samples are trusted over the model.

    Attributes:
        noise: Standard deviation of a sample, in the unit of x.
        forgetting: Weight of a sample relative to the one after it, in (0, 1].
        amplitude_spread: Standard deviation of a factor on the whole model.
        shape_spread: Standard deviation of the departure from the model's shape, as a fraction
            of its largest value.
        gate: A sample further than so many standard deviations from its prediction is an outlier.
        change_after: So many outliers in a row are a change of the response: what was learnt
            is dropped and the samples count again.

    Raises:
        RangeError: A number is outside its range.
    """

    noise: float
    forgetting: float = 0.999
    amplitude_spread: float = 0.5
    shape_spread: float = 0.1
    gate: float = 5.0
    change_after: int = 10

    def __post_init__(self) -> None:
        """Check the ranges."""
        for name in ("noise", "amplitude_spread", "shape_spread", "gate"):
            as_positive(name, getattr(self, name))
        if not 0.0 < self.forgetting <= 1.0:
            raise RangeError(f"forgetting must be above 0 and at most 1, got {self.forgetting}")
        if self.change_after < 1:
            raise RangeError(f"change_after must be at least 1, got {self.change_after}")


class CoefficientEstimator:
    """The corrected model of one response, and how sure it is; its memory does not grow.

    Args:
        model: The model that was fitted offline; its rates are kept.
        options: How far samples are trusted.

    Attributes:
        x: The corrected model; the given one until a sample is accepted.
        accepted: Number of samples that count in it.
        outliers: Number of samples that were refused for being too far from their prediction.
        residual: Last sample minus its prediction, in the unit of x; NaN before the first.

    Raises:
        RangeError: The model is zero everywhere.

    Example:
        >>> model = ExponentialSum([-1.0], [1.0])
        >>> estimator = CoefficientEstimator(model, EstimationOptions(noise=0.01))
        >>> for time in (0.0, 0.1, 0.2):
        ...     _ = estimator.add(time, 1.2 * float(model(time)))
        >>> round(float(estimator.x(0.0)), 3)
        1.2
    """

    def __init__(self, model: ExponentialSum, options: EstimationOptions) -> None:
        """Start at the model."""
        self.x = model
        self.accepted = 0
        self.outliers = 0
        self.residual = math.nan
        self._model = model
        self._options = options
        self._prior_root = _information_root(model, options)
        self._last_time = -math.inf
        self._outliers_in_a_row = 0
        self._forget_all()

    def add(self, time: float, value: float) -> bool:
        """Correct the model by a sample.

        Args:
            time: Time after the onset [s], later than that of the sample before.
            value: The response, in the unit of x.

        Returns:
            False if the sample is an outlier, which counts for nothing.

        Raises:
            NotFiniteError: A number is NaN or infinite.
            RangeError: The time is before the onset or not after that of the sample before.
        """
        t = float(as_floats("time of a sample", time))
        y = float(as_floats("value of a sample", value))
        if t < 0.0:
            raise RangeError(f"a sample's time must be at least 0, got {t:g} s before the onset")
        if not t > self._last_time:
            raise RangeError(
                f"samples must come in the order of time: got {t:g} s after {self._last_time:g} s"
            )
        self._last_time = t
        row = real_basis(self._model.rates, np.array([t]))[0]
        self.residual = y - float(row @ self.x.weights)
        if self._is_outlier(row):
            self.outliers += 1
            self._outliers_in_a_row += 1
            if self._outliers_in_a_row >= self._options.change_after:
                self._forget_all()
            return False
        self._outliers_in_a_row = 0
        self._learn(row, y - float(row @ self._model.weights))
        self.accepted += 1
        return True

    def spread(self, times: ArrayLike) -> Floats:
        """Return the standard deviation of the corrected model at given times.

        Args:
            times: Shape (n,) [s].

        Returns:
            Shape (n,), in the unit of x.
        """
        rows = real_basis(self._model.rates, as_floats("times", times))
        deviations: Floats = np.sqrt((np.linalg.solve(self._root.T, rows.T) ** 2).sum(axis=0))
        return deviations

    def _forget_all(self) -> None:
        self._root = self._prior_root
        self._departure = np.zeros(len(self._root))
        self._outliers_in_a_row = 0

    def _is_outlier(self, row: Floats) -> bool:
        doubt = np.linalg.solve(self._root.T, row)
        expected = math.sqrt(self._options.noise**2 + float(doubt @ doubt))
        return not abs(self.residual) <= self._options.gate * expected

    def _learn(self, row: Floats, departure: float) -> None:
        """Fold in one equation row . (w - w0) = departure and solve for w."""
        kept = self._options.forgetting
        size = len(row)
        rows = np.zeros((2 * size + 1, size + 1))
        rows[:size, :size] = math.sqrt(kept) * self._root
        rows[:size, size] = math.sqrt(kept) * self._departure
        # What is forgotten of the samples is not forgotten of the prior.
        rows[size:-1, :size] = math.sqrt(1.0 - kept) * self._prior_root
        rows[-1, :size] = row / self._options.noise
        rows[-1, size] = departure / self._options.noise
        triangle = _triangular(rows)
        self._root, self._departure = triangle[:size, :size], triangle[:size, size]
        change = np.linalg.solve(self._root, self._departure)
        self.x = ExponentialSum.from_weights(self._model.rates, self._model.weights + change)


def _information_root(model: ExponentialSum, options: EstimationOptions) -> Floats:
    """Return the upper triangular R, shape (terms, terms), with R'R = P0^-1.

    P0 holds a common factor on all weights and, for each weight alone, as much as changes x by
    `shape_spread` of its largest value when all of them do.
    """
    weights = model.weights
    reach = 5.0 / abs(model.slowest_rate) if model.slowest_rate else 1.0
    peak = float(np.abs(model(np.linspace(0.0, reach, 512))).max())
    if not peak > 0.0:
        raise RangeError("a decay model that is zero has no size to judge its corrections by")
    alone = options.shape_spread * peak / math.sqrt(len(weights))
    together = options.amplitude_spread * weights
    # (alone^2 I + together together')^-1 as a sum of squares, by Sherman and Morrison.
    size2 = float(together @ together)
    direction = together / math.sqrt(size2)
    along = alone / math.hypot(alone, math.sqrt(size2))
    root = (np.eye(len(weights)) - (1.0 - along) * np.outer(direction, direction)) / alone
    return _triangular(root)


def _triangular(rows: Floats) -> Floats:
    """Return the upper triangular R with R'R = rows' rows."""
    # The stubs of numpy give every mode the result of the one that returns Q as well.
    triangle: Floats = np.linalg.qr(rows, mode="r")  # type: ignore[assignment]
    return triangle
