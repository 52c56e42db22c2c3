"""Quasi-static pushing with one point of contact: how a pushed body moves, and if it sticks.

A pusher touches the body at a point and moves with a given velocity. Its force lies in the
friction cone at the contact, its wrench on the limit surface, and the body moves along the
outward normal there. See K. M. Lynch and M. T. Mason, "Stable pushing", IJRR 1996,
doi:10.1177/027836499601500602, and J. Zhou, M. T. Mason, R. Paolini and D. Bagnell, IJRR 2018,
doi:10.1177/0278364917698747.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from math import atan, atan2, cos, sin
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from limit_surface_ros.checks import as_floats
from limit_surface_ros.errors import RangeError, ShapeError, ZeroVectorError
from limit_surface_ros.root_bracket import root_bracket

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from limit_surface_ros.checks import Floats
    from limit_surface_ros.surface.protocol import LimitSurface

# Width [rad] of a bracket of force directions that is as good as one direction.
_WIDTH = 1e-13
# Error of direction [rad] of the velocity at the contact that counts as none.
_EXACT = 1e-14


class ContactMode(str, Enum):
    """What a pusher does at its contact; left and right as seen along the inward normal."""

    STICK = "stick"
    SLIDE_LEFT = "slide_left"
    SLIDE_RIGHT = "slide_right"
    SEPARATE = "separate"


@dataclass(frozen=True, eq=False)
class Push:
    """Outcome of a push.

    Attributes:
        twist: Of the body at the reference point, (vx, vy, omega_z) in [m/s, m/s, rad/s].
        mode: Whether the pusher sticks to the body, or which way it slides along it.
        wrench: Of the pusher on the body, (fx, fy, tau_z) in [N, N, N m]; zero if it leaves.
    """

    twist: Floats
    mode: ContactMode
    wrench: Floats


@dataclass(frozen=True, eq=False)
class MotionCone:
    """What a pusher can cause: wrenches and twists at the edges of the friction cone.

    Attributes:
        wrenches: On the limit surface, for the right and the left edge, shape (2, 3).
        twists: The motions these cause, of unit norm in scaled variables, shape (2, 3).
        velocities: Of the body at the contact in these motions, shape (2, 2); a pusher sticks
            whose velocity lies between them.
    """

    wrenches: Floats
    twists: Floats
    velocities: Floats


def motion_cone(
    surface: LimitSurface, point: ArrayLike, normal: ArrayLike, friction: float
) -> MotionCone:
    """Return the twists and contact velocities that bound what a pusher can cause.

    Args:
        surface: Limit surface of the body.
        point: Contact point about the reference point [m], shape (2,).
        normal: Normal of the contact, pointing into the body, of any length, shape (2,).
        friction: Coefficient of friction between pusher and body, 0 or above.

    Raises:
        ShapeError: The point or the normal is no pair of numbers.
        ZeroVectorError: The normal is zero.
        RangeError: The coefficient is negative or not finite.
    """
    contact = _Contact(surface, point, normal, friction)
    edges = contact.edges()
    return MotionCone(
        np.array([contact.wrench(edge.angle, edge.twist) for edge in edges]),
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

    Args:
        surface: Limit surface of the body; it should be convex.
        point: Contact point about the reference point [m], shape (2,).
        normal: Normal of the contact, pointing into the body, of any length, shape (2,).
        friction: Coefficient of friction between pusher and body, 0 or above.
        velocity: Of the pusher [m/s], shape (2,).

    Raises:
        ShapeError: The point, the normal or the velocity is no pair of numbers.
        NotFiniteError: A number is NaN or infinite.
        ZeroVectorError: The normal is zero.
        RangeError: The coefficient is negative or not finite.
    """
    contact = _Contact(surface, point, normal, friction)
    pushed = _pair("velocity", velocity)
    approach = float(pushed @ contact.normal)
    if approach <= 0.0:
        return Push(np.zeros(3), ContactMode.SEPARATE, np.zeros(3))
    right, left = contact.edges()
    heading = contact.angle_of(pushed)
    if right.heading <= heading <= left.heading:
        return contact.stick(pushed, (right, left), heading)
    if heading > left.heading:
        edge, mode = left, ContactMode.SLIDE_LEFT
    else:
        edge, mode = right, ContactMode.SLIDE_RIGHT
    speed = approach / float(edge.velocity @ contact.normal)
    return Push(speed * edge.twist, mode, contact.wrench(edge.angle, edge.twist))


