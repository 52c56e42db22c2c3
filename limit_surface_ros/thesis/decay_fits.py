# SPDX-License-Identifier: Apache-2.0
"""Figures 2.5 to 2.7: the hockey stick as a sum of 9, 15 and 123 exponentials."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING

import numpy as np

from limit_surface_ros.decay.basis import count_terms, real_basis
from limit_surface_ros.decay.coefficients import fit_coefficients
from limit_surface_ros.decay.examples import example
from limit_surface_ros.decay.exponential_sum import ExponentialSum
from limit_surface_ros.decay.fit import fit_decay
from limit_surface_ros.decay.grids import largest_error
from limit_surface_ros.decay.rates import BERNSTEIN_RATE_CONSTANT
from limit_surface_ros.plots.canvas import BLUE, GREY, SKY, VERMILION, line_style, new_figure
from limit_surface_ros.thesis.decay_system import MAX_DELAY, root_table, roots_of
from limit_surface_ros.thesis.findings import Claim, Findings, Study

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from matplotlib.figure import Figure

    from limit_surface_ros.checks import Floats
    from limit_surface_ros.decay.basis import Complexes
    from limit_surface_ros.decay.coefficients import CoefficientFit
    from limit_surface_ros.decay.fit import DecayFit
    from limit_surface_ros.thesis.findings import Table
    from limit_surface_ros.thesis.settings import Settings
    from limit_surface_ros.thesis.store import Store

# Characteristic roots of the upper half plane in each figure: one real, the others pairs.
ROOTS = {"2.5": 5, "2.6": 8, "2.7": 62}
METHODS = ("dde", "neutral", "esprit", "best")
METHOD_LABELS = {
    "dde": "delay system, delay chosen",
    "neutral": "neutral equation",
    "esprit": "matrix pencil",
    "best": "best, rates moved",
}
# About the transition at 1 s [s].
KINK = 0.1
# Moving the rates of more terms takes minutes.
_MOST_MOVED = 31


@cache
def thesis_fit(roots: int, samples: int) -> CoefficientFit:
    """Return the fit of the hockey stick on the thesis's grid and the first roots of (2.4)."""
    times = np.linspace(0.0, MAX_DELAY, samples)
    return fit_coefficients(roots_of("printed", 62)[:roots], times, example("f1")(times))


@cache
def other_fit(method: str, terms: int) -> DecayFit:
    """Return the fit of the hockey stick by another choice of rates."""
    return fit_decay(example("f1"), terms, MAX_DELAY, method)


def few_terms(number: str) -> Callable[[Settings, Store], Findings]:
    """Return the study of Figure 2.5 or 2.6, and the best sum of as many terms beyond it."""

    def study(settings: Settings, store: Store) -> Findings:
        fit = thesis_fit(ROOTS[number], settings.samples)
        terms = fit.sum.terms
        best = other_fit("best", terms)
        times = np.linspace(0.0, MAX_DELAY, settings.samples)
        response = example("f1")(times)
        sums = {"roots of (2.4)": fit.sum(times), "best rates": best.fit.sum(times)}
        return Findings(
            {
                "thesis": draw_fit(times, response, {"approximation": fit.sum(times)}),
                "beyond": draw_fit(times, response, sums),
            },
            {
                "approximation": _fit_table(times, response, sums),
                "roots": root_table(fit.sum.rates),
            },
            (_count_claim(number, fit, settings),),
            f"{terms} real terms: largest error {fit.max_error:.4e} on the samples; with rates "
            f"that are moved, {best.fit.max_error:.3e} everywhere.",
        )

    return study


