# SPDX-License-Identifier: Apache-2.0
"""What of a limit surface matters at one contact: a section in the plane, or along a line.

The wrenches of all forces through a contact fill a plane. Where a kind knows its load factor in
closed form, the section of its surface with that plane is a closed curve, whose outward normal at
a force is along the velocity that the force causes at the contact: two numbers where the surface
has three. Where a kind knows its dissipation, the motions in which the contact has a given
velocity form a line, along which the dissipation is a convex function of the turning rate.

All arrays are columns, one contact each; forces and velocities have components along the inward
normal and to its left.
"""

from __future__ import annotations

from functools import singledispatch
from typing import TYPE_CHECKING, Protocol

import numpy as np

from limit_surface_ros.surface.gauges.power_scale import power_scale
from limit_surface_ros.surface.kinds.polynomial import Polynomial
from limit_surface_ros.surface.kinds.power_sum import PowerSum
from limit_surface_ros.surface.linalg import root_of

if TYPE_CHECKING:
    from limit_surface_ros.checks import Bools, Complexes, Floats
    from limit_surface_ros.surface.base import LimitSurface


# Form of a force, in parts of the largest, below which a norm may be at its kink.
_CORNER = 1e-12
# Angle [rad] over which differences are taken where no derivative is known.
_STEP = 1e-5


class PlaneSection(Protocol):
    """The section of a surface with the plane of forces through a contact."""

    def of_contacts(self, along: Floats, across: Floats) -> Floats:
        """Return what `respond` needs of contacts, one column each, shape (r, m).

        Args:
            along: Scaled wrenches of unit forces along the normals, shape (3, m).
            across: The same for forces to the left of the normals, shape (3, m).
        """
        ...

    def guess(self, contacts: Floats, wanted: Floats) -> Floats:
        """Return angles (m,) near those of the forces that cause velocities at given angles."""
        ...

    def in_corners(self, contacts: Floats, angles: Floats) -> Bools:
        """Tell near which contacts' forces at angles (m,), left or right, a corner may be."""
        ...

    def respond(self, contacts: Floats, angles: Floats) -> tuple[Floats, Floats, Floats]:
        """Return the velocity that a unit force at an angle causes, and how it turns.

        Returns:
            The components of a velocity v of any length, along the force and to its left, and
            h = (v x v') / (v.f), v' its derivative by the force's angle: the curvature of the
            section times the length of v.
        """
        ...


@singledispatch
def plane_section(surface: LimitSurface) -> PlaneSection:
    """Return the section of a surface; a kind that is not registered answers by its maps."""
    return _AnySection(surface)


@plane_section.register
def _(surface: PowerSum) -> PlaneSection:
    roots = np.array([root_of(matrix) for matrix in surface.matrices])
    if len(roots) == 1 or bool((surface.exponents == 0.5).all()):
        return _NormSection(roots)
    return _PowerSection(roots, surface.exponents)


@plane_section.register
def _(surface: Polynomial) -> PlaneSection:
    return _QuarticSection(surface)


