# SPDX-License-Identifier: Apache-2.0
"""How a body with mass slides to rest: shoved, or under a load that dies away, or both.

The body obeys M q' in w(t) - dD(q) (and the turning of its frame), one coefficient of friction for
motion and rest and a pressure that does not shift: a body that is high and brakes hard tips
weight forwards, which is not considered. See S. Goyal, A. Ruina and J. Papadopoulos, Wear 143,
1991, doi:10.1016/0043-1648(91)90105-3.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from limit_surface_ros.checks import as_positive, as_vectors
from limit_surface_ros.errors import RangeError, ShapeError, SolverError, UnstableError
from limit_surface_ros.motion.sliding.body import SlidingBody
from limit_surface_ros.motion.sliding.run import Run
from limit_surface_ros.motion.stages import finish

if TYPE_CHECKING:
    from collections.abc import Generator

    from numpy.typing import ArrayLike

    from limit_surface_ros.motion.sliding.inertia import Inertia
    from limit_surface_ros.motion.sliding.load import Load
    from limit_surface_ros.motion.sliding.result import Slide
    from limit_surface_ros.surface.base import LimitSurface

# Error of one step, in parts of the slide: of a shoved body, and of one under a load.
TOLERANCE, LOAD_TOLERANCE = 1e-8, 1e-9
MOST_STEPS = 20_000


def slide(
    surface: LimitSurface,
    inertia: Inertia,
    twist: ArrayLike,
    load: Load | None = None,
    pose: ArrayLike = (0.0, 0.0, 0.0),
    *,
    horizon: float = math.inf,
    tolerance: float | None = None,
    most_steps: int = MOST_STEPS,
) -> Slide:
    """Return how a body slides to rest.

    Args:
        surface: Its limit surface.
        inertia: Mass, moment of inertia and centre of mass.
        twist: At the start, (vx, vy, omega) at the reference point and in the body's frame
            [m/s, m/s, rad/s], shape (3,); zero for a body that the load moves from rest.
        load: What acts on the body beside friction; nothing if not given.
        pose: At the start, x, y [m] and heading [rad] in the world, shape (3,).
        horizon: Time [s] within which the body must rest.
        tolerance: Error of one step, in parts of the slide; 1e-8 of a shoved body and 1e-9 of one
            under a load if not given.
        most_steps: Of the integration.

    Raises:
        TypeError: The inertia is not an `Inertia`.
        ShapeError: Twist or pose is not three numbers.
        NotFiniteError: One of them is NaN or infinite.
        RangeError: Horizon or tolerance is not above 0.
        DataError: A motion that nothing resists would never end.
        UnstableError: The load that stays is beyond what friction can hold.
        SolverError: The body does not rest within the horizon or the steps.

    Example:
        >>> import numpy as np
        >>> from limit_surface_ros.motion.sliding.inertia import Inertia
        >>> from limit_surface_ros.surface.kinds.power_sum import PowerSum
        >>> from limit_surface_ros.surface.scaling import Scaling
        >>> surface = PowerSum.norms([np.eye(3)], Scaling(0.05, friction_force=2.0))
        >>> found = slide(surface, Inertia(mass=1.0, moment=1e-3), (1.0, 0.0, 0.0))
        >>> round(found.time, 6), found.pose.round(6).tolist()
        (0.5, [0.25, 0.0, 0.0])
    """
    return finish(
        slide_stages(
            SlidingBody(surface, inertia),
            twist,
            load,
            pose,
            horizon=horizon,
            tolerance=tolerance,
            most_steps=most_steps,
        )
    )


def slide_stages(
    body: SlidingBody,
    twist: ArrayLike,
    load: Load | None = None,
    pose: ArrayLike = (0.0, 0.0, 0.0),
    *,
    horizon: float = math.inf,
    tolerance: float | None = None,
    most_steps: int = MOST_STEPS,
) -> Generator[None, None, Slide]:
    """Return a generator that slides a body in stages of some milliseconds; see `slide`."""
    start, place = as_vectors("twist", twist), as_vectors("pose", pose)
    for name, array in (("twist", start), ("pose", place)):
        if array.shape != (3,):
            raise ShapeError(f"{name} must have shape (3,), got {array.shape}")
    if not horizon > 0.0:
        raise RangeError(f"horizon must be above 0, got {horizon}")
    if tolerance is None:
        tolerance = TOLERANCE if load is None else LOAD_TOLERANCE
    tolerance = as_positive("tolerance", tolerance)
    return Run(body, load, horizon, tolerance, most_steps).stages(start, place)


def stop_bracket(
    body: SlidingBody,
    twist: ArrayLike,
    load: Load,
    max_error: float,
    pose: ArrayLike = (0.0, 0.0, 0.0),
    *,
    horizon: float = math.inf,
) -> tuple[float, float]:
    """Return when a body rests under x less and more its largest error, the earlier first [s].

    Errors within the bound that swing were found to stay between the two in all that was tried,
    but that is no proof: the two are a bracket, not a bound.

    Args:
        body: The body.
        twist: As in `slide`.
        load: As in `slide`.
        max_error: Bound of |x - response|, in the unit of x; infinity leaves all open.
        pose: As in `slide`.
        horizon: As in `slide`; what does not rest within it rests at infinity.

    Raises:
        RangeError: The error is negative or not a number.
    """
    return finish(bracket_stages(body, twist, load, max_error, pose, horizon=horizon))


def bracket_stages(
    body: SlidingBody,
    twist: ArrayLike,
    load: Load,
    max_error: float,
    pose: ArrayLike = (0.0, 0.0, 0.0),
    *,
    horizon: float = math.inf,
) -> Generator[None, None, tuple[float, float]]:
    """Find `stop_bracket` in stages of some milliseconds."""
    error = float(max_error)
    if not error >= 0.0:
        raise RangeError(f"max_error must be at least 0, got {error:g}")
    times = []
    start = load.decay.start
    for sign in (-1.0, 1.0):
        # An error as large as the onset may leave nothing of the load.
        less = sign < 0.0 and error >= abs(start)
        try:
            if error == math.inf and sign > 0.0:
                raise UnstableError("any load is within the error")
            changed = None if less else load.shifted(math.copysign(error, sign * start))
            found = yield from slide_stages(body, twist, changed, pose, horizon=horizon)
            times.append(found.time)
        except (UnstableError, SolverError):
            times.append(math.inf)
    return min(times), max(times)
