# SPDX-License-Identifier: Apache-2.0
"""The inertia of a body that moves in the plane."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from limit_surface_ros.checks import as_floats, as_positive
from limit_surface_ros.errors import ShapeError

if TYPE_CHECKING:
    from limit_surface_ros.checks import Floats


@dataclass(frozen=True, eq=False)
class Inertia:
    """Mass, moment of inertia and centre of mass of a body.

    Attributes:
        mass: m [kg].
        moment: J about the vertical axis through the centre of mass [kg m^2].
        centre: The centre of mass about the surface's reference point, in its frame [m],
            shape (2,).
        matrix: M, with the kinetic energy q'Mq / 2 of a twist q at the reference point, in
            [kg, kg m, kg m^2], shape (3, 3).

    Raises:
        RangeError: Mass or moment is not a finite number above zero.
        ShapeError: The centre is not two numbers.
        NotFiniteError: The centre is NaN or infinite.

    Example:
        >>> Inertia(mass=2.0, moment=0.01, centre=(0.0, 0.1)).matrix.tolist()[2]
        [-0.2, 0.0, 0.030000000000000006]
    """

    mass: float
    moment: float
    centre: Floats = field(default_factory=lambda: np.zeros(2))
    matrix: Floats = field(init=False, repr=False)

    def __post_init__(self) -> None:
        """Check the numbers and derive the matrix."""
        mass, moment = as_positive("mass", self.mass), as_positive("moment", self.moment)
        centre = as_floats("centre", self.centre).copy()
        if centre.shape != (2,):
            raise ShapeError(f"centre must have shape (2,), got {centre.shape}")
        x, y = centre.tolist()
        matrix = np.array(
            [
                [mass, 0.0, -mass * y],
                [0.0, mass, mass * x],
                [-mass * y, mass * x, moment + mass * (x * x + y * y)],
            ]
        )
        for array in (centre, matrix):
            array.setflags(write=False)
        object.__setattr__(self, "mass", mass)
        object.__setattr__(self, "moment", moment)
        object.__setattr__(self, "centre", centre)
        object.__setattr__(self, "matrix", matrix)
