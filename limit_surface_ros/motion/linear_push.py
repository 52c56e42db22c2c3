# SPDX-License-Identifier: Apache-2.0
"""Pushes as linear systems, for controllers: dx/dt = f(x, u), A = df/dx and B = df/du.

State, modes and inputs are those of pusher-slider papers: F. R. Hogan and A. Rodriguez, WAFR 2016
(arXiv 1611.08268), whose input is the pusher's velocity, and IJRR 2020,
doi:10.1177/0278364920913938, whose input is its force. They take an ellipsoid, twist = L wrench;
here the motion is that of any limit surface, and the face any outline.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from limit_surface_ros.checks import as_floats
from limit_surface_ros.errors import RangeError, ShapeError
from limit_surface_ros.motion.push_batch import contact_velocities, loads_at
from limit_surface_ros.motion.push_checks import as_complex, as_vectors_of, friction_edges
from limit_surface_ros.motion.push_derivatives import margins_between, push_derivatives
from limit_surface_ros.motion.push_roots import SEPARATE, SLIDE_LEFT, SLIDE_RIGHT, STICK

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from limit_surface_ros.checks import Bools, Complexes, Floats
    from limit_surface_ros.motion.outline import Outline
    from limit_surface_ros.surface.base import LimitSurface

# Inputs, and how many numbers each has.
INPUTS = {"velocity": 2, "force": 3}


@dataclass(frozen=True, eq=False)
class LinearPush:
    """Linear systems of n pushes, or of one.

    The state is (x, y, theta, s): the pose of the body [m, m, rad], and the place of the contact
    along the outline [m], growing to the left of the inward normal, which is clockwise round the
    body. Only the change of s counts.

    Attributes:
        rates: f, the state's change [m/s, m/s, rad/s, m/s], shape (..., 4).
        a: A = df/dx, shape (..., 4, 4).
        b: B = df/du, shape (..., 4, 2) for velocities, (..., 4, 3) for forces.
        twists: Of the body at the origin of its frame, in that frame, shape (..., 3).
        modes: Places in `MODES`: 0 stick, 1 slide left, 2 slide right, 3 separate; shape (...).
        margins: Angles [rad] by which the velocity, or the force, can turn to the right, and to
            the left, before the mode is another, shape (..., 2).
        smooth: Where f has a derivative. Elsewhere, as at a vertex of the outline or where a
            support point rests, A and B are those of what is smooth there; shape (...).
    """

    rates: Floats
    a: Floats
    b: Floats
    twists: Floats
    modes: NDArray[np.intp]
    margins: Floats
    smooth: Bools


def linearise_push(
    surface: LimitSurface,
    outline: Outline,
    friction: float,
    poses: ArrayLike,
    contacts: ArrayLike,
    inputs: ArrayLike,
    *,
    kind: str = "velocity",
    reference_point: ArrayLike = (0.0, 0.0),
) -> LinearPush:
    """Return the linear systems of pushes with a point at given states.

    Within a mode they hold as they are; at the border of two they are those of the mode that the
    push is in. A pusher that sticks has ds/dt = 0, one that leaves does not move the body.

    Args:
        surface: Limit surface of the body; it should be convex.
        outline: Of the body, in its frame.
        friction: Coefficient of friction between pusher and body, from 0 to infinity.
        poses: Of the body, x, y [m] and angle [rad] in a frame that stands still, (3,) or (n, 3).
        contacts: Where the pusher touches, in the body's frame; the nearest points of the outline
            are taken [m], shape (2,) or (n, 2).
        inputs: Shape (2,) or (n, 2) for `kind` "velocity": the pusher's along the inward normal
            and to its left [m/s], which turn with the contact. Shape (3,) or (n, 3) for "force":
            the pusher's in the same axes [N], and ds/dt [m/s], which the caller keeps at 0 within
            the friction cone. The body then moves with `quadratic_twist` of the load, for an
            ellipsoid L times the load: its speed counts up to a common factor alone.
        kind: "velocity" or "force".
        reference_point: Of the surface in the body's frame [m], shape (2,).

    Raises:
        ShapeError: An array has another shape.
        NotFiniteError: A number is NaN or infinite.
        RangeError: The coefficient is negative or NaN, or `kind` is neither of the two.
        DataError: The kind of surface has no derivatives in closed form.

    Example:
        >>> import numpy as np
        >>> from limit_surface_ros.motion.outline import Polygon
        >>> from limit_surface_ros.surface.kinds.power_sum import PowerSum
        >>> square = Polygon([[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]])
        >>> body = PowerSum.thesis([np.eye(3)])
        >>> found = linearise_push(body, square, 0.3, [0, 0, 0], [-0.5, 0.1], [1.0, 0.0])
        >>> found.rates.round(3).tolist()
        [0.99, -0.04, -0.08, 0.0]
    """
    count = INPUTS.get(kind)
    if count is None:
        raise RangeError(f"kind must be one of {', '.join(INPUTS)}, got {kind!r}")
    arrays = [
        as_floats(name, values)
        for name, values in (("poses", poses), ("contacts", contacts), ("inputs", inputs))
    ]
    lead = arrays[0].shape[:-1]
    if len(lead) > 1 or [each.shape for each in arrays] != [(*lead, k) for k in (3, 2, count)]:
        raise ShapeError(
            f"poses, contacts and inputs must have shapes (3,), (2,) and ({count},), or n rows "
            f"each, got {', '.join(str(each.shape) for each in arrays)}"
        )
    about = as_floats("reference_point", reference_point)
    if about.shape != (2,):
        raise ShapeError(f"reference_point must have shape (2,), got {about.shape}")
    pose, contact, given = (
        each.reshape(-1, k) for each, k in zip(arrays, (3, 2, count), strict=True)
    )
    cone = float(np.angle(friction_edges(friction, 1)[0]))
    near = outline.nearest(contact)
    curvature = outline.curvatures(contact)
    # A vertex has no curvature: its edges' is taken.
    corner = ~(curvature < np.inf)
    at = _At(
        surface,
        friction,
        cone,
        as_complex(near.points) - complex(*about),
        -as_complex(near.normals),
        np.where(corner, 0.0, curvature),
    )
    body = _by_velocity(at, given) if kind == "velocity" else _by_force(at, given)
    # To the body's origin, and to the frame of the poses.
    turn = np.exp(1j * pose[:, 2])
    own = contact_velocities(np.full(len(pose), -complex(*about)), body.twists)
    moved = turn * own
    rates, a, b = np.empty((len(pose), 4)), np.zeros((len(pose), 4, 4)), body.by_input
    rates[:, 0], rates[:, 1] = moved.real, moved.imag
    rates[:, 2], rates[:, 3] = body.twists[:, 2], body.slips
    a[:, 0, 2], a[:, 1, 2] = -moved.imag, moved.real
    a[:, :, 3] = body.by_place
    for columns in (a[:, :, 3:], b):
        there = columns[:, 0] + 1j * columns[:, 1] - 1j * complex(*about) * columns[:, 2]
        there *= turn[:, np.newaxis]
        columns[:, 0], columns[:, 1] = there.real, there.imag
    return LinearPush(
        rates.reshape(*lead, 4),
        a.reshape(*lead, 4, 4),
        b.reshape(*lead, 4, count),
        np.column_stack([own.real, own.imag, body.twists[:, 2]]).reshape(*lead, 3),
        body.modes.reshape(lead),
        body.margins.reshape(*lead, 2),
        (body.smooth & ~corner).reshape(lead),
    )


class _At(NamedTuple):
    """Contacts (m,) about a body's reference point; `cone` is half the friction cone [rad]."""

    surface: LimitSurface
    friction: float
    cone: float
    points: Complexes
    normals: Complexes
    curvatures: Floats


