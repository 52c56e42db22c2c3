# SPDX-License-Identifier: Apache-2.0
"""Decay fits beside what a user would write or take instead, on the hockey stick's response.

The memory kernel by a dense matrix and the characteristic roots by Newton's method from even
seeds, as in the thesis; rates by the matrix pencil and by AAA, beside ESPRIT and our methods at
equal numbers of terms. All rates get their coefficients by the same fit in the infinity norm, so
that only they differ; undamped ones are damped as our own ESPRIT does it. AAA sees the generating
function of the samples on a circle, whose radius is the best of four.
"""

from __future__ import annotations

import sys
import time
import warnings
from collections.abc import Callable
from functools import partial

import numpy as np
import scipy.interpolate
from bench_decay import END, HORIZON, sampled_system, table
from interleaved import interleaved
from scipy import linalg

from limit_surface_ros.decay import examples
from limit_surface_ros.decay.delay.kernel import memory_kernel
from limit_surface_ros.decay.delay.roots import roots_in_box
from limit_surface_ros.decay.delay.system import DelaySystem
from limit_surface_ros.decay.esprit import damped
from limit_surface_ros.decay.fit import fit_decay
from limit_surface_ros.decay.rates import judged, take
from limit_surface_ros.decay.targets import Target

Method = Callable[[np.ndarray, float, int], np.ndarray]
SAMPLES = 1001
TERMS = (9, 15, 31)
# Where roots are looked for: real and imaginary parts.
BOX = (-6.0, 3.0), (0.0, 68.0)
SEEDS = 130
# Radii of the circle on which AAA sees the generating function of the samples.
RADII = (1.0, 1.005, 1.02, 1.1)


def dense_kernel(values: np.ndarray, step: float) -> np.ndarray:
    """Return the kernel by a matrix whose columns are convolutions with unit pulses."""
    count = len(values) - 1
    columns = [np.convolve(pulse, values[:-1])[:count] for pulse in np.eye(count)]
    return np.linalg.solve(np.array(columns).T, np.diff(values) / step) / step


def kernels() -> None:
    """Time and difference of the dense way."""
    rows = []
    for count in (500, 1000, 2000):
        times = np.linspace(0.0, END, count)
        values = examples.hockey_stick()(times)
        ways = {
            "ours": lambda t=times, x=values: memory_kernel(t, x),
            "dense": lambda t=times, x=values: dense_kernel(x, t[1]),
        }
        measured = interleaved(ways, rounds=3)
        ours, dense = memory_kernel(times, values).values, dense_kernel(values, times[1])
        off = np.abs(ours - dense).max() / np.abs(ours).max()
        rows.append(
            (
                count,
                f"{1e3 * measured['ours']:.2f}",
                f"{1e3 * measured['dense']:.0f}",
                f"{measured['dense'] / measured['ours']:.0f}",
                f"{off:.0e}",
            )
        )
    table(
        "Memory kernel by a dense matrix",
        ("samples", "ours [ms]", "dense [ms]", "ratio", "largest difference"),
        rows,
    )


def newton_from_a_grid(system: DelaySystem) -> np.ndarray:
    """Return the distinct roots in the box that Newton's method finds from even seeds."""
    roots = -0.5 + 1j * np.linspace(0.0, BOX[1][1], SEEDS)
    for _ in range(50):
        value, slope = system.characteristic_and_derivative(roots)
        roots = roots - value / slope
    value, slope = system.characteristic_and_derivative(roots)
    (left, right), (low, high) = BOX
    inside = (roots.real > left) & (roots.real < right)
    inside &= (roots.imag > low - 1e-9) & (roots.imag < high)
    sound = roots[inside & (np.abs(value) < 1e-9 * np.abs(slope))]
    return np.unique(np.round(sound, 6))


