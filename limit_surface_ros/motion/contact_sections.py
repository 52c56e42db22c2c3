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
from limit_surface_ros.surface.kinds.dissipation_surface import DissipationSurface
from limit_surface_ros.surface.kinds.polynomial import Polynomial
from limit_surface_ros.surface.kinds.power_sum import PowerSum
from limit_surface_ros.surface.linalg import root_of

if TYPE_CHECKING:
    from limit_surface_ros.checks import Floats
    from limit_surface_ros.surface.base import LimitSurface


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

    def guess(self, contacts: Floats, u: Floats, w: Floats) -> Floats:
        """Return angles (m,) near those of the forces that cause velocities along (u, w)."""
        ...

    def respond(self, contacts: Floats, c: Floats, s: Floats) -> tuple[Floats, Floats, Floats]:
        """Return the velocity that a force (c, s) of unit length causes, and how it turns.

        Returns:
            A velocity (v_n, v_t) of any length along the outward normal of the section, and
            h = (v x v') / (v.f), v' its derivative by the force's angle: the section's curvature
            times the length of v.
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

    With 2x2 roots L_i of the forms of forces, L_i' L_i = J A_i J', the velocity is the sum of
    L_i' L_i f / |L_i f|, and h that of det(L_i)^2 / |L_i f|^3.
    """

    def __init__(self, roots: Floats) -> None:
        """Keep R_i, shape (k, 3, 3)."""
        self._stacked = roots.reshape(-1, 3)
        self._terms = len(roots)

    def of_contacts(self, along: Floats, across: Floats) -> Floats:
        """Return the elements (l11, l12, l21, l22) of each term, and its det(L)^2."""
        count = along.shape[1]
        n = (self._stacked @ along).reshape(-1, 3, count)
        t = (self._stacked @ across).reshape(-1, 3, count)
        a, b, d = (np.einsum("kcm,kcm->km", *pair) for pair in ((n, n), (n, t), (t, t)))
        # |n x t|^2 = a d - b^2, without the difference.
        det = (
            (n[:, 1] * t[:, 2] - n[:, 2] * t[:, 1]) ** 2
            + (n[:, 2] * t[:, 0] - n[:, 0] * t[:, 2]) ** 2
            + (n[:, 0] * t[:, 1] - n[:, 1] * t[:, 0]) ** 2
        )
        # Cholesky's root, pivoted: what it leaves to the second row is small and exact.
        upper = a >= d
        pivot = np.sqrt(np.where(upper, a, d))
        safe = np.where(pivot > 0.0, pivot, 1.0)
        beside, rest = b / safe, np.sqrt(det) / safe
        return np.concatenate(
            [
                np.where(upper, pivot, beside),
                np.where(upper, beside, pivot),
                np.where(upper, 0.0, rest),
                np.where(upper, rest, 0.0),
                det,
            ]
        )

    def guess(self, contacts: Floats, u: Floats, w: Floats) -> Floats:
        """Return the answer for the ellipsoid of the terms' sum."""
        l11, l12, l21, l22, _ = contacts.reshape(5, self._terms, -1)
        a = np.add.reduce(l11 * l11 + l21 * l21)
        b = np.add.reduce(l11 * l12 + l21 * l22)
        d = np.add.reduce(l12 * l12 + l22 * l22)
        return np.asarray(np.arctan2(a * w - b * u, d * u - b * w))

    def respond(self, contacts: Floats, c: Floats, s: Floats) -> tuple[Floats, Floats, Floats]:
        """See `PlaneSection`."""
        l11, l12, l21, l22, det = contacts.reshape(5, self._terms, -1)
        x = l11 * c + l12 * s
        y = l21 * c + l22 * s
        square = x * x + y * y
        if not square.all():
            # A term that does not resist a force adds nothing to its velocity.
            square[square == 0.0] = np.inf
        inverse = 1.0 / np.sqrt(square)
        x *= inverse
        y *= inverse
        v_n = np.add.reduce(l11 * x + l21 * y)
        v_t = np.add.reduce(l12 * x + l22 * y)
        inverse *= det
        inverse /= square
        return v_n, v_t, np.add.reduce(inverse)


class _PowerSection(_NormSection):
    """Of a sum of powers, whose terms weigh w_i instead of 1 / |L_i f|."""

    def __init__(self, roots: Floats, exponents: Floats) -> None:
        """Keep R_i, shape (k, 3, 3), and p_i, shape (k,)."""
        super().__init__(roots)
        self._exponents = exponents[:, np.newaxis]
        self._scale = power_scale(exponents)

    def respond(self, contacts: Floats, c: Floats, s: Floats) -> tuple[Floats, Floats, Floats]:
        """See `PlaneSection`; the weights' own change turns the velocity too."""
        l11, l12, l21, l22, _ = contacts.reshape(5, self._terms, -1)
        x = l11 * c + l12 * s
        y = l21 * c + l22 * s
        square = x * x + y * y
        _, weights = self._scale.load_factors_and_weights(square.copy())
        square[square == 0.0] = np.inf
        # Each term's own velocity q, and its derivative by the force's angle.
        q_n, q_t = l11 * x + l21 * y, l12 * x + l22 * y
        x, y = l12 * c - l11 * s, l22 * c - l21 * s
        r_n, r_t = l11 * x + l21 * y, l12 * x + l22 * y
        v_n, v_t = np.add.reduce(weights * q_n), np.add.reduce(weights * q_t)
        power = v_n * c + v_t * s
        # d log w_i = (2 p_i - 2) (q_i.t) / (q_i.f) - 2 p_i (v.t) / (v.f), up to what is common.
        own = (2.0 * self._exponents - 2.0) * (q_t * c - q_n * s) / square
        own -= 2.0 * self._exponents * ((v_t * c - v_n * s) / power)
        turned_n = np.add.reduce(weights * (r_n + own * q_n))
        turned_t = np.add.reduce(weights * (r_t + own * q_t))
        return v_n, v_t, (v_n * turned_t - v_t * turned_n) / power