class _Body(NamedTuple):
    """Pushes in the body's frame: twists at the reference point, slips, and derivatives of both.

    By the contact's place (m, 4), and by the input (m, 4, k).
    """

    twists: Floats
    slips: Floats
    by_place: Floats
    by_input: Floats
    modes: NDArray[np.intp]
    margins: Floats
    smooth: Bools


def _by_velocity(at: _At, inputs: Floats) -> _Body:
    """Return pushes with velocities along the normals and to their left, (m, 2)."""
    # Products with these numbers turn vectors from the contact's axes.
    velocities = at.normals * as_complex(inputs)
    found = push_derivatives(
        at.surface,
        as_vectors_of(at.points),
        as_vectors_of(at.normals),
        at.friction,
        as_vectors_of(velocities),
    )
    left = 1j * at.normals
    by_velocity = found.twist.by_velocity
    # A step to the left turns the normal by minus the curvature, and the velocity with it.
    bent = -at.curvatures[:, np.newaxis]
    by_place = _along(found.twist.by_point, left) + bent * (
        found.twist.by_normal + _along(by_velocity, 1j * velocities)
    )
    by_input = np.stack([_along(by_velocity, at.normals), _along(by_velocity, left)], axis=2)
    caused = np.conj(at.normals) * contact_velocities(at.points, found.twists)
    sticks = found.modes == STICK
    slips = np.where(sticks, 0.0, inputs[:, 1] - caused.imag)
    slip_by_input = -_tangential(at, by_input)
    slip_by_input[:, 1] += 1.0
    slip_by_place = -_tangential(at, by_place[:, :, np.newaxis])[:, 0]
    slip_by_place -= at.curvatures * caused.real
    slip_by_input[sticks], slip_by_place[sticks] = 0.0, 0.0
    return _Body(
        found.twists,
        slips,
        np.column_stack([by_place, slip_by_place]),
        np.concatenate([by_input, slip_by_input[:, np.newaxis]], axis=1),
        found.modes,
        found.margins,
        found.smooth,
    )