def many_terms(settings: Settings, store: Store) -> Findings:
    """Figure 2.7: 123 terms; beyond it, the error against the number of terms by method."""
    number = "2.7"
    fits = {name: thesis_fit(roots, settings.samples) for name, roots in ROOTS.items()}
    fit = fits[number]
    times = np.linspace(0.0, MAX_DELAY, settings.samples)
    response = example("f1")(times)
    errors = [each.max_error for each in fits.values()]
    everywhere = largest_error(fit.sum, example("f1"), 0.0, MAX_DELAY)
    error = response - fit.sum(times)
    near, far = _oscillation(times, error)
    squares = fit_coefficients(fit.sum.rates, times, response, "2")
    swings = _oscillation(times, response - squares.sum(times))
    quick = fit.sum.rates.imag > 0.5 * fit.sum.rates.imag.max()
    slow_part = ExponentialSum(fit.sum.rates[~quick], fit.sum.coefficients[~quick])
    without = np.abs(response - slow_part(times))
    kink = np.abs(times - 1.0) < KINK
    claims = (
        Claim(
            "The fit gets better as terms are added, and the error's oscillations get smaller.",
            f"Largest error with {', '.join(str(f.sum.terms) for f in fits.values())} terms: "
            f"{', '.join(f'{error:.4e}' for error in errors)}.",
            errors == sorted(errors, reverse=True),
        ),
        Claim(
            "With many terms the fit is excellent.",
            f"{fit.sum.terms} terms: {fit.max_error:.4e} on the {settings.samples} samples and "
            f"{everywhere:.2e} between them, next to the kink.",
            fit.max_error < 5e-3,
        ),
        Claim(
            "The errors oscillate with one amplitude, as the infinity norm makes them.",
            f"Largest error in the first half of the interval {near:.3e}, in the second "
            f"{far:.3e}.",
            bool(0.8 < near / far < 1.25),
        ),
        Claim(
            "With least squares the amplitude would vary with time.",
            f"The same rates by least squares: {swings[0]:.1e} in the first half, {swings[1]:.1e} "
            "in the second.",
            bool(swings[0] > 1.25 * swings[1] or swings[1] > 1.25 * swings[0]),
        ),
        Claim(
            "The terms of high frequency serve the sharp transition at 1 s.",
            f"Without the half of them that oscillates fastest the sum is off by up to "
            f"{without[kink].max():.1e} within {KINK:g} s of the transition and by a median of "
            f"{np.median(without[~kink & (times > KINK)]):.1e} elsewhere.",
            bool(without[kink].max() > 5.0 * np.median(without[~kink & (times > KINK)])),
        ),
        _conditions(settings),
    )
    comparison = _comparison(settings)
    return Findings(
        {
            "thesis": draw_fit(times, response, {"approximation": fit.sum(times)}),
            "beyond": _draw_comparison(comparison),
        },
        {
            "approximation": _fit_table(times, response, {"roots of (2.4)": fit.sum(times)}),
            "roots": root_table(fit.sum.rates),
            "methods": dict(comparison),
        },
        claims,
    )


def draw_fit(times: Floats, response: Floats, sums: Mapping[str, Floats]) -> Figure:
    """Draw a response with sums of exponentials, and below it their errors."""
    with new_figure(6.5, 4.6) as figure:
        above, below = figure.subplots(2, 1, sharex=True, height_ratios=(1.3, 1.0))
        above.plot(times, response, color=SKY, linewidth=4, label="response")
        colors = (VERMILION, BLUE)
        for (name, values), color in zip(sums.items(), colors, strict=False):
            error = values - response
            above.plot(times, values, color=color, linewidth=1, label=name)
            below.plot(times, error, color=color, linewidth=1)
            for sign in (1, -1):
                below.axhline(
                    sign * np.abs(error).max(), color=color, linewidth=0.6, dashes=(4, 4)
                )
        above.set_ylabel("x [-]")
        above.legend()
        below.set(xlabel="t [s]", ylabel="error [-]")
    return figure


def _count_claim(number: str, fit: CoefficientFit, settings: Settings) -> Claim:
    pairs = int(np.count_nonzero(fit.sum.rates.imag))
    real = len(fit.sum.rates) - pairs
    return Claim(
        f"The first {ROOTS[number]} roots are {ROOTS[number] - 1} pairs and one real root.",
        f"{pairs} pairs and {real} real; their best sum misses the response by "
        f"{fit.max_error:.4e} at most on the {settings.samples} samples (certified).",
        real == 1,
    )


