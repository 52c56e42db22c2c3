# SPDX-License-Identifier: Apache-2.0
"""Simulated training data: random motions, loads on facets, and noise (thesis 3.3 and 3.5)."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from limit_surface_ros.errors import RangeError
from limit_surface_ros.surface.pairs import Pairs
from limit_surface_ros.surface.sampling import facet_loads, random_motions

if TYPE_CHECKING:
    from limit_surface_ros.surface.kinds.point_contacts import PointContacts

# Contacts of more points are taken for patches: their facets are too small to matter.
_MOST_FACETED = 12


def simulated_pairs(
    contacts: PointContacts,
    motions: int = 2000,
    per_facet: int = 150,
    *,
    load_noise: float = 0.0,
    motion_noise: float = 0.0,
    seed: int = 0,
) -> Pairs:
    """Return pairs of an exact surface, as a fit learns from them.

    Args:
        contacts: The body.
        motions: How many motions, uniform over the directions of scaled motion.
        per_facet: How many loads on each facet, for bodies on a few points; a patch of many gets
            none.
        load_noise: Standard deviation of the noise on each component of the load, in parts of
            that component's root mean square.
        motion_noise: Standard deviation of the noise on each component of the unit motion.
        seed: Of all that is random.

    Raises:
        RangeError: A count or a noise is negative, or there is nothing to draw.
    """
    given = {"per_facet": per_facet, "load_noise": load_noise, "motion_noise": motion_noise}
    for name, value in given.items():
        # NaN fails this.
        if not 0 <= value < math.inf:
            raise RangeError(f"{name} must be a finite number from 0 on, got {value}")
    draw, noise = (np.random.default_rng([seed, part]) for part in (0, 1))
    parts = [random_motions(contacts, motions, draw)]
    if per_facet and len(contacts.points) <= _MOST_FACETED:
        parts.append(facet_loads(contacts, per_facet, draw))
    loads = np.concatenate([part.wrenches for part in parts]) / contacts.scaling.wrench_unit
    twists = np.concatenate([part.twists for part in parts]) / contacts.scaling.twist_unit
    size = np.sqrt(np.mean(loads**2, axis=0))
    loads = loads + load_noise * size * noise.standard_normal(loads.shape)
    twists = twists + motion_noise * noise.standard_normal(twists.shape)
    return Pairs(loads * contacts.scaling.wrench_unit, twists * contacts.scaling.twist_unit)
