# SPDX-License-Identifier: Apache-2.0
"""Surfaces given by their dissipation D(v), a sum of norms: loads in closed form, twists exact."""

from __future__ import annotations

from abc import abstractmethod
from functools import cached_property
from math import sqrt
from typing import TYPE_CHECKING

import numpy as np

from limit_surface_ros.surface.base import LimitSurface
from limit_surface_ros.surface.gauges.norm_sum import FormTerms
from limit_surface_ros.surface.gauges.one_load import norm_gradient_of_one, one_load_terms
from limit_surface_ros.surface.gauges.one_motion import OneMotion
from limit_surface_ros.surface.linalg import even_directions, of_unit_length, root_of
from limit_surface_ros.surface.support.solvers import ConvexInverse
from limit_surface_ros.surface.support.tabulated import TabulatedInverse

if TYPE_CHECKING:
    from limit_surface_ros.checks import Floats
    from limit_surface_ros.surface.gauges.norm_sum import DissipationTerms
    from limit_surface_ros.surface.gauges.one_load import Term, Vector
    from limit_surface_ros.surface.support.solvers import Inverse

# Twists that the inverse may start from.
_STARTS = 400
# Part of a load along a motion that nothing resists, above which the load causes that motion.
_FREE = 1e-12
# Terms up to which plain floats are quicker than numpy for one twist.
_FEW = 30
# Relative eigenvalue below which a motion counts as resisted by nothing.
_NO_RESISTANCE = 1e-14
# Sizes of one wrench between which no number runs out on the way.
_SMALLEST = 1e-100
_LARGEST = 1e100


class DissipationSurface(LimitSurface):
    """What kinds share whose dissipation is a sum of norms, D(v) = sum_k sqrt(v' B_k v).

    The load of maximum dissipation is the gradient of D; at a kink, where the twist belongs to a
    facet, it is the facet's centre. A motion that no term resists (a single support point turns
    freely) makes the load factor of any load along it infinite, and the twist that motion.
    """

    @property
    @abstractmethod
    def scaled_forms(self) -> Floats:
        """The B_k in scaled variables, shape (k, 3, 3)."""

    @cached_property
    def _terms(self) -> DissipationTerms:
        return FormTerms(np.array([root_of(form) for form in self.scaled_forms]))

    @cached_property
    def _free(self) -> Floats:
        """Orthonormal motions that nothing resists, shape (q, 3)."""
        total = self.scaled_forms.sum(axis=0)
        size, vectors = np.linalg.eigh(total)
        free: Floats = vectors[:, size <= _NO_RESISTANCE * size[-1]].T
        return free

    @cached_property
    def _inverse(self) -> Inverse:
        return TabulatedInverse(self._terms, self._inverse_of_any)

    @cached_property
    def _inverse_of_any(self) -> ConvexInverse:
        terms = self._terms
        if len(self._free):
            # A resistance within one norm keeps the least twist at zero along the free motions.
            forms = self.scaled_forms.copy()
            forms[0] += np.trace(forms[0]) * self._free.T @ self._free
            terms = FormTerms(np.array([root_of(form) for form in forms]))
        return ConvexInverse(terms, even_directions(_STARTS).T, terms.corners())

    @cached_property
    def _one_twist_terms(self) -> list[Term] | None:
        """The terms for one physical twist; None where numpy is the quicker."""
        forms = self.scaled_forms
        if len(forms) > _FEW:
            return None
        roots = np.array([root_of(form) for form in forms])
        return one_load_terms(roots, np.full(len(forms), 0.5), self.scaling.twist_unit)

    @cached_property
    def _one_motion(self) -> OneMotion | None:
        """The inverse for one load; None where numpy is the quicker, or care is needed."""
        forms = self.scaled_forms
        if len(forms) > _FEW or len(self._free):
            return None
        return OneMotion(np.array([root_of(form) for form in forms]), self._inverse_of_any)

    def _twist_and_load_factor_of_one(self, wrench: Vector) -> tuple[Vector, float] | None:
        found = self._motion_of_one(wrench)
        return None if found is None else (self._twist_along(found[0]), found[1])

    def _twist_of_one(self, wrench: Vector) -> Vector | None:
        found = self._motion_of_one(wrench)
        if found is None:
            return None
        return self._twist_along(found[0])

    def _twist_along(self, motion: Vector) -> Vector:
        """Return the twist of unit norm along one scaled motion."""
        x, y, z = motion
        length = sqrt(x * x + y * y + z * z)
        return x / length, y / length, z / (length * self.scaling.characteristic_length)

    def _load_factor_of_one(self, wrench: Vector) -> float | None:
        found = self._motion_of_one(wrench)
        if found is None:
            return None
        return found[1]

    def _motion_of_one(self, wrench: Vector) -> tuple[Vector, float] | None:
        """Return the scaled motion v with D(v) = 1 under one wrench, and its power, the factor."""
        inverse = self._one_motion
        if inverse is None:
            return None
        force = self.scaling.friction_force
        x, y, z = wrench[0], wrench[1], wrench[2] / self.scaling.characteristic_length
        size = abs(x) + abs(y) + abs(z)
        if not _SMALLEST < size < _LARGEST:
            return None
        load = (x / size, y / size, z / size)
        motion = inverse.of_load(load)
        if motion is None:
            return None
        power = motion[0] * load[0] + motion[1] * load[1] + motion[2] * load[2]
        return motion, power * (size / force)

    def _wrench_of_one(self, twist: Vector) -> Vector | None:
        terms = self._one_twist_terms
        load = None if terms is None else norm_gradient_of_one(terms, twist)
        if load is None:
            return None
        # The gradient for physical twists is the physical wrench for a friction force of 1 N.
        force = self.scaling.friction_force
        return force * load[0], force * load[1], force * load[2]

    def _loads(self, twists: Floats) -> Floats:
        return self._terms.gradient(twists)

    def _twists(self, loads: Floats) -> Floats:
        return of_unit_length(self._solve(loads)[0])

    def _twists_and_load_factors(self, loads: Floats) -> tuple[Floats, Floats]:
        motions, factors = self._solve(loads)
        return of_unit_length(motions), factors

    def _load_factors(self, loads: Floats) -> Floats:
        factors = np.zeros(loads.shape[1])
        some = loads.any(axis=0)
        if some.any():
            factors[some] = self._solve(loads[:, some])[1]
        return factors

    def _solve(self, loads: Floats) -> tuple[Floats, Floats]:
        """Return twists and load factors of scaled loads, of which none is zero."""
        if not len(self._free):
            return self._inverse.solve(loads)
        along = self._free.T @ (self._free @ loads)
        moves = np.abs(along).max(axis=0) > _FREE * np.abs(loads).max(axis=0)
        twists, factors = along, np.full(loads.shape[1], np.inf)
        if not moves.all():
            twists[:, ~moves], factors[~moves] = self._inverse.solve((loads - along)[:, ~moves])
        return twists, factors
