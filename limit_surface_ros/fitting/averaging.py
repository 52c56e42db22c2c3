"""The mean of surfaces of one kind, which is again one surface of that kind.

The mean of dissipation models has the mean of their loads at every motion; the mean of power sums
has the mean of their values at every load. Both stay convex where their members are.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from limit_surface_ros.errors import ShapeError
from limit_surface_ros.surface.dissipation import Dissipation
from limit_surface_ros.surface.power_sum import PowerSum

if TYPE_CHECKING:
    from collections.abc import Sequence

    from limit_surface_ros.surface.protocol import LimitSurface


def mean_surface(members: Sequence[LimitSurface]) -> LimitSurface:
    """Return the mean of power sums or of dissipation models, with all their terms.

    Raises:
        ShapeError: There are no members, or they are not of one of these kinds and one scaling.
    """
    count = len(members)
    if count and all(isinstance(each, Dissipation) for each in members):
        dissipations = [each for each in members if isinstance(each, Dissipation)]
        if len({each.scaling for each in dissipations}) == 1:
            matrices = np.concatenate([each.matrices for each in dissipations])
            return Dissipation(matrices / count**2, members[0].scaling)
    if count and all(isinstance(each, PowerSum) for each in members):
        sums = [each for each in members if isinstance(each, PowerSum)]
        if len({each.scaling for each in sums}) == 1:
            exponents = np.concatenate([each.exponents for each in sums])
            matrices = np.concatenate([each.matrices for each in sums])
            shares = float(count) ** (-1.0 / exponents)
            return PowerSum(matrices * shares[:, None, None], exponents, members[0].scaling)
    raise ShapeError("a mean needs power sums or dissipation models of one scaling")
