# SPDX-License-Identifier: Apache-2.0
"""Derivatives of a surface's maps, from one gauge with vectors along its gradient.

The load factor g and the dissipation D are each the support function of the other's unit surface:
g^2 / 2 and D^2 / 2 are conjugate (Rockafellar, Convex Analysis, section 15). All derivatives
follow from vectors N of any length along the gradient of the one, and from symmetric matrices K
that say how N turns: K x is along N, and (1 - u u') K / |N| is the derivative of u = N / |N| by x.
What K has along N does not matter.

The Hessian of the other at n, whose support point is x, is

    (N.x / n.x) [n] K [n]' / (n' adj(K) n),

[n] the cross product with n. It is zero within a facet, where K is infinite.

Symmetric matrices are six rows, xx, xy, xz, yy, yz and zz.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from limit_surface_ros.surface.gauges.gauge import Turning
from limit_surface_ros.surface.linalg import squared_lengths

if TYPE_CHECKING:
    from limit_surface_ros.checks import Bools, Floats
    from limit_surface_ros.surface.gauges.gauge import Gauge

# Product of the two curvatures of a surface, in parts of the square of their sum, below which it
# is flat in one direction.
FLAT = 1e-14
# Turn of a support point with its normal, in parts of the usual, below which it is within a facet.
FACET = 1e-9
# Square of the sine of the angle between a normal and that of its point from which a kink is near,
# and the norm of its term, relative to what it could be.
PARALLEL = 1e-14
# The same of a point that is as right as rounding lets it be.
ROUNDED = 1e-27
_BESIDE = 1e-6
# Square of a vector's length beyond which its powers may not be numbers.
_LARGE = 1e120
# Second invariant of the kinks' matrix, in parts of the square of its trace, up to which it has
# rank one.
_ONE_RANK = 1e-14
# Curvature along a crease, in parts of the usual, up to which it is straight.
_STRAIGHT = 1e-12
# Rows of a symmetric matrix as entries of its six.
ENTRIES = [[0, 1, 2], [1, 3, 4], [2, 4, 5]]


def six_of(matrices: Floats) -> Floats:
    """Return the six entries (6, k) of symmetric matrices (k, 3, 3)."""
    return np.ascontiguousarray(matrices[:, [0, 0, 0, 1, 1, 2], [0, 1, 2, 1, 2, 2]].T)


def take_outer(six: Floats, parts: Floats) -> None:
    """Take the sums over k of p p' for vectors p in (3, k, m) from symmetric matrices (6, m)."""
    x, y, z = parts
    part = np.empty(parts.shape[2])
    for row, (a, b) in zip(six, ((x, x), (x, y), (x, z), (y, y), (y, z), (z, z)), strict=True):
        if len(a) == 1:
            np.multiply(a[0], b[0], out=part)
        else:
            np.einsum("km,km->m", a, b, out=part)
        row -= part


def sum_of_terms(parts: Floats) -> Floats:
    """Return the sums over k (3, m) of parts (3, k, m)."""
    # Few long rows: quicker than numpy's own sum along the middle.
    sums: Floats = parts[:, 0].copy()
    for term in range(1, parts.shape[1]):
        sums += parts[:, term]
    return sums


def products(six: Floats, vectors: Floats) -> Floats:
    """Return K x (3, m) for K in six rows (6, m) and x (3, m)."""
    result = np.empty_like(vectors)
    part = np.empty(vectors.shape[1])
    for row, entries in zip(result, ENTRIES, strict=True):
        np.multiply(six[entries[0]], vectors[0], out=row)
        for entry, vector in zip(entries[1:], vectors[1:], strict=True):
            np.multiply(six[entry], vector, out=part)
            row += part
    return result


def direction_jacobians(
    normals: Floats, six: Floats, sizes: Floats, units: Floats
) -> tuple[Floats, Floats]:
    """Return u = N / |N| (3, m) and its derivatives (3, 3, m).

    Args:
        normals: N, shape (3, m).
        six: K, shape (6, m).
        sizes: What the derivatives are divided by, shape (m,).
        units: What each entry is multiplied by, shape (3, 3).
    """
    scale = 1.0 / np.sqrt(np.einsum("im,im->m", normals, normals))
    unit = normals * scale
    scale /= sizes
    six = six * scale
    along = products(six, unit)
    jacobians = np.empty((3, 3, normals.shape[1]))
    part = np.empty_like(scale)
    for row, entries, component in zip(jacobians, ENTRIES, unit, strict=True):
        for place, entry, of_column in zip(row, entries, along, strict=True):
            np.multiply(component, of_column, out=part)
            np.subtract(six[entry], part, out=place)
    jacobians *= units[:, :, np.newaxis]
    return unit, jacobians


