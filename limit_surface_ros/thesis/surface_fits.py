# SPDX-License-Identifier: Apache-2.0
"""Figures 3.6 to 3.8: fitted surfaces with the loads that they were fitted to."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from limit_surface_ros.plots.canvas import BLUE, VERMILION, new_figure
from limit_surface_ros.plots.surface_view import draw_section, draw_solid
from limit_surface_ros.thesis.findings import Claim, Findings, Study
from limit_surface_ros.thesis.fits import Fit, body_of, fitted, training_pairs

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from matplotlib.figure import Figure

    from limit_surface_ros.checks import Floats
    from limit_surface_ros.surface.base import LimitSurface
    from limit_surface_ros.thesis.findings import Table
    from limit_surface_ros.thesis.settings import Settings
    from limit_surface_ros.thesis.store import Store

TERMS = ("thesis1", "thesis2", "thesis3")
BEYOND = ("norms3", "norms4")
SHAPES = ("square", "whole_face", "ellipse")
SHAPE_NAMES = {"square": "square", "whole_face": "triangle", "ellipse": "ellipse"}
_COLOURS = {"J1": BLUE, "J2": VERMILION}


def radial_errors(surface: LimitSurface, loads: Floats) -> Floats:
    """Return how far loads of the exact surface lie off a fitted one along their rays.

    Returns:
        |load factor - 1|, shape (n,); 0.1: the fitted surface is 10 % too small or 11 % too big.
    """
    return np.asarray(np.abs(surface.load_factor(loads) - 1.0))


def three_points(settings: Settings, store: Store) -> Findings:
    """Figure 3.6: three points, one to three terms, J1 and J2."""
    grid, exact = _fits("three_points", store), body_of("three_points")
    loads = training_pairs("three_points", False, settings).wrenches
    facets = loads[settings.motions :]
    typical = {fit: float(np.mean(radial_errors(s, facets))) for fit, s in grid.items()}
    j1 = [typical[Fit("three_points", family, "J1")] for family in TERMS]
    j2 = [typical[Fit("three_points", family, "J2")] for family in TERMS]
    overall = {
        fit: float(np.sqrt(np.mean(radial_errors(s, loads) ** 2))) for fit, s in grid.items()
    }
    closer = [
        overall[Fit("three_points", family, "J1")] <= overall[Fit("three_points", family, "J2")]
        for family in TERMS
    ]
    claims = (
        Claim(
            "More terms follow the facets better; the ellipsoid cannot.",
            f"Mean distance of facet loads from the surface for 1, 2, 3 terms: J1 {_listed(j1)}, "
            f"J2 {_listed(j2)} of their size.",
            j1[0] > max(j1[1:]) and j2[0] > max(j2[1:]),
        ),
        Claim(
            "J1 meets the surface itself more closely than J2.",
            f"Root mean square distance of all loads for 1, 2, 3 terms: "
            f"J1 {_listed([overall[Fit('three_points', f, 'J1')] for f in TERMS])}, "
            f"J2 {_listed([overall[Fit('three_points', f, 'J2')] for f in TERMS])}.",
            all(closer),
        ),
    )
    pictures = {
        "thesis": _solids(grid, loads),
        "beyond": _sections("three_points", exact, store, loads),
    }
    return Findings(pictures, {"distances": _distance_table(grid, loads)}, claims)


def whole_face(settings: Settings, store: Store) -> Findings:
    """Figure 3.7: the whole face, one to three terms, J1 and J2."""
    grid, exact = _fits("whole_face", store), body_of("whole_face")
    loads = training_pairs("whole_face", False, settings).wrenches
    rms = {fit: float(np.sqrt(np.mean(radial_errors(s, loads) ** 2))) for fit, s in grid.items()}
    j1 = [rms[Fit("whole_face", family, "J1")] for family in TERMS]
    j2 = [rms[Fit("whole_face", family, "J2")] for family in TERMS]
    claim = Claim(
        "One term does not do well; with more terms, J1 and J2 both meet the data well.",
        f"Root mean square distance of the loads for 1, 2, 3 terms: J1 {_listed(j1)}, "
        f"J2 {_listed(j2)} of their size.",
        j1[0] > 1.5 * max(j1[1:]) and j2[0] > 1.2 * max(j2[1:]),
    )
    pictures = {
        "thesis": _solids(grid, loads),
        "beyond": _sections("whole_face", exact, store, loads),
    }
    return Findings(pictures, {"distances": _distance_table(grid, loads)}, (claim,))


def shapes(settings: Settings, store: Store) -> Findings:
    """Figure 3.8: square, triangle and ellipse with one to three terms."""
    tables: dict[str, Table] = {}
    rows: list[list[float]] = []
    with new_figure(7.5, 7.5) as figure:
        for row, body in enumerate(SHAPES):
            loads = training_pairs(body, False, settings).wrenches
            errors = []
            for column, family in enumerate(TERMS):
                fit = Fit(body, family, "J1")
                surface = fitted(fit, store)
                axes: Any = figure.add_subplot(3, 3, 3 * row + column + 1, projection="3d")
                draw_solid(axes, surface, loads, VERMILION, BLUE)
                axes.set_title(f"{SHAPE_NAMES[body]}, {fit.label}", y=0.98)
                errors.append(float(np.sqrt(np.mean(radial_errors(surface, loads) ** 2))))
            rows.append(errors)
    best = [
        [
            float(
                np.sqrt(np.mean(radial_errors(fitted(Fit(body, family, "J1"), store), loads) ** 2))
            )
            for family in BEYOND
        ]
        for body in SHAPES
        for loads in [training_pairs(body, False, settings).wrenches]
    ]
    tables["distances"] = {
        "shape": list(SHAPES),
        **{f"{family} J1": [row[k] for row in rows] for k, family in enumerate(TERMS)},
        **{f"{family} J1": [row[k] for row in best] for k, family in enumerate(BEYOND)},
    }
    claim = Claim(
        "For all three shapes the ellipsoid struggles and more terms do better.",
        "Root mean square distance for 1, 2, 3 terms: "
        + "; ".join(
            f"{SHAPE_NAMES[body]} {_listed(row)}" for body, row in zip(SHAPES, rows, strict=True)
        )
        + ". Sums of 3 and 4 norms: "
        + "; ".join(
            f"{SHAPE_NAMES[body]} {_listed(row)}" for body, row in zip(SHAPES, best, strict=True)
        )
        + ".",
        all(row[0] > max(row[1:]) for row in rows),
    )
    remarks = "Blue dots: exact loads. Red: the fitted surface."
    return Findings({"thesis": figure}, tables, (claim,), remarks)


def _fits(body: str, store: Store) -> dict[Fit, LimitSurface]:
    grid = [Fit(body, family, objective) for objective in ("J1", "J2") for family in TERMS]
    return {fit: fitted(fit, store) for fit in grid}


def _solids(grid: Mapping[Fit, LimitSurface], loads: Floats) -> Figure:
    """Draw one surface a panel, objectives in rows, numbers of terms in columns."""
    with new_figure(7.5, 5.2) as figure:
        for place, (fit, surface) in enumerate(grid.items()):
            axes: Any = figure.add_subplot(2, len(TERMS), place + 1, projection="3d")
            draw_solid(axes, surface, loads, _COLOURS[fit.objective])
            axes.set_title(fit.label, y=0.98)
    return figure


def _sections(body: str, exact: LimitSurface, store: Store, loads: Floats) -> Figure:
    """Draw sections of the exact surface, the best of the thesis and what goes beyond it."""
    compared = {"exact": exact}
    for family in ("thesis1", "thesis3", *BEYOND[:1]):
        fit = Fit(body, family, "J2")
        compared[fit.label] = fitted(fit, store)
    with new_figure(7.5, 3.0) as figure:
        panels = figure.subplots(1, 3)
        for axes, components in zip(panels, ((0, 1), (0, 2), (1, 2)), strict=True):
            draw_section(axes, compared, components)
        panels[0].legend(loc="center")
    return figure


def _distance_table(grid: Mapping[Fit, LimitSurface], loads: Floats) -> Table:
    return {fit.label: radial_errors(surface, loads) for fit, surface in grid.items()}


def _listed(values: Sequence[float]) -> str:
    return ", ".join(f"{value:.3f}" for value in values)


def _names(body: str, families: Sequence[str], objectives: Sequence[str]) -> tuple[str, ...]:
    return tuple(Fit(body, family, o).name for family in families for o in objectives)


_ALL = (*TERMS, "norms3")
STUDIES = (
    Study(
        "3.6",
        "Fitted surfaces, three points",
        three_points,
        _names("three_points", _ALL, ("J1", "J2")),
    ),
    Study(
        "3.7", "Fitted surfaces, whole face", whole_face, _names("whole_face", _ALL, ("J1", "J2"))
    ),
    Study(
        "3.8",
        "Fitted surfaces of square, triangle and ellipse",
        shapes,
        tuple(n for body in SHAPES for n in _names(body, (*TERMS, *BEYOND), ("J1",))),
    ),
)
