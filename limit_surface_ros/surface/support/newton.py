# SPDX-License-Identifier: Apache-2.0
"""Least value of a gauge over a plane: the one optimisation behind all support points.

A gauge g is positive and homogeneous of degree one. Where n.x = 1 is held and g(x) is least, the
gradient of g is parallel to n and x / g(x) is the point of g = 1 with the largest n.x. With the
dissipation as gauge this takes loads to twists, with a surface's load factor twists to loads.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from limit_surface_ros.errors import SolverError
from limit_surface_ros.surface.linalg import squared_lengths

if TYPE_CHECKING:
    from typing import TypeAlias

    from limit_surface_ros.checks import Bools, Floats
    from limit_surface_ros.surface.gauges.gauge import Gauge

    Derivatives: TypeAlias = tuple[Floats, Floats, Floats]

# Newton's method stops after a step of this relative length: the next one would be its square.
_LAST_STEP = 1e-8
# It also stops where the sine of the angle between normal and gradient is below this, and where no
# step lowers the gauge any more.
_TARGET = 1e-14
# Where it stops with a larger sine, a kink may have drawn it in.
_PARALLEL = 1e-6
_STEPS = 25
_HALVINGS = 40
# Relative smoothing of the kinks where Newton's method alone does not settle.
_RATIO = 0.2
_SMOOTHINGS = 0.3 * _RATIO ** np.arange(18)


def certain_minimum(
    gauge: Gauge, normals: Floats, starts: Floats, initial: Derivatives | None = None
) -> Floats:
    """Return the points (3, m) where n.x = 1 and the gauge is least; see `plane_minimum`.

    Where Newton's method does not settle, or ends with the gradient at an angle to n, a kink is
    near: the minimum is then followed while the kinks sharpen, along a path that is straight in
    the end. The lower end of the two is the answer.

    Raises:
        SolverError: A minimum could not be certified.
    """
    found, settled, sines = plane_minimum(
        gauge, normals, starts, np.zeros(starts.shape[1]), initial
    )
    hard = np.flatnonzero(~settled | (sines > _PARALLEL))
    if len(hard) == 0:
        return found
    path = before = found.take(hard, axis=1)
    across = normals.take(hard, axis=1)
    for size in _SMOOTHINGS:
        start = path + _RATIO * (path - before)
        before = path
        path, ended, _ = plane_minimum(gauge, across, start, np.full(len(hard), size))
    certain = ended | settled[hard]
    if not certain.all():
        normal = normals[:, hard[np.argmin(certain)]].tolist()
        raise SolverError(f"no answer could be certified for the scaled direction {normal}")
    lower = gauge.values(path) < gauge.values(found.take(hard, axis=1))
    better = ended & (lower | ~settled[hard])
    found[:, hard[better]] = path[:, better]
    return found


def plane_minimum(
    gauge: Gauge,
    normals: Floats,
    starts: Floats,
    smoothing: Floats,
    initial: Derivatives | None = None,
) -> tuple[Floats, Bools, Floats]:
    """Return the points (3, m) where n.x = 1 and the gauge is least, and which have settled (m,).

    Beside them go the sines (m,) of the angles between gradient and normal before the last steps.

    Newton's method with a line search in the two directions across each normal, all columns at
    once. Where the gauge is not convex the minimum is a local one.

    Args:
        gauge: The gauge.
        normals: n, unit vectors, shape (3, m).
        starts: Points to start from, with n.x > 0, shape (3, m).
        smoothing: Passed to the gauge, shape (m,).
        initial: The gauge's derivatives at the starts, if they are known.
    """
    scale = 1.0 / (normals * starts).sum(axis=0)
    points = starts * scale
    result = points.copy()
    settled = np.zeros(points.shape[1], dtype=bool)
    angles = np.zeros(points.shape[1])
    todo = np.arange(points.shape[1])
    basis = plane_basis(normals)
    if initial is None:
        values, gradients, hessians = gauge.derivatives(points, smoothing)
    else:
        values, gradients, hessians = initial[0] * scale, initial[1], initial[2] / scale
    for _ in range(_STEPS):
        moves, slopes, sines = newton_moves(normals, basis, points, gradients, hessians)
        lengths = np.sqrt(squared_lengths(moves) / squared_lengths(points))
        last = lengths <= _LAST_STEP
        angles[todo] = sines
        settled[todo] = last | (sines <= _PARALLEL)
        result[:, todo] = points + np.where(last, moves, 0.0)
        # Just beyond a corner the curvature is large, and one step more makes the gradient
        # parallel; at a kink none does. Where kinks are rounded, their length alone tells.
        last &= (sines <= _PARALLEL) | (smoothing > 0.0)
        keep = ~last & (sines > _TARGET)
        if not keep.any():
            break
        if not keep.all():
            todo, normals, basis, smoothing, points, moves, slopes, values = kept(
                keep, todo, normals, basis, smoothing, points, moves, slopes, values
            )
        points, moved, values, gradients, hessians = _line_search(
            gauge, points, moves, values, slopes, smoothing
        )
        if not moved.any():
            break
        if not moved.all():
            todo, normals, basis, smoothing, points, values, gradients, hessians = kept(
                moved, todo, normals, basis, smoothing, points, values, gradients, hessians
            )
    return result, settled, angles


def kept(keep: Bools, *arrays: Any) -> list[Any]:
    """Return the columns of arrays (..., m) that are kept, contiguous: `a[:, keep]` is not."""
    return [array.compress(keep, axis=-1) for array in arrays]


def newton_moves(
    normals: Floats, basis: Floats, points: Floats, gradients: Floats, hessians: Floats
) -> tuple[Floats, Floats, Floats]:
    """Return Newton's moves (3, m) in the planes, slopes along them, and sines (m,)."""
    first, second = basis
    across_first, across_second = np.einsum("bim,im->bm", basis, gradients)
    along = np.einsum("im,im->m", normals, gradients)
    rising = along > 0.0
    across = np.sqrt(across_first * across_first + across_second * across_second)
    sines = across / np.where(rising, along, 1.0)
    sines[~rising] = np.inf
    by_first = np.einsum("ijm,jm->im", hessians, first)
    by_second = np.einsum("ijm,jm->im", hessians, second)
    a = np.einsum("im,im->m", first, by_first)
    b = np.einsum("im,im->m", first, by_second)
    c = np.einsum("im,im->m", second, by_second)
    # Where the gauge is flat the answer is not unique and any step will do.
    squares = squared_lengths(points)
    size = np.sqrt(squared_lengths(gradients) / squares)
    mean, half = 0.5 * (a + c), 0.5 * (a - c)
    spread = np.sqrt(half * half + b * b)
    ridge = 1e-15 * spread + 1e-13 * size
    # Negative curvature is replaced by its absolute value (modified Newton).
    negative = np.flatnonzero(mean < spread * (1.0 - 1e-10))
    if len(negative):
        a[negative], b[negative], c[negative] = _absolute(
            *(each[negative] for each in (a, b, c, mean, spread))
        )
    a += ridge
    c += ridge
    determinant = np.maximum(a * c - b * b, ridge * (a + c))
    p = (b * across_second - c * across_first) / determinant
    q = (b * across_first - a * across_second) / determinant
    length = np.sqrt(p * p + q * q)
    reach = np.sqrt(squares)
    long = length > reach
    if long.any():
        shrink = np.where(long, reach / np.where(long, length, 1.0), 1.0)
        p *= shrink
        q *= shrink
    return p * first + q * second, p * across_first + q * across_second, sines