def gradients_and_hessians(points: Floats, turning: Turning) -> tuple[Floats, Floats]:
    """Return g grad g (3, m), and its derivatives (6, m) by x: grad g grad g' + g Hess g.

    Args:
        points: x, shape (3, m).
        turning: Of the gauge there; where its value is infinite, all is zero.
    """
    values, normals, six, _ = turning
    values = np.where(values < np.inf, values, 0.0)
    along = np.einsum("im,im->m", normals, points)
    # grad g = scale N, and Hess g = scale (K - part N N') with Hess g x = 0.
    scale = values / along
    part = np.einsum("im,im->m", products(six, points), points) / along / along
    weight = values * scale
    outer = scale * scale - weight * part
    hessians = six * weight
    x, y, z = normals
    for row, (a, b) in zip(
        hessians, ((x, x), (x, y), (x, z), (y, y), (y, z), (z, z)), strict=True
    ):
        row += outer * (a * b)
    return normals * weight, hessians


def of_support(normals: Floats, points: Floats, gauge: Gauge) -> tuple[Floats, Floats, Bools]:
    """Return support points, the support function's Hessians (6, m), and where they are whole.

    Where a surface is flat in one direction, the Hessian is infinite in that, and what is returned
    is the rest. Points from a table are first brought to where rounding leaves them.

    Args:
        normals: n, shape (3, m).
        points: Their support points x on the unit surface of a gauge, shape (3, m).
        gauge: The gauge.
    """
    sizes = squared_lengths(normals)
    if not (sizes.min(initial=1.0) > 1.0 / _LARGE and sizes.max(initial=1.0) < _LARGE):
        # Of loads in units that are far from theirs: what follows takes fourth powers.
        lengths = np.sqrt(sizes)
        points, found, whole = of_support(normals / lengths, points, gauge)
        return points, found / lengths, whole
    turning = gauge.turning(points)
    found, whole = _of_turning(normals, points, turning)
    off, squares = _off(normals, points, turning)
    beside = squares > PARALLEL
    if squares.max(initial=0.0) > ROUNDED:
        # The Hessian takes the way between two normals to that between their points.
        step = products(found, off)
        smooth = ~beside & whole
        if turning.kinks is not None:
            smooth &= ~turning.kinks.any(axis=0)
        step *= smooth
        points = points - step
        turning = gauge.turning(points)
        points /= turning.values
        found, whole = _of_turning(normals, points, turning)
    # A normal that is not that of its point is one of many at a kink, which is not quite met.
    if beside.any():
        at = np.flatnonzero(beside)
        near, normals = points.take(at, axis=1), normals.take(at, axis=1)
        found[:, at], whole[at] = _of_turning(normals, near, gauge.turning(near, _BESIDE))
    return points, found, whole


def _off(normals: Floats, points: Floats, turning: Turning) -> tuple[Floats, Floats]:
    """Return the points' own normals less those wanted (3, m), and their squares in parts."""
    along = np.einsum("im,im->m", normals, points)
    along /= np.einsum("im,im->m", turning.normals, points)
    off = turning.normals * along
    off -= normals
    return off, np.einsum("im,im->m", off, off) / squared_lengths(normals)


def _of_turning(normals: Floats, points: Floats, turning: Turning) -> tuple[Floats, Bools]:
    if turning.kinks is None:
        return _smooth_hessians(normals, points, turning)
    found = np.empty_like(turning.matrices)
    whole = np.empty(points.shape[1], dtype=bool)
    kinked = turning.kinks.any(axis=0)
    for at, hessians in ((~kinked, _smooth_hessians), (kinked, _kinked_hessians)):
        some = Turning(
            turning.values[at],
            turning.normals[:, at],
            turning.matrices[:, at],
            turning.kinks[:, at],
        )
        found[:, at], whole[at] = hessians(normals[:, at], points[:, at], some)
    return found, whole


def _smooth_hessians(normals: Floats, points: Floats, turning: Turning) -> tuple[Floats, Bools]:
    return support_hessians(normals, points, turning.normals, turning.matrices)


