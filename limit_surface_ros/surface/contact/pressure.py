# SPDX-License-Identifier: Apache-2.0
"""Pressure distributions: how a body's weight spreads over its contact.

A distribution is any function of `Cells` that returns relative pressures, shape (n,); only their
ratios matter. Those here are the common ones.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from limit_surface_ros.checks import as_floats, as_positive
from limit_surface_ros.errors import GeometryError, ShapeError
from limit_surface_ros.surface.contact.shapes import Cells

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from limit_surface_ros.checks import Floats

Pressure: TypeAlias = "Callable[[Cells], Floats]"


def uniform(cells: Cells) -> Floats:
    """Return the same pressure everywhere."""
    return np.ones(len(cells.sizes))


def linear(centre_of_pressure: ArrayLike) -> Pressure:
    """Return a pressure that varies linearly so that its centre lies at the given point.

    This is how a rigid body that carries its weight off the middle presses on a stiff ground.

    Args:
        centre_of_pressure: Point [m] in the coordinates of the cells, shape (2,).

    Raises:
        ShapeError: The centre is no pair of numbers.
        GeometryError: From the distribution, when the centre lies so far out that part of the
            body would lift.
    """
    centre = as_floats("centre_of_pressure", centre_of_pressure)
    if centre.shape != (2,):
        raise ShapeError(f"centre_of_pressure must be two numbers, got shape {centre.shape}")

    def distribution(cells: Cells) -> Floats:
        arms = cells.points - cells.centroid
        weights = cells.sizes / cells.sizes.sum()
        moments = (weights * arms.T) @ arms
        # The pseudo-inverse serves lines, on which pressure varies in one direction only.
        slope = np.linalg.pinv(moments, hermitian=True) @ (centre - cells.centroid)
        pressures: Floats = 1.0 + arms @ slope
        reached = cells.centroid + moments @ slope
        off = not np.allclose(reached, centre, atol=1e-9 * np.abs(arms).max())
        if off or pressures.min() < 0.0:
            raise GeometryError(
                f"no linear pressure has its centre at {centre.tolist()}: the body would lift; "
                f"the shape's centroid is at {cells.centroid.tolist()}"
            )
        return pressures

    return distribution


def rim(power: float = 4.0) -> Pressure:
    """Return a pressure that grows towards the rim, as the distance from the centroid to a power.

    Raises:
        RangeError: The power is not above 0.
    """
    power = as_positive("power", power)
    return lambda cells: _relative_distance(cells) ** power


def centre_heavy(power: float = 2.0) -> Pressure:
    """Return a pressure that falls as 1 - d^power from the centroid to 0 at the rim.

    d is the distance from the centroid in parts of that of the shape's farthest point: a disc's
    whole rim, a rectangle's corners.

    Raises:
        RangeError: The power is not above 0.
    """
    power = as_positive("power", power)
    return lambda cells: 1.0 - _relative_distance(cells) ** power


def _relative_distance(cells: Cells) -> Floats:
    """Return the cells' distances from the centroid in parts of the shape's reach, at most 1."""
    distances = np.linalg.norm(cells.points - cells.centroid, axis=1)
    # A single cell is at its own centroid and has no reach.
    return np.asarray(np.minimum(distances / max(cells.reach, np.finfo(np.float64).tiny), 1.0))
