# SPDX-License-Identifier: Apache-2.0
"""Quasi-static pushing with one point of contact: how a pushed body moves, and if it sticks.

A pusher touches the body at a point and moves with a given velocity. Its force lies in the
friction cone at the contact, its wrench on the limit surface, and the body moves along the
outward normal there. See K. M. Lynch and M. T. Mason, "Stable pushing", IJRR 1996,
doi:10.1177/027836499601500602, and J. Zhou, M. T. Mason, R. Paolini and D. Bagnell, IJRR 2018,
doi:10.1177/0278364917698747.

All angles are measured from the inward normal. The angle of the velocity that a force causes at
the contact never falls as the force turns to the left, and lies within 90 deg of the force's:
one comparison with the pusher's angle at each edge of the friction cone tells the mode, whatever
the friction. `push` answers one question in plain floats, through the surface's maps for one
vector, `pushes` many at once by `push_batch`.
"""

from __future__ import annotations

from math import hypot
from typing import TYPE_CHECKING

import numpy as np

from limit_surface_ros.errors import ShapeError
from limit_surface_ros.motion.outcomes import MODES, ContactMode, MotionCone, Push, Pushes
from limit_surface_ros.motion.push_batch import Contacts, PushBatch
from limit_surface_ros.motion.push_checks import as_complex, friction_edges, pairs, unit_normals
from limit_surface_ros.motion.push_roots import SEPARATE
from limit_surface_ros.motion.push_scalar import ContactScalar, pair, product

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from limit_surface_ros.surface.base import LimitSurface

__all__ = ["MODES", "ContactMode", "MotionCone", "Push", "Pushes", "motion_cone", "push", "pushes"]


def motion_cone(
    surface: LimitSurface, point: ArrayLike, normal: ArrayLike, friction: float
) -> MotionCone:
    """Return the twists and contact velocities that bound what a pusher can cause.

    Args:
        surface: Limit surface of the body.
        point: Contact point about the reference point [m], shape (2,).
        normal: Normal of the contact, pointing into the body, of any length, shape (2,).
        friction: Coefficient of friction between pusher and body, from 0 to infinity.

    Raises:
        ShapeError: The point or the normal is no pair of numbers.
        ZeroVectorError: The normal is zero.
        RangeError: The coefficient is negative or NaN.
    """
    contact = ContactScalar(surface, point, normal, friction)
    edges = contact.edge(-1.0), contact.edge(1.0)
    return MotionCone(
        np.array([contact.wrench(edge.force, edge.twist) for edge in edges]),
        np.array([edge.twist for edge in edges]),
        np.array([edge.velocity for edge in edges]),
    )


def push(
    surface: LimitSurface,
    point: ArrayLike,
    normal: ArrayLike,
    friction: float,
    velocity: ArrayLike,
) -> Push:
    """Return how a body moves whose contact point is pushed with a velocity.

    With infinite friction a pusher slips only where sticking would need it to pull.

    Args:
        surface: Limit surface of the body; it should be convex.
        point: Contact point about the reference point [m], shape (2,).
        normal: Normal of the contact, pointing into the body, of any length, shape (2,).
        friction: Coefficient of friction between pusher and body, from 0 to infinity.
        velocity: Of the pusher [m/s], shape (2,).

    Raises:
        ShapeError: The point, the normal or the velocity is no pair of numbers.
        NotFiniteError: A number is NaN or infinite.
        ZeroVectorError: The normal is zero.
        RangeError: The coefficient is negative or NaN.

    Example:
        >>> import numpy as np
        >>> from limit_surface_ros.surface.kinds.power_sum import PowerSum
        >>> body = PowerSum.thesis([np.eye(3)])
        >>> push(body, [-0.5, 0.0], [1.0, 0.0], 0.3, [0.1, 0.0]).mode.value
        'stick'
    """
    contact = ContactScalar(surface, point, normal, friction)
    pushed = pair("velocity", velocity)
    approach = product(pushed, contact.normal)
    if approach <= 0.0:
        return Push(np.zeros(3), ContactMode.SEPARATE, np.zeros(3))
    # The velocity's size is taken out, so that nothing overflows or vanishes on the way.
    speed = hypot(*pushed)
    found = contact.push((pushed[0] / speed, pushed[1] / speed))
    return Push(speed * found.twist, found.mode, found.wrench)


def pushes(
    surface: LimitSurface,
    points: ArrayLike,
    normals: ArrayLike,
    friction: ArrayLike,
    velocities: ArrayLike,
) -> Pushes:
    """Return how a body moves under each of n pushes: `push` for many, in far less time.

    Args:
        surface: Limit surface of the body; it should be convex.
        points: Contact points about the reference point [m], shape (n, 2).
        normals: Normals of the contacts, pointing into the body, of any length, shape (n, 2).
        friction: Coefficients of friction between pusher and body, from 0 to infinity, one for
            all or shape (n,).
        velocities: Of the pusher [m/s], shape (n, 2).

    Raises:
        ShapeError: An array has another shape.
        NotFiniteError: A number other than a coefficient of friction is NaN or infinite.
        ZeroVectorError: A normal is zero.
        RangeError: A coefficient is negative or NaN.

    Example:
        >>> import numpy as np
        >>> from limit_surface_ros.surface.kinds.power_sum import PowerSum
        >>> body = PowerSum.thesis([np.eye(3)])
        >>> pushes(body, [[-0.5, 0.0]], [[1.0, 0.0]], 0.3, [[0.1, 0.0]]).modes
        array([0])
    """
    place, normal, moved = (
        pairs(name, values)
        for name, values in (("points", points), ("normals", normals), ("velocities", velocities))
    )
    if not len(place) == len(normal) == len(moved):
        raise ShapeError(
            "points, normals and velocities must be as many, "
            f"got {len(place)}, {len(normal)} and {len(moved)}"
        )
    inward, moving = as_complex(unit_normals(normal)), as_complex(moved)
    edges = friction_edges(friction, len(place))
    twists, wrenches = np.zeros((len(place), 3)), np.zeros((len(place), 3))
    modes = np.full(len(place), SEPARATE)
    rows = np.flatnonzero((np.conj(inward) * moving).real > 0.0)
    if not len(rows):
        return Pushes(twists, modes, wrenches)
    speeds = np.abs(moving[rows])
    contacts = Contacts(as_complex(place)[rows], inward[rows], edges[rows], moving[rows] / speeds)
    found = PushBatch(surface).solve(contacts)
    assert found.wrenches is not None
    twists[rows] = speeds[:, np.newaxis] * found.twists
    modes[rows], wrenches[rows] = found.modes, found.wrenches
    return Pushes(twists, modes, wrenches)
