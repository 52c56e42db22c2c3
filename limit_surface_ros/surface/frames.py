# SPDX-License-Identifier: Apache-2.0
"""Wrenches and twists seen from another frame, and the planar part of what a frame shows.

Six-vectors here are (force, torque) and (linear, angular velocity), each about the origin of its
frame: (fx, fy, fz, tau_x, tau_y, tau_z) and (vx, vy, vz, omega_x, omega_y, omega_z).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from limit_surface_ros.checks import as_floats
from limit_surface_ros.errors import ShapeError, ZeroVectorError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import ArrayLike

    from limit_surface_ros.checks import Floats


@dataclass(frozen=True, eq=False)
class RigidTransform:
    """Pose of a source frame in a target frame: takes vectors from source to target.

    Attributes:
        rotation: R, shape (3, 3), orthogonal.
        translation: t [m], the source's origin in the target, shape (3,).
    """

    rotation: Floats
    translation: Floats

    @classmethod
    def from_quaternion(cls, translation: ArrayLike, quaternion: ArrayLike) -> RigidTransform:
        """Build from a translation [m] and a quaternion (x, y, z, w), which need not be unit.

        Raises:
            ShapeError: There are not three and four numbers.
            NotFiniteError: A number is NaN or infinite.
            ZeroVectorError: The quaternion is zero.
        """
        moved = as_floats("translation", translation)
        turned = as_floats("quaternion", quaternion)
        if moved.shape != (3,) or turned.shape != (4,):
            raise ShapeError(
                f"a translation has 3 and a quaternion 4 numbers, got {moved.shape} and "
                f"{turned.shape}"
            )
        size = float(np.abs(turned).max())
        if size == 0.0:
            raise ZeroVectorError("quaternion must not be zero: it is no rotation")
        x, y, z, w = (turned / size) / np.linalg.norm(turned / size)
        rotation = np.array(
            [
                [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
            ]
        )
        return cls(rotation, moved)

    @classmethod
    def from_euler(cls, translation: ArrayLike, angles: ArrayLike) -> RigidTransform:
        """Build from a translation [m] and (roll, pitch, yaw) [rad] about the fixed x, y, z.

        Raises:
            ShapeError: There are not three and three numbers.
            NotFiniteError: A number is NaN or infinite.
        """
        halves = as_floats("angles", angles) / 2.0
        if halves.shape != (3,):
            raise ShapeError(f"angles are roll, pitch and yaw, got shape {halves.shape}")
        (cr, cp, cy), (sr, sp, sy) = np.cos(halves), np.sin(halves)
        quaternion = [
            sr * cp * cy - cr * sp * sy,
            cr * sp * cy + sr * cp * sy,
            cr * cp * sy - sr * sp * cy,
            cr * cp * cy + sr * sp * sy,
        ]
        return cls.from_quaternion(translation, quaternion)

    @property
    def inverse(self) -> RigidTransform:
        """The transform from target to source."""
        return RigidTransform(self.rotation.T, -self.rotation.T @ self.translation)

    def __matmul__(self, first: RigidTransform) -> RigidTransform:
        """Return the transform that applies `first` and then this one."""
        return RigidTransform(
            self.rotation @ first.rotation, self.rotation @ first.translation + self.translation
        )

    def point(self, point: ArrayLike) -> Floats:
        """Return the same place in the target frame: R p + t, shape (3,) [m].

        Raises:
            NotFiniteError: A coordinate is NaN or infinite.
        """
        return self.direction(point) + self.translation

    def direction(self, vector: ArrayLike) -> Floats:
        """Return the same direction, or velocity of a point, in the target frame: R v, shape (3,).

        Raises:
            NotFiniteError: A component is NaN or infinite.
        """
        return np.asarray(self.rotation @ as_floats("vector", vector))

    def wrench(self, wrench: ArrayLike) -> Floats:
        """Return the same load in the target frame: f' = R f, tau' = R tau + t x f'.

        Args:
            wrench: Shape (..., 6), force and torque about the source's origin [N, N m].

        Returns:
            Shape (..., 6), force and torque about the target's origin.

        Raises:
            ShapeError: The last axis does not hold six components.
            NotFiniteError: A component is NaN or infinite.
        """
        array = _as_sixes("wrench", wrench)
        force = array[..., :3] @ self.rotation.T
        torque = array[..., 3:] @ self.rotation.T + np.cross(self.translation, force)
        return np.concatenate([force, torque], axis=-1)

    def twist(self, twist: ArrayLike) -> Floats:
        """Return the same motion in the target frame: omega' = R omega, v' = R v + t x omega'.

        Args:
            twist: Shape (..., 6), velocity of the source's origin and angular velocity
                [m/s, rad/s].

        Returns:
            Shape (..., 6), velocity of the body at the target's origin and angular velocity.

        Raises:
            ShapeError: The last axis does not hold six components.
            NotFiniteError: A component is NaN or infinite.
        """
        array = _as_sixes("twist", twist)
        angular = array[..., 3:] @ self.rotation.T
        linear = array[..., :3] @ self.rotation.T + np.cross(self.translation, angular)
        return np.concatenate([linear, angular], axis=-1)


def planar(six: Sequence[float]) -> tuple[float, float, float]:
    """Return x, y and the turn about z of a wrench or twist.

    Args:
        six: (fx, fy, fz, tau_x, tau_y, tau_z) or (vx, vy, vz, omega_x, omega_y, omega_z).
    """
    return six[0], six[1], six[5]


def out_of_plane(six: Sequence[float], length: float, *, pressing: bool = False) -> float:
    """Return how large the left-out part is beside the planar part; 0 where there is none.

    Turns are compared with translations through a length: torques are divided by it, angular
    velocities multiplied.

    Args:
        six: A wrench or twist as for `planar`.
        length: rho [m] for a twist, 1 / rho [1/m] for a wrench.
        pressing: Whether z counts as used, as a pressing force does.
    """
    left_out = math.hypot(0.0 if pressing else six[2], six[3] * length, six[4] * length)
    if left_out == 0.0:
        return 0.0
    return left_out / max(math.hypot(six[0], six[1], six[5] * length), 1e-300)


def power(wrench: Floats, twist: Floats) -> Floats:
    """Return the power wrench . twist [W].

    Args:
        wrench: Shape (..., 3), (fx, fy, tau_z) in [N, N, N m].
        twist: Shape (..., 3), (vx, vy, omega_z) in [m/s, m/s, rad/s].

    Returns:
        Shape (...).
    """
    # By a product with ones: numpy adds up rows of three one by one.
    return np.asarray(np.multiply(wrench, twist).dot(np.ones(3)))


def _as_sixes(name: str, values: ArrayLike) -> Floats:
    array = as_floats(name, values)
    if array.ndim == 0 or array.shape[-1] != 6:
        raise ShapeError(f"{name} must have shape (..., 6), got {array.shape}")
    return array
