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
from typing import TYPE_CHECKING

import numpy as np

from limit_surface_ros.checks import as_floats
from limit_surface_ros.errors import RangeError, ShapeError, ZeroVectorError

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from limit_surface_ros.checks import Floats
    from limit_surface_ros.surface.protocol import LimitSurface

# The direction of a sticking force is found among so many, in so many rounds of refinement.
_DIRECTIONS = 65
_ROUNDS = 7


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
    surface: LimitSurface, point: ArrayLike, normal: ArrayLike, mu: float
) -> MotionCone:
    """Return the twists and contact velocities that bound what a pusher can cause.

    Args:
        surface: Limit surface of the body.
        point: Contact point about the reference point [m], shape (2,).
        normal: Normal of the contact, pointing into the body, of any length, shape (2,).
        mu: Friction coefficient between pusher and body, 0 or above.

    Raises:
        ShapeError: The point or the normal is no pair of numbers.
        ZeroVectorError: The normal is zero.
        RangeError: The coefficient is negative or not finite.
    """
    return _Contact(surface, point, normal, mu).cone()


def push(
    surface: LimitSurface, point: ArrayLike, normal: ArrayLike, mu: float, velocity: ArrayLike
) -> Push:
    """Return how a body moves whose contact point is pushed with a velocity.

    Args:
        surface: Limit surface of the body; it should be convex.
        point: Contact point about the reference point [m], shape (2,).
        normal: Normal of the contact, pointing into the body, of any length, shape (2,).
        mu: Friction coefficient between pusher and body, 0 or above.
        velocity: Of the pusher [m/s], shape (2,).

    Raises:
        ShapeError: The point, the normal or the velocity is no pair of numbers.
        NotFiniteError: A number is NaN or infinite.
        ZeroVectorError: The normal is zero.
        RangeError: The coefficient is negative or not finite.
    """
    contact = _Contact(surface, point, normal, mu)
    pushed = _pair("velocity", velocity)
    approach = float(pushed @ contact.normal)
    if approach <= 0.0:
        return Push(np.zeros(3), ContactMode.SEPARATE, np.zeros(3))
    cone = contact.cone()
    right, left = (contact.angle_of(edge) for edge in cone.velocities)
    angle = contact.angle_of(pushed)
    if right <= angle <= left:
        return contact.stick(pushed, angle)
    edge, mode = (1, ContactMode.SLIDE_LEFT) if angle > left else (0, ContactMode.SLIDE_RIGHT)
    speed = approach / float(cone.velocities[edge] @ contact.normal)
    return Push(speed * cone.twists[edge], mode, cone.wrenches[edge])


class _Contact:
    """A contact point with its friction cone; directions are angles from the inward normal."""

    def __init__(
        self, surface: LimitSurface, point: ArrayLike, normal: ArrayLike, mu: float
    ) -> None:
        self._surface = surface
        self._x, self._y = _pair("point", point)
        direction = _pair("normal", normal)
        if not direction.any():
            raise ZeroVectorError("normal must not be zero: it has no direction")
        if not 0.0 <= mu < float("inf"):
            raise RangeError(f"mu must be a finite number from 0 on, got {mu}")
        self.normal = direction / np.hypot(*direction)
        self._half_angle = float(np.arctan(mu))

    def cone(self) -> MotionCone:
        wrenches, twists, velocities = self._respond(np.array([-1.0, 1.0]) * self._half_angle)
        return MotionCone(wrenches, twists, velocities)

    def angle_of(self, vector: Floats) -> float:
        """Return the angle [rad] of a planar vector, counter-clockwise from the normal."""
        nx, ny = self.normal
        vx, vy = vector
        return float(np.arctan2(nx * vy - ny * vx, nx * vx + ny * vy))

    def stick(self, velocity: Floats, angle: float) -> Push:
        """Find the force within the cone for which the body follows the pusher.

        The velocity that a force causes at the contact turns with the force, so that a bracket
        of directions shrinks to the answer. Where the load is at a corner of the surface its
        twists fill a cone: the answer is the sum of its edges that has the pusher's velocity.
        """
        low, high = -self._half_angle, self._half_angle
        for _ in range(_ROUNDS):
            directions = np.linspace(low, high, _DIRECTIONS)
            wrenches, twists, velocities = self._respond(directions)
            below = [self.angle_of(each) <= angle for each in velocities]
            last = min(
                max((i for i, flag in enumerate(below) if flag), default=0), _DIRECTIONS - 2
            )
            low, high = directions[last], directions[last + 1]
        ends = slice(last, last + 2)
        shares = np.linalg.lstsq(velocities[ends].T, velocity, rcond=1e-9)[0]
        return Push(shares @ twists[ends], ContactMode.STICK, wrenches[ends].mean(axis=0))

    def _respond(self, angles: Floats) -> tuple[Floats, Floats, Floats]:
        """Return wrenches on the surface, twists and contact velocities for forces at angles."""
        nx, ny = self.normal
        cos, sin = np.cos(angles), np.sin(angles)
        fx, fy = nx * cos - ny * sin, ny * cos + nx * sin
        wrenches = np.stack([fx, fy, self._x * fy - self._y * fx], axis=1)
        wrenches /= self._surface.load_factor(wrenches)[:, np.newaxis]
        twists = self._surface.twist_of_wrench(wrenches)
        vx, vy, omega = twists.T
        return wrenches, twists, np.stack([vx - omega * self._y, vy + omega * self._x], axis=1)


def _pair(name: str, values: ArrayLike) -> Floats:
    pair = as_floats(name, values)
    if pair.shape != (2,):
        raise ShapeError(f"{name} must have shape (2,), got {pair.shape}")
    return pair
