# SPDX-License-Identifier: Apache-2.0
"""One push in plain floats, through the maps of a surface for one vector."""

from __future__ import annotations

from math import atan2, cos, hypot, sin
from typing import TYPE_CHECKING, Any, NamedTuple, TypeAlias

import numpy as np

from limit_surface_ros.bracket import root_bracket
from limit_surface_ros.checks import as_floats
from limit_surface_ros.errors import ShapeError, ZeroVectorError
from limit_surface_ros.motion.outcomes import ContactMode, Push
from limit_surface_ros.motion.push_checks import one_friction

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from limit_surface_ros.checks import Floats
    from limit_surface_ros.surface.base import LimitSurface

# Width of a bracket of angles [rad], or part of the range of turning rates, that is as good as
# one of them.
_WIDTH = 4e-16
# Error of an angle [rad], or of a moment in parts of the moment unit, that counts as none.
_EXACT = 4e-15
# Product of two such errors between which what is straight in them is as good.
_STRAIGHT = 1e-28
# Angle [rad] from an edge of the friction cone in a corner that is surely beyond the corner.
_BEYOND = 1e-11
# A body that turns freely about its contact needs no turning rate, however large.
_DOUBLINGS = 60
_INFINITY = float("inf")


class Response(NamedTuple):
    """What a force causes: the twist, and the velocity at the contact."""

    force: _Pair
    twist: Floats
    velocity: _Pair


_Pair: TypeAlias = "tuple[float, float]"
# A sticking push, or the edge of the friction cone along which the pusher slides, and how.
_Outcome: TypeAlias = "Push | tuple[Response, ContactMode]"


