# SPDX-License-Identifier: Apache-2.0
"""Figures 2.8 to 2.16: two more functions, and every function on every basis."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING

import numpy as np

from limit_surface_ros.decay.coefficients import fit_coefficients
from limit_surface_ros.decay.delay.construction import delay_system
from limit_surface_ros.decay.delay.roots import first_roots
from limit_surface_ros.decay.examples import example, simple_system, thesis_system
from limit_surface_ros.plots.canvas import BLUE, line_style, new_figure
from limit_surface_ros.thesis.decay_system import (
    MAX_DELAY,
    draw_pieces,
    draw_roots,
    kernel_of,
    pieces_table,
    root_table,
)
from limit_surface_ros.thesis.findings import Claim, Findings, Study

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from matplotlib.figure import Figure

    from limit_surface_ros.checks import Floats
    from limit_surface_ros.decay.basis import Complexes
    from limit_surface_ros.decay.exponential_sum import ExponentialSum
    from limit_surface_ros.thesis.settings import Settings
    from limit_surface_ros.thesis.store import Store

END = 19.0
BASES = ("basis 0", "basis 1", "basis 2", "basis 3")
FUNCTIONS = ("f1", "f2", "f3")
_UNKNOWN = (
    "The thesis does not print its second and third function; these two have as many impulses."
)


@cache
def basis_roots(basis: str, count: int) -> Complexes:
    """Return the first roots of a basis; basis 1 is the printed equation (2.4)."""
    if basis == "basis 0":
        return first_roots(simple_system(), count)
    if basis == "basis 1":
        return first_roots(thesis_system(), count)
    return first_roots(delay_system(example(f"f{basis[-1]}"), MAX_DELAY), count)


@cache
def fit_on(basis: str, function: str, end: float, roots: int, samples: int) -> ExponentialSum:
    """Return a function's best sum, in the infinity norm on [0, end], over a basis's roots."""
    times = np.unique(
        np.concatenate([np.linspace(0.0, MAX_DELAY, samples), np.linspace(0.0, end, samples)])
    )
    return fit_coefficients(basis_roots(basis, roots), times, example(function)(times)).sum


def functions(settings: Settings, store: Store) -> Findings:
    """Figure 2.8: the three functions."""
    times = np.linspace(0.0, 2.0, 401)
    values = {name: example(name)(times) for name in FUNCTIONS}
    with new_figure(6.5, 2.8) as figure:
        axes = figure.subplots()
        for index, (name, x) in enumerate(values.items()):
            axes.plot(times, x, label=f"$f_{name[1]}$", **line_style(index))
        axes.set(xlabel="t [s]", ylabel="x [-]")
        axes.legend()
    return Findings({"thesis": figure}, {"functions": {"t [s]": times, **values}}, (), _UNKNOWN)


def kernel_view(function: str, impulses: int) -> Callable[[Settings, Store], Findings]:
    """Return the study of Figure 2.9 or 2.10: the sampled kernel of f2 or f3."""

    def study(settings: Settings, store: Store) -> Findings:
        kernel = kernel_of(function, settings.samples)
        found = kernel.impulses
        with new_figure(6.5, 3.0) as figure:
            axes = figure.subplots()
            axes.plot(kernel.sampled.times, kernel.sampled.values, color=BLUE, linewidth=1)
            axes.set(xlabel="t [s]", ylabel="f [1/s²]")
        strengths = ", ".join(
            f"{strength:.4f} at {delay:.3f} s"
            for delay, strength in zip(found.delays, found.strengths, strict=True)
        )
        claim = Claim(
            f"The kernel of {function} has {impulses} impulses.",
            f"Found {len(found.delays)}: {strengths}.",
            len(found.delays) == impulses,
        )
        table = {"t [s]": kernel.sampled.times, "f [1/s^2]": kernel.sampled.values}
        return Findings({"thesis": figure}, {"kernel": table}, (claim,))

    return study


def pieces_view(function: str) -> Callable[[Settings, Store], Findings]:
    """Return the study of Figure 2.11 or 2.12: polynomials on half-unit cells."""

    def study(settings: Settings, store: Store) -> Findings:
        kernel = kernel_of(function, settings.samples)
        size = float(np.abs(kernel.exact(np.linspace(0.0, MAX_DELAY, 2001))).max())
        claim = Claim(
            "Polynomials of degree five meet the kernel between its impulses.",
            f"They miss the samples by at most {kernel.pieces.residual:.1e}; the kernel's largest "
            f"value is {size:.2f}.",
            kernel.pieces.residual < 1e-2 * size,
        )
        return Findings(
            {"thesis": draw_pieces(kernel)}, {"pieces": pieces_table(kernel)}, (claim,)
        )

    return study


def all_roots(settings: Settings, store: Store) -> Findings:
    """Figure 2.13: the roots of the bases."""
    rates = {basis: basis_roots(basis, settings.roots - 2) for basis in BASES}
    slowest = {basis: float(each.real.max()) for basis, each in rates.items()}
    claim = Claim(
        "Basis 3 has two roots that decay slowly.",
        "Slowest decay by basis: "
        + ", ".join(f"{basis[-1]}: {-rate:.3f}/s" for basis, rate in slowest.items())
        + ". Basis 0 is slower still.",
        slowest["basis 3"] > max(slowest["basis 1"], slowest["basis 2"]),
    )
    shown = {basis: rates[basis] for basis in BASES[1:]}
    return Findings(
        {"thesis": draw_roots(shown), "beyond": draw_roots(rates)},
        {basis.replace(" ", "_"): root_table(each) for basis, each in rates.items()},
        (claim,),
        _UNKNOWN,
    )


def on_every_basis(function: str) -> Callable[[Settings, Store], Findings]:
    """Return the study of Figure 2.14, 2.15 or 2.16: one function on all bases."""

    def study(settings: Settings, store: Store) -> Findings:
        count = settings.roots - 2
        times = np.linspace(0.0, END, 7601)
        response = example(function)(times)
        early = times <= MAX_DELAY
        errors, longer = (
            {
                basis: fit_on(basis, function, end, count, settings.samples)(times) - response
                for basis in BASES
            }
            for end in (MAX_DELAY, END)
        )
        within = {basis: float(np.abs(e[early]).max()) for basis, e in errors.items()}
        beyond = {basis: float(np.abs(e[~early]).max()) for basis, e in errors.items()}
        last = {basis: float(np.abs(e[times > END - 2.0]).max()) for basis, e in errors.items()}
        table = {
            "t [s]": times,
            "x [-]": response,
            **{f"error, {basis}, fitted to 6 s": e for basis, e in errors.items()},
            **{f"error, {basis}, fitted to 19 s": e for basis, e in longer.items()},
        }
        return Findings(
            {"thesis": _draw_errors(times, errors), "beyond": _draw_errors(times, longer)},
            {"errors": table},
            _claims(within, beyond, last),
            "Above: fitted on [0 s, 6 s] and projected to 19 s. Beyond: the same rates fitted on "
            "all of it, largest errors "
            + _by_basis({basis: float(np.abs(e).max()) for basis, e in longer.items()})
            + ".",
        )

    return study


def _claims(
    within: Mapping[str, float], beyond: Mapping[str, float], last: Mapping[str, float]
) -> tuple[Claim, ...]:
    others = [within[basis] for basis in BASES[:3]]
    return (
        Claim(
            "Basis 3 struggles; the other bases fit excellently up to 6 s.",
            f"Largest error up to 6 s, basis 0 to 3: {_by_basis(within)}. With this f3, the slow "
            "roots of basis 3 do not keep it from fitting.",
            within["basis 3"] > 2.0 * max(others) and max(others) < 1e-2,
            max(others) < 1e-2,
        ),
        Claim(
            "After 6 s basis 0 has a large response that decreases in the end, the others a "
            "smaller one.",
            f"Largest after 6 s, basis 0 to 3: {_by_basis(beyond)}; in the last 2 s: "
            f"{_by_basis(last)}.",
            all(beyond["basis 0"] > beyond[basis] for basis in BASES[1:])
            and last["basis 0"] < beyond["basis 0"],
        ),
    )


def _by_basis(values: Mapping[str, float]) -> str:
    return ", ".join(f"{value:.1e}" for value in values.values())


def _draw_errors(times: Floats, errors: Mapping[str, Floats]) -> Figure:
    """Draw the errors of all bases, those of the fit above those of the projection."""
    with new_figure(6.5, 4.8) as figure:
        whole, near = figure.subplots(2, 1)
        for index, (basis, error) in enumerate(errors.items()):
            style = {"color": line_style(index)["color"], "linewidth": 0.9, "label": basis}
            whole.plot(times, error, **style)
            near.plot(times, error, **style)
        whole.axvline(MAX_DELAY, color="black", linewidth=0.8, linestyle=":")
        whole.set(ylabel="error [-]", xlim=(0.0, END))
        whole.legend(ncols=4, loc="lower right", bbox_to_anchor=(1.0, 1.0))
        most = max(float(np.abs(error[times <= MAX_DELAY]).max()) for error in errors.values())
        near.set(
            xlabel="t [s]",
            ylabel="error [-]",
            xlim=(0.0, MAX_DELAY),
            ylim=(-1.1 * most, 1.1 * most),
        )
    return figure


STUDIES = (
    Study("2.8", "The three functions", functions),
    Study("2.9", "First view of the memory kernel of f2", kernel_view("f2", 4)),
    Study("2.10", "First view of the memory kernel of f3", kernel_view("f3", 3)),
    Study("2.11", "Polynomials for the kernel of f2", pieces_view("f2")),
    Study("2.12", "Polynomials for the kernel of f3", pieces_view("f3")),
    Study("2.13", "Roots of the three characteristic equations", all_roots),
    Study("2.14", "f1 on four bases", on_every_basis("f1")),
    Study("2.15", "f2 on four bases", on_every_basis("f2")),
    Study("2.16", "f3 on four bases", on_every_basis("f3")),
)
