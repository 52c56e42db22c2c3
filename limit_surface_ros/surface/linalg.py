# SPDX-License-Identifier: Apache-2.0
"""Small linear algebra: positive semidefinite 3x3 matrices, and directions on the unit sphere."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from limit_surface_ros.checks import as_floats
from limit_surface_ros.errors import MatrixError, ShapeError

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from limit_surface_ros.checks import Floats

# Relative asymmetry and negativity that rounding may leave in a matrix.
_TOLERANCE = 1e-10
# Relative pivot below which a matrix has no further rank.
_RANK_TOLERANCE = 8 * np.finfo(np.float64).eps

# A form v'Av below this part of trace(A) v'v is zero but for rounding: v is in A's null space.
NULL_TOLERANCE = 1e-28
# Singular value, relative to the largest, below which one is rounding.
_NULL_SINGULAR = 1e-14

_ONES = np.ones(3)


def as_psd_matrices(name: str, matrices: ArrayLike) -> Floats:
    """Return `matrices` as a read-only float64 array (k, 3, 3) of PSD matrices, k at least 1.

    Args:
        name: What one matrix is, for the error.
        matrices: Shape (k, 3, 3).

    Raises:
        ShapeError: The shape is another.
        NotFiniteError: An element is NaN or infinite.
        MatrixError: A matrix is zero, not symmetric or not positive semidefinite.
    """
    array = as_floats(name, matrices)
    if array.ndim != 3 or array.shape[1:] != (3, 3) or len(array) == 0:
        raise ShapeError(f"{name} must have shape (k, 3, 3) with k >= 1, got {array.shape}")
    for index, matrix in enumerate(array):
        size = np.abs(matrix).max()
        if size == 0.0:
            raise MatrixError(f"{name} {index} is zero: every term must resist some load")
        if np.abs(matrix - matrix.T).max() > _TOLERANCE * size:
            raise MatrixError(f"{name} {index} must be symmetric, got {matrix.tolist()}")
        lowest = np.linalg.eigvalsh(matrix / size)[0]
        if lowest < -_TOLERANCE:
            raise MatrixError(
                f"{name} {index} must be positive semidefinite, "
                f"its lowest eigenvalue is {lowest * size:.6g}"
            )
    result: Floats = array.copy()
    result.setflags(write=False)
    return result


def root_of(matrix: Floats) -> Floats:
    """Return R with R'R = `matrix`, by Cholesky's method with pivots.

    |R u|^2 is never negative and keeps twice the digits of u'Au where that is small; rows of R
    are zero beyond the matrix's rank.

    Args:
        matrix: Positive semidefinite, shape (3, 3).

    Returns:
        Shape (3, 3); a column permutation of an upper triangle.
    """
    rest = 0.5 * (matrix + matrix.T)
    diagonal = np.diagonal(rest).copy()
    root = np.zeros((3, 3))
    free = [i for i in range(3) if diagonal[i] > 0.0]
    for row in range(3):
        pivots = {i: rest[i, i] / diagonal[i] for i in free}
        pivot = max(pivots, key=pivots.__getitem__, default=-1)
        if pivot < 0 or pivots[pivot] <= _RANK_TOLERANCE:
            break
        free.remove(pivot)
        root[row, [pivot, *free]] = rest[pivot, [pivot, *free]] / np.sqrt(rest[pivot, pivot])
        rest = rest - np.outer(root[row], root[row])
    return root


def even_directions(count: int) -> Floats:
    """Return `count` unit vectors on a Fibonacci spiral, shape (count, 3).

    Each stands for an equal share of the sphere; neighbours are about sqrt(4 pi / count) apart.
    """
    index = np.arange(count)
    z = (2.0 * index + 1.0) / count - 1.0
    angle = np.pi * (1.0 + np.sqrt(5.0)) * index
    radius = np.sqrt(1.0 - z * z)
    return np.stack([radius * np.cos(angle), radius * np.sin(angle), z], axis=1)


def of_unit_length(columns: Floats) -> Floats:
    """Return vectors (3, m), none zero, divided by their lengths."""
    return np.asarray(columns / np.sqrt(squared_lengths(columns)))


def squared_lengths(columns: Floats) -> Floats:
    """Return the squared lengths (m,) of vectors (3, m)."""
    # The quickest way for few and for many.
    return np.asarray(_ONES.dot(columns * columns))


def null_space(roots: Floats) -> Floats:
    """Return orthonormal vectors (q, 3) that matrices R_k (k, 3, 3) all take to zero.

    Each column is measured in its own size, so that neither units nor factors of 1e12 between the
    matrices make a vector of what is small.
    """
    rows = roots.reshape(-1, 3)
    sizes = np.sqrt(np.square(rows).sum(axis=0))
    sizes[sizes == 0.0] = 1.0
    _, singular, vectors = np.linalg.svd(rows / sizes)
    null = vectors[singular <= _NULL_SINGULAR * singular[0]] / sizes
    return np.linalg.qr(null.T)[0].T if len(null) else np.empty((0, 3))
