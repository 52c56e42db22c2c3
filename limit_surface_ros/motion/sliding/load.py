# SPDX-License-Identifier: Apache-2.0
"""A load on a sliding body that dies away by a decay model."""

from __future__ import annotations

import math
from cmath import exp
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from limit_surface_ros.checks import as_floats
from limit_surface_ros.decay.response import onset_value
from limit_surface_ros.errors import RangeError, ShapeError, UnstableError
from limit_surface_ros.motion.crossings import first_above

if TYPE_CHECKING:
    from limit_surface_ros.checks import Floats
    from limit_surface_ros.decay.exponential_sum import ExponentialSum


@dataclass(frozen=True, eq=False)
class Load:
    """A wrench that dies away as w(t) = w(0) x(t) / x(0).

    Attributes:
        wrench: w(0), (fx, fy, tau_z) about the surface's reference point [N, N, N m], shape (3,).
        decay: x, the decay model. A constant term leaves a load that stays.
        in_world: Whether the force keeps its direction in the world while the body turns; if
            not, it turns with the body. It is applied at the reference point in both cases.
            The wrench's axes are the world's then, and the surface's otherwise.

    Raises:
        ShapeError: The wrench is not three numbers.
        NotFiniteError: A component is NaN or infinite.
        NoOnsetError: x(0) is zero.
        UnstableError: x grows, or swings for ever.
    """

    wrench: Floats
    decay: ExponentialSum
    in_world: bool = False
    _terms: list[tuple[complex, complex]] = field(init=False, repr=False)
    _waves: list[tuple[float, float, float, float]] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        """Check the wrench and the decay model."""
        wrench = as_floats("wrench", self.wrench).copy()
        if wrench.shape != (3,):
            raise ShapeError(f"wrench must have shape (3,), got {wrench.shape}")
        wrench.setflags(write=False)
        start = onset_value(self.decay)
        if not self.decay.settles:
            raise UnstableError(
                f"a load can die away only by a decay model whose rates decay; the right-most "
                f"has the real part {self.decay.slowest_rate:g}"
            )
        terms = list(
            zip(self.decay.rates.tolist(), (self.decay.coefficients / start).tolist(), strict=True)
        )
        object.__setattr__(self, "wrench", wrench)
        waves = [(rate.real, rate.imag, c.real, c.imag) for rate, c in terms]
        object.__setattr__(self, "_terms", terms)
        object.__setattr__(self, "_waves", waves)

    def shifted(self, error: float) -> Load:
        """Return the load under x(t) + error, scaled to the x(0) of the model as it is.

        Args:
            error: In the unit of x; of either sign.

        Raises:
            RangeError: Nothing is left of the onset.
        """
        start = self.decay.start
        share = 1.0 + error / start
        if not share > 0.0:
            raise RangeError(f"an error of {error:g} leaves nothing of an onset of {start:g}")
        decay = type(self.decay)(
            np.append(self.decay.rates, 0.0), np.append(self.decay.coefficients, error)
        )
        return Load(self.wrench * share, decay, self.in_world)

    def fraction(self, time: float) -> float:
        """Return x(t) / x(0) at a time [s]."""
        value = 0.0
        for damping, frequency, real, imaginary in self._waves:
            size = math.exp(damping * time)
            if frequency:
                angle = frequency * time
                value += size * (real * math.cos(angle) - imaginary * math.sin(angle))
            else:
                value += size * real
        return value

    def mean_fraction(self, start: float, end: float) -> float:
        """Return the mean of x(t) / x(0) between two times [s]."""
        span = end - start
        total = 0.0
        for rate, c in self._terms:
            phase = rate * span
            # (exp(z) - 1) / z without the loss of digits where z is small.
            if abs(phase) < 1e-3:
                growth = 1.0 + phase / 2.0 + phase * phase / 6.0 + phase**3 / 24.0
            else:
                growth = (exp(phase) - 1.0) / phase
            total += (c * exp(rate * start) * growth).real
        return total

    @property
    def shortest_time(self) -> float:
        """Shortest time in which a term changes [s]; infinity if the load is constant."""
        fastest = max(abs(rate) for rate, _ in self._terms)
        return 1.0 / fastest if fastest else math.inf

    @property
    def last_fraction(self) -> float:
        """What is left of the onset for ever, the constant of x over x(0)."""
        return self.decay.constant / self.decay.start

    def next_above(self, along: float, against: float, start: float) -> float | None:
        """Return the first time from `start` on at which x(t) / x(0) exceeds a fraction.

        Args:
            along: Fraction that it must exceed above zero.
            against: Fraction that it must exceed below zero.
            start: [s].

        Returns:
            The time [s]; None if it never does.
        """
        size = abs(self.decay.start)
        upwards = math.copysign(1.0, self.decay.start)
        times = []
        for sign, fraction in ((upwards, along), (-upwards, against)):
            if fraction < math.inf:
                x = type(self.decay)(self.decay.rates, sign * self.decay.coefficients)
                times.append(first_above(x, fraction * size, start))
        return min((time for time in times if time is not None), default=None)

    def in_body(self, heading: float) -> Floats:
        """Return w(0) in the axes of a body of some heading [rad], shape (3,)."""
        if not self.in_world:
            return self.wrench
        fx, fy, torque = self.wrench.tolist()
        c, s = math.cos(heading), math.sin(heading)
        return np.array([c * fx + s * fy, c * fy - s * fx, torque])
