# SPDX-License-Identifier: Apache-2.0
"""Many pushes at once: the force within the friction cone, or the edge along which it slides.

With the load factor in closed form the force's angle is looked for, with the dissipation in closed
form the turning rate; see `push_roots`. The surface's own maps then give the motions. Vectors of
the plane are complex numbers here: a product with a unit one turns, conj(a) b holds the scalar
product and the cross product.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from limit_surface_ros.motion.contact_sections import LineSection, PlaneSection, plane_section
from limit_surface_ros.motion.outcomes import MODES
from limit_surface_ros.motion.push_roots import (
    EXACT,
    SLIDE_LEFT,
    SLIDE_RIGHT,
    STICK,
    force_angles,
    turning_rates,
)
from limit_surface_ros.motion.push_scalar import ContactScalar

if TYPE_CHECKING:
    from limit_surface_ros.checks import Bools, Complexes, Floats, Places
    from limit_surface_ros.motion.outcomes import Push
    from limit_surface_ros.surface.base import LimitSurface

# Angle [rad] from a corner beyond which the surface's own map is surely past its kink.
_ROUNDING = 1e-12
# Turning rate, in parts of its unit, that sets a resting support point in motion.
_REST = 1e-13
# The side to which pushers of each mode slide.
_SIDES = np.array([0.0, 1.0, -1.0, 0.0])


class Contacts(NamedTuple):
    """Pushes whose pusher approaches, one each, shape (m,).

    Attributes:
        points: About the reference point [m].
        normals: Unit, inward.
        edges: Unit forces at the left edges of the friction cones, of which the normal is 1.
        velocities: Unit, with a component along the normal above 0.
    """

    points: Complexes
    normals: Complexes
    edges: Complexes
    velocities: Complexes

    def wrenches(self, forces: Complexes) -> Floats:
        """Return wrenches (m, 3) of forces, given from the normals."""
        return loads_at(self.points, self.normals * forces)

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
        self._length = surface.scaling.characteristic_length
        self._section: PlaneSection | LineSection
        forms = surface.scaled_forms
        if forms is not None:
            self._section = LineSection(forms)
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
        n = contacts.normals
        arm = np.conj(contacts.points) * (n / self._length)
        along = np.array([n.real, n.imag, arm.imag])
        across = np.array([-n.imag, n.real, arm.real])
        data = section.of_contacts(along, across)
        wanted = np.angle(np.conj(n) * contacts.velocities)
        if starts is None:
            first = section.guess(data, wanted)
        else:
            first = starts
            new = np.isnan(starts)
            if new.any():
                first = np.where(new, section.guess(data, wanted), starts)
        limit = np.angle(contacts.edges)
        low, high, modes = force_angles(section, data, limit, wanted, first, exact)
        jumps = np.flatnonzero((low < high) & (modes == STICK))
        if len(jumps):
            # The surface's own map takes what is close for the corner: both sides must be met.
            low[jumps] -= _ROUNDING
            high[jumps] += _ROUNDING
        twists, loads = self._caused(contacts, low, modes, wrenches)
        if len(jumps):
            some = contacts.take(jumps)
            more, more_loads = self._caused(some, high[jumps], modes[jumps], wrenches)
            _mix(some, twists, loads, jumps, more, more_loads)
        # Where an edge of the friction cone lies in a corner the section and the surface's own map
        # may find two of the many velocities there: what is so rare is solved one by one.
        for row in np.flatnonzero(section.in_corners(data, limit)).tolist():
            alone = self._alone(contacts, row)
            twists[row], modes[row] = alone.twist, MODES.index(alone.mode)
            if loads is not None:
                loads[row] = alone.wrench
        _follow(contacts, twists, modes)
        return Answers(twists, modes, loads, low)

    def _alone(self, contacts: Contacts, row: int) -> Push:
        """Return what one of the pushes does, from the maps for one vector."""
        point, normal, edge, velocity = (complex(each[row]) for each in contacts)
        contact = ContactScalar(
            self._surface,
            (point.real, point.imag),
            (normal.real, normal.imag),
            edge.imag / edge.real if edge.real > 0.0 else math.inf,
        )
        return contact.push((velocity.real, velocity.imag))

    def _caused(
        self, contacts: Contacts, angles: Floats, modes: Places, wrenches: bool
    ) -> tuple[Floats, Floats | None]:
        """Return the unit twists and the wrenches that forces at angles cause."""
        forces = np.exp(1j * angles)
        slides = np.flatnonzero(modes != STICK)
        if len(slides):
            edges = contacts.edges[slides]
            forces[slides] = edges.real + 1j * _SIDES[modes[slides]] * edges.imag
        return self._motions(contacts.wrenches(forces), wrenches)

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
        p, u = contacts.points / self._length, contacts.velocities
        one = np.ones(len(p))
        motion, turn = np.array([u.real, u.imag, 0.0 * one]), np.array([p.imag, -p.real, one])
        lines = section.of_lines(motion, turn)
        low, high = turning_rates(section, lines, starts, exact)
        twists, loads = self._turned(motion, turn, low)
        jumps = np.flatnonzero(low < high)
        rates = low
        if len(jumps):
            # Support points stand still in between: their loads fill the range without a moment.
            # They count as at rest, and add nothing, up to some way from there.
            apart = _REST * (1.0 + np.abs(low[jumps]))
            line, about = (motion[:, jumps], turn[:, jumps]), contacts.points[jumps]
            less, more = (
                self._turned(*line, ends)[1] for ends in (low[jumps] - apart, high[jumps] + apart)
            )
            below, above = (_moments(about, each) for each in (less, more))
            crossed = below < above
            share = np.where(crossed, below / np.where(crossed, below - above, 1.0), 0.5)
            share = np.clip(share, 0.0, 1.0)
            rates = low.copy()
            rates[jumps] += share * (high[jumps] - low[jumps])
            loads[jumps] = less + share[:, np.newaxis] * (more - less)
            twists[jumps] = self._line_twists(*line, rates[jumps])
        force = np.conj(contacts.normals) * (loads[:, 0] + 1j * loads[:, 1])
        edges = contacts.edges
        beyond = np.abs(force.imag) * edges.real > force.real * edges.imag
        modes = np.where(beyond, np.where(force.imag > 0.0, SLIDE_LEFT, SLIDE_RIGHT), STICK)
        slides = np.flatnonzero(beyond)
        if len(slides):
            some, picked = contacts.take(slides), modes[slides]
            moved, edge_loads = self._caused(some, np.zeros(len(slides)), picked, wrenches)
            _follow(some, moved, picked)
            twists[slides] = moved
            if edge_loads is not None:
                loads[slides] = edge_loads
        return Answers(twists, modes, loads if wrenches else None, rates)

    def _line_twists(self, motion: Floats, turn: Floats, rates: Floats) -> Floats:
        """Return physical twists V_0 + w d (m, 3); the rate is in scaled variables."""
        twists = motion + rates * turn
        twists[2] /= self._length
        return np.ascontiguousarray(twists.T)

    def _turned(self, motion: Floats, turn: Floats, rates: Floats) -> tuple[Floats, Floats]:
        twists = self._line_twists(motion, turn, rates)
        return twists, self._surface.wrench_of_twist(twists)


def _moments(points: Complexes, wrenches: Floats) -> Floats:
    """Return the moments (m,) of wrenches (m, 3) about points."""
    force = wrenches[:, 0] + 1j * wrenches[:, 1]
    return np.asarray(wrenches[:, 2] - (np.conj(points) * force).imag)


def loads_at(points: Complexes, forces: Complexes) -> Floats:
    """Return wrenches (m, 3) of forces (m,) through points [m]."""
    loads = np.empty((len(forces), 3))
    loads[:, 0], loads[:, 1] = forces.real, forces.imag
    loads[:, 2] = (np.conj(points) * forces).imag
    return loads


def contact_velocities(points: Complexes, twists: Floats) -> Complexes:
    """Return the velocities (m,) [m/s] at points of bodies with twists (m, 3)."""
    velocities = (1j * twists[:, 2]) * points
    velocities.real += twists[:, 0]
    velocities.imag += twists[:, 1]
    return velocities


def _follow(contacts: Contacts, twists: Floats, modes: Places) -> None:
    """Scale twists so that the contact keeps up with a pusher of unit velocity."""
    moved, u = contact_velocities(contacts.points, twists), contacts.velocities
    # Along the pusher's velocity if it sticks, along the normal if it slides.
    along = np.where(modes == STICK, moved, contacts.normals)
    speed = (np.conj(along) * u).real / (np.conj(along) * moved).real
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
    lower, upper = (contact_velocities(contacts.points, each) for each in (twists[rows], more))
    # Unit velocities weigh as the sines, whichever the lengths of the motions.
    first, second = (
        np.maximum(sign * (np.conj(contacts.velocities) * each).imag / np.abs(each), 0.0)
        for each, sign in ((upper, 1.0), (lower, -1.0))
    )
    low = np.where(first + second == 0.0, 1.0, first) / np.abs(lower)
    high = second / np.abs(upper)
    twists[rows] = low[:, np.newaxis] * twists[rows] + high[:, np.newaxis] * more
    if loads is not None and more_loads is not None:
        part = (high / (low + high))[:, np.newaxis]
        loads[rows] += part * (more_loads - loads[rows])