class _Response(NamedTuple):
    """What a force causes: its angle, the twist, and velocity and heading at the contact."""

    angle: float
    twist: Floats
    velocity: Floats
    heading: float


class _Contact:
    """A contact point with its friction cone; directions are angles from the inward normal."""

    def __init__(
        self, surface: LimitSurface, point: ArrayLike, normal: ArrayLike, friction: float
    ) -> None:
        self._surface = surface
        self._x, self._y = _pair("point", point).tolist()
        direction = _pair("normal", normal)
        if not direction.any():
            raise ZeroVectorError("normal must not be zero: it has no direction")
        if not 0.0 <= friction < float("inf"):
            raise RangeError(f"friction must be a finite number from 0 on, got {friction}")
        self.normal = direction / np.hypot(*direction)
        self._normal = self.normal.tolist()
        self._half_angle = atan(friction)

    def edges(self) -> tuple[_Response, _Response]:
        """Return what the forces along the right and the left edge of the friction cone cause."""
        return self._respond(-self._half_angle), self._respond(self._half_angle)

    def angle_of(self, vector: Floats) -> float:
        """Return the angle [rad] of a planar vector, counter-clockwise from the normal."""
        nx, ny = self._normal
        vx, vy = vector.tolist()
        return atan2(nx * vy - ny * vx, nx * vx + ny * vy)

    def stick(self, velocity: Floats, edges: tuple[_Response, _Response], heading: float) -> Push:
        """Find the force within the cone for which the body follows the pusher.

        The velocity that a force causes at the contact turns with the force, so that a bracket
        of directions shrinks to the answer. Where the load is at a corner of the surface its
        twists fill a cone: the answer is the sum of its edges that has the pusher's velocity.
        """
        right, left = edges
        ends = root_bracket(
            lambda angle: self._respond(angle).heading - heading,
            right.angle,
            left.angle,
            _WIDTH,
            _EXACT,
        )
        low, high = map(self._respond, ends)
        velocities = np.array([low.velocity, high.velocity])
        shares = np.linalg.lstsq(velocities.T, velocity, rcond=1e-9)[0]
        twist = shares @ np.array([low.twist, high.twist])
        return Push(twist, ContactMode.STICK, self.wrench(0.5 * (low.angle + high.angle), twist))

    def wrench(self, angle: float, twist: Floats) -> Floats:
        """Return the wrench on the surface (3,) of a force at an angle that causes a twist."""
        load = self._load(angle)
        factor = self._surface.load_factor(load)
        # Beside a single support point a body turns freely under any force, however small: the
        # twist alone says which one it needs.
        return np.array(load) / factor if factor < np.inf else self._surface.wrench_of_twist(twist)

    def _respond(self, angle: float) -> _Response:
        twist = self._surface.twist_of_wrench(self._load(angle))
        vx, vy, omega = twist.tolist()
        velocity = np.array([vx - omega * self._y, vy + omega * self._x])
        return _Response(angle, twist, velocity, self.angle_of(velocity))

    def _load(self, angle: float) -> tuple[float, float, float]:
        """Return the wrench of a unit force through the contact."""
        nx, ny = self._normal
        fx = nx * cos(angle) - ny * sin(angle)
        fy = ny * cos(angle) + nx * sin(angle)
        return fx, fy, self._x * fy - self._y * fx


def _pair(name: str, values: ArrayLike) -> Floats:
    pair = as_floats(name, values)
    if pair.shape != (2,):
        raise ShapeError(f"{name} must have shape (2,), got {pair.shape}")
    return pair
