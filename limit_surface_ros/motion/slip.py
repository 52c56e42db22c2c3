# SPDX-License-Identifier: Apache-2.0
"""When a grasp slips whose normal force relaxes, and how much normal force holds a load.

Under a share nu of the normal force N0 of a surface, the forces that the contact can hold are nu
times what they are there; the moments about its centre, the surface's reference point, are
nu^(1 + gamma) times that, because the radius of a soft contact grows as N^gamma (N. Xydas and
I. Kao, IJRR 1999, doi:10.1177/02783649922066673): gamma is 0 of a rigid contact and 1/3 of an
elastic sphere (Hertz). The law is that of pressing: a pad that is held at a position and relaxes
keeps its area, and gamma = 0 is then the safe choice from the area at N0.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from limit_surface_ros.checks import as_floats, as_number, as_positive, as_vectors
from limit_surface_ros.decay.response import onset_value
from limit_surface_ros.errors import DataError, RangeError, ShapeError, SolverError, UnstableError
from limit_surface_ros.motion.crossings import first_above

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import ArrayLike

    from limit_surface_ros.checks import Floats
    from limit_surface_ros.decay.exponential_sum import ExponentialSum
    from limit_surface_ros.surface.base import LimitSurface

# Logarithm of a load factor that is 1 to rounding, and steps of Newton's method.
_EXACT, _STEPS = 2e-15, 60
# Largest exponent of a contact's radius: that of a cone is 1/2.
LARGEST_EXPONENT = 1.0
# Slope of the load factor in the normal force, both as logarithms, below which more force hardly
# holds more.
_LEAST_SLOPE = 0.05


@dataclass(frozen=True, eq=False)
class Requirement:
    """What a load asks of the normal force.

    Attributes:
        share: The smallest normal force that holds the load with the margin, in parts of N0.
        load_factor: Of the load, without the margin, at N0.
        torsional_share: Part of the power of the load that its moment has in the motion that
            would begin, n_z tau / (n.w).
        twist: Direction n of that motion, of unit norm in the surface's scaled variables, shape
            (3,); zero without a load.
    """

    share: float
    load_factor: float
    torsional_share: float
    twist: Floats


@dataclass(frozen=True)
class Slip:
    """When a grasp slips; times in [s] after the onset.

    Attributes:
        time: The first at which the normal force is below what the load asks for; infinity if
            it never is.
        earliest: The same for any normal force within the error of the decay model, at least.
        latest: The same, at most.
        slips: Whether it ever slips.
        share: What is left of N0 when it slips.
        load_factor: Of the load at N0.
    """

    time: float
    earliest: float
    latest: float
    slips: bool
    share: float
    load_factor: float


def required_share(
    surface: LimitSurface, wrench: ArrayLike, exponent: float = 0.0, margin: float = 1.0
) -> Requirement:
    """Return the smallest normal force that holds a load, in parts of the surface's.

    Args:
        surface: Of the contact, at its normal force N0.
        wrench: (fx, fy, tau_z) about the centre of the contact [N, N, N m], shape (3,).
        exponent: gamma of the contact, 0 (rigid) to 1; 1/3 of an elastic sphere.
        margin: By which the load is multiplied first. With gamma above 0, a margin on the normal
            force would be another one.

    Raises:
        ShapeError: The wrench is not three numbers.
        NotFiniteError: A component is NaN or infinite.
        RangeError: Exponent or margin lies outside its range.
        DataError: No normal force holds the load.
        SolverError: More normal force does not hold more of this load, because the surface is
            far from symmetric about the centre.

    Example:
        >>> import numpy as np
        >>> from limit_surface_ros.surface.kinds.power_sum import PowerSum
        >>> disc = PowerSum([np.eye(3)], [1.0])
        >>> required_share(disc, (0.3, 0.0, 0.4)).share
        0.5
    """
    load = as_vectors("wrench", wrench)
    if load.shape != (3,):
        raise ShapeError(f"wrench must have shape (3,), got {load.shape}")
    exponent, margin = _as_exponent(exponent), as_positive("margin", margin)
    if not load.any():
        return Requirement(0.0, 0.0, 0.0, np.zeros(3))
    twist, factor = _twist_and_factor(surface, load)
    force_x, force_y, torque = (margin * load).tolist()
    first = margin * factor
    if exponent == 0.0:
        share = _torsional_share(load.tolist(), twist)
        return Requirement(first, factor, share, twist)
    # ln s falls in ln nu with the slope 1 + gamma sigma, between 1 and 1 + gamma where a moment
    # never helps.
    place, motion, current = 0.0, twist, first
    low, high = -math.inf, math.inf
    scaled: Sequence[float] = (force_x, force_y, torque)
    for _ in range(_STEPS):
        height = math.log(current)
        if height >= 0.0:
            low = place
        if height <= 0.0:
            high = place
        slope = 1.0 + exponent * _torsional_share(scaled, motion)
        if not slope > _LEAST_SLOPE:
            raise SolverError(
                "more normal force does not hold more of this load: its moment acts against the "
                "motion that it causes"
            )
        if abs(height) <= _EXACT:
            break
        following = place + height / slope
        if not low <= following <= high:
            following = 0.5 * (low + high)
        if following == place:
            break
        place = following
        share = math.exp(-place)
        scaled = (force_x * share, force_y * share, torque * share ** (1.0 + exponent))
        motion, current = _twist_and_factor(surface, scaled)
    else:
        raise SolverError("the normal force that holds the load was not found")
    return Requirement(math.exp(place), factor, _torsional_share(scaled, motion), motion)


def required_normal_force(
    surface: LimitSurface,
    normal_force: float,
    wrench: ArrayLike,
    exponent: float = 0.0,
    margin: float = 1.0,
) -> float:
    """Return the smallest normal force that holds a load with a margin [N].

    Args:
        surface: Of the contact, at `normal_force`.
        normal_force: N0 [N].
        wrench: As in `required_share`.
        exponent: As in `required_share`.
        margin: As in `required_share`.

    Raises:
        RangeError: The normal force is not a finite number above 0.
        LimitSurfaceError: As in `required_share`.

    Example:
        >>> import numpy as np
        >>> from limit_surface_ros.surface.kinds.power_sum import PowerSum
        >>> disc = PowerSum([np.eye(3)], [1.0])
        >>> required_normal_force(disc, 10.0, (0.3, 0.0, 0.4), margin=1.5)
        7.5
    """
    held_by = as_positive("normal_force", normal_force)
    return required_share(surface, wrench, exponent, margin).share * held_by


def predict_slip(
    surface: LimitSurface,
    x: ExponentialSum,
    wrench: ArrayLike,
    exponent: float = 0.0,
    margin: float = 1.0,
    max_error: float = 0.0,
) -> Slip:
    """Return when a grasp slips that holds a load while N(t) = N0 x(t) / x(0) relaxes.

    The first time is certified: nowhere before does x fall below what the load asks for.

    Args:
        surface: Of the contact, at N0, the normal force of the onset.
        x: How the normal force relaxes; a constant term (rate 0) is what stays.
        wrench: As in `required_share`.
        exponent: As in `required_share`.
        margin: As in `required_share`.
        max_error: Bound of |x - response|, in the unit of x.

    Raises:
        NoOnsetError: x(0) is zero.
        UnstableError: x grows.
        RangeError: The error is negative.
        LimitSurfaceError: As in `required_share`.

    Example:
        >>> import numpy as np
        >>> from limit_surface_ros.decay.exponential_sum import ExponentialSum
        >>> from limit_surface_ros.surface.kinds.power_sum import PowerSum
        >>> disc = PowerSum([np.eye(3)], [1.0])
        >>> pad = ExponentialSum([0.0, -1.0], [0.6, 0.4])
        >>> round(predict_slip(disc, pad, (0.8, 0.0, 0.0)).time, 9) == round(np.log(2.0), 9)
        True
        >>> predict_slip(disc, pad, (0.6, 0.0, 0.0)).slips
        False
    """
    error = as_number("max_error", max_error)
    if error < 0.0:
        raise RangeError(f"max_error must be at least 0, got {error:g}")
    start = onset_value(x)
    if not x.settles:
        raise UnstableError(
            f"the normal force cannot relax by a model that grows: its right-most rate has the "
            f"real part {x.slowest_rate:g}"
        )
    found = required_share(surface, wrench, exponent, margin)
    # What falls through a level rises through its opposite.
    falling = type(x)(x.rates, -math.copysign(1.0, start) * x.coefficients)
    level = found.share * abs(start)

    def first_below(height: float) -> float:
        time = first_above(falling, -height)
        return math.inf if time is None else time

    if found.share == 0.0:
        return Slip(math.inf, math.inf, math.inf, False, 0.0, 0.0)
    time = first_below(level)
    return Slip(
        time=time,
        earliest=first_below(level + error) if error else time,
        latest=first_below(level - error) if error else time,
        slips=time < math.inf,
        share=found.share,
        load_factor=found.load_factor,
    )


def load_factors(
    surface: LimitSurface, wrench: ArrayLike, shares: ArrayLike, exponent: float = 0.0
) -> Floats:
    """Return the load factors of one load under shares of the normal force.

    Args:
        surface: Of the contact, at N0.
        wrench: As in `required_share`.
        shares: N / N0, each above 0, shape (n,).
        exponent: As in `required_share`.

    Returns:
        Shape (n,): above 1, the contact slips.

    Raises:
        ShapeError: The wrench is not three numbers.
        NotFiniteError: A number is NaN or infinite.
        RangeError: A share is not above 0, or the exponent lies outside its range.
    """
    load, parts = as_vectors("wrench", wrench), as_floats("shares", shares)
    if load.shape != (3,):
        raise ShapeError(f"wrench must have shape (3,), got {load.shape}")
    if not (parts > 0.0).all():
        raise RangeError(f"shares must be above 0, got {float(parts.min())}")
    inverse = 1.0 / parts
    moments = inverse ** (1.0 + _as_exponent(exponent))
    return surface.load_factor(load * np.stack([inverse, inverse, moments], axis=-1))


def _as_exponent(exponent: float) -> float:
    value = as_number("exponent", exponent)
    if not 0.0 <= value <= LARGEST_EXPONENT:
        raise RangeError(f"exponent must lie in [0, {LARGEST_EXPONENT:g}], got {value:g}")
    return value


def _twist_and_factor(surface: LimitSurface, load: ArrayLike) -> tuple[Floats, float]:
    twist, factor = surface.twist_and_load_factor(load)
    if not factor < math.inf:
        raise DataError("no normal force holds this load: nothing resists the motion it causes")
    return twist, float(factor)


def _torsional_share(load: Sequence[float], twist: Floats) -> float:
    fx, fy, torque = load
    vx, vy, turn = twist.tolist()
    return float(torque * turn / (fx * vx + fy * vy + torque * turn))