def _conditions(settings: Settings) -> Claim:
    """Judge arbitrary rates beside characteristic roots, at as many terms."""
    times = np.linspace(0.0, MAX_DELAY, settings.samples)
    response = example("f1")(times)
    fit = thesis_fit(ROOTS["2.6"], settings.samples)
    even = np.linspace(-0.5, -0.5 * fit.sum.terms, fit.sum.terms).astype(complex)
    arbitrary = fit_coefficients(even, times, response)
    conditions = [
        float(np.linalg.cond(real_basis(rates, times))) for rates in (even, fit.sum.rates)
    ]
    return Claim(
        "Arbitrary rates can make ill-conditioned matrices or a poor fit; characteristic roots "
        "do not.",
        f"{fit.sum.terms} terms: real rates at equal steps of 0.5/s give a condition number of "
        f"{conditions[0]:.0e} and an error of {arbitrary.max_error:.1e}, the roots of (2.4) "
        f"{conditions[1]:.0e} and {fit.max_error:.1e}.",
        conditions[0] > 1e3 * conditions[1] or arbitrary.max_error > 2.0 * fit.max_error,
    )


def _comparison(settings: Settings) -> dict[str, list[float]]:
    """Return the largest error on [0, 6] by number of terms and method; NaN where not tried."""
    terms = list(settings.decay_terms)
    printed = roots_of("printed", 62)
    rows: dict[str, list[float]] = {"terms": [float(count) for count in terms]}
    rows["roots of (2.4)"] = [
        largest_error(
            thesis_fit(_roots_for(printed, n), settings.samples).sum, example("f1"), 0.0, MAX_DELAY
        )
        for n in terms
    ]
    for method in METHODS:
        rows[METHOD_LABELS[method]] = [
            float("nan")
            if method == "best" and n > _MOST_MOVED
            else other_fit(method, n).fit.max_error
            for n in terms
        ]
    rows["law 0.0446 J T / N, T = 6 s"] = [BERNSTEIN_RATE_CONSTANT * MAX_DELAY / n for n in terms]
    return rows


def _roots_for(rates: Complexes, terms: int) -> int:
    """Return how many of the first roots make at most this many terms."""
    return max(k for k in range(1, len(rates) + 1) if count_terms(rates[:k]) <= terms)


def _draw_comparison(rows: Mapping[str, list[float]]) -> Figure:
    terms = rows["terms"]
    with new_figure(6.5, 4.2) as figure:
        axes = figure.subplots()
        for index, (name, errors) in enumerate(list(rows.items())[1:]):
            style = line_style(index)
            if name.startswith("law"):
                style = {"color": GREY, "linestyle": "-", "linewidth": 1}
            else:
                style["marker"] = "os^Dv"[index]
            axes.loglog(terms, errors, markersize=4, label=name, **style)
        axes.set(xlabel="real terms", ylabel="largest error on [0 s, 6 s] [-]")
        axes.set_xticks(terms, labels=[f"{count:.0f}" for count in terms])
        axes.set_xticks([], minor=True)
        axes.legend()
    return figure


def _fit_table(times: Floats, response: Floats, sums: Mapping[str, Floats]) -> Table:
    return {"t [s]": times, "x [-]": response, **sums}


def _oscillation(times: Floats, error: Floats) -> tuple[float, float]:
    early = times <= 0.5 * MAX_DELAY
    return float(np.abs(error[early]).max()), float(np.abs(error[~early]).max())


STUDIES = (
    Study("2.5", "Sum of 4 pairs and 1 real exponential", few_terms("2.5")),
    Study("2.6", "Sum of 7 pairs and 1 real exponential", few_terms("2.6")),
    Study("2.7", "Sum of 61 pairs and 1 real exponential", many_terms),
)