class ContactScalar:
    """A contact point with its friction cone."""

    def __init__(
        self, surface: LimitSurface, point: ArrayLike, normal: ArrayLike, friction: float
    ) -> None:
        """Check the numbers; see `push`."""
        self._surface = surface
        self._x, self._y = pair("point", point)
        nx, ny = pair("normal", normal)
        if not (nx or ny):
            raise ZeroVectorError("normal must not be zero: it has no direction")
        friction = one_friction(friction)
        size = max(abs(nx), abs(ny))
        nx, ny = nx / size, ny / size
        length = hypot(nx, ny)
        self.normal = nx / length, ny / length
        # Of the edges' unit forces, along the normal and to its left.
        self._along = 1.0 / hypot(1.0, friction)
        self._across = friction * self._along if friction < _INFINITY else 1.0

    def push(self, velocity: _Pair) -> Push:
        """Return what a pusher with a unit velocity, of which a part is along the normal, does."""
        if self._surface.wrench_is_closed:
            found = self.stick_by_turning(self._surface, velocity)
        else:
            found = self.stick_by_force(velocity)
        if isinstance(found, Push):
            return found
        edge, mode = found
        factor = product(velocity, self.normal) / product(edge.velocity, self.normal)
        return Push(factor * edge.twist, mode, self.wrench(edge.force, edge.twist))

    def edge(self, side: float) -> Response:
        """Return what the force along the left (1) or right (-1) edge of the cone causes.

        Where the edge lies in a corner of the surface that is any motion of a cone. The pusher
        sticks wherever a force within the friction cone, or at its edge, lets it: of these
        motions the one that is the farthest to the edge's side counts, which a force just beyond
        the edge causes.
        """
        along, across = self._along, side * self._across
        response = self._respond(along, across)
        if self._surface.may_have_corners and self._is_in_corner(response.force):
            turned = side * _BEYOND
            beyond = self._respond(along - turned * across, across + turned * along)
            return Response(response.force, beyond.twist, beyond.velocity)
        return response

    def stick_by_force(self, velocity: _Pair) -> _Outcome:
        """Find the force within the cone for which the body follows the pusher.

        Where the load is at a corner of the surface its twists fill a cone: the answer is the sum
        of its edges that has the pusher's velocity.
        """
        wanted = atan2(turn(self.normal, velocity), product(self.normal, velocity))
        limit = atan2(self._across, self._along)

        def error_of(angle: float, response: Response) -> float:
            # Friction takes power: velocity and force are less than 90 deg apart.
            force, _, caused = response
            return angle + atan2(turn(force, caused), product(force, caused)) - wanted

        edges: dict[float, Response] = {}
        # The side to which the pusher moves is the likelier to slide.
        for side in (1.0, -1.0) if wanted > 0.0 else (-1.0, 1.0):
            edges[side] = self.edge(side)
            if side * error_of(side * limit, edges[side]) < -_EXACT:
                mode = ContactMode.SLIDE_LEFT if side > 0.0 else ContactMode.SLIDE_RIGHT
                return edges[side], mode
        responses = {-limit: edges[-1.0], limit: edges[1.0]}

        def error(angle: float) -> float:
            if angle not in responses:
                responses[angle] = self._respond(cos(angle), sin(angle))
            return error_of(angle, responses[angle])

        low, high, right, left = -limit, limit, edges[-1.0], edges[1.0]
        if limit > 0.0:
            low, high = root_bracket(error, low, high, _WIDTH, _EXACT, _STRAIGHT)
            right, left = responses[low], responses[high]
        below, above = max(0.0, -error_of(low, right)), max(0.0, error_of(high, left))
        twist, force = right.twist, right.force
        if right is not left and below + above > 0.0:
            # Unit velocities weigh as the sines of the angles that they are off.
            first = sin(above) / hypot(*right.velocity)
            second = sin(below) / hypot(*left.velocity)
            twist = first * twist + second * left.twist
            part, (ax, ay), (bx, by) = second / (first + second), force, left.force
            force = ax + part * (bx - ax), ay + part * (by - ay)
        wrench = self.wrench(force, twist)
        caused = self._velocity(twist)
        return Push(
            product(velocity, velocity) / product(velocity, caused) * twist,
            ContactMode.STICK,
            wrench,
        )

    def stick_by_turning(self, surface: LimitSurface, velocity: _Pair) -> _Outcome:
        """Find the motion of least dissipation in which the body follows the pusher.

        The moment about the contact of the load that a turning rate needs rises with the rate,
        and is zero in a push. Where support points stand still it jumps: the answer is then the
        sum of the loads on both sides that has no moment. These loads come in closed form.
        """
        vx, vy = velocity

        def motion(rate: float) -> tuple[float, float, float]:
            return vx + rate * self._y, vy - rate * self._x, rate

        load_scalar = surface.shape.load_scalar
        length, force = surface.scaling.characteristic_length, surface.scaling.friction_force
        loads: dict[float, tuple[float, ...]] = {}

        def moment(rate: float) -> float:
            if rate not in loads:
                x, y, turning = motion(rate)
                scaled = load_scalar((x, y, length * turning))
                if scaled is None:
                    loads[rate] = tuple(surface.wrench_of_twist((x, y, turning)).tolist())
                else:
                    fx, fy, torque = scaled
                    loads[rate] = force * fx, force * fy, force * length * torque
            fx, fy, torque = loads[rate]
            return torque - self._x * fy + self._y * fx

        # Of no turning, and as far to the side of the root as need be.
        side = -1.0 if moment(0.0) > 0.0 else 1.0
        near, far = 0.0, side / length
        unit = force * length
        # A body on one support point that is pushed there may turn as it likes: it does not.
        if abs(moment(0.0)) <= _EXACT * (unit + force * hypot(self._x, self._y)):
            far = 0.0
        for _ in range(_DOUBLINGS):
            if side * moment(far) >= 0.0 or far == 0.0:
                break
            near, far = far, 2.0 * far
        low, high = root_bracket(
            moment,
            min(near, far),
            max(near, far),
            _WIDTH * abs(far),
            _EXACT * unit,
            _STRAIGHT * unit * unit,
        )
        below, above = moment(low), moment(high)
        share = below / (below - above) if below < above else 0.5
        fx, fy, torque = (
            (1.0 - share) * a + share * b for a, b in zip(loads[low], loads[high], strict=True)
        )
        across = turn(self.normal, (fx, fy))
        if abs(across) * self._along > self._across * product(self.normal, (fx, fy)):
            if across > 0.0:
                return self.edge(1.0), ContactMode.SLIDE_LEFT
            return self.edge(-1.0), ContactMode.SLIDE_RIGHT
        rate = (1.0 - share) * low + share * high
        return Push(np.array(motion(rate)), ContactMode.STICK, np.array((fx, fy, torque)))

    def wrench(self, force: _Pair, twist: Floats) -> Floats:
        """Return the wrench on the surface (3,) along a force that causes a twist."""
        load = self._load(force)
        factor = self._surface.load_factor(load)
        # Beside a single support point a body turns freely under any force, however small: the
        # twist alone says which one it needs.
        return np.array(load) / factor if factor < np.inf else self._surface.wrench_of_twist(twist)

    def _respond(self, along: float, across: float) -> Response:
        """Return what a force along the normal and to its left causes."""
        nx, ny = self.normal
        force = along * nx - across * ny, along * ny + across * nx
        twist = self._surface.twist_of_wrench(self._load(force))
        return Response(force, twist, self._velocity(twist))

    def _is_in_corner(self, force: _Pair) -> bool:
        """Tell whether the maps for one vector leave the load of a force, as they do at kinks."""
        fx, fy, torque = self._load(force)
        length, unit = (
            self._surface.scaling.characteristic_length,
            self._surface.scaling.friction_force,
        )
        load = fx / unit, fy / unit, torque / (unit * length)
        return self._surface.shape.load_factor_and_motion_scalar(load) is None

    def _velocity(self, twist: Floats) -> _Pair:
        vx, vy, omega = twist.tolist()
        return vx - omega * self._y, vy + omega * self._x

    def _load(self, force: _Pair) -> tuple[float, float, float]:
        """Return the wrench of a force through the contact."""
        fx, fy = force
        return fx, fy, self._x * fy - self._y * fx


def turn(a: _Pair, b: _Pair) -> float:
    """Return the cross product, positive if b is to the left of a."""
    return a[0] * b[1] - a[1] * b[0]


def product(a: _Pair, b: _Pair) -> float:
    """Return the scalar product."""
    return a[0] * b[0] + a[1] * b[1]


def pair(name: str, values: Any) -> _Pair:
    """Return two finite numbers.

    Raises:
        ShapeError: They are no pair of numbers.
        NotFiniteError: One is NaN or infinite.
    """
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
