# SPDX-License-Identifier: Apache-2.0
"""Planar parts of spatial wrenches and twists, and how much they leave out."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

    from limit_surface_ros.checks import Floats


def planar(six: Sequence[float]) -> tuple[float, float, float]:
    """Return x, y and the turn about z of a wrench or twist.

    Args:
        six: (fx, fy, fz, tau_x, tau_y, tau_z) or (vx, vy, vz, omega_x, omega_y, omega_z).
    """
    return six[0], six[1], six[5]


def out_of_plane(six: Sequence[float], length: float, *, pressing: bool = False) -> float:
    """Return how large the left-out part is beside the planar part; 0 where there is none.

    Turns are compared with translations through a length: torques are divided by it, angular
    velocities multiplied.

    Args:
        six: A wrench or twist as for `planar`.
        length: rho [m] for a twist, 1 / rho [1/m] for a wrench.
        pressing: Whether z counts as used, as a pressing force does.
    """
    left_out = math.hypot(0.0 if pressing else six[2], six[3] * length, six[4] * length)
    if left_out == 0.0:
        return 0.0
    return left_out / max(math.hypot(six[0], six[1], six[5] * length), 1e-300)


def power(wrench: Floats, twist: Floats) -> Floats:
    """Return the power wrench . twist [W].

    Args:
        wrench: Shape (..., 3), (fx, fy, tau_z) in [N, N, N m].
        twist: Shape (..., 3), (vx, vy, omega_z) in [m/s, m/s, rad/s].

    Returns:
        Shape (...).
    """
    # By a product with ones: numpy adds up rows of three one by one.
    return np.asarray(np.multiply(wrench, twist).dot(np.ones(3)))
