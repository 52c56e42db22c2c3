# SPDX-License-Identifier: Apache-2.0
"""Fits of mirror-symmetric bodies: terms come as mirror images, or are their own.

A mirror M = diag(m) turns a term's matrix L L' into (M L M)(M L M)': it changes nothing but the
signs m_i m_j of the six entries of L. Parameters of a symmetric model are therefore a linear
map, of signs and zeros, of fewer free ones: a term that is its own image has zeros where the signs
change, and of the others one stands for all its images.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from limit_surface_ros.errors import RangeError
from limit_surface_ros.fitting.factors import PARAMETERS_PER_MATRIX
from limit_surface_ros.surface.contact.symmetry import MIRRORS

if TYPE_CHECKING:
    from collections.abc import Sequence

    from limit_surface_ros.checks import Floats
    from limit_surface_ros.fitting.objective import Objective
    from limit_surface_ros.fitting.pairs import ScaledPairs
    from limit_surface_ros.surface.base import LimitSurface

_ROWS, _COLUMNS = np.tril_indices(3)


@dataclass(frozen=True, eq=False)
class SymmetricObjective:
    """Another objective over the parameters of symmetric models alone.

    Attributes:
        objective: Over all parameters, six for each term.
        images: The linear map from free parameters to all of them, shape (6 k, free).
    """

    objective: Objective
    images: Floats

    @property
    def size(self) -> int:
        """Number of free parameters."""
        return int(self.images.shape[1])

    def cost_and_gradient(self, parameters: Floats) -> tuple[float, Floats]:
        """Return the cost and its gradient by the free parameters."""
        cost, gradient = self.objective.cost_and_gradient(self.images @ parameters)
        return cost, gradient @ self.images

    def start(self, rng: np.random.Generator) -> Floats:
        """Return the free parameters of a random start's first terms."""
        return self._free(self.objective.start(rng))

    def start_near(self, parameters: Floats, rng: np.random.Generator) -> Floats:
        """Return a start for which one or two terms are changed."""
        return self._free(self.objective.start_near(self.images @ parameters, rng))

    def coarse(self) -> SymmetricObjective | None:
        """Return the same on a part of the pairs, None where they are few anyway."""
        part = self.objective.coarse()
        return None if part is None else SymmetricObjective(part, self.images)

    def surface(self, parameters: Floats) -> LimitSurface:
        """Return the symmetric surface of free parameters."""
        return self.objective.surface(self.images @ parameters)

    def _free(self, parameters: Floats) -> Floats:
        """Return each free parameter as its first image has it."""
        first = np.abs(self.images).argmax(axis=0)
        return np.asarray(parameters[first] * self.images[first, np.arange(self.size)])


def with_mirror_images(pairs: ScaledPairs, axes: Sequence[str]) -> ScaledPairs:
    """Return pairs joined with their images in the mirrors, weighing as much as before in all.

    Raises:
        RangeError: An axis is neither x nor y.
    """
    check_axes(axes)
    for axis in axes:
        mirror = MIRRORS[axis]
        image = replace(
            pairs, wrenches=pairs.wrenches * mirror, directions=pairs.directions * mirror
        )
        pairs = pairs.joined(image)
        pairs = pairs.weighted(np.full(len(pairs), 0.5))
    return pairs


def check_axes(axes: Sequence[str]) -> None:
    """Refuse what is no axis of a mirror.

    Raises:
        RangeError: An axis is neither x nor y.
    """
    unknown = sorted(set(axes) - set(MIRRORS))
    if unknown:
        raise RangeError(f"symmetry is about x, y or both, got {', '.join(unknown)}")


def symmetric(objective: Objective, images: Floats) -> Objective:
    """Return an objective over the parameters that `images` leaves free."""
    rows, free = images.shape
    return objective if rows == free else SymmetricObjective(objective, images)


def images_of_terms(terms: int, axes: Sequence[str], *, alike: bool) -> Floats:
    """Return the linear map from free parameters to those of a symmetric model.

    Args:
        terms: Of the model, images included.
        axes: About which it is symmetric, of "x" and "y", the one along which the body is longer
            first; none leaves every parameter free.
        alike: Whether terms can be images of each other, which those of unlike exponents cannot.

    Returns:
        Shape (6 terms, free).

    Raises:
        RangeError: An axis is neither x nor y.
    """
    check_axes(axes)
    if not axes:
        return np.eye(PARAMETERS_PER_MATRIX * terms)
    blocks = [_block(orbit, axes) for orbit in _orbits(terms, len(axes), alike)]
    images = np.zeros((PARAMETERS_PER_MATRIX * terms, sum(block.shape[1] for block in blocks)))
    row = column = 0
    for block in blocks:
        images[row : row + len(block), column : column + block.shape[1]] = block
        row, column = row + len(block), column + block.shape[1]
    return images


def _orbits(terms: int, axes: int, alike: bool) -> list[str]:
    """Return how terms divide into images of each other; each orbit by what leaves it as it is.

    "own" is a term that every mirror leaves as it is, "first" and "second" two terms on the first
    or the second axis, "none" two terms beside one axis or four beside two. Of what was tried on
    rectangles and discs these have the least error.
    """
    if not alike:
        return ["own"] * terms
    if axes == 1:
        return ["none"] * (terms // 2) + ["own"] * (terms % 2)
    small = [[], ["own"], ["first"], ["first", "own"], ["first", "second"]]
    small += [["first", "second", "own"]]
    fours = max(0, (terms - 2) // 4) if terms > 5 else 0
    return ["none"] * fours + small[terms - 4 * fours]


def _block(orbit: str, axes: Sequence[str]) -> Floats:
    """Return the map from the free parameters of one orbit to those of its terms."""
    mirrors = [MIRRORS[axis] for axis in axes]
    signs = [mirror[_ROWS] * mirror[_COLUMNS] for mirror in mirrors]
    fixed = {"own": signs, "first": signs[:1], "second": signs[1:], "none": []}[orbit]
    kept = np.eye(PARAMETERS_PER_MATRIX)
    for each in fixed:
        kept = kept[:, kept.T @ each > 0.0]
    images = [kept]
    for each in signs:
        if not any(each is other for other in fixed):
            images += [each[:, None] * image for image in images]
    return np.concatenate(images)
