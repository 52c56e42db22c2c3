# SPDX-License-Identifier: Apache-2.0
"""The unit sphere: directions spread evenly over it, and vectors brought onto it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from limit_surface_ros.checks import Floats

_ONES = np.ones(3)


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
