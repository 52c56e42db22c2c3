# SPDX-License-Identifier: Apache-2.0
"""Pairs of load and motion drawn from a surface: what fits learn from and are tested on."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from limit_surface_ros.errors import RangeError
from limit_surface_ros.surface.pairs import Pairs

if TYPE_CHECKING:
    from limit_surface_ros.checks import Floats
    from limit_surface_ros.surface.base import LimitSurface
    from limit_surface_ros.surface.kinds.point_contacts import PointContacts


def random_directions(count: int, rng: np.random.Generator | int | None = None) -> Floats:
    """Return unit vectors drawn uniformly from the sphere.

    Args:
        count: How many.
        rng: Generator or seed.

    Returns:
        Shape (count, 3).
    """
    _check_count("count", count)
    vectors = np.random.default_rng(rng).standard_normal((count, 3))
    return np.asarray(vectors / np.linalg.norm(vectors, axis=1, keepdims=True))


def random_motions(
    surface: LimitSurface, count: int, rng: np.random.Generator | int | None = None
) -> Pairs:
    """Return pairs whose twists are uniform over the directions of scaled motion.

    Args:
        surface: Whose loads of maximum dissipation to take.
        count: How many pairs.
        rng: Generator or seed.
    """
    twists = random_directions(count, rng) * surface.scaling.twist_unit
    return Pairs(surface.wrench_of_twist(twists), twists)


def random_loads(
    surface: LimitSurface, count: int, rng: np.random.Generator | int | None = None
) -> Pairs:
    """Return pairs whose wrenches lie on the surface, uniform over the directions of scaled load.

    Args:
        surface: Whose load factors and twists to take.
        count: How many pairs.
        rng: Generator or seed.
    """
    directions = random_directions(count, rng) * surface.scaling.wrench_unit
    wrenches = directions / surface.load_factor(directions)[:, np.newaxis]
    return Pairs(wrenches, surface.twist_of_wrench(wrenches))


def facet_loads(
    contacts: PointContacts, per_facet: int, rng: np.random.Generator | int | None = None
) -> Pairs:
    """Return pairs on the facets: rotations about each support point, both ways.

    The point at rest adds forces in evenly spaced directions, of sizes uniform from 0 to its
    friction limit; all other points slide.

    Args:
        contacts: The body; each of its n points makes two facets.
        per_facet: How many pairs on each facet.
        rng: Generator or seed.

    Returns:
        2 n per_facet pairs, facet by facet.
    """
    _check_count("per_facet", per_facet)
    generator = np.random.default_rng(rng)
    x, y = contacts.points.T
    ones = np.ones_like(x)
    sense = np.array([1.0, -1.0])[:, np.newaxis]
    rotations = np.stack(np.broadcast_arrays(sense * y, -sense * x, sense * ones), axis=-1)
    rotations = np.swapaxes(rotations, 0, 1)
    rotations /= np.linalg.norm(rotations / contacts.scaling.twist_unit, axis=-1, keepdims=True)
    angle = np.linspace(0.0, 2.0 * np.pi, per_facet, endpoint=False)
    size = generator.uniform(size=(len(x), 2, per_facet)) * contacts.friction_limits[:, None, None]
    fx, fy = size * np.cos(angle), size * np.sin(angle)
    at_rest = np.stack([fx, fy, x[:, None, None] * fy - y[:, None, None] * fx], axis=-1)
    sliding = contacts.wrench_of_twist(rotations)[:, :, np.newaxis]
    twists = np.broadcast_to(rotations[:, :, np.newaxis], at_rest.shape)
    return Pairs((sliding + at_rest).reshape(-1, 3), twists.reshape(-1, 3))


def _check_count(name: str, count: int) -> None:
    if count < 1:
        raise RangeError(f"{name} must be at least 1, got {count}")