def _by_force(at: _At, inputs: Floats) -> _Body:
    """Return pushes with forces along the normals and to their left, and slips, (m, 3)."""
    own = as_complex(inputs[:, :2])
    count, forces = len(own), at.normals * own
    twists, smooth = np.zeros((count, 3)), np.ones(count, dtype=bool)
    by_place, by_input = np.zeros((count, 4)), np.zeros((count, 4, 3))
    by_input[:, 3, 2] = 1.0
    angles = np.angle(own)
    modes = np.where(angles > at.cone, SLIDE_LEFT, np.where(angles < -at.cone, SLIDE_RIGHT, STICK))
    modes[~(own.real > 0.0)] = SEPARATE
    rows = np.flatnonzero(modes != SEPARATE)
    if len(rows):
        points, normals, force = at.points[rows], at.normals[rows], forces[rows]
        loads = loads_at(points, force)
        twists[rows], k = at.surface.quadratic_twist(loads)
        smooth[rows] = at.surface.is_smooth_at(loads)
        # The force turns with the contact, and its arm grows by the step.
        moved = loads_at(points, -at.curvatures[rows] * 1j * force)
        moved[:, 2] += (np.conj(1j * normals) * force).imag
        axes = np.stack([loads_at(points, normals), loads_at(points, 1j * normals)], axis=2)
        by_place[rows, :3] = np.einsum("mij,mj->mi", k, moved)
        by_input[rows, :3, :2] = k @ axes
    full = np.full(count, at.cone)
    margins, _ = margins_between(angles, -full, full, modes)
    margins[own == 0.0] = 0.0
    return _Body(twists, inputs[:, 2], by_place, by_input, modes, margins, smooth)


def _along(columns: Floats, directions: Complexes) -> Floats:
    """Return derivatives (m, 3) along directions, from those (m, 3, 2) by both coordinates."""
    return np.asarray((columns @ as_vectors_of(directions)[:, :, np.newaxis])[:, :, 0])


def _tangential(at: _At, twists: Floats) -> Floats:
    """Return the velocities (m, c) to the left of the normals that changes (m, 3, c) cause."""
    vx = twists[:, 0] - at.points.imag[:, np.newaxis] * twists[:, 2]
    vy = twists[:, 1] + at.points.real[:, np.newaxis] * twists[:, 2]
    return np.asarray((np.conj(at.normals)[:, np.newaxis] * (vx + 1j * vy)).imag)
