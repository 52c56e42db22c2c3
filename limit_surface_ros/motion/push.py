# SPDX-License-Identifier: Apache-2.0
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
from functools import cache
from math import hypot
from typing import TYPE_CHECKING, Any, NamedTuple, TypeAlias

import numpy as np

from limit_surface_ros.bracket import root_bracket
from limit_surface_ros.checks import as_floats
from limit_surface_ros.errors import RangeError, ShapeError, ZeroVectorError
from limit_surface_ros.surface.kinds.dissipation_surface import DissipationSurface

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from limit_surface_ros.checks import Floats
    from limit_surface_ros.surface.base import LimitSurface

# Width of a bracket of directions [rad], or part of the range of turning rates, that is as good as
# one of them.
_WIDTH = 1e-13
# Error of the direction of the velocity at the contact, in parts of the way between the edges, or
# of the moment about it, in parts of the moment scale, that counts as none.
_EXACT = 1e-10
# Product of two such errors between which what is straight in them is as good.
_STRAIGHT = 1e-12
# Sine between two velocities below which they count as one direction.
_PARALLEL = 1e-12
# A body that turns freely about its contact needs no turning rate, however large.
_DOUBLINGS = 60


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
    approach = _product(pushed, contact.normal)
    if approach <= 0.0:
        return Push(np.zeros(3), ContactMode.SEPARATE, np.zeros(3))
    if isinstance(surface, DissipationSurface):
        found = contact.stick_by_turning(surface, pushed)
    else:
        found = contact.stick_by_force(pushed)
    if isinstance(found, Push):
        return found
    edge, mode = found
    speed = approach / _product(edge.velocity, contact.normal)
    return Push(speed * edge.twist, mode, contact.wrench(edge.force, edge.twist))


class _Response(NamedTuple):
    """What a force causes: the twist, and the velocity at the contact."""

    force: _Pair
    twist: Floats
    velocity: _Pair


_Pair: TypeAlias = "tuple[float, float]"
# A sticking push, or the edge of the friction cone along which the pusher slides, and how.
_Outcome: TypeAlias = "Push | tuple[_Response, ContactMode]"


class _Contact:
    """A contact point with its friction cone."""

    def __init__(
        self, surface: LimitSurface, point: ArrayLike, normal: ArrayLike, friction: float
    ) -> None:
        self._surface = surface
        self._x, self._y = _pair("point", point)
        nx, ny = _pair("normal", normal)
        if not (nx or ny):
            raise ZeroVectorError("normal must not be zero: it has no direction")
        if not 0.0 <= friction < float("inf"):
            raise RangeError(f"friction must be a finite number from 0 on, got {friction}")
        length = hypot(nx, ny)
        self.normal = nx / length, ny / length
        self._friction = friction
        # Of the edges' unit forces, along the normal and to its left.
        self._along = 1.0 / hypot(1.0, friction)
        self._across = friction * self._along

    def edge(self, side: float) -> _Response:
        """Return what the force along the left (1) or right (-1) edge of the cone causes."""
        nx, ny = self.normal
        across = side * self._across
        return self._respond((self._along * nx - across * ny, self._along * ny + across * nx))

    def stick_by_force(self, velocity: _Pair) -> _Outcome:
        """Find the force within the cone for which the body follows the pusher.

        The velocity that a force causes at the contact turns with the force. Both are looked at
        as shares of their ways between the edges, measured so that the shares would be the same
        were the surface an ellipsoid: a bracket of them shrinks to the answer in few steps. Where
        the load is at a corner of the surface its twists fill a cone: the answer is the sum of
        its edges that has the pusher's velocity.
        """
        right, left = self.edge(-1.0), self.edge(1.0)
        if _turn(left.velocity, velocity) > 0.0:
            return left, ContactMode.SLIDE_LEFT
        if _turn(right.velocity, velocity) < 0.0:
            return right, ContactMode.SLIDE_RIGHT
        responses = {0.0: right, 1.0: left}
        first = _matched(right, left)
        wanted = _share(velocity, first, left.velocity)

        def error(share: float) -> float:
            if share not in responses:
                rest = 1.0 - share
                (ax, ay), (bx, by) = right.force, left.force
                responses[share] = self._respond((rest * ax + share * bx, rest * ay + share * by))
            return _share(responses[share].velocity, first, left.velocity) - wanted

        ends = root_bracket(error, 0.0, 1.0, _WIDTH, _EXACT, _STRAIGHT)
        low, high = (responses[end] for end in ends)
        twist, shares = _sum_with_velocity(low, high, velocity)
        total = sum(shares)
        force = (
            (shares[0] * low.force[0] + shares[1] * high.force[0]) / total,
            (shares[0] * low.force[1] + shares[1] * high.force[1]) / total,
        )
        return Push(twist, ContactMode.STICK, self.wrench(force, twist))

    def stick_by_turning(self, surface: DissipationSurface, velocity: _Pair) -> _Outcome:
        """Find the motion of least dissipation in which the body follows the pusher.

        The moment about the contact of the load that a turning rate needs rises with the rate,
        and is zero in a push. Where support points stand still it jumps: the answer is then the
        sum of the loads on both sides that has no moment. These loads come in closed form.
        """
        vx, vy = velocity

        def motion(rate: float) -> tuple[float, float, float]:
            return vx + rate * self._y, vy - rate * self._x, rate

        @cache
        def load(rate: float) -> Floats:
            return surface.wrench_of_twist(motion(rate))

        def moment(rate: float) -> float:
            fx, fy, torque = load(rate).tolist()
            return float(torque - self._x * fy + self._y * fx)

        reach = hypot(vx, vy) / surface.scaling.characteristic_length
        for _ in range(_DOUBLINGS):
            if moment(-reach) <= 0.0 <= moment(reach):
                break
            reach *= 2.0
        unit = float(surface.scaling.wrench_unit[2])
        low, high = root_bracket(
            moment, -reach, reach, _WIDTH * reach, _EXACT * unit, _STRAIGHT * unit * unit
        )
        below, above = moment(low), moment(high)
        share = below / (below - above) if below < above else 0.5
        wrench = (1.0 - share) * load(low) + share * load(high)
        fx, fy, _ = wrench.tolist()
        across = _turn(self.normal, (fx, fy))
        if abs(across) > self._friction * _product(self.normal, (fx, fy)):
            if across > 0.0:
                return self.edge(1.0), ContactMode.SLIDE_LEFT
            return self.edge(-1.0), ContactMode.SLIDE_RIGHT
        rate = (1.0 - share) * low + share * high
        return Push(np.array(motion(rate)), ContactMode.STICK, wrench)

    def wrench(self, force: _Pair, twist: Floats) -> Floats:
        """Return the wrench on the surface (3,) along a force that causes a twist."""
        load = self._load(force)
        factor = self._surface.load_factor(load)
        # Beside a single support point a body turns freely under any force, however small: the
        # twist alone says which one it needs.
        return np.array(load) / factor if factor < np.inf else self._surface.wrench_of_twist(twist)

    def _respond(self, force: _Pair) -> _Response:
        twist = self._surface.twist_of_wrench(self._load(force))
        vx, vy, omega = twist.tolist()
        return _Response(force, twist, (vx - omega * self._y, vy + omega * self._x))

    def _load(self, force: _Pair) -> tuple[float, float, float]:
        """Return the wrench of a force through the contact."""
        fx, fy = force
        return fx, fy, self._x * fy - self._y * fx