def roots() -> None:
    """How many roots Newton's method finds from even seeds."""
    rows = []
    for name, system in (("(2.4)", examples.thesis_system()), ("2000 samples", sampled_system())):
        ways = {
            "ours": lambda s=system: roots_in_box(s, *BOX),
            "newton": lambda s=system: newton_from_a_grid(s),
        }
        found = {way: len(call()) for way, call in ways.items()}
        times = interleaved(ways, rounds=3)
        rows.append(
            (name, *(f"{found[way]} in {1e3 * times[way]:.0f} ms" for way in ("ours", "newton")))
        )
    table(
        f"Roots with Im in [0, {BOX[1][1]:g}] by Newton's method from {SEEDS} even seeds",
        ("system", "ours, certified", "even seeds"),
        rows,
    )


def matrix_pencil(samples: np.ndarray, step: float, terms: int) -> np.ndarray:
    """Return rates of uniform samples (Hua and Sarkar 1990, doi:10.1109/29.56027)."""
    half = len(samples) // 2
    hankel = linalg.hankel(samples[: len(samples) - half], samples[len(samples) - half - 1 :])
    right = linalg.svd(hankel, full_matrices=False)[2][:terms]
    poles = linalg.eigvals(np.linalg.pinv(right[:, :-1].T) @ right[:, 1:].T)
    return rates_of_poles(poles, step)


def aaa(samples: np.ndarray, step: float, terms: int, radius: float) -> np.ndarray:
    """Return rates as poles of sum_k x_k z^-k, known on a circle.

    Nakatsukasa, Sete and Trefethen 2018, doi:10.1137/16M1106122.
    """
    count = 4 * len(samples)
    points = radius * np.exp(2j * np.pi * np.arange(count) / count)
    values = np.polynomial.polynomial.polyval(1.0 / points, samples)
    with warnings.catch_warnings():
        # It says that it was stopped at the number of terms asked for.
        warnings.simplefilter("ignore")
        rational = scipy.interpolate.AAA(points, values, rtol=1e-14, max_terms=terms + 1)
    return rates_of_poles(rational.poles(), step)


def rates_of_poles(poles: np.ndarray, step: float) -> np.ndarray:
    """Return log(pole) / step, one of each pair, slowest first."""
    # Poles of real samples are real or come in pairs, but for rounding.
    poles = np.where(np.abs(poles.imag) < 1e-9 * np.abs(poles), poles.real + 0.0j, poles)
    usable = (poles.imag > 0.0) | ((poles.imag == 0.0) & (poles.real > 0.0))
    rates = np.log(poles[usable]) / step
    return rates[np.argsort(-rates.real, kind="stable")]


def judge(method: Method, target: Target, terms: int) -> tuple[float, float]:
    """Return the error of a method's rates with refitted coefficients, and its time [s]."""
    times = np.linspace(0.0, HORIZON, SAMPLES)
    samples = target(times)
    begin = time.perf_counter()
    rates = take(damped(method(samples, times[1], terms), HORIZON), terms)
    if not len(rates):
        return np.inf, time.perf_counter() - begin
    return judged(rates, target, HORIZON, "peer").error, time.perf_counter() - begin


def rates_beside_peers() -> None:
    """Errors and times of all methods at equal numbers of terms."""
    target = examples.hockey_stick()
    peers: dict[str, list[Method]] = {"matrix pencil": [matrix_pencil]}
    if hasattr(scipy.interpolate, "AAA"):
        peers["AAA"] = [partial(aaa, radius=radius) for radius in RADII]
    else:
        print("AAA is left out: this scipy does not have it.\n")
    rows = []
    for name, methods in peers.items():
        cells = []
        for terms in TERMS:
            error, seconds = min(judge(method, target, terms) for method in methods)
            cells.append(f"{error:.2e} ({seconds:.2f} s)")
        rows.append((name, *cells))
    for method in ("esprit", "dde", "neutral", "best"):
        fits = [fit_decay(target, terms, HORIZON, method) for terms in TERMS]
        rows.append(
            (f"ours, {method}", *(f"{f.fit.max_error:.2e} ({f.seconds:.2f} s)" for f in fits))
        )
    table(
        "Hockey stick on [0, 19], rates by several methods: largest error (time)",
        ("method", *(f"{terms} terms" for terms in TERMS)),
        rows,
    )


def main() -> int:
    """Print the tables."""
    kernels()
    roots()
    rates_beside_peers()
    return 0


if __name__ == "__main__":
    sys.exit(main())
