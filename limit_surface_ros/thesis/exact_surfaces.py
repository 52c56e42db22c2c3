# SPDX-License-Identifier: Apache-2.0
"""Figures 3.1 to 3.5: the exact limit surfaces of simple bodies, and the two sliders."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from limit_surface_ros.plots.canvas import BLACK, BLUE, GREY, SKY, VERMILION, new_figure
from limit_surface_ros.plots.surface_view import draw_solid, style_solid
from limit_surface_ros.surface.sampling import facet_loads, random_motions
from limit_surface_ros.thesis import bodies
from limit_surface_ros.thesis.findings import Claim, Findings, Study

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from limit_surface_ros.checks import Floats
    from limit_surface_ros.surface.kinds.point_contacts import PointContacts
    from limit_surface_ros.surface.pairs import Pairs
    from limit_surface_ros.thesis.findings import Table
    from limit_surface_ros.thesis.settings import Settings
    from limit_surface_ros.thesis.store import Store

# How far inside a supporting plane a load may seem to lie by rounding.
_ON_PLANE = 1e-12
# Mean distance from the centre of a square of side 2: what its moment about the centre must be.
_SQUARE_MOMENT = (np.sqrt(2.0) + np.log(1.0 + np.sqrt(2.0))) / 3.0


def one_point(settings: Settings, store: Store) -> Findings:
    """Figure 3.1: the loads of a single contact lie on a curve."""
    angle = np.linspace(0.0, 2.0 * np.pi, 361)
    body = bodies.one_point()
    loads = body.wrench_of_twist(np.column_stack([np.cos(angle), np.sin(angle), 0.0 * angle]))
    others = random_motions(body, settings.motions, settings.seed).wrenches
    moment = others[:, 2] - others[:, 1]
    size = np.hypot(others[:, 0], others[:, 1])
    with new_figure(5.0, 4.2) as figure:
        axes: Any = figure.add_subplot(projection="3d")
        axes.plot(*loads.T, color=BLUE)
        style_solid(axes, np.abs(loads).max(axis=0))
    claim = Claim(
        "A single contact has a limit curve instead of a surface.",
        f"All {len(others)} loads lie on the curve |force| = {bodies.FRICTION}, moment = 1 m "
        f"times f_y, to {np.abs([moment, size - bodies.FRICTION]).max():.1e}.",
        bool(np.abs([moment, size - bodies.FRICTION]).max() < _ON_PLANE),
    )
    return Findings({"thesis": figure}, {"curve": load_table(loads)}, (claim, _moment(settings)))


def _moment(settings: Settings) -> Claim:
    """Judge the moment of (3.1): loads must resist each motion at least as others do."""
    body = bodies.three_points()
    pairs = random_motions(body, min(settings.motions, 400), settings.seed)
    # The points' forces: friction against the motion of each.
    x, y = body.points.T
    vx = pairs.twists[:, :1] - pairs.twists[:, 2:] * y
    vy = pairs.twists[:, 1:2] + pairs.twists[:, 2:] * x
    forces = body.friction_limits / np.hypot(vx, vy) * np.stack([vx, vy])
    wrong = pairs.wrenches.copy()
    wrong[:, 2] = (x * forces[0] - y * forces[1]).sum(axis=1)
    shares = []
    for loads in (wrong, pairs.wrenches):
        powers = pairs.twists @ loads.T
        own = np.diagonal(powers)
        shares.append(100.0 * float(np.mean(powers.max(axis=1) > own + 1e-9)))
    return Claim(
        "The moment of the loads is the sum of x fx - y fy, equation (3.1).",
        f"With it {shares[0]:.0f} % of {len(pairs)} motions of the triangle would be resisted "
        "more by the load of another motion, against maximum dissipation; with x fy - y fx "
        f"{shares[1]:.0f} %. The printed Matlab code has it right.",
        shares[0] == 0.0,
    )


def bar_layout(settings: Settings, store: Store) -> Findings:
    """Figure 3.2: a rigid bar on its two ends."""
    body = bodies.bar()
    with new_figure(6.0, 2.2) as figure:
        axes = figure.subplots()
        axes.plot(*body.points.T, color=GREY, linewidth=8, solid_capstyle="round", zorder=1)
        _draw_points(axes, body)
        axes.set(ylim=(-0.5, 0.5), xlim=(-1.4, 1.4))
    return Findings({"thesis": figure}, {"points": _point_table(body)})


def bar_surface(settings: Settings, store: Store) -> Findings:
    """Figure 3.3: the limit surface of the bar, with its facets."""
    body = bodies.bar()
    motions = random_motions(body, settings.motions, settings.seed)
    facets = facet_loads(body, settings.per_facet, settings.seed)
    on_plane = _largest_excess(facets, motions)
    flat = _facet_count(facets, settings.per_facet)
    count = len(body.points)
    with new_figure(6.0, 5.0) as figure:
        axes: Any = figure.add_subplot(projection="3d")
        draw_solid(axes, None, motions.wrenches, dot_color=BLUE)
        _draw_facet_rims(axes, body)
    claim = Claim(
        "The surface has two flat facets for each contact point, four for the bar.",
        f"{flat} facets, each with one twist. The loads of {len(motions)} other motions stay "
        f"behind their planes, the nearest by {-on_plane:.0e}.",
        flat == 2 * count and on_plane < _ON_PLANE,
    )
    tables = {"motions": _pair_table(motions), "facets": _pair_table(facets)}
    return Findings({"thesis": figure}, tables, (claim,), "Red: the rims of the facets.")


def square_surface(settings: Settings, store: Store) -> Findings:
    """Figure 3.4: the limit surface of a square patch."""
    body = bodies.square_patch()
    motions = random_motions(body, settings.motions, settings.seed)
    friction = float(body.friction_limits.sum())
    moment = float(body.wrench_of_twist([0.0, 0.0, 1.0])[2])
    expected = friction * float(_SQUARE_MOMENT)
    with new_figure(6.0, 5.0) as figure:
        axes: Any = figure.add_subplot(projection="3d")
        draw_solid(axes, None, motions.wrenches, dot_color=BLUE)
    across = 2.0 * float(body.friction_limits.max()) / (2.0 * friction)
    claim = Claim(
        "With a continuous patch the facets vanish.",
        f"In {len(body.points)} cells each facet is {100 * across:.2f} % as wide as the surface. "
        f"The largest moment is {moment:.5f}; in closed form it is {expected:.5f}.",
        across < 0.01 and abs(moment / expected - 1.0) < 1e-2,
    )
    return Findings({"thesis": figure}, {"motions": _pair_table(motions)}, (claim,))


def sliders(settings: Settings, store: Store) -> Findings:
    """Figure 3.5: the triangle on three points and with its whole face down."""
    on_points, on_face = bodies.three_points(), bodies.triangle_patch()
    outline = np.vstack([bodies.TRIANGLE, bodies.TRIANGLE[:1]])
    with new_figure(6.5, 3.2) as figure:
        panels = figure.subplots(1, 2, sharey=True)
        for axes, title in zip(panels, ("three points", "whole face"), strict=True):
            axes.plot(*outline.T, color=BLACK, linewidth=1)
            axes.set_title(title)
        panels[1].fill(*outline.T, color=SKY, alpha=0.4)
        _draw_points(panels[0], on_points)
        _draw_points(panels[1], on_face, size=2)
    tables = {"three_points": _point_table(on_points), "whole_face": _point_table(on_face)}
    centre = np.abs([body.points.mean(axis=0) for body in (on_points, on_face)]).max()
    claim = Claim(
        "The reference point of both sliders is the centroid of the triangle.",
        f"The means of the points lie within {centre:.1e} of it.",
        bool(centre < 1e-2),
    )
    return Findings({"thesis": figure}, tables, (claim,))


def load_table(loads: Floats) -> Table:
    """Return wrenches as a table."""
    return dict(zip(("fx [N]", "fy [N]", "tau_z [N m]"), loads.T, strict=True))


def _pair_table(pairs: Pairs) -> Table:
    headings = ("vx [m/s]", "vy [m/s]", "omega_z [rad/s]")
    return {**load_table(pairs.wrenches), **dict(zip(headings, pairs.twists.T, strict=True))}


def _point_table(body: PointContacts) -> Table:
    x, y = body.points.T
    return {"x [m]": x, "y [m]": y, "friction limit [N]": body.friction_limits}


def _largest_excess(facets: Pairs, others: Pairs) -> float:
    """How far a load of other motions lies beyond a facet's plane; negative: none does."""
    twists = np.unique(facets.twists, axis=0)
    planes = [
        (facets.wrenches[(facets.twists == twist).all(axis=1)] @ twist).min() for twist in twists
    ]
    return float((others.wrenches @ twists.T - planes).max())


