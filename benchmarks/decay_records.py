# SPDX-License-Identifier: Apache-2.0
"""Responses, noisy records of them, and the peer that noisy fits are held against."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from limit_surface_ros.decay.esprit import esprit
from limit_surface_ros.decay.rates import take
from limit_surface_ros.errors import LimitSurfaceError

Response = Callable[[np.ndarray], np.ndarray]
SUM5 = np.array([-0.4, -1.1, -3.0, -9.0, -25.0]), np.array([0.25, 0.3, 0.2, 0.15, 0.1])


def held(t: np.ndarray) -> np.ndarray:
    """8 N held for 3 s, then released within half a second."""
    return 8.0 * np.clip((3.5 - t) / 0.5, 0.0, 1.0)


RESPONSES: dict[str, tuple[Response, float]] = {
    "sum5": (lambda t: np.exp(np.multiply.outer(t, SUM5[0])) @ SUM5[1], 6.0),
    "exp(-t^0.3)": (lambda t: np.exp(-(t**0.3)), 6.0),
    "1/(1+t)^2": (lambda t: 1.0 / (1.0 + t) ** 2, 6.0),
    "exp*cos": (lambda t: np.exp(-0.7 * t) * np.cos(5.0 * t), 6.0),
    "two kinks": (lambda t: np.interp(t, [0.0, 1.0, 2.5, 9.0], [1.0, 0.5, 0.1, 0.0]), 6.0),
    "held": (held, 6.0),
    "held, cut": (held, 3.4),
}


@dataclass(frozen=True, eq=False)
class NoisyRecord:
    """Samples of a known response: times, values, the response itself and its interval."""

    name: str
    times: np.ndarray
    values: np.ndarray
    response: Response
    end: float

    def rms(self, x: Response) -> float:
        """Return the root mean square of x - response on [0, end]."""
        times = np.linspace(0.0, self.end, 6001)
        return float(np.sqrt(np.mean((x(times) - self.response(times)) ** 2)))


def noisy(name: str, samples: int, noise: float, outliers: float, seed: int) -> NoisyRecord:
    """Return a record with noise and a share of outliers, both in parts of the onset."""
    response, end = RESPONSES[name]
    times = np.linspace(0.0, end, samples)
    random = np.random.default_rng([seed, samples, int(1e4 * noise), len(name)])
    clean = response(times)
    values = clean + noise * abs(clean[0]) * random.normal(size=samples)
    count = round(outliers * samples)
    places = random.choice(np.arange(3, samples), count, replace=False)
    values[places] += (
        abs(clean[0]) * random.choice([-1.0, 1.0], count) * random.uniform(1, 5, count)
    )
    return NoisyRecord(name, times, values, response, end)


def _unpack(point: np.ndarray, pairs: int) -> np.ndarray:
    decays = -np.exp(point[: len(point) - pairs])
    rates = decays + 0.0j
    if pairs:
        rates[:pairs] += 1j * point[len(point) - pairs :]
    return rates


def _basis(rates: np.ndarray, times: np.ndarray) -> np.ndarray:
    waves = np.exp(np.multiply.outer(times, rates))
    return np.concatenate([waves.real, waves.imag[:, rates.imag > 0.0]], axis=1)


def varpro(times: np.ndarray, values: np.ndarray, terms: int, offset: float = 0.0) -> Response:
    """Return the peer's fit: free rates by scipy, coefficients solved inside.

    Log decays and frequencies by `least_squares` (trf, numerical Jacobian, at most 60
    evaluations), started from ESPRIT on two windows and from a geometric grid; the best is kept.
    """
    target, end = values - offset, times[-1]
    even = np.linspace(0.0, end, min(len(times), 1001))
    starts = [-np.geomspace(1.0, 200.0, terms) / end + 0.0j]
    for part in (1.0, 1.0 / 3.0):
        grid = even[even <= part * end]
        try:
            rates = take(esprit(np.interp(grid, times, target), grid[1], terms), terms)
        except LimitSurfaceError:
            continue
        if len(rates):
            starts.append(np.minimum(rates.real, -0.02 / end) + 1j * rates.imag)
    best, least = None, np.inf
    for start in starts:
        start = start[np.argsort(start.imag == 0.0, kind="stable")]
        pairs = int(np.count_nonzero(start.imag))

        def residuals(point: np.ndarray, pairs: int = pairs) -> np.ndarray:
            basis = _basis(_unpack(point, pairs), times)
            return basis @ np.linalg.lstsq(basis, target, rcond=1e-12)[0] - target

        point = np.concatenate([np.log(-start.real), start.imag[:pairs]])
        low = np.concatenate([np.full(len(start), np.log(1e-3 / end)), np.zeros(pairs)])
        high = np.concatenate(
            [np.full(len(start), np.log(3.0 / np.diff(times).min())), np.full(pairs, np.inf)]
        )
        point = np.clip(point, low + 1e-6, high - 1e-6)
        found = least_squares(residuals, point, bounds=(low, high), method="trf", max_nfev=60)
        if found.cost < least:
            rates = _unpack(found.x, pairs)
            basis = _basis(rates, times)
            coefficients = np.linalg.lstsq(basis, target, rcond=1e-12)[0]
            best, least = (rates, coefficients), found.cost
    assert best is not None
    return lambda t: _basis(best[0], t) @ best[1] + offset