class _NormSection:
    """Of a sum of norms, sum_i |R_i f|.

    In the axes of the form S_i = J A_i J' of a term, with eigenvalues M and m, a force at the
    angle d has f'S f = M cos(d)^2 + m sin(d)^2 =: q, and the velocity of that term is sqrt(q)
    along the force and (m - M) sin(d) cos(d) / sqrt(q) to its left: no differences, so that a
    term which hardly resists a force costs no digits. Its h is M m / q^(3/2).
    """

    def __init__(self, roots: Floats) -> None:
        """Keep R_i, shape (k, 3, 3)."""
        self._stacked = roots.reshape(-1, 3)
        self._terms = len(roots)

    def of_contacts(self, along: Floats, across: Floats) -> Floats:
        """Return the angle of the first axis, M, m, m - M and M m of each term."""
        count = along.shape[1]
        n = (self._stacked @ along).reshape(-1, 3, count)
        t = (self._stacked @ across).reshape(-1, 3, count)
        b = 2.0 * np.einsum("kcm,kcm->km", n, t)
        n_n, t_t = np.einsum("kcm,kcm->km", n, n), np.einsum("kcm,kcm->km", t, t)
        c = n_n - t_t
        # |n x t|^2 is the form's determinant, without a difference of squares.
        x = n[:, 1] * t[:, 2] - n[:, 2] * t[:, 1]
        y = n[:, 2] * t[:, 0] - n[:, 0] * t[:, 2]
        z = n[:, 0] * t[:, 1] - n[:, 1] * t[:, 0]
        determinant = x * x + y * y + z * z
        largest = 0.5 * (n_n + t_t + np.sqrt(b * b + c * c))
        least = determinant / np.maximum(largest, 1e-300)
        return np.concatenate(
            [0.5 * np.arctan2(b, c), largest, least, least - largest, determinant]
        )

    def guess(self, contacts: Floats, wanted: Floats) -> Floats:
        """Return the answer for the ellipsoid of the terms' sum."""
        axis, largest, least, less, _ = contacts.reshape(5, self._terms, -1)
        total = np.add.reduce(largest + least)
        turned = -np.add.reduce(less * np.exp(2j * axis))
        # (S^-1 u) of S = (total + turned conj) / 2, up to its length.
        u = np.exp(1j * wanted)
        return np.asarray(np.angle(total * u - turned * np.conj(u)))

    def in_corners(self, contacts: Floats, angles: Floats) -> Bools:
        """See `PlaneSection`; a norm is all but zero there."""
        axis, largest, least, _, _ = contacts.reshape(5, self._terms, -1)
        near = np.zeros(len(angles), dtype=bool)
        rows = np.flatnonzero((least <= _CORNER * largest).any(axis=0))
        if len(rows):
            axis, largest, least = (each.take(rows, axis=1) for each in (axis, largest, least))
            for turn in (angles[rows] - axis, -angles[rows] - axis):
                square = largest * np.cos(turn) ** 2 + least
                near[rows] |= (square <= _CORNER * largest).any(axis=0)
        return near

    def respond(self, contacts: Floats, angles: Floats) -> tuple[Floats, Floats, Floats]:
        """See `PlaneSection`."""
        axis, largest, least, less, determinant = contacts.reshape(5, self._terms, -1)
        turn = angles - axis
        c, s = np.cos(turn), np.sin(turn)
        square = largest * (c * c)
        square += least * (s * s)
        norm = np.sqrt(square)
        along = np.add.reduce(norm)
        if not norm.all():
            # A term that does not resist a force adds nothing to its velocity.
            norm[norm == 0.0] = square[square == 0.0] = np.inf
        c *= s
        c *= less
        c /= norm
        norm *= square
        return along, np.add.reduce(c), np.add.reduce(determinant / norm)


class _PowerSection(_NormSection):
    """Of a sum of powers, whose terms weigh w_i instead of 1 / |R_i f|."""

    def __init__(self, roots: Floats, exponents: Floats) -> None:
        """Keep R_i, shape (k, 3, 3), and p_i, shape (k,)."""
        super().__init__(roots)
        self._exponents = 2.0 * exponents[:, np.newaxis]
        self._scale = power_scale(exponents)

    def respond(self, contacts: Floats, angles: Floats) -> tuple[Floats, Floats, Floats]:
        """See `PlaneSection`; the weights' own change turns the velocity too."""
        axis, largest, least, less, _ = contacts.reshape(5, self._terms, -1)
        turn = angles - axis
        c, s = np.cos(turn), np.sin(turn)
        # The forms f'S f, t'S f and t'S t, t to the left of f.
        square = largest * c * c + least * s * s
        mixed, beside = less * s * c, largest * s * s + least * c * c
        _, weights = self._scale.load_factors_and_weights(square.copy())
        along, across = np.add.reduce(weights * square), np.add.reduce(weights * mixed)
        square[square == 0.0] = np.inf
        # d log w_i, up to what is common to all.
        own = (self._exponents - 2.0) * mixed / square - self._exponents * (across / along)
        turned_along = np.add.reduce(weights * (mixed + own * square))
        turned_across = np.add.reduce(weights * (beside + own * mixed))
        return along, across, turned_across - across / along * turned_along


