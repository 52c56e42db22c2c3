# SPDX-License-Identifier: Apache-2.0
"""Named examples of decaying responses.

The thesis does not print its second and third function; those here show the same numbers of
impulses (four and three, one of them at 0). The fourth is not minimum-phase.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from limit_surface_ros.decay.delay.pieces import PiecewisePolynomial
from limit_surface_ros.decay.delay.system import DelaySystem, from_quasi_polynomial
from limit_surface_ros.decay.targets import Analytic, PiecewiseLinear, Target
from limit_surface_ros.errors import RangeError

# Highest power of lambda first; row k stands before exp(-k lambda).
THESIS_EQUATION = (
    (-1.0, -0.997, -0.9956, -0.992, -1.0152, -0.828, -1.644),
    (1.0, 1.991, 2.9827, 3.9568, 5.0604, 4.7976, 9.54),
    (0.0, -0.9911, -2.9744, -5.9014, -10.0308, -11.412, -22.656),
    (0.0, -0.0168, 0.9617, 3.8512, 9.7878, 14.0472, 27.852),
    (0.0, -0.0186, -0.0195, -0.9356, -4.6128, -9.144, -18.036),
    (0.0, 0.1547, 0.1543, 0.085, 0.7254, 2.5824, 5.076),
    (0.0, -0.0841, -0.0705, -0.0344, 0.0672, 0.1848, -0.132),
)

# Highest power of t first. The first row is as (2.4) implies it; (2.2) misprints four of its
# coefficients.
THESIS_POLYNOMIALS = (
    (-0.0137, -0.0345, -0.1692, -0.4960, -0.9956, -0.9970),
    (0.0657, -0.2321, 0.6695, -0.6433, 0.1583, -0.7332),
    (-0.1230, 1.1803, -4.7502, 10.1286, -10.9627, 4.2296),
    (0.1091, -1.7157, 10.7465, -33.6881, 53.2784, -34.3779),
    (-0.0411, 0.9092, -7.9743, 34.6855, -74.7489, 63.7709),
    (0.0010, -0.0407, 0.5696, -3.8203, 12.4353, -15.8333),
)


def hockey_stick() -> PiecewiseLinear:
    """Return f1: 1 - t up to t = 1 s, then 0; impulses at 0 and 1 s."""
    return PiecewiseLinear(np.array([0.0, 1.0]), np.array([1.0, 0.0]))


def four_impulses() -> PiecewiseLinear:
    """Return f2, with kinks at 0.5, 1 and 1.5 s."""
    return PiecewiseLinear(np.array([0.0, 0.5, 1.0, 1.5]), np.array([1.0, 0.5, 0.2, 0.0]))


def three_impulses() -> PiecewiseLinear:
    """Return f3, with kinks at 1 and 1.5 s; its delay system has a slow pair of roots."""
    return PiecewiseLinear(np.array([0.0, 1.0, 1.5]), np.array([1.0, 0.8, 0.0]))


def undershoot() -> PiecewiseLinear:
    """Return f4, which undershoots: not minimum-phase, so that its delay system is unstable."""
    return PiecewiseLinear(np.array([0.0, 0.5, 1.0]), np.array([1.0, -0.6, 0.0]))


def kink_with_tail() -> Analytic:
    """Return a hockey stick on an exponential tail: 0.8 (1 - t) + 0.2, then 0.2 exp(-(t-1)/2)."""
    return Analytic(
        lambda t: np.maximum(0.8 * (1.0 - t), 0.0) + 0.2 * np.exp(-0.5 * np.maximum(t - 1.0, 0.0)),
        np.array([1.0]),
        "monotone",
    )


def exponential() -> Analytic:
    """Return exp(-t)."""
    return Analytic(lambda t: np.exp(-t), shape="convex")


def gaussian() -> Analytic:
    """Return exp(-t^2)."""
    return Analytic(lambda t: np.exp(-(t**2)), shape="monotone")


def power_law() -> Analytic:
    """Return 1 / (1 + t)^2."""
    return Analytic(lambda t: 1.0 / (1.0 + t) ** 2, shape="convex")


EXAMPLES: dict[str, Callable[[], Target]] = {
    "f1": hockey_stick,
    "f2": four_impulses,
    "f3": three_impulses,
    "f4": undershoot,
    "exponential": exponential,
    "tail": kink_with_tail,
    "gaussian": gaussian,
    "power_law": power_law,
}


def example(name: str) -> Target:
    """Return the named example.

    Raises:
        RangeError: No example has that name; the error lists them.
    """
    if name not in EXAMPLES:
        raise RangeError(f"no example {name!r}; there are {', '.join(EXAMPLES)}")
    return EXAMPLES[name]()


def thesis_system() -> DelaySystem:
    """Return the delay system of the hockey stick as the thesis prints it (2.4): basis 1."""
    return from_quasi_polynomial(THESIS_EQUATION)


def printed_system() -> DelaySystem:
    """Return the hockey stick's system from the polynomials that the thesis prints, (2.2).

    Four decimals of monomials far from their cell are few: the last cells miss the kernel by up
    to 0.7, where it is below 0.005.
    """
    pieces = PiecewisePolynomial.from_monomials(np.arange(7.0), THESIS_POLYNOMIALS)
    return DelaySystem(np.array([0.0, 1.0]), np.array([-1.0, 1.0]), pieces)


def simple_system() -> DelaySystem:
    """Return xdot(t) = -0.1 x(t - 6): basis 0 of the thesis."""
    return DelaySystem(np.array([6.0]), np.array([-0.1]))
