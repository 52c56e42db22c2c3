# SPDX-License-Identifier: Apache-2.0
"""What chapter 2 leaves to later work: the right-most roots, and the length of the interval."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from limit_surface_ros.decay.coefficients import fit_coefficients
from limit_surface_ros.decay.examples import example
from limit_surface_ros.plots.canvas import line_style, new_figure
from limit_surface_ros.thesis.decay_system import MAX_DELAY
from limit_surface_ros.thesis.findings import Claim, Findings, Study
from limit_surface_ros.thesis.more_functions import BASES, END, basis_roots

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from matplotlib.figure import Figure

    from limit_surface_ros.checks import Floats
    from limit_surface_ros.decay.basis import Complexes
    from limit_surface_ros.thesis.settings import Settings
    from limit_surface_ros.thesis.store import Store

ROOTS = 30
LEFT_OUT = (0, 1, 2, 3, 4, 6, 8)
ENDS = (1.5, 2.0, 3.0, 4.0, 6.0, 9.0, 12.0, 16.0)
# Samples to the second: errors are known to a few percent.
_DENSITY = 150


def rightmost(settings: Settings, store: Store) -> Findings:
    """What becomes of the fit of f1 when the slowest roots of a basis are left out."""
    errors = {
        basis: np.array([_errors(_without(basis, count), MAX_DELAY) for count in LEFT_OUT])
        for basis in BASES
    }
    slowest = {basis: -_without(basis, 0)[0].real for basis in BASES}
    after = {basis: float(rows[0, 1]) for basis, rows in errors.items()}
    order = sorted(BASES, key=lambda basis: slowest[basis])
    within = {basis: float(rows[0, 0]) for basis, rows in errors.items()}
    best = {basis: int(np.argmin(rows.max(axis=1))) for basis, rows in errors.items()}
    claims = (
        Claim(
            "The approach works well where the characteristic roots decay fast.",
            "Bases from the slowest root on, its rate, largest error up to 6 s and after: "
            + "; ".join(
                f"{basis[-1]} {slowest[basis]:.2f}/s, {within[basis]:.1e}, {after[basis]:.1e}"
                for basis in order
            )
            + ". Slow roots do no harm up to 6 s, and all of it after.",
            [after[basis] for basis in order] == sorted(after.values(), reverse=True),
        ),
        Claim(
            "The few right-most roots play a role of their own (left to later work).",
            "The larger of both errors is least with so many roots left out of basis 0 to 3: "
            + ", ".join(f"{LEFT_OUT[best[basis]]}" for basis in BASES)
            + "; there it is "
            + ", ".join(f"{errors[basis][best[basis]].max():.1e}" for basis in BASES)
            + ", with all roots "
            + ", ".join(f"{errors[basis][0].max():.1e}" for basis in BASES)
            + ".",
            any(best.values()),
        ),
    )
    return Findings(
        {"rightmost": _draw(LEFT_OUT, errors, "right-most roots left out")},
        {"rightmost": _table("left out", LEFT_OUT, errors)},
        claims,
        f"f1 on the first {ROOTS} roots of each basis, fitted on [0 s, 6 s] in the infinity norm.",
        captions={"rightmost": "Largest error within the interval and after it, up to 19 s"},
    )


def interval(settings: Settings, store: Store) -> Findings:
    """What becomes of the fit of f1 when the interval is shorter or longer."""
    errors = {
        basis: np.array([_errors(_without(basis, 0), end) for end in ENDS]) for basis in BASES
    }
    at_six = ENDS.index(MAX_DELAY)
    within, after = (
        {
            basis: f"{rows[at_six, column]:.1e} to {rows[-1, column]:.1e}"
            for basis, rows in errors.items()
        }
        for column in (0, 1)
    )
    change = max(float(rows[-1, 0] / rows[at_six, 0]) for rows in errors.values())
    claim = Claim(
        "The length of the interval plays a role (left to later work).",
        "From an end at 6 s to one at 16 s the largest error within goes, basis 0 to 3, from "
        + ", ".join(within.values())
        + ", and that after it from "
        + ", ".join(after.values())
        + ".",
        change > 1.5,
    )
    return Findings(
        {"interval": _draw(ENDS, errors, "end of the interval [s]")},
        {"interval": _table("end [s]", ENDS, errors)},
        (claim,),
        f"f1 on the first {ROOTS} roots of each basis, in the infinity norm. The delay stays 6 s.",
        captions={"interval": "Largest error within the interval and after it, up to 19 s"},
    )


def _without(basis: str, count: int) -> Complexes:
    """Return the first roots of a basis, the slowest first and `count` of those left out."""
    roots = basis_roots(basis, ROOTS)
    return roots[np.argsort(-roots.real, kind="stable")][count:]


def _errors(rates: Complexes, end: float) -> tuple[float, float]:
    """Fit f1 on [0, end], and return its largest errors there and after it."""
    response = example("f1")
    times = np.linspace(0.0, end, int(_DENSITY * end) + 1)
    fit = fit_coefficients(np.sort_complex(rates), times, response(times))
    later = np.linspace(end, END, 2000)
    return fit.max_error, float(np.abs(fit.sum(later) - response(later)).max())


def _table(
    heading: str, values: Sequence[float], errors: Mapping[str, Floats]
) -> dict[str, Sequence[float] | Floats]:
    table: dict[str, Sequence[float] | Floats] = {heading: values}
    for basis, rows in errors.items():
        table[f"{basis} within"], table[f"{basis} after"] = rows.T
    return table


def _draw(values: Sequence[float], errors: Mapping[str, Floats], label: str) -> Figure:
    with new_figure(7.0, 3.4) as figure:
        panels = figure.subplots(1, 2)
        for column, (axes, title) in enumerate(zip(panels, ("within", "after"), strict=True)):
            for index, (basis, rows) in enumerate(errors.items()):
                style = line_style(index) | {"marker": "os^D"[index], "markersize": 4}
                axes.semilogy(values, rows[:, column], label=basis, **style)
            axes.set(xlabel=label, title=title)
        panels[0].set_ylabel("largest error [-]")
        panels[0].legend()
    return figure


STUDIES = (
    Study("B.1", "The role of the right-most roots", rightmost),
    Study("B.2", "The role of the interval", interval),
)