class _QuarticSection:
    """Of a polynomial of fourth order: five numbers, e_k for c^(4 - k) s^k.

    They belong to the axes along the force without a moment and to its left: at a contact far
    from the reference point forces along others have moments beside which a force counts little,
    and their numbers would lose it.
    """

    def __init__(self, surface: Polynomial) -> None:
        """Keep the polynomial."""
        self._surface = surface

    def of_contacts(self, along: Floats, across: Floats) -> Floats:
        """Return the angle of the first axis and e_0 to e_4."""
        arm = np.hypot(along[2], across[2])
        safe = np.where(arm > 0.0, arm, 1.0)
        c, s = np.where(arm > 0.0, across[2] / safe, 1.0), -along[2] / safe
        first, second = c * along + s * across, c * across - s * along
        first[2] = 0.0
        size = np.maximum(1.0, arm)
        second /= size
        value, gradient = self._surface.value, self._surface.gradient
        ends = [value(first.T), value(second.T)]
        sides = [
            (gradient(first.T) * second.T).sum(axis=1),
            (gradient(second.T) * first.T).sum(axis=1),
        ]
        # p(1, 1) + p(1, -1) = 2 (e_0 + e_2 + e_4).
        both = 0.5 * (value((first + second).T) + value((first - second).T))
        found = np.array([ends[0], sides[0], both - ends[0] - ends[1], sides[1], ends[1]])
        return np.concatenate([[np.arctan2(s, c)], found * size ** np.arange(5.0)[:, np.newaxis]])

    def guess(self, contacts: Floats, wanted: Floats) -> Floats:
        """Return the answer for the ellipse through the axes' ends."""
        axis, n, t = contacts[0], np.sqrt(contacts[1]), np.sqrt(contacts[5])
        turn = wanted - axis
        return np.asarray(np.angle(np.exp(1j * axis) * (t * np.cos(turn) + 1j * n * np.sin(turn))))

    def in_corners(self, contacts: Floats, angles: Floats) -> Bools:
        """See `PlaneSection`; none is known."""
        return np.zeros(len(angles), dtype=bool)

    def respond(self, contacts: Floats, angles: Floats) -> tuple[Floats, Floats, Floats]:
        """See `PlaneSection`."""
        axis, e0, e1, e2, e3, e4 = contacts
        c, s = np.cos(angles - axis), np.sin(angles - axis)
        cc, cs, ss = c * c, c * s, s * s
        v_n = 4.0 * e0 * cc * c + 3.0 * e1 * cc * s + 2.0 * e2 * c * ss + e3 * ss * s
        v_t = e1 * cc * c + 2.0 * e2 * cc * s + 3.0 * e3 * c * ss + 4.0 * e4 * ss * s
        nn = 12.0 * e0 * cc + 6.0 * e1 * cs + 2.0 * e2 * ss
        nt = 3.0 * e1 * cc + 4.0 * e2 * cs + 3.0 * e3 * ss
        tt = 2.0 * e2 * cc + 6.0 * e3 * cs + 12.0 * e4 * ss
        turned_n, turned_t = nt * c - nn * s, tt * c - nt * s
        along = v_n * c + v_t * s
        return along, v_t * c - v_n * s, (v_n * turned_t - v_t * turned_n) / along


