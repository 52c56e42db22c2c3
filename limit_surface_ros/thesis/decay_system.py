# SPDX-License-Identifier: Apache-2.0
"""Figures 2.1 to 2.4: the hockey stick, its memory kernel and its characteristic roots."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING

import numpy as np

from limit_surface_ros.decay.delay.closed_kernel import ClosedKernel
from limit_surface_ros.decay.delay.construction import delay_system
from limit_surface_ros.decay.delay.impulses import find_impulses
from limit_surface_ros.decay.delay.kernel import memory_kernel
from limit_surface_ros.decay.delay.pieces import PiecewisePolynomial
from limit_surface_ros.decay.delay.roots import first_roots
from limit_surface_ros.decay.delay.system import quasi_polynomial
from limit_surface_ros.decay.examples import (
    THESIS_EQUATION,
    example,
    printed_system,
    thesis_system,
)
from limit_surface_ros.decay.targets import PiecewiseLinear, uniform_times
from limit_surface_ros.plots.canvas import BLACK, BLUE, SKY, VERMILION, new_figure
from limit_surface_ros.thesis.findings import Claim, Findings, Study

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from limit_surface_ros.checks import Floats
    from limit_surface_ros.decay.basis import Complexes
    from limit_surface_ros.decay.delay.impulses import Impulses
    from limit_surface_ros.decay.delay.kernel import MemoryKernel
    from limit_surface_ros.thesis.findings import Table
    from limit_surface_ros.thesis.settings import Settings
    from limit_surface_ros.thesis.store import Store

MAX_DELAY = 6.0
DEGREE = 5
# The polynomials of (2.2) as they are printed, highest power first.
PRINTED = (
    (-0.0137, -0.0345, -0.0345, -0.0345, -0.03451, -0.9970),
    (0.0657, -0.2321, 0.6695, -0.6433, 0.1583, -0.7332),
    (-0.1230, 1.1803, -4.7502, 10.1286, -10.9627, 4.2296),
    (0.1091, -1.7157, 10.7465, -33.6881, 53.2784, -34.3779),
    (-0.0411, 0.9092, -7.9743, 34.6855, -74.7489, 63.7709),
    (0.0010, -0.0407, 0.5696, -3.8203, 12.4353, -15.8333),
)


@dataclass(frozen=True)
class Kernel:
    """The memory kernel of a named response on [0, 6], sampled, taken apart, and exact.

    Attributes:
        response: The response.
        sampled: Its kernel by the thesis's forward differences.
        impulses: What stands out of it.
        pieces: Polynomials of degree five for the rest.
        exact: The kernel in closed form.
    """

    response: PiecewiseLinear
    sampled: MemoryKernel
    impulses: Impulses
    pieces: PiecewisePolynomial
    exact: ClosedKernel


@cache
def kernel_of(name: str, samples: int) -> Kernel:
    """Return the kernel of one of the responses f1, f2, f3."""
    response = example(name)
    assert isinstance(response, PiecewiseLinear)
    times = uniform_times(MAX_DELAY, samples, response.breakpoints)
    sampled = memory_kernel(times, response(times), response.breakpoints)
    exact = ClosedKernel(response, MAX_DELAY)
    # The cells of the thesis: its breakpoints are multiples of this.
    cell = 1.0 if name == "f1" else 0.5
    edges = np.arange(0.0, MAX_DELAY + 0.5 * cell, cell)
    pieces = PiecewisePolynomial.from_samples(
        sampled.times, sampled.values, edges, DEGREE, spread=2.0 * sampled.step
    )
    return Kernel(response, sampled, find_impulses(sampled), pieces, exact)


@cache
def roots_of(basis: str, count: int) -> Complexes:
    """Return the first characteristic roots of a basis: "printed" is (2.4), others a response."""
    system = thesis_system() if basis == "printed" else delay_system(example(basis), MAX_DELAY)
    return first_roots(system, count)


def function(settings: Settings, store: Store) -> Findings:
    """Figure 2.1: the hockey stick function."""
    times = np.linspace(0.0, MAX_DELAY, 601)
    values = example("f1")(times)
    with new_figure(6.0, 2.8) as figure:
        axes = figure.subplots()
        axes.plot(times, values, color=BLUE)
        axes.set(xlabel="t [s]", ylabel="x [-]")
    return Findings({"thesis": figure}, {"response": {"t [s]": times, "x [-]": values}})


def first_view(settings: Settings, store: Store) -> Findings:
    """Figure 2.2: the kernel from two numbers of samples."""
    fine, coarse = (kernel_of("f1", n) for n in (settings.samples, settings.samples // 2))
    found = fine.impulses
    names = [f"{len(kernel.sampled.times) + 1} samples" for kernel in (fine, coarse)]
    whole = np.abs(fine.exact(np.linspace(0.0, MAX_DELAY, 2001))).max()
    late = np.abs(
        ClosedKernel(fine.response, 2.0 * MAX_DELAY)(np.linspace(MAX_DELAY, 2.0 * MAX_DELAY, 2001))
    ).max()
    claim = Claim(
        "The kernel has impulses at 0 and 1, both of unit size.",
        f"Found at {_listed(found.delays, 4)} s with strengths {_listed(found.strengths, 5)} "
        f"({names[0]}; the kink lies on the grid) and {_listed(coarse.impulses.strengths, 5)} "
        f"({names[1]}). Exact: -1 at 0 and +1 at 1 s, and nothing else.",
        len(found.delays) == 2 and bool(np.abs(np.abs(found.strengths) - 1.0).max() < 5e-3),
    )
    ignored = Claim(
        "What the kernel is after 6 s can be ignored.",
        f"It is {late:.0e}/s² there at most, and {whole:.1f}/s² before.",
        bool(late < 1e-3 * whole),
    )
    with new_figure(6.5, 4.6) as figure:
        above, below = figure.subplots(2, 1, sharex=True)
        for axes in (above, below):
            for kernel, color, name in zip((fine, coarse), (BLUE, VERMILION), names, strict=True):
                sampled = kernel.sampled
                axes.plot(sampled.times, sampled.values, color=color, linewidth=1, label=name)
            axes.set_ylabel("f [1/s²]")
        above.legend()
        below.set(xlabel="t [s]", ylim=(-3.2, 1.4), title="the same between the impulses")
    tables = {f"kernel_{len(k.sampled.times)}": _kernel_table(k.sampled) for k in (fine, coarse)}
    return Findings({"thesis": figure}, tables, (claim, ignored))


def polynomials(settings: Settings, store: Store) -> Findings:
    """Figure 2.3: polynomials of degree five on the unit cells."""
    kernel = kernel_of("f1", settings.samples)
    printed = PiecewisePolynomial.from_monomials(np.arange(7.0), PRINTED)
    off = _largest_by_cell(printed, kernel)
    claims = (
        Claim(
            "Between the impulses, polynomials of degree five on unit cells meet the kernel well.",
            f"They miss the samples by at most {kernel.pieces.residual:.1e}; the kernel itself "
            f"is {np.abs(kernel.exact(np.array([0.5])))[0]:.2f} at 0.5 s.",
            kernel.pieces.residual < 1e-3,
        ),
        Claim(
            "The printed coefficients (2.2) are those polynomials.",
            f"They miss the kernel by up to {_listed(off, 4)} on the six cells: that of the "
            "first cell is misprinted, and four decimals are too few far from 0.",
            bool(off.max() < 1e-2),
            bool(off.min() < 1e-2),
        ),
    )
    return Findings(
        {"thesis": draw_pieces(kernel)},
        {"pieces": pieces_table(kernel)},
        claims,
        listings={
            "The polynomials p1 to p6, coefficients of t^5 to 1": _coefficients(
                "p", kernel.pieces.monomials(), np.array(PRINTED)
            )
        },
    )


def roots(settings: Settings, store: Store) -> Findings:
    """Figure 2.4: the first roots of the printed equation (2.4)."""
    printed = roots_of("printed", settings.roots)
    accurate = roots_of("f1", settings.roots)
    late = printed[len(printed) // 2 :]
    spacing = np.diff(late.imag)
    real = printed.real[printed.imag == 0.0]
    _, rows = quasi_polynomial(printed_system())
    rounding = np.abs(rows - np.array(THESIS_EQUATION)).max(axis=1)
    claims = (
        Claim(
            "The imaginary parts of the large roots grow by nearly constant amounts, their real "
            "parts change slowly.",
            f"In the upper half of them the imaginary part grows by {spacing.mean():.4f} "
            f"(+- {spacing.std():.4f}) from root to root, the real part changes by "
            f"{np.abs(np.diff(late.real)).mean():.4f}.",
            bool(spacing.std() < 0.05 * spacing.mean()),
        ),
        Claim(
            "The equation has one real root.",
            f"Real roots among the first {len(printed)}: {_listed(real, 4)}. The accurate system "
            f"has {np.count_nonzero(accurate.imag == 0.0)} there: the real root and the slow "
            "pairs come from rounding the coefficients.",
            len(real) == 1,
        ),
        Claim(
            "Equation (2.4) is that of the polynomials (2.2).",
            "With the first polynomial as (2.4) implies it, the coefficients differ by up to "
            f"{_listed(rounding, 3)} in the rows of 1, exp(-λ), ..., exp(-6λ): (2.4) comes from "
            "polynomials of more digits, and the first one of (2.2) is misprinted.",
            bool(rounding.max() < 1e-3),
            bool(rounding.min() < 1e-3),
        ),
    )
    six = delay_system(example("f1"), MAX_DELAY, DEGREE)
    return Findings(
        {
            "thesis": draw_roots({"equation (2.4)": printed}),
            "beyond": draw_roots({"equation (2.4)": printed, "accurate kernel": accurate}),
        },
        {"printed": root_table(printed), "accurate": root_table(accurate)},
        claims,
        "All roots are certified: the argument principle counts as many as were found.",
        listings={
            "Equation (2.4), coefficients of λ^6 to 1": _coefficients(
                "exp(-{}λ)", quasi_polynomial(six)[1], np.array(THESIS_EQUATION)
            )
        },
    )


def draw_pieces(kernel: Kernel) -> Figure:
    """Draw the kernel between its impulses, and the polynomials over it."""
    times, pieces = kernel.sampled.times, kernel.pieces
    with new_figure(6.5, 3.2) as figure:
        axes = figure.subplots()
        exact = kernel.exact(times)
        axes.plot(times, exact, color=SKY, linewidth=5, label="kernel")
        for left, right in zip(pieces.edges[:-1], pieces.edges[1:], strict=True):
            inside = np.linspace(left, right, 60, endpoint=False)
            axes.plot(inside, _values(pieces, inside), ":", color=VERMILION, linewidth=2)
        axes.plot([], [], ":", color=VERMILION, label="polynomials of degree 5")
        axes.set(xlabel="t [s]", ylabel="f [1/s²]")
        axes.legend()
    return figure


def draw_roots(groups: dict[str, Complexes]) -> Figure:
    """Draw characteristic roots of the upper half plane."""
    markers = "o^sD"
    colors = (BLUE, VERMILION, BLACK, SKY)
    with new_figure(6.0, 4.2) as figure:
        axes = figure.subplots()
        for (name, rates), marker, color in zip(groups.items(), markers, colors, strict=False):
            axes.plot(
                rates.real,
                rates.imag,
                marker,
                color=color,
                markersize=4,
                fillstyle="none",
                label=name,
            )
        axes.set(xlabel="Re λ [1/s]", ylabel="Im λ [1/s]")
        axes.legend()
    return figure


def pieces_table(kernel: Kernel) -> Table:
    """Return the kernel's samples between the impulses, exact and by polynomials."""
    times = kernel.sampled.times
    return {
        "t [s]": times,
        "sampled [1/s^2]": kernel.sampled.values,
        "polynomials [1/s^2]": _values(kernel.pieces, times),
        "exact without impulses [1/s^2]": kernel.exact(times),
    }


