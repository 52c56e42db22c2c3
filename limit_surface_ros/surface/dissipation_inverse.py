"""From a load to the motion of most power for its dissipation: the inverse of grad D.

The load factor of f is the largest f.v / D(v), and the twist is where that is attained. With
f.v held, this is the minimum of the convex D over a plane. D has kinks, where a support point
rests: loads whose answer is a kink are found first, by the facets they lie on; elsewhere Newton's
method meets a smooth function, though a kink may be near.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from limit_surface_ros.surface.plane_minimum import certain_minimum

if TYPE_CHECKING:
    from limit_surface_ros.checks import Floats
    from limit_surface_ros.surface.dissipation_terms import DissipationTerms


class DissipationInverse:
    """Twists and load factors of loads, for one dissipation that every motion raises."""

    def __init__(self, terms: DissipationTerms, directions: Floats) -> None:
        """Prepare the facets and the table of starts.

        Args:
            terms: The dissipation; D(v) > 0 for all v but 0.
            directions: Scaled twists to start from, spread over the sphere, shape (3, d).
        """
        self._terms = terms
        self._facets = terms.facets()
        power = (terms.gradient(directions) * directions).sum(axis=0)
        self._starts = directions / power

    def solve(self, loads: Floats) -> tuple[Floats, Floats]:
        """Return the twists with the largest f.v / D(v), and these largest values.

        Args:
            loads: Scaled loads, none zero, shape (3, m).

        Returns:
            Twists (3, m) with D(v) = 1, and load factors (m,).

        Raises:
            SolverError: A minimum could not be certified.
        """
        normals = loads / np.sqrt((loads * loads).sum(axis=0))
        twists = self._starts[:, np.argmax(self._starts.T @ normals, axis=0)]
        rest = np.arange(loads.shape[1])
        none = np.zeros(loads.shape[1])
        if len(self._facets):
            distance, near = self._facets.nearest(normals)
            twists = self._better(normals, twists, near)
            flat = distance <= 1.0
            twists[:, flat] = near[:, flat]
            rest = np.flatnonzero(~flat)
        if len(rest):
            twists[:, rest] = certain_minimum(self._terms, normals[:, rest], twists[:, rest])
        twists /= self._terms.derivatives(twists, none)[0]
        return twists, (loads * twists).sum(axis=0)

    def _better(self, normals: Floats, first: Floats, second: Floats) -> Floats:
        """Return of two twists for each load the one of more power for its dissipation."""
        none = np.zeros(normals.shape[1])
        ratios = [
            (normals * twists).sum(axis=0) / self._terms.derivatives(twists, none)[0]
            for twists in (first, second)
        ]
        better: Floats = np.where(ratios[0] >= ratios[1], first, second)
        return better
