# SPDX-License-Identifier: Apache-2.0
"""How uncertain the end of a slide is: many surfaces and inertias that data allow, one shove.

The members of the ensemble are what is uncertain: surfaces of `UncertainSurface.members` or of a
bootstrap, friction and inertia drawn with them. Of n members the standard deviation is known to
about 1 / sqrt(2 n).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from limit_surface_ros.checks import as_vectors
from limit_surface_ros.errors import RangeError, ShapeError
from limit_surface_ros.motion.sliding.batch import slides
from limit_surface_ros.motion.spread import QUANTILES, EndPoses

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import ArrayLike

    from limit_surface_ros.checks import Floats
    from limit_surface_ros.motion.sliding.inertia import Inertia
    from limit_surface_ros.motion.sliding.load import Load
    from limit_surface_ros.surface.base import LimitSurface


@dataclass(frozen=True, eq=False)
class Spread(EndPoses):
    """Where and when the members of an ensemble come to rest.

    Attributes:
        times: [s], shape (n,).
    """

    times: Floats

    @cached_property
    def time_quantiles(self) -> Floats:
        """Of the times, at `QUANTILES`, shape (3,)."""
        return np.quantile(self.times, QUANTILES)


def slide_spread(
    surfaces: LimitSurface | Sequence[LimitSurface],
    inertias: Inertia | Sequence[Inertia],
    twists: ArrayLike,
    load: Load | None = None,
    pose: ArrayLike = (0.0, 0.0, 0.0),
) -> Spread:
    """Return how the ends of the slides of an ensemble spread.

    Args:
        surfaces: One for each member, or one for all, such as those of a bootstrap.
        inertias: One for each member, or one for all.
        twists: At the start: one for all members, shape (3,), or one for each, (n, 3).
        load: On each member.
        pose: At the start, shape (3,).

    Raises:
        ShapeError: The lengths do not fit.
        RangeError: There are fewer than two members.
        LimitSurfaceError: As in `slides`.

    Example:
        >>> import numpy as np
        >>> from limit_surface_ros.motion.sliding.inertia import Inertia
        >>> from limit_surface_ros.surface.kinds.dissipation import Dissipation
        >>> surface = Dissipation([np.eye(3)])
        >>> members = [surface.scaled(1.0 + 0.01 * k) for k in range(-10, 11)]
        >>> found = slide_spread(members, Inertia(1.0, 1.0), (1.0, 0.0, 0.0))
        >>> found.time_quantiles.round(3).tolist()
        [0.917, 1.0, 1.099]
    """
    starts = as_vectors("twists", twists)
    if starts.ndim > 2:
        raise ShapeError(f"twists must have shape (3,) or (n, 3), got {starts.shape}")
    lengths = {len(each) for each in (surfaces, inertias) if isinstance(each, list | tuple)}
    if starts.ndim == 2:
        lengths.add(len(starts))
    if len(lengths) > 1:
        raise ShapeError(f"the members are not of one number: {sorted(lengths)}")
    count = lengths.pop() if lengths else 1
    if count < 2:
        raise RangeError("an ensemble needs at least two members")
    found = slides(surfaces, inertias, np.broadcast_to(starts, (count, 3)), load, pose)
    return Spread(poses=found.poses, times=found.times)
