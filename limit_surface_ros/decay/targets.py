# SPDX-License-Identifier: Apache-2.0
"""Decaying responses: what is to be approximated, as functions of t >= 0 with known kinks."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from limit_surface_ros.checks import as_floats
from limit_surface_ros.errors import DataError, RangeError, ShapeError

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from limit_surface_ros.checks import Floats

# Sizes of a record's largest value between which fits neither overflow nor lose digits.
SMALLEST, LARGEST = 1e-100, 1e100
SHAPES = ("", "monotone", "convex")
# Samples count as uniform whose times lie within this part of their distance.
UNEVEN = 1e-3


@dataclass(frozen=True, eq=False)
class PiecewiseLinear:
    """A response that is linear between knots and keeps its last value after them.

    Attributes:
        knots: Shape (n,), increasing from 0 [s].
        values: Shape (n,), x at the knots.

    Raises:
        ShapeError: The two are not lists of one length, at least two.
        NotFiniteError: A number is NaN or infinite.
        DataError: The knots do not start at 0 or do not increase, or x(0) = 0.
    """

    knots: Floats
    values: Floats

    def __post_init__(self) -> None:
        """Check knots and values and make them read-only."""
        knots = as_floats("times", self.knots).copy()
        values = as_floats("values", self.values).copy()
        if knots.ndim != 1 or knots.shape != values.shape or len(knots) < 2:
            raise ShapeError(
                f"a response needs times and values of one shape (n,), n >= 2, "
                f"got {knots.shape} and {values.shape}"
            )
        if knots[0] != 0.0:
            raise DataError(f"the times must start at 0 (the onset), got {knots[0]:g}")
        if not (np.diff(knots) > 0.0).all():
            place = int(np.argmin(np.diff(knots))) + 1
            raise DataError(f"the times must increase: time {knots[place]:g} at index {place}")
        require_onset(values[0])
        knots.setflags(write=False)
        values.setflags(write=False)
        object.__setattr__(self, "knots", knots)
        object.__setattr__(self, "values", values)

    def __call__(self, times: ArrayLike) -> Floats:
        """Return x at times [s] of any shape."""
        values: Floats = np.interp(np.asarray(times, dtype=np.float64), self.knots, self.values)
        return values

    @property
    def slopes(self) -> Floats:
        """Slopes between the knots and after the last, shape (n,)."""
        return np.append(np.diff(self.values) / np.diff(self.knots), 0.0)

    @property
    def breakpoints(self) -> Floats:
        """Times after 0 at which the slope jumps [s]."""
        places: Floats = self.knots[1:][np.diff(self.slopes) != 0.0]
        return places

    @property
    def slope_jumps(self) -> Floats:
        """Jumps of the slope at the breakpoints."""
        jumps: Floats = np.diff(self.slopes)
        changes: Floats = jumps[jumps != 0.0]
        return changes


@dataclass(frozen=True, eq=False)
class Record(PiecewiseLinear):
    """Recorded samples: fits are made on them, and errors measured at them.

    The straight lines between them serve what needs a function, such as a memory kernel.

    Attributes:
        knots: Times of the samples, shape (n,), increasing from 0 [s].
        values: The samples, shape (n,).

    Raises:
        RangeError: Their sizes are beyond 1e+-100.
    """

    def __post_init__(self) -> None:
        """Check sizes too."""
        super().__post_init__()
        for name, numbers in (("times", self.knots), ("values", self.values)):
            size = float(np.abs(numbers).max())
            if not SMALLEST <= size <= LARGEST:
                raise RangeError(
                    f"the largest of the {name} must be between {SMALLEST:g} and {LARGEST:g}, "
                    f"got {size:g}"
                )

    @property
    def lines(self) -> PiecewiseLinear:
        """The straight lines between the samples, a response like any other."""
        return PiecewiseLinear(self.knots, self.values)

    def step(self, end: float) -> float | None:
        """Return the distance of the samples on [0, end] [s] if they are uniform, else None."""
        times = self.knots[self.knots <= end]
        if len(times) < 2:
            return None
        even = np.linspace(0.0, times[-1], len(times))
        step = float(even[1])
        return step if float(np.abs(times - even).max()) <= UNEVEN * step else None


@dataclass(frozen=True, eq=False)
class Analytic:
    """A response given as a function, smooth but for the breakpoints that are named.

    Attributes:
        function: Takes times [s] of any shape and returns x there.
        breakpoints: Times after 0 at which the slope jumps [s].
        shape: "monotone" or "convex" if x is so for all t >= 0, which proves what lies between
            points that were looked at; "" if nothing is known.

    Raises:
        NotFiniteError: A breakpoint or x(0) is NaN or infinite.
        RangeError: A breakpoint is not above 0, or the shape is not known.
        DataError: x(0) = 0.
    """

    function: Callable[[Floats], Floats]
    breakpoints: Floats = field(default_factory=lambda: np.zeros(0))
    shape: str = ""

    def __post_init__(self) -> None:
        """Check the breakpoints, the shape and the onset."""
        if self.shape not in SHAPES:
            raise RangeError(f"shape must be one of {', '.join(SHAPES[1:])} or empty")
        breakpoints = np.sort(as_floats("breakpoints", self.breakpoints))
        if (breakpoints <= 0.0).any():
            raise RangeError(f"breakpoints must be above 0, got {float(breakpoints[0])}")
        object.__setattr__(self, "breakpoints", breakpoints)
        require_onset(float(self(0.0)))

    def __call__(self, times: ArrayLike) -> Floats:
        """Return x at times [s] of any shape.

        Raises:
            NotFiniteError: x is NaN or infinite at one of them.
        """
        return as_floats("response", self.function(np.asarray(times, dtype=np.float64)))

    @property
    def slope_jumps(self) -> Floats:
        """Jumps of the slope at the breakpoints, from one-sided differences."""
        step = 1e-6 * (1.0 + self.breakpoints)
        middle = self(self.breakpoints)
        after = (self(self.breakpoints + step) - middle) / step
        before = (middle - self(self.breakpoints - step)) / step
        jumps: Floats = after - before
        return jumps


Target: TypeAlias = PiecewiseLinear | Analytic


def in_unit_of(response: Target, unit: float) -> Target:
    """Return a response with times counted in a unit of `unit` seconds."""
    if isinstance(response, PiecewiseLinear):
        return PiecewiseLinear(response.knots / unit, response.values)
    return Analytic(
        lambda t: response.function(t * unit), response.breakpoints / unit, response.shape
    )


def require_onset(value: float) -> None:
    """Refuse a response that is zero at its onset: xdot = f * x then has no solution f.

    Raises:
        DataError: The value is zero.
    """
    if value == 0.0:
        raise DataError("x(0) must not be zero: the response is measured from its onset")


def uniform_times(
    end: float, samples: int, breakpoints: ArrayLike = (), stretch: int = 4
) -> Floats:
    """Return times from 0 to `end`, uniform, with all breakpoints among them.

    Args:
        end: Last time [s].
        samples: Least number of times.
        breakpoints: Times in (0, end) that must be on the grid [s].
        stretch: At most this many times as many samples are returned.

    Raises:
        RangeError: The end is not above 0, or fewer than two samples are asked for.
        DataError: No such grid holds the breakpoints.
    """
    if not 0.0 < end < np.inf or samples < 2:
        raise RangeError(f"need an end above 0 and at least 2 samples, got {end} and {samples}")
    places = as_floats("breakpoints", breakpoints)
    places = places[(places > 0.0) & (places < end)] / end
    for intervals in range(samples - 1, stretch * samples):
        steps = places * intervals
        if (np.abs(steps - np.round(steps)) < 1e-9 * intervals).all():
            return np.linspace(0.0, end, intervals + 1)
    raise DataError(
        f"no uniform grid of {samples} to {stretch * samples} samples on [0, {end:g}] holds the "
        f"breakpoints {np.round(places * end, 6).tolist()}: round them or give more samples"
    )


def largest_slope_jump(response: Target) -> float:
    """Return the largest |jump| of the slope after the onset; 0 for a smooth response."""
    return float(np.abs(response.slope_jumps).max(initial=0.0))
