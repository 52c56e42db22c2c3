# SPDX-License-Identifier: Apache-2.0
"""Pairs made dimensionless for a fit, and the checks that they can support one."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np

from limit_surface_ros.checks import counted
from limit_surface_ros.errors import DataError
from limit_surface_ros.surface.scaling import Scaling

if TYPE_CHECKING:
    from limit_surface_ros.checks import Floats
    from limit_surface_ros.surface.pairs import Pairs

# Share of the motions' second moment along one line from which on they are one motion: all within
# about 8 degrees of it.
_ONE_DIRECTION = 0.98
# Relative second moment below which the loads leave a direction of load untried.
_UNTRIED = 1e-8
# Parts of a load, and how much of an axis is along one of them if it is named after it.
_PARTS = ("force along x", "force along y", "moment")
_PURE = 0.999
# The same pairs in other units differ by rounding, which can lead a descent to another minimum
# where costs have kinks. Far below any measurement they are made the same.
_DECIMALS = 9
# A fit finds its way on one of so many pairs, but on so many for each parameter at least.
_COARSE_STRIDES = range(4, 9)
_COARSE_PAIRS = 12


@dataclass(frozen=True)
class ScaledPairs:
    """Loads and unit motions in scaled variables.

    Attributes:
        wrenches: Shape (n, 3).
        directions: Unit twists, shape (n, 3).
        scaling: What they were scaled with.
        weights: How much each pair counts, shape (n,); 1 each if not given.
    """

    wrenches: Floats
    directions: Floats
    scaling: Scaling
    weights: Floats = field(default_factory=lambda: np.empty(0))

    def __post_init__(self) -> None:
        """Fill in weights of 1."""
        if not self.weights.size:
            object.__setattr__(self, "weights", np.ones(len(self.wrenches)))

    def weighted(self, weights: Floats) -> ScaledPairs:
        """Return the same pairs with their weights multiplied by `weights`, shape (n,)."""
        return replace(self, weights=self.weights * weights)

    def coarse(self, parameters: int) -> ScaledPairs | None:
        """Return one of every eight pairs, with weights for the rest; None where they are few.

        Args:
            parameters: Of the fit; a dozen pairs are kept for each, if need be one of every four.
        """
        stride = min(len(self) // (_COARSE_PAIRS * parameters), _COARSE_STRIDES[-1])
        if stride not in _COARSE_STRIDES:
            return None
        return self.every(stride)

    def every(self, stride: int) -> ScaledPairs:
        """Return every so many pairs, with weights for the rest."""
        part = slice(None, None, stride)
        weights = self.weights[part] * stride
        return ScaledPairs(self.wrenches[part], self.directions[part], self.scaling, weights)

    def joined(self, other: ScaledPairs) -> ScaledPairs:
        """Return these pairs and then those of `other`, which has the same scaling."""
        return ScaledPairs(
            np.concatenate([self.wrenches, other.wrenches]),
            np.concatenate([self.directions, other.directions]),
            self.scaling,
            np.concatenate([self.weights, other.weights]),
        )

    def __len__(self) -> int:
        """Return the number of pairs."""
        return len(self.wrenches)


def scaling_of_pairs(pairs: Pairs, characteristic_length: float | None = None) -> Scaling:
    """Choose scales from data, so that the choice moves with the units of the data.

    The friction force scale is the root mean square of the forces; the characteristic length, if
    it is not given, that of the moments over it, so that forces and moments weigh alike.

    Raises:
        DataError: All forces are zero, or all moments and no length is given.
        RangeError: The length is not above zero.
    """
    force = float(np.sqrt(np.mean(np.sum(pairs.wrenches[:, :2] ** 2, axis=1))))
    if not force > 0.0:
        raise DataError("all forces are zero: the pairs say nothing about friction")
    if characteristic_length is None:
        characteristic_length = float(np.sqrt(np.mean(pairs.wrenches[:, 2] ** 2))) / force
        if not characteristic_length > 0.0:
            raise DataError(
                "all moments are zero: the pairs say nothing about rotation or a length"
            )
    return Scaling(characteristic_length, force)


def scale_pairs(pairs: Pairs, scaling: Scaling | None = None) -> ScaledPairs:
    """Scale pairs; without a scaling, by `scaling_of_pairs`.

    Raises:
        DataError: See `scaling_of_pairs`.
    """
    scaling = scaling or scaling_of_pairs(pairs)
    directions = pairs.twists / scaling.twist_unit
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    wrenches = pairs.wrenches / scaling.wrench_unit
    rounded = np.round(directions, _DECIMALS)
    return ScaledPairs(_rounded(wrenches), rounded, scaling, pairs.weights)


def _rounded(wrenches: Floats) -> Floats:
    """Return scaled wrenches rounded, in parts of their size where a given scaling is far off."""
    size = float(np.sqrt(np.mean(wrenches**2)))
    # By a power of two, which keeps every digit; scalings chosen from the pairs need none.
    unit = 1.0 if 0.01 < size < 100.0 or size == 0.0 else 2.0 ** round(math.log2(size))
    return np.asarray(np.round(wrenches / unit, _DECIMALS) * unit)


def check_support(pairs: ScaledPairs, parameters: int) -> None:
    """Refuse pairs that cannot determine a surface.

    Args:
        pairs: What is to be fitted.
        parameters: How many numbers the fit is to find; 0 leaves the count unchecked.

    Raises:
        DataError: There are fewer pairs than parameters, most have negative power, all motions
            are one, or a direction of load was never tried.
    """
    count = len(pairs)
    if count < max(parameters, 1):
        raise DataError(
            f"{counted(count, 'pair')} cannot determine {parameters} parameters: give more "
            "pairs, fewer terms, or choose the fit for few pushes (--auto)"
        )
    against = int(np.count_nonzero(np.sum(pairs.wrenches * pairs.directions, axis=1) < 0.0))
    if against > count / 2:
        raise DataError(
            f"{against} of {count} pushes have negative power: a body that slides with "
            "friction only takes power in; are the wrenches those on the pusher, or the twists "
            "reversed?"
        )
    moments, axes = np.linalg.eigh(pairs.directions.T @ pairs.directions / count)
    if moments[-1] > _ONE_DIRECTION:
        if abs(axes[2, -1]) > _PURE:
            raise DataError(
                "all motions are turns on the spot: next to a characteristic length of "
                f"{pairs.scaling.characteristic_length:g} m the velocities are nothing; are that "
                "length in metres and the angular velocities in rad/s?"
            )
        raise DataError(
            "all motions go in one direction: they cannot determine a surface; "
            "push and turn the body in several directions"
        )
    scaled = pairs.wrenches / np.abs(pairs.wrenches).max()
    loads, axes = np.linalg.eigh(scaled.T @ scaled / count)
    if loads[0] <= _UNTRIED * loads[-1]:
        raise DataError(
            f"{_untried(axes[:, 0])}: nothing tells how much of it the ground holds; give pushes "
            "that have some (support points that coincide, or a characteristic length far from "
            "the body's size, leave moments out)"
        )


def _untried(axis: Floats) -> str:
    """Say which part of a load, a unit vector in scaled variables, no load has."""
    for name, component in zip(_PARTS, axis, strict=True):
        if abs(component) > _PURE:
            return f"no load has a {name}"
    parts = ", ".join(f"{component:.2f}" for component in axis)
    return f"no load has a part along (f_x, f_y, tau_z / characteristic length) = ({parts})"
