# SPDX-License-Identifier: Apache-2.0
"""What an error of motion costs: the squared chord between unit twists, or a robust form of it.

    rho(d) = d^2                                        for chords d = |v - v^|
    rho(d) = 2 c (sqrt(d^2 + c^2) - c)                  with a robust scale c

The robust form is the square for chords below c and grows like 2 c d beyond, so that a few pushes
that went astray do not bend the surface (pseudo-Huber; Charbonnier et al. 1997,
doi:10.1109/83.551699).
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from limit_surface_ros.checks import Floats


def direction_loss(cosines: Floats, robust_scale: float | None) -> tuple[Floats, Floats]:
    """Return rho and its slope with respect to the cosine of the angle.

    Args:
        cosines: v . v^ of unit vectors, shape (n,).
        robust_scale: c; None for the square.

    Returns:
        rho and d rho / d cosine, shape (n,) each.
    """
    squares = np.maximum(2.0 - 2.0 * cosines, 0.0)
    if robust_scale is None:
        return squares, np.full_like(squares, -2.0)
    roots = np.sqrt(squares + robust_scale**2)
    return 2.0 * robust_scale * (roots - robust_scale), -2.0 * robust_scale / roots
