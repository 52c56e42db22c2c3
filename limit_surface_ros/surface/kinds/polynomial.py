# SPDX-License-Identifier: Apache-2.0
"""Homogeneous polynomials of fourth order: the model of Zhou et al., the peer of the other kinds.

J. Zhou, R. Paolini, J. A. Bagnell and M. T. Mason, "A convex polynomial force-motion model for
planar sliding", ICRA 2016, doi:10.1109/ICRA.2016.7487155.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from limit_surface_ros.checks import as_floats, as_vectors
from limit_surface_ros.errors import MatrixError, RangeError, ShapeError
from limit_surface_ros.surface.base import FileArray, LimitSurface
from limit_surface_ros.surface.gauges.quartic import MONOMIALS, Quartic
from limit_surface_ros.surface.gauges.scalar import QuarticScalar
from limit_surface_ros.surface.gauges.sum_of_squares import proves_convex, proves_positive
from limit_surface_ros.surface.linalg import even_directions
from limit_surface_ros.surface.scaling import Scaling
from limit_surface_ros.surface.shape import GaugeShape
from limit_surface_ros.surface.support.small_batch import SmallBatch
from limit_surface_ros.surface.support.solvers import (
    ConvexNewton,
    InFrame,
    PeakSearch,
    SupportSolver,
    round_frame,
)
from limit_surface_ros.surface.support.tabulated import Tabulated

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from limit_surface_ros.checks import Floats

__all__ = ["MONOMIALS", "Polynomial"]

_CHECKED_DIRECTIONS = 2000
# Sizes of coefficients of which products are numbers.
_LEAST, _MOST = 1e-100, 1e100
# Least P(f) / |f|^4 that a polynomial must have where its surface is about the unit sphere.
_MARGIN = 1e-9
_STARTS = 500
# Vectors up to which several climbs each, one after another, are quicker than all at once.
_FEW_WITH_PEAKS = 8


@dataclass(frozen=True, eq=False)
class Polynomial(LimitSurface):
    """The surface P(f) = 1 of a polynomial that is homogeneous of degree four.

    Attributes:
        coefficients: In the order of `MONOMIALS`, for scaled loads, shape (15,).
        scaling: Characteristic length [m] and friction force [N].

    Raises:
        ShapeError: There are not 15 coefficients.
        NotFiniteError: A coefficient is NaN or infinite.
        RangeError: The largest coefficient is below 1e-100 or above 1e100.
        MatrixError: The polynomial is not positive, so that the surface is not closed.
    """

    kind: ClassVar[str] = "polynomial"
    arrays: ClassVar[tuple[FileArray, ...]] = (FileArray("coefficients", (15,)),)

    coefficients: Floats
    scaling: Scaling = field(default_factory=Scaling)

    def __post_init__(self) -> None:
        """Check the coefficients."""
        coefficients = as_floats("coefficients", self.coefficients).copy()
        if coefficients.shape != (15,):
            raise ShapeError(f"coefficients must have shape (15,), got {coefficients.shape}")
        size = np.abs(coefficients).max()
        if size > 0.0 and not _LEAST <= size <= _MOST:
            raise RangeError(
                f"the largest coefficient must lie between 1e-100 and 1e100, got {size:g}"
            )
        coefficients.setflags(write=False)
        object.__setattr__(self, "coefficients", coefficients)
        _check_positive(self._quartic)

    @cached_property
    def _quartic(self) -> Quartic:
        return Quartic(self.coefficients)

    def value(self, load: ArrayLike) -> Floats:
        """Return P at scaled loads (..., 3): below 1 inside the surface, 1 on it; shape (...)."""
        array = as_vectors("load", load)
        values = self._quartic.polynomial(array.reshape(-1, 3).T)
        return np.asarray(values.reshape(array.shape[:-1]))[()]

    def gradient(self, load: ArrayLike) -> Floats:
        """Return the gradient of P at scaled loads (..., 3); shape (..., 3)."""
        array = as_vectors("load", load)
        return np.asarray(self._quartic.gradient(array.reshape(-1, 3).T).T.reshape(array.shape))

    @cached_property
    def convex_because(self) -> str | None:
        """Why the surface is convex, if it is: by a certificate of its own numbers."""
        return "its Hessian is a sum of squares" if proves_convex(self._quartic) else None

    def _new_shape(self) -> _QuarticShape:
        return _QuarticShape(self._quartic)


class _QuarticShape(GaugeShape):
    """The shape of P = 1."""

    def __init__(self, quartic: Quartic) -> None:
        super().__init__(quartic, QuarticScalar(quartic.first, quartic.second))
        self._quartic = quartic

    @cached_property
    def solver(self) -> SupportSolver:
        """Finds the loads of maximum dissipation."""
        frame = round_frame(self._quartic)
        quartic = self._quartic.in_frame(frame)
        scalar = QuarticScalar(quartic.first, quartic.second)
        directions = even_directions(2 * _STARTS).T
        if proves_convex(quartic):
            newton = SmallBatch(ConvexNewton(quartic, directions), scalar)
            return InFrame(frame, Tabulated(quartic, newton, scalar=scalar))
        search = PeakSearch(quartic, directions[:, _STARTS:])
        peaks = SmallBatch(search, scalar, few=_FEW_WITH_PEAKS)
        return InFrame(frame, Tabulated(quartic, peaks, scalar=scalar, convex=False))


def _check_positive(quartic: Quartic) -> None:
    """Prove that P is positive, in axes in which the surface P = 1 is about round.

    Raises:
        MatrixError: It is not, or only by what rounding may have added.
    """
    directions = even_directions(_CHECKED_DIRECTIONS).T
    if quartic.polynomial(directions).min() > 0.0:
        try:
            with np.errstate(invalid="ignore"):
                frame = round_frame(quartic)
            if not np.isfinite(frame).all():
                raise np.linalg.LinAlgError("a gauge without values has no frame")
            round_quartic = quartic.in_frame(frame)
            if proves_positive(round_quartic, _MARGIN):
                return
            lowest = frame @ round_quartic.lowest(directions)
        except np.linalg.LinAlgError:
            lowest = quartic.lowest(directions)
    else:
        lowest = quartic.lowest(directions)
    lowest /= np.sqrt(lowest @ lowest)
    value = float(quartic.polynomial(lowest[:, np.newaxis])[0])
    raise MatrixError(
        "the polynomial must be positive: it is "
        f"{value:.6g} at the scaled load {[float(f'{x:.6g}') for x in lowest]}"
        + (", which is too little to be certain of it nearby" if value > 0.0 else "")
    )
