# SPDX-License-Identifier: Apache-2.0
"""Noisy records: a path of least-squares fits with free rates, and how many terms a record holds.

Each number of terms starts from the fits with fewer and one more real rate or pair, from ESPRIT on
three windows, and from a geometric grid; a few steps choose the three best, which are followed to
the end (`varpro`). Outliers are those that stand out from their neighbours (`outliers`). The
number of terms is that of the least BIC [1], in which a pair counts 6 and not 4 numbers: a
frequency that was searched for costs more than a parameter [2].

[1] G. Schwarz, Estimating the dimension of a model, Ann. Statist. 6, 461-464, 1978,
    doi 10.1214/aos/1176344136.
[2] P. M. Djuric, A model selection rule for sinusoids in white Gaussian noise, IEEE Trans. Signal
    Process. 44, 1744-1751, 1996, doi 10.1109/78.510621.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from scipy import fft, linalg

from limit_surface_ros.checks import counted
from limit_surface_ros.decay.basis import as_rates, count_terms, real_basis
from limit_surface_ros.decay.esprit import rates_of_subspace, signal_subspace
from limit_surface_ros.decay.outliers import (
    neighbour_weights,
    resting_median,
    stand_out,
    stray_start,
)
from limit_surface_ros.decay.rates import take
from limit_surface_ros.decay.varpro import FreeFit, Projection, Samples, VariableProjection
from limit_surface_ros.errors import SolverError

if TYPE_CHECKING:
    from collections.abc import Callable

    from limit_surface_ros.checks import Bools, Floats
    from limit_surface_ros.decay.basis import Complexes

# Real rates that are tried beside those of the fit before, from 0.4 / end to 1.5 / step.
DICTIONARY = 40
# Dampings that are tried for a pair at the peak of the residuals' spectrum.
DAMPINGS = 6
WINDOWS = (1.0, 1.0 / 3.0, 0.12)
# Most samples of a window that ESPRIT looks at; of more it takes means.
ESPRIT_SAMPLES = 801
FIRST_STEPS, LAST_STEPS, ROBUST_STEPS = 6, 40, 12
KEPT_STARTS = 3
ROBUST_ROUNDS = 3
# Residuals that exceed the noise by less than this factor are noise.
MORE_MISFIT = 1.3
# Numbers that a real rate, a pair and a constant count in BIC.
REAL_PENALTY, PAIR_PENALTY, OFFSET_PENALTY = 2, 6, 1
# What the logarithm of the number of frequencies up to a pair's counts in the sum of squares [2].
SEARCHED = 5.0
MOST_AUTOMATIC = 15
# The path ends when so many numbers of terms in a row brought no lower BIC.
PATIENCE = 4


@dataclass(frozen=True)
class Tried:
    """One number of terms that was tried.

    Attributes:
        terms: Number of real terms beside the constant.
        bic: The criterion by which numbers are compared.
        deviation: Root of the mean square of the residuals, in the unit of x.
    """

    terms: int
    bic: float
    deviation: float


@dataclass(frozen=True, eq=False)
class FreeRates:
    """The fit that was chosen and what it was chosen from.

    Attributes:
        fit: The rates with their coefficients.
        outliers: Shape (n,), the samples that count for nothing.
        weights: Shape (n,), roots of the weights of all samples.
        tried: All numbers of terms, in the order of the path.
    """

    fit: FreeFit
    outliers: Bools
    weights: Floats
    tried: tuple[Tried, ...]


def free_rates(
    samples: Samples,
    terms: int | None,
    robust: bool = True,
    progress: Callable[[str], None] | None = None,
) -> FreeRates:
    """Fit rates and coefficients to noisy samples.

    Args:
        samples: The samples; weights of all but outliers that are known are 1.
        terms: Number of real terms beside the constant; that of the least BIC if None.
        robust: Whether outliers are looked for.
        progress: Called with a line of text for each number of terms.

    Raises:
        SolverError: No number of terms could be fitted.
    """
    if robust:
        # Weights of residuals do not tell them from a steep start.
        level = resting_median(samples.values) if samples.offset else 0.0
        strays = stray_start(samples.times, samples.values - level, samples.noise)
        samples = replace(samples, weights=np.where(strays, 0.0, samples.weights))
    weights = samples.weights.copy()
    if robust:
        weights[stand_out(samples.values, samples.noise)] = 0.0
    search = _Path(replace(samples, weights=weights))
    most = terms or max(1, min(MOST_AUTOMATIC, len(samples.times) // 4))
    path: list[FreeFit] = []
    tried: list[Tried] = []
    best = 0
    for count in range(1, most + 1):
        fit = search.next_fit(path, count)
        if fit is None:
            break
        path.append(fit)
        tried.append(_judge(fit, search.problem.samples))
        if progress is not None:
            progress(f"{counted(count, 'term')}: deviation {tried[-1].deviation:.4g}")
        if tried[-1].bic < tried[best].bic:
            best = count - 1
        elif terms is None and count - 1 - best >= PATIENCE:
            break
    if not path or (terms is not None and len(path) < terms):
        raise SolverError(f"no fit with {terms} terms was found in these samples")
    fit = path[-1 if terms is not None else best]
    misfit = 1.0
    for _ in range(ROBUST_ROUNDS):
        before = (weights, misfit)
        if robust:
            weights = samples.weights * np.sqrt(neighbour_weights(fit.residuals, samples.noise))
        misfit = max(1.0, _judge(fit, replace(samples, weights=weights)).deviation / samples.noise)
        if (weights == before[0]).all() and misfit <= MORE_MISFIT * before[1]:
            break
        problem = VariableProjection(replace(samples, weights=weights, misfit=misfit))
        fit = problem.result(problem.improve(problem.project(fit.rates), ROBUST_STEPS))
    return FreeRates(fit, weights == 0.0, weights, tuple(tried))


def _judge(fit: FreeFit, samples: Samples) -> Tried:
    squares = float(((samples.weights * fit.residuals) ** 2).sum())
    count = int(np.count_nonzero(samples.weights))
    numbers = _numbers(fit.rates) + OFFSET_PENALTY * samples.offset
    # Residuals far below the noise tell nothing of the number of terms.
    mean = max(squares / count, (1e-3 * samples.noise) ** 2)
    return Tried(fit.terms, count * math.log(mean) + numbers * math.log(count), math.sqrt(mean))


def _numbers(rates: Complexes) -> int:
    """Return how many numbers the rates and their coefficients count as."""
    pairs = int(np.count_nonzero(rates.imag))
    return REAL_PENALTY * (len(rates) - pairs) + PAIR_PENALTY * pairs


class _Path:
    """Starts and searches for one number of terms after another."""

    def __init__(self, samples: Samples) -> None:
        self.problem = VariableProjection(samples)
        self._good = samples.weights > 0.0
        times, values = samples.times[self._good], samples.values[self._good]
        self._step = float(np.median(np.diff(times)))
        self._dictionary = -np.geomspace(0.4 / samples.end, 1.5 / self._step, DICTIONARY)
        # Without a constant, which ESPRIT would take for a slow rate.
        level = resting_median(values) if samples.offset else 0.0
        self._subspaces = [
            subspace
            for part in WINDOWS
            if (subspace := _window(times, values - level, part * samples.end)) is not None
        ]

    def next_fit(self, path: list[FreeFit], terms: int) -> FreeFit | None:
        """Return the best fit with this many terms, from the path so far and other starts."""
        points = []
        for rates in self._starts(path, terms):
            try:
                start = self.problem.project(self.problem.within_bounds(rates))
                points.append(self.problem.improve(start, FIRST_STEPS))
            except linalg.LinAlgError:
                continue
        points.sort(key=self._criterion)
        ends = []
        for point in points[:KEPT_STARTS]:
            try:
                ends.append(self.problem.improve(point, LAST_STEPS - FIRST_STEPS))
            except linalg.LinAlgError:
                ends.append(point)
        if not ends:
            return None
        return self.problem.result(min(ends, key=self._criterion))

    def _criterion(self, point: Projection) -> float:
        """Compare fits with as many terms: the noise is followed by the best of many frequencies.

        Among k independent ones the best lowers the sum of squares by 2 log k in the mean; finer
        frequencies and dampings, which are searched for too, let it exceed 3 log k now and then.
        """
        periods = point.rates.imag * self.problem.samples.end / (2.0 * np.pi)
        return point.cost + SEARCHED * float(np.log1p(periods).sum())

    def _starts(self, path: list[FreeFit], terms: int) -> list[Complexes]:
        starts: list[Complexes] = [self._with_real(path[-1] if path else None)]
        if terms >= 2:
            starts += self._with_pair(path[-2] if len(path) >= 2 else None)
        samples = self.problem.samples
        for subspace, step in self._subspaces:
            rates = take(rates_of_subspace(subspace, terms, step), terms)
            starts.append(self._filled(rates, terms))
        starts.append(as_rates(-np.geomspace(1.0, 200.0, terms) / samples.end))
        return starts

    def _filled(self, rates: Complexes, terms: int) -> Complexes:
        """Return rates with as many more real ones as are missing."""
        missing = terms - count_terms(rates) if len(rates) else terms
        samples = self.problem.samples
        more = -np.geomspace(1.0, 30.0, missing) / samples.end if missing else np.zeros(0)
        filled: Complexes = np.append(rates, more + 0.0j)
        return filled

    def _residual_rows(self, fit: FreeFit | None) -> tuple[Floats, Floats, Complexes]:
        """Return the weighted residuals of a fit, an orthonormal basis of it, and its rates."""
        samples = self.problem.samples
        rates = np.zeros(0, dtype=np.complex128) if fit is None else fit.rates
        residuals = samples.values if fit is None else fit.residuals
        columns = real_basis(rates, samples.times)
        if samples.offset:
            columns = np.column_stack([columns, np.ones(len(samples.times))])
        if columns.shape[1] == 0:
            return residuals * samples.weights, np.zeros((len(residuals), 0)), rates
        basis = linalg.qr(columns * samples.weights[:, np.newaxis], mode="economic")[0]
        rows = residuals * samples.weights
        return rows - basis @ (basis.T @ rows), basis, rates

    def _with_real(self, fit: FreeFit | None) -> Complexes:
        """Return a fit's rates with the real rate of the dictionary that explains most."""
        samples = self.problem.samples
        rows, basis, rates = self._residual_rows(fit)
        columns = np.exp(np.multiply.outer(samples.times, self._dictionary))
        columns *= samples.weights[:, np.newaxis]
        columns -= basis @ (basis.T @ columns)
        squares = (columns**2).sum(axis=0)
        gains = (columns.T @ rows) ** 2 / np.where(squares > 1e-8 * squares.max(), squares, np.inf)
        return as_rates(np.append(rates, self._dictionary[int(np.argmax(gains))] + 0.0j))

    def _with_pair(self, fit: FreeFit | None) -> list[Complexes]:
        """Return a fit's rates with a pair at the peak of the residuals' spectrum."""
        samples = self.problem.samples
        rows, basis, rates = self._residual_rows(fit)
        frequency = self._peak(rows)
        best, most = None, 0.0
        for decay in np.geomspace(0.5 / samples.end, max(frequency, 2.0 / samples.end), DAMPINGS):
            columns = real_basis(np.array([-decay + 1j * frequency]), samples.times)
            columns *= samples.weights[:, np.newaxis]
            columns -= basis @ (basis.T @ columns)
            span = linalg.qr(columns, mode="economic")[0]
            gain = float(((span.T @ rows) ** 2).sum())
            if gain > most:
                best, most = decay, gain
        if best is None:
            return []
        return [as_rates(np.append(rates, -best + 1j * frequency))]

    def _peak(self, rows: Floats) -> float:
        """Return the frequency [rad/s] of the highest peak of the residuals' spectrum."""
        samples = self.problem.samples
        # On the grid of the median step, with zeros in gaps, for records that are not uniform.
        places = np.round(samples.times / self._step).astype(np.intp)
        if places[-1] > 8 * len(places):
            places = np.round(samples.times * (8 * len(places) / samples.end)).astype(np.intp)
        signal = np.zeros(int(places[-1]) + 1)
        np.add.at(signal, places, rows * np.exp(-samples.times / samples.end))
        spectrum = np.abs(fft.rfft(signal, 4 * len(signal)))
        spectrum[0] = 0.0
        step = samples.end / max(len(signal) - 1, 1)
        return float(2.0 * np.pi * max(int(np.argmax(spectrum)), 1) / (4 * len(signal) * step))


def _window(times: Floats, values: Floats, length: float) -> tuple[Floats, float] | None:
    """Return the dominant subspace of the samples on [0, length], and their step [s]."""
    inside = times <= length
    count = int(np.count_nonzero(inside))
    if count < 8:
        return None
    even = np.linspace(0.0, float(times[inside][-1]), count)
    signal = np.interp(even, times[inside], values[inside])
    # Means of neighbours keep what a thinned record would lose against the noise.
    group = -(-count // ESPRIT_SAMPLES)
    whole = count // group * group
    signal = signal[:whole].reshape(-1, group).mean(axis=1)
    return signal_subspace(signal, min(len(signal) // 3, 40)), group * float(even[1])