class _QuarticSection:
    """Of a polynomial of fourth order: five numbers, e_k for c^(4 - k) s^k."""

    def __init__(self, surface: Polynomial) -> None:
        """Keep the polynomial."""
        self._surface = surface

    def of_contacts(self, along: Floats, across: Floats) -> Floats:
        """Return e_0 to e_4."""
        value, gradient = self._surface.value, self._surface.gradient
        ends = [value(along.T), value(across.T)]
        sides = [
            (gradient(along.T) * across.T).sum(axis=1),
            (gradient(across.T) * along.T).sum(axis=1),
        ]
        # p(1, 1) + p(1, -1) = 2 (e_0 + e_2 + e_4).
        both = 0.5 * (value((along + across).T) + value((along - across).T))
        return np.array([ends[0], sides[0], both - ends[0] - ends[1], sides[1], ends[1]])

    def guess(self, contacts: Floats, u: Floats, w: Floats) -> Floats:
        """Return the answer for the ellipse through the axes' ends."""
        return np.asarray(np.arctan2(w / np.sqrt(contacts[4]), u / np.sqrt(contacts[0])))

    def respond(self, contacts: Floats, c: Floats, s: Floats) -> tuple[Floats, Floats, Floats]:
        """See `PlaneSection`."""
        e0, e1, e2, e3, e4 = contacts
        cc, cs, ss = c * c, c * s, s * s
        v_n = 4.0 * e0 * cc * c + 3.0 * e1 * cc * s + 2.0 * e2 * c * ss + e3 * ss * s
        v_t = e1 * cc * c + 2.0 * e2 * cc * s + 3.0 * e3 * c * ss + 4.0 * e4 * ss * s
        nn = 12.0 * e0 * cc + 6.0 * e1 * cs + 2.0 * e2 * ss
        nt = 3.0 * e1 * cc + 4.0 * e2 * cs + 3.0 * e3 * ss
        tt = 2.0 * e2 * cc + 6.0 * e3 * cs + 12.0 * e4 * ss
        turned_n, turned_t = nt * c - nn * s, tt * c - nt * s
        return v_n, v_t, (v_n * turned_t - v_t * turned_n) / (v_n * c + v_t * s)


class _AnySection:
    """Of a kind of which nothing but its maps is known: h by differences."""

    def __init__(self, surface: LimitSurface) -> None:
        """Keep the surface."""
        self._surface = surface
        self._unit = surface.scaling.wrench_unit[:, np.newaxis]

    def of_contacts(self, along: Floats, across: Floats) -> Floats:
        """Return both wrenches, shape (6, m)."""
        return np.concatenate([along, across])

    def guess(self, contacts: Floats, u: Floats, w: Floats) -> Floats:
        """Return the answer for a body that follows a force."""
        return np.arctan2(w, u)

    def respond(self, contacts: Floats, c: Floats, s: Floats) -> tuple[Floats, Floats, Floats]:
        """See `PlaneSection`."""
        v_n, v_t = self._velocity(contacts, c, s)
        before, after = (self._velocity(contacts, c - d * s, s + d * c) for d in (-_STEP, _STEP))
        turned = np.arctan2(
            before[0] * after[1] - before[1] * after[0],
            before[0] * after[0] + before[1] * after[1],
        )
        return v_n, v_t, turned / (2.0 * _STEP) * (v_n**2 + v_t**2) / (v_n * c + v_t * s)

    def _velocity(self, contacts: Floats, c: Floats, s: Floats) -> tuple[Floats, Floats]:
        along, across = contacts[:3], contacts[3:]
        twists = self._surface.twist_of_wrench(((along * c + across * s) * self._unit).T)
        scaled = (twists / self._surface.scaling.twist_unit).T
        return (along * scaled).sum(axis=0), (across * scaled).sum(axis=0)


class LineSection:
    """The dissipation D = sum_k |R_k V| along the line of motions V = V_0 + w d.

    With d a turn about the contact, each term is |R_k V|^2 = g_k (w - w_k)^2 + l_k^2: sums of
    squares, so that a support point nearly at rest costs no digits.
    """

    def __init__(self, surface: DissipationSurface) -> None:
        """Factor the terms of a dissipation."""
        self.terms = len(surface.scaled_forms)
        self._stacked = np.array([root_of(form) for form in surface.scaled_forms]).reshape(-1, 3)

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
