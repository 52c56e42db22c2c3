# SPDX-License-Identifier: Apache-2.0
"""A rigid pusher with two contacts: all motions that it can cause, and the turns it holds.

At each contact the body does not enter the pusher, the normal force does not pull, one of both is
zero, and friction is Coulomb's. While both contacts stay closed the body has one freedom beside
the pusher's own motion: sliding along a common edge, or turning about the point where the normals
meet. So two contacts have six kinds of answers: neither pushes, one of them does, both stick, or
the body slides one way or the other. Friction may leave more than one answer; all are given.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np

from limit_surface_ros.bracket import root_bracket
from limit_surface_ros.checks import as_floats, as_vectors
from limit_surface_ros.errors import ShapeError
from limit_surface_ros.motion.outcomes import ContactMode
from limit_surface_ros.motion.push import push
from limit_surface_ros.motion.push_checks import friction_edges, pairs, unit_normals

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from numpy.typing import ArrayLike

    from limit_surface_ros.checks import Bools, Complexes, Floats
    from limit_surface_ros.surface.base import LimitSurface

# Residual of a wrench, in parts of itself, outside of the cone of those that contacts can give.
_CONE = 1e-9
# Speed of a contact, in parts of the pusher's, that counts as none.
_STILL = 1e-10
# Directions of motion among which the sliding ones are looked for, on each side.
_SCANNED = 200
# Length of a cross product of scaled unit vectors below which they are one direction.
_PARALLEL = 1e-12
# Distance of two contacts, in characteristic lengths, below which they are one.
_ONE_POINT = 1e-9
# How the pusher slides where the body slips to the right and to the left.
_MODES = (ContactMode.SLIDE_LEFT, ContactMode.SLIDE_RIGHT)


@dataclass(frozen=True, eq=False)
class TwoPointPush:
    """One motion that a pusher with two contacts can cause.

    Attributes:
        twist: Of the body at the reference point, (vx, vy, omega_z) in [m/s, m/s, rad/s].
        modes: What the pusher does at each contact.
        wrench: Of the pusher on the body, (fx, fy, tau_z) in [N, N, N m].
        forces: At each contact [N], shape (2, 2). Where both contacts stick the four parts of two
            forces are not determined by the three of the wrench: this is one way to share it.
    """

    twist: Floats
    modes: tuple[ContactMode, ContactMode]
    wrench: Floats
    forces: Floats


def two_point_push(
    surface: LimitSurface,
    points: ArrayLike,
    normals: ArrayLike,
    friction: ArrayLike,
    twist: ArrayLike,
) -> list[TwoPointPush]:
    """Return all motions of a body that a rigid pusher touches at two points.

    Args:
        surface: Limit surface of the body; it should be convex.
        points: Contact points about the reference point [m], shape (2, 2).
        normals: Normals of the contacts, pointing into the body, shape (2, 2).
        friction: Coefficients of friction, from 0 to infinity, one for both or shape (2,).
        twist: Of the pusher, as of a body at the reference point, (vx, vy, omega_z), shape (3,).

    Returns:
        At least one answer for a convex surface; first the one in which both contacts stick.

    Raises:
        ShapeError: An array has another shape.
        NotFiniteError: A number other than a coefficient of friction is NaN or infinite.
        ZeroVectorError: A normal is zero.
        RangeError: A coefficient is negative or NaN.
    """
    place = pairs("points", points)
    if place.shape != (2, 2):
        raise ShapeError(f"points must have shape (2, 2), got {place.shape}")
    inward = unit_normals(pairs("normals", normals))
    if inward.shape != (2, 2):
        raise ShapeError(f"normals must have shape (2, 2), got {inward.shape}")
    edges = friction_edges(friction, 2)
    given = as_vectors("twist", twist)
    if given.shape != (3,):
        raise ShapeError(f"twist must have shape (3,), got {given.shape}")
    return list(TwoContacts(surface, place, inward, edges, given).answers())


def stable_turns(
    surface: LimitSurface,
    points: ArrayLike,
    normals: ArrayLike,
    friction: ArrayLike,
    twists: ArrayLike,
) -> Bools:
    """Return in which motions of a pusher the body stays with it: stable pushes.

    The wrench that a motion needs must lie in the cone of those that the contacts can give; see
    K. M. Lynch and M. T. Mason, IJRR 1996, doi:10.1177/027836499601500602. A turn about the
    point (x, y) with the rate w has the twist (w y, -w x, w).

    Args:
        surface: Limit surface of the body.
        points: Contact points about the reference point [m], shape (n, 2); the ends of an edge
            stand for the whole of it.
        normals: Normals of the contacts, pointing into the body, shape (n, 2).
        friction: Coefficients of friction, from 0 to infinity, one for all or shape (n,).
        twists: Of the pusher, not zero, shape (..., 3).

    Returns:
        Whether each motion is stable, shape (...).

    Raises:
        ShapeError, NotFiniteError, ZeroVectorError, RangeError: As `two_point_push`.
    """
    place, inward = pairs("points", points), unit_normals(pairs("normals", normals))
    if len(place) != len(inward):
        raise ShapeError(f"got {len(place)} points and {len(inward)} normals")
    cone = _cone(surface, place, inward, friction_edges(friction, len(place)))
    moved = as_floats("twists", twists)
    wrenches = surface.wrench_of_twist(moved) / surface.scaling.wrench_unit
    inside = _shares(cone, wrenches.reshape(-1, 3))[0]
    return inside.reshape(moved.shape[:-1])


def _cone(surface: LimitSurface, points: Floats, normals: Floats, edges: Complexes) -> Floats:
    """Return scaled wrenches of unit forces at the edges, right and left of each, (2 n, 3)."""
    x, y = np.repeat(points, 2, axis=0).T
    edge = np.repeat(edges, 2)
    along, across = edge.real, edge.imag * np.tile([-1.0, 1.0], len(points))
    nx, ny = np.repeat(normals, 2, axis=0).T
    fx, fy = along * nx - across * ny, along * ny + across * nx
    wrenches = np.stack([fx, fy, x * fy - y * fx], axis=1)
    return np.asarray(wrenches * surface.scaling.friction_force / surface.scaling.wrench_unit)


def _shares(cone: Floats, wrenches: Floats) -> tuple[Bools, Floats]:
    """Return which scaled wrenches (m, 3) lie in the cone of generators (g, 3), and how.

    A cone in space is the union of those of its triples; pairs and single generators count where
    it is flat.

    Returns:
        Which do, shape (m,), and how much of each generator they hold, shape (m, g).
    """
    size = np.linalg.norm(wrenches, axis=1)
    best = np.full(len(wrenches), np.inf)
    shares = np.zeros((len(wrenches), len(cone)))
    for count in (3, 2, 1):
        for chosen in combinations(range(len(cone)), count):
            some = cone[list(chosen)]
            if count > 1 and np.linalg.cond(some) > 1e10:
                continue
            parts = wrenches @ np.linalg.pinv(some)
            parts[parts < 0.0] = 0.0
            residual = np.linalg.norm(wrenches - parts @ some, axis=1) / size
            better = residual < best - 1e-14
            best[better] = residual[better]
            shares[better] = 0.0
            shares[np.ix_(better, list(chosen))] = parts[better]
    return best <= _CONE, shares


class TwoContacts:
    """The six candidates, each judged by its own conditions."""

    def __init__(
        self,
        surface: LimitSurface,
        points: Floats,
        normals: Floats,
        edges: Complexes,
        twist: Floats,
    ) -> None:
        """Keep checked arguments of `two_point_push`; `edges` as `friction_edges` gives them."""
        self._surface, self._points, self._normals, self._edges = surface, points, normals, edges
        self._twist = twist
        self._unit = surface.scaling.twist_unit
        self._length = surface.scaling.characteristic_length
        self._cone = _cone(surface, points, normals, edges)
        self._velocities = self._at_contacts(twist)
        self._approach = (self._velocities * normals).sum(axis=1)
        speeds = np.hypot(*self._velocities.T)
        self._still = _STILL * max(float(speeds.max()), 1e-300)

    def answers(self) -> Iterator[TwoPointPush]:
        """Yield all that hold, both sticking first."""
        if (self._approach <= 0.0).all():
            away = (ContactMode.SEPARATE, ContactMode.SEPARATE)
            yield TwoPointPush(np.zeros(3), away, np.zeros(3), np.zeros((2, 2)))
            return
        yield from self._both_stick()
        for contact in (0, 1):
            yield from self._one_pushes(contact)
        yield from self._both_slide()

    def _at_contacts(self, twist: Floats) -> Floats:
        vx, vy, omega = twist
        x, y = self._points.T
        return np.stack([vx - omega * y, vy + omega * x], axis=1)

    def _both_stick(self) -> list[TwoPointPush]:
        twist = self._twist
        if np.ptp(self._points, axis=0).max() <= _ONE_POINT * self._length:
            # Both are at one point, about which the body may turn: without a moment there.
            velocity = self._velocities[0]
            twist = push(self._surface, self._points[0], velocity, np.inf, velocity).twist
        wrench = self._surface.wrench_of_twist(twist)
        inside, shares = _shares(self._cone, (wrench / self._surface.scaling.wrench_unit)[None])
        if not inside[0]:
            return []
        stick = (ContactMode.STICK, ContactMode.STICK)
        return [TwoPointPush(twist.copy(), stick, wrench, self._forces(shares[0]))]

    def _forces(self, shares: Floats) -> Floats:
        """Return the forces at both contacts (2, 2) of shares of the four edges' unit forces."""
        forces = np.zeros((2, 2))
        for place, share in enumerate(shares * self._surface.scaling.friction_force):
            contact, side = place // 2, (-1.0, 1.0)[place % 2]
            nx, ny = self._normals[contact]
            along, across = self._edges[contact].real, side * self._edges[contact].imag
            forces[contact] += share * np.array(
                [along * nx - across * ny, along * ny + across * nx]
            )
        return forces

    def _one_pushes(self, contact: int) -> list[TwoPointPush]:
        if self._approach[contact] <= 0.0:
            return []
        edge = self._edges[contact]
        friction = float(edge.imag / edge.real) if edge.real > 0.0 else np.inf
        pushed = push(
            self._surface,
            self._points[contact],
            self._normals[contact],
            friction,
            self._velocities[contact],
        )
        other = 1 - contact
        gap = (self._at_contacts(pushed.twist) - self._velocities)[other] @ self._normals[other]
        if gap < -self._still:
            return []
        modes = [ContactMode.SEPARATE, ContactMode.SEPARATE]
        modes[contact] = pushed.mode
        forces = np.zeros((2, 2))
        forces[contact] = pushed.wrench[:2]
        return [TwoPointPush(pushed.twist, (modes[0], modes[1]), pushed.wrench, forces)]

    def _both_slide(self) -> list[TwoPointPush]:
        """Return the answers V = V_p + s d, with d the motion that leaves both contacts closed."""
        (nx, ny), (x, y) = self._normals.T, self._points.T
        along = np.cross(*np.stack([nx, ny, x * ny - y * nx], axis=1))
        length = np.linalg.norm(along / self._unit)
        if length <= _PARALLEL:
            return []
        along = along / length
        tangents = np.stack([-ny, nx], axis=1)
        slips = (self._at_contacts(along) * tangents).sum(axis=1)
        return self._slides(along, slips) + self._slides(-along, -slips)

    def _slides(self, along: Floats, slips: Floats) -> list[TwoPointPush]:
        """Return the answers with s > 0, at whose contacts the body slips left by s times slips.

        Motions are V_p cos(a) + d sin(a), of sizes one; the wrench must have no moment about the
        line of wrenches that both contacts give as they slide.
        """
        # Friction on the body is against its slip: its edge is the right one of a left slip.
        chosen = [2 * contact + int(slips[contact] < 0.0) for contact in (0, 1)]
        across = np.cross(*self._cone[chosen])
        if np.linalg.norm(across) <= _PARALLEL:
            return []
        size = max(float(np.linalg.norm(self._twist / self._unit)), 1e-300)
        unit = self._surface.scaling.wrench_unit

        def motion(angle: float) -> Floats:
            return np.asarray(np.cos(angle) * self._twist / size + np.sin(angle) * along)

        def wrench(angle: float) -> Floats:
            return self._surface.wrench_of_twist(motion(angle))

        def moment(angle: float) -> float:
            return float(across @ (wrench(angle) / unit))

        angles = np.linspace(0.0, 0.5 * np.pi * (1.0 - 1e-9), _SCANNED)
        motions = np.outer(np.cos(angles), self._twist / size) + np.outer(np.sin(angles), along)
        moments = (self._surface.wrench_of_twist(motions) / unit) @ across
        found = []
        # Coulomb's friction makes the moment rise and fall: keep all of its roots.
        for place in np.flatnonzero(moments[:-1] * moments[1:] < 0.0):
            sign = 1.0 if moments[place + 1] > 0.0 else -1.0
            ends = float(angles[place]), float(angles[place + 1])
            low, high = root_bracket(partial(_signed, moment, sign), *ends, 1e-16, 1e-15)
            below, above = moment(low), moment(high)
            share = below / (below - above) if below * above < 0.0 else 0.5
            load = (1.0 - share) * wrench(low) + share * wrench(high)
            inside, shares = _shares(self._cone[chosen], (load / unit)[np.newaxis])
            if not inside[0]:
                continue
            spread = np.zeros(4)
            spread[chosen] = shares[0]
            angle = 0.5 * (low + high)
            first, second = (_MODES[slip > 0.0] for slip in slips.tolist())
            twist = motion(angle) * (size / np.cos(angle))
            found.append(TwoPointPush(twist, (first, second), load, self._forces(spread)))
        return found


def _signed(function: Callable[[float], float], sign: float, value: float) -> float:
    return sign * function(value)