def _kinked_hessians(normals: Floats, points: Floats, turning: Turning) -> tuple[Floats, Bools]:
    """Return what `of_support` does where a norm is zero: the limit of infinite curvature there.

    With K + s C for K, the formula of this module has the limit [n] C [n]' / (K : [n] C [n]') for
    s to infinity if the kinks' C has rank one, the crease's, along which alone the point moves.
    With a larger rank it stays where it is.
    """
    kinks, six = turning.kinks, turning.matrices
    assert kinks is not None
    a, b, c, d, e, f = kinks
    # C x is zero and n.x is not: across n, too, C has the rank of the whole.
    crease = a * d + a * f + d * f - b * b - c * c - e * e <= _ONE_RANK * np.square(a + d + f)
    found = _twice_crossed(normals, kinks)
    curvatures = np.einsum("im,im->m", six, found)
    for entry in (1, 2, 4):
        curvatures += six[entry] * found[entry]
    along = found[0] + found[3] + found[5]
    sizes = np.sqrt(squared_lengths(turning.normals) / squared_lengths(points))
    curved = curvatures > _STRAIGHT * along * sizes
    factors = np.einsum("im,im->m", turning.normals, points)
    factors /= np.einsum("im,im->m", normals, points)
    factors /= np.where(curved, curvatures, np.inf)
    found *= factors * crease
    return found, curved | ~crease


def support_hessians(
    normals: Floats, points: Floats, gauge_normals: Floats, six: Floats
) -> tuple[Floats, Bools]:
    """Return what `of_support` does, from finite matrices.

    Args:
        normals: n, shape (3, m).
        points: Their support points x on the unit surface of a gauge, shape (3, m).
        gauge_normals: N of the gauge there, shape (3, m).
        six: K of the gauge there, shape (6, m).
    """
    found = _twice_crossed(normals, six)
    # K : [n] K [n]' = 2 n' adj(K) n.
    minors = np.einsum("im,im->m", six, found)
    minors += six[1] * found[1]
    minors += six[2] * found[2]
    minors += six[4] * found[4]
    minors *= 0.5
    sums = found[0] + found[3]
    sums += found[5]
    square = squared_lengths(normals)
    powers = np.einsum("im,im->m", normals, points)
    factors = np.einsum("im,im->m", gauge_normals, points)
    factors /= powers
    # The sum of the curvatures is tr([n] K [n]') / |n|^2, their product n' adj(K) n / |n|^2.
    flat = ~(minors * square > FLAT * sums * sums)
    if flat.any():
        minors[flat] = np.inf
    factors /= minors
    found *= factors
    if flat.any():
        at = np.flatnonzero(flat)
        scale = np.einsum("im,im->m", gauge_normals[:, at], points[:, at]) / powers[at]
        found[:, at] = scale * _rest_of_flat(normals[:, at], six[:, at])
    # A support point that all but stays where it is, as in a facet, is told to stay.
    turn = found[0] + found[3]
    turn += found[5]
    turn *= powers
    still = np.abs(turn) <= FACET * squared_lengths(points)
    if still.any():
        found[:, still] = 0.0
    return found, ~flat


def _twice_crossed(normals: Floats, six: Floats) -> Floats:
    """Return [n] K [n]' in six rows (6, m)."""
    x, y, z = normals
    a, b, c, d, e, f = six
    part = np.empty_like(x)

    def difference(out: Floats, first: Floats, by: Floats, second: Floats, and_by: Floats) -> None:
        np.multiply(first, by, out=out)
        np.multiply(second, and_by, out=part)
        out -= part

    # Rows of [n] K, each entry that is needed, and these times [n]'.
    rows = np.empty((3, *x.shape))
    p, q, r = rows
    found = np.empty_like(six)
    difference(p, y, c, z, b)
    difference(q, y, e, z, d)
    difference(r, y, f, z, e)
    difference(found[0], y, r, z, q)
    difference(found[1], z, p, x, r)
    difference(found[2], x, q, y, p)
    difference(p, z, a, x, c)
    difference(q, z, b, x, e)
    difference(r, z, c, x, f)
    difference(found[3], z, p, x, r)
    difference(found[4], x, q, y, p)
    difference(p, x, b, y, a)
    difference(q, x, d, y, b)
    difference(found[5], x, q, y, p)
    return found


def _rest_of_flat(normals: Floats, six: Floats) -> Floats:
    """Return the inverses of K across n in six rows, without what is infinite, for few columns."""
    found = np.empty_like(six)
    for column, (normal, entries) in enumerate(zip(normals.T, six.T, strict=True)):
        basis = np.linalg.svd(normal[np.newaxis])[2][1:]
        values, vectors = np.linalg.eigh(basis @ entries[ENTRIES] @ basis.T)
        inverse = 1.0 / values[1] if values[1] > 0.0 else 0.0
        vector = vectors[:, 1] @ basis
        found[:, column] = six_of((inverse * np.outer(vector, vector))[np.newaxis])[:, 0]
    return found
