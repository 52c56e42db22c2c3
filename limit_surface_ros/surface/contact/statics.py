# SPDX-License-Identifier: Apache-2.0
"""How a body's weight spreads over its feet: statics for three or fewer, springs for more."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from limit_surface_ros.checks import as_floats, as_positive
from limit_surface_ros.errors import GeometryError, RangeError, ShapeError

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from limit_surface_ros.checks import Floats

# Share of the weight, and of the feet's spread, that is rounding.
_ROUNDING = 1e-9
_MOST_STEPS = 200


@dataclass(frozen=True, eq=False)
class SupportLoads:
    """Normal forces of the feet, and the assumption that made them.

    Attributes:
        loads: Normal force of each foot [N], shape (n,), adding up to the weight.
        method: How they were found, in words.
    """

    loads: Floats
    method: str


def support_loads(
    points: ArrayLike,
    normal_force: float,
    centre_of_mass: ArrayLike,
    stiffnesses: ArrayLike | None = None,
) -> SupportLoads:
    """Return how a rigid body presses on its feet.

    Force and both moments determine the loads of three feet that are not on one line. More feet
    are taken as springs of the given stiffnesses on a rigid ground; feet that the body would lift
    carry nothing. With equal stiffnesses and no lifted foot that is the solution of least norm.

    Args:
        points: Feet [m], shape (n, 2).
        normal_force: Weight of the body [N].
        centre_of_mass: [m], shape (2,), in the coordinates of the feet.
        stiffnesses: Of the feet, above zero, shape (n,); only their ratios count; equal if not
            given.

    Raises:
        ShapeError: An array has not the shape above.
        RangeError: The weight or a stiffness is not above zero.
        GeometryError: The centre of mass is not above the feet: the body would tip over.

    Example:
        >>> from limit_surface_ros.surface.contact.statics import support_loads
        >>> feet = [[0.0, 0.0], [0.4, 0.0], [0.0, 0.4]]
        >>> support_loads(feet, 8.0, [0.1, 0.1]).loads.tolist()
        [4.0, 2.0, 2.0]
    """
    feet, centre = as_floats("points", points), as_floats("centre_of_mass", centre_of_mass)
    weight = as_positive("normal_force", normal_force)
    if feet.ndim != 2 or feet.shape[1] != 2 or not len(feet):
        raise ShapeError(f"points must have shape (n, 2) with n >= 1, got {feet.shape}")
    if centre.shape != (2,):
        raise ShapeError(f"centre_of_mass must be two numbers, got shape {centre.shape}")
    springs = np.ones(len(feet))
    if stiffnesses is not None:
        springs = as_floats("stiffnesses", stiffnesses)
        if springs.shape != (len(feet),):
            raise ShapeError(f"stiffnesses must be {len(feet)} numbers, got {springs.shape}")
        if not (springs > 0.0).all():
            raise RangeError(f"stiffnesses must be above 0, got {springs.min()}")
    arms = feet - centre
    size = float(np.abs(arms).max()) or 1.0
    # Rows: force, and moments about the centre of mass, in parts of weight and size.
    balance = np.concatenate([np.ones((1, len(feet))), arms.T / size])
    shares = _spring_shares(balance, springs / springs.sum())
    if shares is None or np.abs(balance @ shares - [1.0, 0.0, 0.0]).max() > _ROUNDING:
        raise GeometryError(
            f"the centre of mass {centre.tolist()} is not above the feet: the body would tip over"
        )
    determined = np.linalg.matrix_rank(balance, tol=_ROUNDING) == len(feet)
    lifted = int(np.count_nonzero(shares <= _ROUNDING))
    if determined:
        method = "statics"
    elif stiffnesses is None:
        method = "equal springs under a rigid body (least norm; statics leaves them open)"
    else:
        method = "springs of the given stiffnesses under a rigid body"
    if lifted and not determined:
        method += f"; {lifted} of {len(feet)} feet carry nothing"
    shares = np.where(shares <= _ROUNDING, 0.0, shares)
    return SupportLoads(weight * shares / shares.sum(), method)


def _spring_shares(balance: Floats, springs: Floats) -> Floats | None:
    """Return shares k_i max(0, sinking_i) in balance with a unit weight; None without any.

    The sinking of a foot is linear in depth and tilts; these maximise a concave function whose
    gradient is the balance, by Newton's method with backtracking.
    """
    target = np.array([1.0, 0.0, 0.0])
    pose = np.array([1.0, 0.0, 0.0])

    def value(of_pose: Floats) -> float:
        return float(target @ of_pose - 0.5 * springs @ np.maximum(of_pose @ balance, 0.0) ** 2)

    for _ in range(_MOST_STEPS):
        sinking = pose @ balance
        pressed = sinking > 0.0
        shares = np.where(pressed, springs * sinking, 0.0)
        residual = target - balance @ shares
        if np.abs(residual).max() <= 0.01 * _ROUNDING:
            return np.asarray(shares)
        hessian = (balance[:, pressed] * springs[pressed]) @ balance[:, pressed].T
        step = np.linalg.lstsq(hessian + 1e-14 * np.eye(3), residual, rcond=None)[0]
        here, length = value(pose), 1.0
        while value(pose + length * step) < here and length > 1e-12:
            length *= 0.5
        pose = pose + length * step
        if not np.isfinite(pose).all() or np.abs(pose).max() > 1e12:
            return None
    return np.asarray(shares)
