# SPDX-License-Identifier: Apache-2.0
"""Derivatives of a surface's maps, on scaled columns, from one gauge with its Hessian.

The load factor g and the dissipation D are each the support function of the other's unit surface:
g^2 / 2 and D^2 / 2 are conjugate (Rockafellar, Convex Analysis, section 15). The Hessian of the
one at n, whose support point is x with m = grad and H = Hess of the other there, is therefore

    |x|^2 [m] H [m]' / (n.x e2(H)),

[m] the cross product with m, e2 the sum of the principal minors of second order. Where the support
point is a kink, as within a facet, it is zero: the answer does not change there.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from limit_surface_ros.checks import Bools, Floats

# Sine of the angle between a vector and the gradient at its support point from which this is a
# kink, whose own term gives the rest of the vector.
_KINK = 1e-7
# e2 in parts of the trace's square below which a surface is flat in one direction.
_FLAT = 1e-28


def unit_jacobians(vectors: Floats, jacobians: Floats) -> tuple[Floats, Floats]:
    """Return y / |y| and its derivative (1 - u u') J / |y| from those of y.

    Args:
        vectors: y, shape (3, m).
        jacobians: J of y, shape (3, 3, m).
    """
    length = np.sqrt((vectors * vectors).sum(axis=0))
    unit = vectors / length
    along = np.einsum("im,ijm->jm", unit, jacobians)
    across = jacobians - unit[:, np.newaxis] * along
    across /= length
    return unit, across


def support_hessians(
    normals: Floats, points: Floats, gradients: Floats, hessians: Floats
) -> tuple[Floats, Bools]:
    """Return the Hessians (3, 3, m) of a support function, and where it is smooth (m,).

    Args:
        normals: n, shape (3, m).
        points: Their support points x on the unit surface of a gauge, shape (3, m).
        gradients: Of the gauge at the points; what is at a kink adds nothing; shape (3, m).
        hessians: Of the gauge there, shape (3, 3, m).
    """
    (a, b, c), (_, d, e), (_, _, f) = hessians
    minors = a * d - b * b + a * f - c * c + d * f - e * e
    trace = a + d + f
    power = (normals * points).sum(axis=0)
    size = np.sqrt((normals * normals).sum(axis=0))
    # On a smooth place n is along the gradient: n = (n.x) m.
    off = normals - power * gradients
    kink = np.sqrt((off * off).sum(axis=0)) > _KINK * size
    flat = ~(minors > _FLAT * trace * trace)
    usable = ~(kink | flat)
    square = (points * points).sum(axis=0)
    factor = np.where(usable, square / np.where(usable, power * minors, 1.0), 0.0)
    x, y, z = gradients
    zero = np.zeros_like(x)
    cross = np.array([[zero, -z, y], [z, zero, -x], [-y, x, zero]])
    half = np.einsum("ikm,klm->ilm", cross, hessians)
    return np.einsum("ilm,jlm->ijm", half, cross) * factor, ~flat
