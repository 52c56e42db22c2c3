# SPDX-License-Identifier: Apache-2.0
"""A delay system in words: what `fit_decay --show-system` and the page of the thesis show."""

from __future__ import annotations

from typing import TYPE_CHECKING

from limit_surface_ros.decay.delay.system import quasi_polynomial

if TYPE_CHECKING:
    from collections.abc import Sequence

    from limit_surface_ros.checks import Floats
    from limit_surface_ros.decay.basis import Complexes
    from limit_surface_ros.decay.delay.system import DelaySystem


def system_in_words(system: DelaySystem, roots: Complexes) -> str:
    """Return impulses, pieces, characteristic equation and roots of a system, as lines.

    Args:
        system: The delay system.
        roots: Those of its roots that are the rates of the fit [1/s].
    """
    lines = ["", "impulses of the memory kernel (delta functions):"]
    lines += [
        f"  {strength:+.6g} 1/s at {delay:.6g} s"
        for delay, strength in zip(system.delays, system.strengths, strict=True)
    ] or ["  none"]
    if system.pieces is not None:
        lines += ["pieces, Legendre coefficients on each cell mapped to [-1, 1], constant first:"]
        lines += _rows(system.pieces.edges, system.pieces.coefficients)
        degree = system.pieces.degree
        powers = ", ".join([*(f"t^{power}" for power in range(degree, 0, -1)), "1"])
        lines += [f"pieces as polynomials in t, coefficients of {powers}:"]
        lines += _rows(system.pieces.edges, system.pieces.monomials())
    lines += ["characteristic equation:", *_equation(system)]
    lines += [f"the {len(roots)} roots that are rates (each complex one stands for a pair):"]
    lines += [f"  {root.real:+.8g} {root.imag:+.8g}i 1/s" for root in roots]
    return "\n".join(lines)


def _rows(edges: Floats, rows: Floats) -> list[str]:
    return [
        f"  [{left:.6g}, {right:.6g}) s: " + " ".join(f"{number:.6g}" for number in row)
        for left, right, row in zip(edges[:-1], edges[1:], rows, strict=True)
    ]


def _equation(system: DelaySystem) -> list[str]:
    delays, rows = quasi_polynomial(system)
    top = rows.shape[1]
    lines = [f"  l^{top} =" if top > 1 else "  l ="]
    for delay, row in zip(delays, rows, strict=True):
        wave = f"exp(-{delay:.6g} l) " if delay else ""
        lines.append(f"    + {wave}({_polynomial(row.tolist())})")
    return lines


def _polynomial(row: Sequence[float]) -> str:
    """Return a polynomial in l, highest power first."""
    parts = []
    for power, number in zip(range(len(row) - 1, -1, -1), row, strict=True):
        if number:
            name = {0: "", 1: " l"}.get(power, f" l^{power}")
            parts.append(f"{number:.6g}{name}")
    return " + ".join(parts).replace("+ -", "- ") or "0"