def _absolute(
    a: Floats, b: Floats, c: Floats, mean: Floats, spread: Floats
) -> tuple[Floats, Floats, Floats]:
    """Return symmetric 2x2 matrices with the signs of their negative eigenvalues changed.

    Their eigenvalues are mean +- spread. That of |M| are known, and it has the axes of M.
    """
    high, low = np.abs(mean + spread), np.abs(mean - spread)
    middle, slope = 0.5 * (high + low), 0.5 * (high - low) / spread
    return middle + slope * (a - mean), slope * b, middle + slope * (c - mean)


def _line_search(
    gauge: Gauge, points: Floats, moves: Floats, values: Floats, slopes: Floats, smoothing: Floats
) -> tuple[Floats, Bools, Floats, Floats, Floats]:
    """Halve the moves until the gauge falls; return points, which moved, and the derivatives."""
    trial = points + moves
    new_values, gradients, hessians = gauge.derivatives(trial, smoothing)
    high = np.flatnonzero(new_values > values * (1.0 + 1e-15) + 1e-4 * slopes)
    step = 1.0
    for _ in range(_HALVINGS):
        if len(high) == 0:
            break
        step *= 0.5
        shorter = points.take(high, axis=1) + step * moves.take(high, axis=1)
        trial[:, high] = shorter
        new_values[high], gradients[:, high], hessians[:, :, high] = gauge.derivatives(
            shorter, smoothing[high]
        )
        bound = values[high] * (1.0 + 1e-15) + 1e-4 * step * slopes[high]
        high = high[new_values[high] > bound]
    moved = np.ones(len(values), dtype=bool)
    moved[high] = False
    return trial, moved, new_values, gradients, hessians


def plane_basis(normals: Floats) -> Floats:
    """Return for unit vectors (3, m) two unit vectors across each and each other, (2, 3, m)."""
    x, y, z = normals
    sign = np.where(z >= 0.0, 1.0, -1.0)
    a = -1.0 / (sign + z)
    b = x * y * a
    return np.array([[1.0 + sign * x * x * a, sign * b, -sign * x], [b, sign + y * y * a, -y]])