def _matched(right: _Response, left: _Response) -> _Pair:
    """Return the right edge's velocity, as long beside the left one's as on an ellipsoid.

    There velocities are M f with a symmetric M, so that f_left . v_right = f_right . v_left.
    """
    ours, theirs = _product(left.force, right.velocity), _product(right.force, left.velocity)
    length = theirs / ours if ours * theirs > 0.0 else 1.0
    return length * right.velocity[0], length * right.velocity[1]


def _share(velocity: _Pair, right: _Pair, left: _Pair) -> float:
    """Return the s for which a velocity is along (1 - s) right + s left."""
    beyond_right, before_left = _turn(right, velocity), _turn(velocity, left)
    total = beyond_right + before_left
    # Right and left may be one direction, and a bent surface may lead beyond them.
    return beyond_right / total if total > 0.0 else 0.5


def _sum_with_velocity(
    low: _Response, high: _Response, velocity: _Pair
) -> tuple[Floats, tuple[float, float]]:
    """Return the sum of two neighbouring motions that has a velocity, and their factors."""
    turn = _turn(low.velocity, high.velocity)
    if abs(turn) > _PARALLEL * hypot(*low.velocity) * hypot(*high.velocity):
        first = _turn(velocity, high.velocity) / turn
        second = _turn(low.velocity, velocity) / turn
    else:
        square = _product(velocity, velocity)
        first = 0.5 * square / _product(velocity, low.velocity)
        second = 0.5 * square / _product(velocity, high.velocity)
    return first * low.twist + second * high.twist, (first, second)


def _turn(a: _Pair, b: _Pair) -> float:
    return a[0] * b[1] - a[1] * b[0]


def _product(a: _Pair, b: _Pair) -> float:
    return a[0] * b[0] + a[1] * b[1]


def _pair(name: str, values: Any) -> _Pair:
    if type(values) in (list, tuple) and len(values) == 2:
        x, y = values
        # The quick way for plain numbers; NaN and infinity fail the comparison.
        if type(x) is type(y) is float and abs(x) + abs(y) < float("inf"):
            return x, y
    pair = as_floats(name, values)
    if pair.shape != (2,):
        raise ShapeError(f"{name} must have shape (2,), got {pair.shape}")
    x, y = pair.tolist()
    return x, y
