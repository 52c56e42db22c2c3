"""Known support points as the centre of a prior on a dissipation model's factors."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from limit_surface_ros.fitting.cholesky import parameters_of

if TYPE_CHECKING:
    from limit_surface_ros.checks import Floats
    from limit_surface_ros.fitting.scaled_pairs import ScaledPairs
    from limit_surface_ros.surface.point_contacts import PointContacts

# Radius of the small area that stands for a support point, in parts of how far the points spread.
_CONTACT_SIZE = 0.1


def support_factors(support: PointContacts, pairs: ScaledPairs) -> Floats:
    """Return the parameters of one term per support point, on the scale of the pairs' loads.

    A point (x, y) of friction m makes the term m |(vx - y w, vy + x w, c w)|, with c the size of a
    small contact: three speeds instead of two, so that the term is smooth.

    Args:
        support: The points; only the ratios of their friction limits count.
        pairs: Whose loads give the size, through their median load factor.

    Returns:
        Shape (6 k,).
    """
    loads = pairs.wrenches * pairs.scaling.wrench_unit
    size = float(np.median(support.load_factor(loads))) / pairs.scaling.friction_force
    points = support.points / pairs.scaling.characteristic_length
    radius = _CONTACT_SIZE * np.sqrt(np.mean(np.sum((points - points.mean(axis=0)) ** 2, axis=1)))
    factors = np.zeros((len(points), 3, 3))
    for factor, (x, y), limit in zip(factors, points, support.friction_limits, strict=True):
        speeds = np.array([[1.0, 0.0, -y], [0.0, 1.0, x], [0.0, 0.0, max(radius, 1e-3)]])
        factor[:] = size * limit * np.linalg.cholesky(speeds.T @ speeds)
    return parameters_of(factors)
