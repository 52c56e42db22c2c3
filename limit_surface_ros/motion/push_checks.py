# SPDX-License-Identifier: Apache-2.0
"""Checks of what pushes are given: pairs of numbers, normals and coefficients of friction."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from limit_surface_ros.checks import as_floats
from limit_surface_ros.errors import RangeError, ShapeError, ZeroVectorError

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from limit_surface_ros.checks import Complexes, Floats


def friction_edges(friction: ArrayLike, count: int) -> Complexes:
    """Return unit forces (count,) at the left edges of friction cones whose normal is 1.

    Args:
        friction: Coefficients from 0 to infinity, one for all or shape (count,).
        count: How many.

    Raises:
        ShapeError: There are neither one nor `count` coefficients.
        RangeError: A coefficient is negative or NaN.
    """
    try:
        # The real part of a complex number is no friction.
        given = np.asarray(friction, dtype=np.float64) if np.isrealobj(friction) else None
    except (TypeError, ValueError, OverflowError):
        given = None
    if given is None:
        raise ShapeError("friction must be a number, or one for each push")
    if given.shape not in ((), (count,)):
        raise ShapeError(f"friction must be one number or {count}, got shape {given.shape}")
    if not (given >= 0.0).all():
        wrong = given[~(given >= 0.0)].ravel()[0]
        raise RangeError(f"friction must be 0 or above, up to infinity, got {wrong}")
    limited = np.isfinite(given)
    along = 1.0 / np.hypot(1.0, given)
    across = np.where(limited, np.where(limited, given, 0.0) * along, 1.0)
    return np.asarray(np.broadcast_to(along + 1j * across, (count,)))


def one_friction(friction: float) -> float:
    """Return a coefficient of friction, from 0 to infinity, as a float.

    Raises:
        ShapeError: It is no number.
        RangeError: It is negative or NaN.
    """
    try:
        given = float(friction)
    except (TypeError, ValueError, OverflowError):
        raise ShapeError("friction must be a number") from None
    if not given >= 0.0:
        raise RangeError(f"friction must be 0 or above, up to infinity, got {given}")
    return given


def unit_normals(normals: Floats) -> Floats:
    """Return normals (n, 2) of length one.

    Raises:
        ZeroVectorError: A normal is zero; the error gives the first one's place.
    """
    size = np.abs(normals).max(axis=1, initial=0.0)
    if not size.all():
        place = int(np.flatnonzero(size == 0.0)[0])
        raise ZeroVectorError(f"normals must not be zero: no direction at index {place}")
    scaled = normals / size[:, np.newaxis]
    return np.asarray(scaled / np.hypot(*scaled.T)[:, np.newaxis])


def pairs(name: str, values: ArrayLike) -> Floats:
    """Return values as a finite array of shape (n, 2).

    Raises:
        ShapeError: The shape is another.
        NotFiniteError: A number is NaN or infinite.
    """
    array = as_floats(name, values)
    if array.ndim != 2 or array.shape[1] != 2:
        raise ShapeError(f"{name} must have shape (n, 2), got {array.shape}")
    return array


def same_pairs(**values: ArrayLike) -> tuple[list[Floats], tuple[int, ...]]:
    """Return arrays that hold one pair each, (2,), or as many, (n, 2), as rows, and their lead.

    Raises:
        ShapeError: A shape is another, or they differ.
        NotFiniteError: A number is NaN or infinite.
    """
    arrays = {name: as_floats(name, each) for name, each in values.items()}
    shapes = [array.shape for array in arrays.values()]
    lead = shapes[0][:-1]
    if len(lead) > 1 or any(shape != (*lead, 2) for shape in shapes):
        raise ShapeError(
            f"{', '.join(arrays)} must all have shape (2,), or (n, 2), "
            f"got {', '.join(map(str, shapes))}"
        )
    return [array.reshape(-1, 2) for array in arrays.values()], lead


def as_complex(vectors: Floats) -> Complexes:
    """Return vectors (m, 2) as complex numbers (m,)."""
    return np.ascontiguousarray(vectors).view(np.complex128)[:, 0]


def as_vectors_of(numbers: Complexes) -> Floats:
    """Return complex numbers (m,) as vectors (m, 2)."""
    return np.ascontiguousarray(numbers).view(np.float64).reshape(-1, 2)
