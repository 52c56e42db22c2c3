# SPDX-License-Identifier: Apache-2.0
"""How far a model is from the truth: errors of motion and of load, and their distributions.

All are measured in scaled variables, so that they are numbers without a unit: errors of unit
twists lie between 0 and 2, errors of load are in parts of the friction force scale.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from limit_surface_ros.checks import as_directions, as_floats
from limit_surface_ros.errors import DataError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import ArrayLike

    from limit_surface_ros.checks import Floats
    from limit_surface_ros.surface.base import LimitSurface
    from limit_surface_ros.surface.pairs import Pairs
    from limit_surface_ros.surface.scaling import Scaling


def velocity_error(surface: LimitSurface, pairs: Pairs) -> Floats:
    """Return |v - v^| with v^ along the gradient of H at the load itself: the thesis's, in 3.5.

    H is the function that defines the surface, H = 1. For a power sum of mixed exponents and a
    load off the surface, its gradient there is not the normal where the ray of the load leaves,
    which is the motion that the model predicts; see `direction_error`.

    Args:
        surface: The model.
        pairs: Loads and the motions they caused.

    Returns:
        Shape (n,), from 0 to 2.
    """
    return _distances(surface, pairs, surface.gradient_twist(pairs.wrenches))


def direction_error(surface: LimitSurface, pairs: Pairs) -> Floats:
    """Return |v - v^|: the pairs' unit scaled twists against those that the model predicts.

    Args:
        surface: The model.
        pairs: Loads and the motions they caused; only the loads' directions matter.

    Returns:
        Shape (n,), from 0 to 2.
    """
    return _distances(surface, pairs, surface.twist_of_wrench(pairs.wrenches))


def _distances(surface: LimitSurface, pairs: Pairs, twists: Floats) -> Floats:
    """Return the distances between the pairs' twists and others, all made unit scaled twists."""
    unit = surface.scaling.twist_unit
    measured = pairs.twists / unit
    measured = measured / np.linalg.norm(measured, axis=1, keepdims=True)
    return np.asarray(np.linalg.norm(measured - twists / unit, axis=1))


def angle_error(surface: LimitSurface, pairs: Pairs) -> Floats:
    """Return the angles [rad] between the pairs' twists and the model's, in scaled variables.

    Returns:
        Shape (n,), from 0 to pi.
    """
    return np.asarray(2.0 * np.arcsin(np.minimum(0.5 * direction_error(surface, pairs), 1.0)))


def mean_angle(surface: LimitSurface, pairs: Pairs) -> float:
    """Return the mean angle [rad] between the pairs' twists and the model's."""
    return float(angle_error(surface, pairs).mean())


def force_error(surface: LimitSurface, reference: LimitSurface, directions: ArrayLike) -> Floats:
    """Return |f_s - f|: the model's loads against the reference's for the model's own motions.

    Loads in the given directions are scaled onto the model's surface, f_s; the reference's load
    for the twist that the model gives there is f. Measured in the model's scaled variables.

    Args:
        surface: The model.
        reference: The truth, of which only `wrench_of_twist` is used.
        directions: Directions of load in the model's *scaled* variables, shape (n, 3), for
            example `sampling.random_directions(1000)`.

    Returns:
        Shape (n,), in parts of the model's friction force scale.
    """
    unit = surface.scaling.wrench_unit
    wrenches = as_directions("direction", directions) * unit
    wrenches = wrenches / surface.load_factor(wrenches)[..., np.newaxis]
    exact = reference.wrench_of_twist(surface.twist_of_wrench(wrenches))
    return np.asarray(np.linalg.norm((wrenches - exact) / unit, axis=-1))


def load_error(surface: LimitSurface, pairs: Pairs, scaling: Scaling | None = None) -> Floats:
    """Return |f - f^|: the pairs' wrenches against the model's for their twists.

    For data of which the twist is known better than the wrench; where a twist belongs to a facet
    of the surface, many loads cause it and the error is that of the one the model names.

    Args:
        surface: The model.
        pairs: The data.
        scaling: In whose scaled variables; the model's if not given.

    Returns:
        Shape (n,), in parts of the friction force scale.
    """
    difference = pairs.wrenches - surface.wrench_of_twist(pairs.twists)
    unit = (scaling or surface.scaling).wrench_unit
    return np.asarray(np.linalg.norm(difference / unit, axis=1))


def quantiles(errors: ArrayLike, levels: Sequence[float] = (0.5, 0.95, 1.0)) -> Floats:
    """Return the errors' quantiles, by default the median, 95 % and the largest.

    Raises:
        DataError: There are no errors.
    """
    array = as_floats("errors", errors)
    if array.size == 0:
        raise DataError("quantiles need at least one error, got none")
    return np.asarray(np.quantile(array, levels))


def empirical_distribution(errors: ArrayLike) -> tuple[Floats, Floats]:
    """Return the sorted errors, and for each the share of errors that are no larger.

    Raises:
        DataError: There are no errors.
    """
    values = np.sort(as_floats("errors", errors), axis=None)
    if values.size == 0:
        raise DataError("a distribution needs at least one error, got none")
    return values, np.arange(1, len(values) + 1) / len(values)
