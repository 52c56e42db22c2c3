# SPDX-License-Identifier: Apache-2.0
"""The bodies of chapter 3, in the thesis's own units: lengths and forces near one."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from limit_surface_ros.surface.kinds.point_contacts import PointContacts

if TYPE_CHECKING:
    from limit_surface_ros.checks import Floats

# Largest friction at each support point: mu N of the thesis's code.
FRICTION = 0.5
TRIANGLE = np.array([[-40.0, -40.0], [-40.0, 80.0], [80.0, -40.0]]) / 150.0
# The patches are cut into this many cells along a side.
CELLS = 20


def one_point() -> PointContacts:
    """Return a body on a single point beside the reference point."""
    return _equal_points(np.array([[1.0, 0.0]]), FRICTION)


def bar() -> PointContacts:
    """Return a rigid bar on its two ends."""
    return _equal_points(np.array([[-1.0, 0.0], [1.0, 0.0]]), 2 * FRICTION)


def three_points() -> PointContacts:
    """Return the right-angled triangle on its three corners."""
    return _equal_points(TRIANGLE, 3 * FRICTION)


def square_patch() -> PointContacts:
    """Return an evenly pressed square of side 2, in 400 cells."""
    x, y = np.meshgrid(*(_midpoints(2.0),) * 2)
    return _equal_points(np.column_stack([x.ravel(), y.ravel()]) - 1.0, 2 * FRICTION)


def triangle_patch() -> PointContacts:
    """Return the right-angled triangle with its whole face down, evenly pressed, in 400 cells."""
    corner, leg = TRIANGLE[0], TRIANGLE[2, 0] - TRIANGLE[0, 0]
    i, j = np.mgrid[:CELLS, :CELLS]
    # Each square of the grid holds two triangular cells; those beyond the long side fall away.
    lower = np.column_stack([(i + 1 / 3).ravel(), (j + 1 / 3).ravel()])
    upper = np.column_stack([(i + 2 / 3).ravel(), (j + 2 / 3).ravel()])
    cells = np.vstack([lower, upper]) / CELLS
    inside = cells[cells.sum(axis=1) < 1.0]
    return _equal_points(corner + leg * inside, 3 * FRICTION)


def ellipse_patch() -> PointContacts:
    """Return an evenly pressed ellipse with half axes 1 and 1/2, in 400 cells of one area."""
    rings = np.sqrt((np.arange(CELLS) + 0.5) / CELLS)
    angles = 2.0 * np.pi * (np.arange(CELLS) + 0.5) / CELLS
    x = np.outer(rings, np.cos(angles)).ravel()
    y = np.outer(rings, np.sin(angles)).ravel()
    return _equal_points(np.column_stack([x, 0.5 * y]), 2 * FRICTION)


def _equal_points(points: Floats, friction: float) -> PointContacts:
    return PointContacts(points, np.full(len(points), friction / len(points)))


def _midpoints(length: float) -> Floats:
    return np.asarray(length * (np.arange(CELLS) + 0.5) / CELLS)