def _facet_count(facets: Pairs, per_facet: int) -> int:
    """Count the groups of loads that span a plane and no more."""
    count = 0
    for group in np.split(facets.wrenches, len(facets) // per_facet):
        extents = np.linalg.svd(group - group.mean(axis=0), compute_uv=False)
        count += bool(extents[2] < 1e-9 * extents[0] and extents[1] > 1e-3 * extents[0])
    return count


def _draw_facet_rims(axes: Axes, body: PointContacts) -> None:
    """Draw the rim of each facet: the point at rest gives all its friction, all around."""
    angle = np.linspace(0.0, 2.0 * np.pi, 181)
    for (x, y), limit in zip(body.points, body.friction_limits, strict=True):
        fx, fy = limit * np.cos(angle), limit * np.sin(angle)
        for sense in (1.0, -1.0):
            sliding = body.wrench_of_twist([sense * y, -sense * x, sense])
            rim = sliding + np.column_stack([fx, fy, x * fy - y * fx])
            axes.plot(*rim.T, color=VERMILION, zorder=3)


def _draw_points(axes: Axes, body: PointContacts, size: float = 7.0) -> None:
    axes.plot(*body.points.T, "o", color=VERMILION, markersize=size, label="contact")
    axes.plot(0.0, 0.0, "+", color=BLACK, markersize=9, label="reference point")
    axes.set(xlabel="x [m]", ylabel="y [m]")
    axes.set_aspect("equal")
    axes.legend(loc="upper right")


STUDIES = (
    Study("3.1", "Limit curve of a single contact", one_point),
    Study("3.2", "A rigid bar on its two ends", bar_layout),
    Study("3.3", "Limit surface of the bar", bar_surface),
    Study("3.4", "Limit surface of a square patch", square_surface),
    Study("3.5", "The two sliders", sliders),
)
