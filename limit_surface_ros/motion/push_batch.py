# SPDX-License-Identifier: Apache-2.0
"""Many pushes at once: the force within the friction cone, or the edge along which it slides.

With the load factor in closed form the force's angle is looked for, with the dissipation in closed
form the turning rate; see `push_roots`. The surface's own maps then give the motions.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from limit_surface_ros.motion.contact_sections import LineSection, PlaneSection, plane_section
from limit_surface_ros.motion.push_roots import (
    EXACT,
    SLIDE_LEFT,
    SLIDE_RIGHT,
    STICK,
    force_angles,
    turning_rates,
)
from limit_surface_ros.surface.kinds.dissipation_surface import DissipationSurface

if TYPE_CHECKING:
    from limit_surface_ros.checks import Bools, Floats, Places
    from limit_surface_ros.surface.base import LimitSurface


# Angle [rad] beyond which two ways to compute one wrench agree on the side of a corner.
_ROUNDING = 2e-15
# Angle [rad] beyond which two ways to compute one wrench agree on the side of a corner.
_ROUNDING = 2e-15


class Contacts(NamedTuple):
    """Pushes whose pusher approaches: one row each.

    Attributes:
        points: About the reference point [m], shape (m, 2).
        normals: Unit, inward, shape (m, 2).
        edges: cos and sin of the friction angle, shape (m, 2).
        velocities: Unit, shape (m, 2), with a component along the normal above 0.
    """

    points: Floats
    normals: Floats
    edges: Floats
    velocities: Floats

    def wrenches(self, along: Floats, across: Floats) -> Floats:
        """Return wrenches (m, 3) of forces along the normal and to its left."""
        nx, ny = self.normals.T
        fx, fy = along * nx - across * ny, along * ny + across * nx
        x, y = self.points.T
        return np.stack([fx, fy, x * fy - y * fx], axis=1)

    def take(self, rows: Places | Bools) -> Contacts:
        """Return some of the pushes."""
        return Contacts(*(each[rows] for each in self))


class Answers(NamedTuple):
    """What pushes with a unit velocity do: twists (m, 3), modes (m,), wrenches (m, 3) or None.

    `starts` (m,) are numbers from which a push nearby is found sooner.
    """

    twists: Floats
    modes: Places
    wrenches: Floats | None
    starts: Floats


class PushBatch:
    """Solves pushes of one surface."""

    def __init__(self, surface: LimitSurface) -> None:
        """Prepare what all pushes share."""
        self._surface = surface
        self._section: PlaneSection | LineSection
        if isinstance(surface, DissipationSurface):
            self._section = LineSection(surface)
        else:
            self._section = plane_section(surface)

    def solve(
        self,
        contacts: Contacts,
        *,
        starts: Floats | None = None,
        exact: float = EXACT,
        wrenches: bool = True,
    ) -> Answers:
        """Return what the pushes do.

        Args:
            contacts: The pushes.
            starts: Of pushes nearby, shape (m,); NaN where there is none.
            exact: Error of an angle or of a moment that counts as none.
            wrenches: Whether they are wanted.
        """
        if isinstance(self._section, LineSection):
            return self._by_turning(self._section, contacts, starts, exact, wrenches)
        return self._by_force(self._section, contacts, starts, exact, wrenches)

    def _by_force(
        self,
        section: PlaneSection,
        contacts: Contacts,
        starts: Floats | None,
        exact: float,
        wrenches: bool,
    ) -> Answers:
        nx, ny = contacts.normals.T
        ux, uy = contacts.velocities.T
        u, w = ux * nx + uy * ny, uy * nx - ux * ny
        zero, one = np.zeros_like(u), np.ones_like(u)
        unit = self._surface.scaling.wrench_unit / self._surface.scaling.friction_force
        along = (contacts.wrenches(one, zero) / unit).T
        across = (contacts.wrenches(zero, one) / unit).T
        data = section.of_contacts(along, across)
        first = section.guess(data, u, w)
        if starts is not None:
            first = np.where(np.isfinite(starts), starts, first)
        low, high, modes = force_angles(section, data, contacts.edges, u, w, first, exact)
        jumps = np.flatnonzero(low < high)
        if len(jumps):
            # The surface's own map rounds otherwise: both sides of a corner must be met.
            low[jumps] -= _ROUNDING
            high[jumps] += _ROUNDING
        twists, loads = self._caused(contacts, low, modes, wrenches)
        if len(jumps):
            some, picked = contacts.take(jumps), modes[jumps]
            more, more_loads = self._caused(some, high[jumps], picked, wrenches)
            _mix(some, twists, loads, jumps, more, more_loads)
        _follow(contacts, twists, modes)
        return Answers(twists, modes, loads, low)

    def _caused(
        self, contacts: Contacts, angles: Floats, modes: Places, wrenches: bool
    ) -> tuple[Floats, Floats | None]:
        """Return the unit twists and the wrenches that forces at angles cause."""
        side = _SIDES[modes]
        c = np.where(side == 0.0, np.cos(angles), contacts.edges[:, 0])
        s = np.where(side == 0.0, np.sin(angles), side * contacts.edges[:, 1])
        return self._motions(contacts.wrenches(c, s), wrenches)

    def _motions(self, loads: Floats, wrenches: bool) -> tuple[Floats, Floats | None]:
        """Return the twists that wrenches (m, 3) cause, and the same wrenches on the surface."""
        if not wrenches:
            return self._surface.twist_of_wrench(loads), None
        twists, factors = self._surface.twist_and_load_factor(loads)
        free = ~(factors < np.inf)
        loads /= np.where(free, 1.0, factors)[:, np.newaxis]
        if free.any():
            # A body that turns freely needs no force: what its twist says.
            loads[free] = self._surface.wrench_of_twist(twists[free])
        return twists, loads

    def _by_turning(
        self,
        section: LineSection,
        contacts: Contacts,
        starts: Floats | None,
        exact: float,
        wrenches: bool,
    ) -> Answers:
        length = self._surface.scaling.characteristic_length
        x, y = contacts.points.T / length
        ux, uy = contacts.velocities.T
        zero, one = np.zeros_like(x), np.ones_like(x)
        motion, turn = np.array([ux, uy, zero]), np.array([y, -x, one])
        lines = section.of_lines(motion, turn)
        low, high = turning_rates(section, lines, starts, exact)
        twists, loads = self._turned(motion, turn, low)
        jumps = np.flatnonzero(low < high)
        rates = low.copy()
        if len(jumps):
            # Support points stand still in between: their loads fill the range without a moment.
            _, more = self._turned(motion[:, jumps], turn[:, jumps], high[jumps])
            px, py = contacts.points[jumps].T
            below, above = (w[:, 2] - px * w[:, 1] + py * w[:, 0] for w in (loads[jumps], more))
            crossed = below < above
            share = np.where(crossed, below / np.where(crossed, below - above, 1.0), 0.5)
            share = np.clip(share, 0.0, 1.0)
            rates[jumps] += share * (high[jumps] - low[jumps])
            loads[jumps] += share[:, np.newaxis] * (more - loads[jumps])
            twists[jumps] = self._line_twists(motion[:, jumps], turn[:, jumps], rates[jumps])
        nx, ny = contacts.normals.T
        f_n, f_t = loads[:, 0] * nx + loads[:, 1] * ny, loads[:, 1] * nx - loads[:, 0] * ny
        beyond = np.abs(f_t) * contacts.edges[:, 0] > f_n * contacts.edges[:, 1]
        modes = np.where(beyond, np.where(f_t > 0.0, SLIDE_LEFT, SLIDE_RIGHT), STICK)
        slides = np.flatnonzero(beyond)
        if len(slides):
            some, picked = contacts.take(slides), modes[slides]
            side = _SIDES[picked]
            edge = some.wrenches(some.edges[:, 0], side * some.edges[:, 1])
            twists[slides], edge_loads = self._motions(edge, wrenches)
            if edge_loads is not None:
                loads[slides] = edge_loads
            moved = twists[slides]
            _follow(some, moved, picked)
            twists[slides] = moved
        return Answers(twists, modes, loads if wrenches else None, rates)

    def _line_twists(self, motion: Floats, turn: Floats, rates: Floats) -> Floats:
        """Return physical twists V_0 + w d (m, 3); the rate is in scaled variables."""
        twists = motion + rates * turn
        twists[2] /= self._surface.scaling.characteristic_length
        return np.ascontiguousarray(twists.T)

    def _turned(self, motion: Floats, turn: Floats, rates: Floats) -> tuple[Floats, Floats]:
        twists = self._line_twists(motion, turn, rates)
        # A pusher at a support point may find a motion that nothing resists, a zero twist never.
        return twists, self._surface.wrench_of_twist(twists)


_SIDES = np.array([0.0, 1.0, -1.0, 0.0])


def contact_velocities(points: Floats, twists: Floats) -> tuple[Floats, Floats]:
    """Return the velocities (vx, vy) [m/s] at points (m, 2) of bodies with twists (m, 3)."""
    vx, vy, omega = twists.T
    return vx - omega * points[:, 1], vy + omega * points[:, 0]


def _follow(contacts: Contacts, twists: Floats, modes: Places) -> None:
    """Scale twists so that the contact keeps up with a pusher of unit velocity."""
    vx, vy = contact_velocities(contacts.points, twists)
    ux, uy = contacts.velocities.T
    nx, ny = contacts.normals.T
    stick = modes == STICK
    speed = np.where(
        stick,
        (ux * vx + uy * vy) / np.where(stick, vx * vx + vy * vy, 1.0),
        (ux * nx + uy * ny) / np.where(stick, 1.0, vx * nx + vy * ny),
    )
    twists *= speed[:, np.newaxis]


def _mix(
    contacts: Contacts,
    twists: Floats,
    loads: Floats | None,
    rows: Places,
    more: Floats,
    more_loads: Floats | None,
) -> None:
    """Put the sums of two motions at a corner, along the pusher's velocity, in place of one.

    At a corner of the surface one load has a cone of motions; the two are at its sides.
    """
    ux, uy = contacts.velocities.T
    lower, upper = (contact_velocities(contacts.points, each) for each in (twists[rows], more))
    shares = []
    for (vx, vy), sign in ((upper, 1.0), (lower, -1.0)):
        turned = sign * (ux * vy - uy * vx) / np.hypot(vx, vy)
        shares.append(np.maximum(turned, 0.0))
    none = shares[0] + shares[1] == 0.0
    # Unit velocities weigh as the sines, whichever the lengths of the motions.
    low = np.where(none, 1.0, shares[0]) / np.hypot(*lower)
    high = shares[1] / np.hypot(*upper)
    twists[rows] = low[:, np.newaxis] * twists[rows] + high[:, np.newaxis] * more
    if loads is not None and more_loads is not None:
        part = (high / (low + high))[:, np.newaxis]
        loads[rows] += part * (more_loads - loads[rows])