def root_table(rates: Complexes) -> Table:
    """Return rates as a table."""
    return {"re [1/s]": rates.real, "im [1/s]": rates.imag}


def _kernel_table(kernel: MemoryKernel) -> Table:
    return {"t [s]": kernel.times, "f [1/s^2]": kernel.values}


def _coefficients(name: str, ours: Floats, printed: Floats) -> str:
    """Return the rows of two tables of numbers, one below the other."""
    lines = []
    for place, pair in enumerate(zip(ours, printed, strict=True)):
        row = name.format(place) if "{" in name else f"{name}{place + 1}"
        for which, numbers in zip(("here", "printed"), pair, strict=True):
            lines.append(
                f"{row:<9} {which:<8}" + "".join(f"{number:>10.4f}" for number in numbers)
            )
            row = ""
    return "\n".join(lines)


def _values(pieces: PiecewisePolynomial, times: Floats) -> Floats:
    """Return the values of piecewise polynomials, 0 outside of their cells."""
    edges = pieces.edges
    cell = np.clip(np.searchsorted(edges, times, side="right") - 1, 0, len(edges) - 2)
    v = (2.0 * times - edges[cell] - edges[cell + 1]) / (edges[cell + 1] - edges[cell])
    legendre = np.polynomial.legendre.legvander(v, pieces.degree)
    return np.asarray((legendre * pieces.coefficients[cell]).sum(axis=1))


def _largest_by_cell(pieces: PiecewisePolynomial, kernel: Kernel) -> Floats:
    """Return the largest distance from the exact kernel in each cell."""
    inside = np.linspace(0.02, 0.98, 97)
    return np.array(
        [
            np.abs(_values(pieces, times) - kernel.exact(times)).max()
            for left, right in zip(pieces.edges[:-1], pieces.edges[1:], strict=True)
            for times in [left + (right - left) * inside]
        ]
    )


def _listed(values: Floats, digits: int) -> str:
    return ", ".join(f"{value:.{digits}f}" for value in values)


STUDIES = (
    Study("2.1", "The hockey stick function", function),
    Study("2.2", "First view of its memory kernel", first_view),
    Study("2.3", "Polynomials between the impulses", polynomials),
    Study("2.4", "Roots of the characteristic equation", roots),
)