class _AnySection:
    """Of a kind of which nothing but its maps is known: h by differences."""

    def __init__(self, surface: LimitSurface) -> None:
        """Keep the surface."""
        self._surface = surface
        self._unit = surface.scaling.wrench_unit[:, np.newaxis]

    def of_contacts(self, along: Floats, across: Floats) -> Floats:
        """Return both wrenches, shape (6, m)."""
        return np.concatenate([along, across])

    def guess(self, contacts: Floats, wanted: Floats) -> Floats:
        """Return the answer for a body that follows a force."""
        return wanted

    def in_corners(self, contacts: Floats, angles: Floats) -> Bools:
        """See `PlaneSection`; none is known."""
        return np.zeros(len(angles), dtype=bool)

    def respond(self, contacts: Floats, angles: Floats) -> tuple[Floats, Floats, Floats]:
        """See `PlaneSection`."""
        before, here, after = (
            self._velocity(contacts, angles + step) for step in (-_STEP, 0.0, _STEP)
        )
        turned = np.angle(np.conj(before) * after) / (2.0 * _STEP)
        v = np.conj(np.exp(1j * angles)) * here
        return v.real, v.imag, turned * np.abs(v) ** 2 / v.real

    def _velocity(self, contacts: Floats, angles: Floats) -> Complexes:
        along, across = contacts[:3], contacts[3:]
        loads = along * np.cos(angles) + across * np.sin(angles)
        twists = self._surface.twist_of_wrench((loads * self._unit).T)
        scaled = (twists / self._surface.scaling.twist_unit).T
        return np.asarray((along * scaled).sum(axis=0) + 1j * (across * scaled).sum(axis=0))


class LineSection:
    """The dissipation D = sum_k |R_k V| along the line of motions V = V_0 + w d.

    With d a turn about the contact, each term is |R_k V|^2 = g_k (w - w_k)^2 + l_k^2: sums of
    squares, so that a support point nearly at rest costs no digits.
    """

    def __init__(self, forms: Floats) -> None:
        """Factor the terms of a dissipation, the B_k in scaled variables (k, 3, 3)."""
        self.terms = len(forms)
        self._stacked = np.array([root_of(form) for form in forms]).reshape(-1, 3)

    def of_lines(self, motion: Floats, turn: Floats) -> Floats:
        """Return g_k, w_k and l_k^2 of lines, one column each, shape (3 k, m).

        Args:
            motion: V_0 in scaled variables, shape (3, m).
            turn: d in scaled variables, shape (3, m).
        """
        count = motion.shape[1]
        p = (self._stacked @ motion).reshape(-1, 3, count)
        d = (self._stacked @ turn).reshape(-1, 3, count)
        g = np.einsum("kcm,kcm->km", d, d)
        cross = (
            (p[:, 1] * d[:, 2] - p[:, 2] * d[:, 1]) ** 2
            + (p[:, 2] * d[:, 0] - p[:, 0] * d[:, 2]) ** 2
            + (p[:, 0] * d[:, 1] - p[:, 1] * d[:, 0]) ** 2
        )
        turns = g > 0.0
        safe = np.where(turns, g, 1.0)
        place = np.where(turns, -np.einsum("kcm,kcm->km", p, d) / safe, 0.0)
        least = np.where(turns, cross / safe, np.einsum("kcm,kcm->km", p, p))
        return np.concatenate([g, place, least])

    def dissipation(self, lines: Floats, w: Floats) -> tuple[Floats, Floats, Floats]:
        """Return D and its first and second derivative by w, each (m,)."""
        g, place, least = lines.reshape(3, self.terms, -1)
        arm = w - place
        square = arm * arm
        square *= g
        square += least
        norm = np.sqrt(square)
        total = np.add.reduce(norm)
        # A term at rest adds no moment.
        inverse = np.divide(1.0, norm, out=np.zeros_like(norm), where=norm > 0.0)
        arm *= g
        arm *= inverse
        moment = np.add.reduce(arm)
        inverse **= 3
        inverse *= least
        inverse *= g
        return total, moment, np.add.reduce(inverse)
