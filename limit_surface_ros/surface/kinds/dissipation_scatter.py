# SPDX-License-Identifier: Apache-2.0
"""How far a real body's motion may be from the predicted one: a distribution of the unit twist.

The residual r of a push, in the plane that touches the sphere of unit scaled twists at the
prediction u, follows a bivariate Student t of nu degrees of freedom with the scale

    S(f) = e^g (kappa P + a^2 I + b^2 M / (1 + M / m^2))

J = du / d(f/|f|) is the curvature of the surface there. M = J F J' is the scatter that comes of
every term's friction varying by itself from push to push, F = sum_k g_k g_k' / |G|^2 with the
loads g_k of the terms and G of them all; J is unbounded at edges and a finite scatter is not,
hence m. P is the jackknife variance over the models that leave out a fold of the pushes each
(Efron and Stein 1981, doi:10.1214/aos/1176345462): what the pushes did not tell. Both are
evaluated in closed form for a dissipation model, J from the bordered Hessian of D.

The constants were fitted once, to 32 recorded sets; g is fitted to the pushes of each model by
`fitting.few_pushes.calibration`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from limit_surface_ros.checks import as_floats, as_number
from limit_surface_ros.errors import DataError, RangeError
from limit_surface_ros.surface.kinds.dissipation import Dissipation

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import ArrayLike

    from limit_surface_ros.checks import Floats
    from limit_surface_ros.surface.base import LimitSurface

VERSION = 1
# a [rad], b and m as the text above has them, kappa of the linearised jackknife and the value at
# which that saturates, nu.
OWN, FRICTION, SATURATED = float(np.radians(3.2)), 0.218, 2.1
JACKKNIFE, JACKKNIFE_SATURATED = 1.4, 0.5
FREEDOM = 3.3
# Covariance of the t distribution in parts of its scale.
_VARIANCE = FREEDOM / (FREEDOM - 2.0)
# Nodes along each side of a face of the table.
_NODES = 33
_TINY = 1e-12


def region_quantile(probability: float) -> float:
    """Return q with r' inv(S) r <= q in that share of pushes.

    Args:
        probability: Above 0 and below 1.

    Raises:
        RangeError: The probability is not between 0 and 1.

    Example:
        >>> round(region_quantile(0.9), 3)
        10.022
    """
    if not 0.0 < probability < 1.0:
        raise RangeError(f"probability must be above 0 and below 1, got {probability}")
    return FREEDOM * float((1.0 - probability) ** (-2.0 / FREEDOM) - 1.0)


def region_probability(squares: Floats) -> Floats:
    """Return the probability of the region on whose border a push lies.

    Args:
        squares: r' inv(S) r, not negative, any shape.

    Example:
        >>> float(region_probability(np.array(10.022)).round(3))
        0.9
    """
    return np.asarray(1.0 - (1.0 + squares / FREEDOM) ** (-0.5 * FREEDOM))


@dataclass(frozen=True, eq=False)
class TwistWithCovariance:
    """A predicted twist and how far pushes scatter around it.

    Attributes:
        twist: Predicted twists (vx, vy, omega_z), unit in scaled variables, shape (..., 3).
        covariance: Of (vx, vy, omega_z) [m/s, m/s, rad/s], shape (..., 3, 3), of rank two: the
            size of a unit twist does not scatter. A heavy-tailed law's covariance is wider than
            its 68 % region.
        half_axes: Of the region in which the unit scaled twist lies at the asked probability
            [rad], the larger first, shape (..., 2).
    """

    twist: Floats
    covariance: Floats
    half_axes: Floats


@dataclass(frozen=True, eq=False)
class TwistScatter:
    """The scatter of a dissipation model's twists.

    Attributes:
        matrices: B_k of the model, in scaled variables, shape (k, 3, 3).
        folds: Those of the models that left out one fold of the pushes each.
        log_scale: g.

    Raises:
        DataError: There are fewer than two folds, or what is given are no matrices.
    """

    matrices: Floats
    folds: tuple[Floats, ...]
    log_scale: float = 0.0

    def __post_init__(self) -> None:
        """Check the matrices."""
        if len(self.folds) < 2:
            raise DataError(f"a jackknife needs at least two folds, got {len(self.folds)}")
        for each in (self.matrices, *self.folds):
            if each.ndim != 3 or each.shape[1:] != (3, 3) or not len(each):
                raise DataError(f"matrices must have shape (k, 3, 3), got {each.shape}")

    def scale(self, units: Floats) -> Floats:
        """Return S of unit scaled twists, as 3x3 matrices whose null vector is the twist.

        Args:
            units: Twists of the model, shape (n, 3).

        Returns:
            Shape (n, 3, 3).
        """
        plane = tangent_basis(units)
        return np.asarray(plane.transpose(0, 2, 1) @ self.plane_scale(units, plane) @ plane)

    def plane_scale(self, units: Floats, plane: Floats) -> Floats:
        """Return S in the given bases of the tangent planes, shape (n, 2, 3), as (n, 2, 2)."""
        loads, parts, hessian = _loads(self.matrices, units)
        size = np.linalg.norm(loads, axis=1)
        bordered = np.zeros((len(units), 4, 4))
        bordered[:, :3, :3] = hessian
        bordered[:, :3, 3] = bordered[:, 3, :3] = loads
        turning = size[:, None, None] * (plane @ np.linalg.inv(bordered)[:, :3, :3])
        through = np.einsum("nij,knj->nki", turning, parts) / size[:, None, None]
        friction = through.transpose(0, 2, 1) @ through
        direction = loads / size[:, None]
        away = []
        for fold in self.folds:
            other = _loads(fold, units)[0]
            away.append(other / np.linalg.norm(other, axis=1, keepdims=True) - direction)
        shifts = np.einsum("nij,knj->nki", turning, np.array(away))
        shifts -= shifts.mean(axis=1, keepdims=True)
        count = len(self.folds)
        jackknife = (count - 1) / count * (shifts.transpose(0, 2, 1) @ shifts)
        scale = JACKKNIFE * _saturated(jackknife, JACKKNIFE_SATURATED)
        scale += FRICTION**2 * _saturated(friction, SATURATED) + OWN**2 * np.eye(2)
        return np.asarray(np.exp(self.log_scale) * scale)

    def stored(self) -> dict[str, Any]:
        """Return plain values for a model file's `fit: uncertainty`."""
        return {
            "version": VERSION,
            "log_scale": float(f"{self.log_scale:.6g}"),
            "fold_matrices": [
                [[float(f"{entry:.6g}") for entry in each[_UPPER]] for each in fold]
                for fold in self.folds
            ],
        }


_UPPER = np.triu_indices(3)


def scatter_of(stored: Mapping[str, Any], surface: LimitSurface) -> TwistScatter:
    """Return the scatter that `TwistScatter.stored` put into a model file.

    Args:
        stored: What stands under `fit: uncertainty`.
        surface: The model.

    Raises:
        DataError: It is of another version or form, or the model is no dissipation.
    """
    if not isinstance(surface, Dissipation):
        raise DataError("uncertainty is that of dissipation models")
    try:
        if stored["version"] != VERSION:
            raise DataError(f"fit: uncertainty has version {stored['version']}, read is {VERSION}")
        folds = []
        for fold in stored["fold_matrices"]:
            entries = as_floats("fold_matrices", fold)
            matrices = np.zeros((len(entries), 3, 3))
            matrices[:, _UPPER[0], _UPPER[1]] = matrices[:, _UPPER[1], _UPPER[0]] = entries
            folds.append(matrices)
        scale = as_number("log_scale", stored["log_scale"])
    except (KeyError, TypeError, ValueError, IndexError) as error:
        raise DataError(f"fit: uncertainty is not what fits write: {error}") from None
    return TwistScatter(surface.matrices, tuple(folds), scale)


@dataclass(frozen=True, eq=False)
class UncertainSurface:
    """A dissipation model with the scatter of its twists.

    Attributes:
        surface: The model.
        scatter: Of its unit twists.

    Example:
        >>> import numpy as np
        >>> from limit_surface_ros.surface.kinds.dissipation import Dissipation
        >>> sphere = np.eye(3)[None]
        >>> uncertain = UncertainSurface(Dissipation(sphere), TwistScatter(sphere, (sphere,) * 5))
        >>> answer = uncertain.twist_with_covariance([2.0, 0.0, 0.0], probability=0.9)
        >>> answer.half_axes.round(3).tolist()
        [0.177, 0.177]
    """

    surface: LimitSurface
    scatter: TwistScatter

    def twist_with_covariance(
        self, wrench: ArrayLike, probability: float = 0.9
    ) -> TwistWithCovariance:
        """Return twists with their covariances and the half-axes of a region.

        One load alone is looked up in a table that the first such call makes (some tenths of a
        second; `prepare` makes it, too). It is within 2 % of the spread but next to edges of the
        surface, many loads are worked out exactly.

        Args:
            wrench: Shape (..., 3), (fx, fy, tau_z) [N, N, N m].
            probability: Of the region whose half-axes are asked for.

        Raises:
            RangeError: The probability is not between 0 and 1.
            ZeroVectorError: A wrench is zero.
        """
        quantile = region_quantile(probability)
        twists = np.asarray(self.surface.twist_of_wrench(wrench))
        if twists.ndim == 1:
            return self._looked_up(wrench, twists, quantile)
        unit = self.surface.scaling.twist_unit
        scales = self.scatter.scale((twists / unit).reshape(-1, 3))
        # One eigenvalue is 0: the others follow from the trace and that of the square.
        middle = 0.5 * np.trace(scales, axis1=1, axis2=2)
        squares = np.einsum("nij,nji->n", scales, scales)
        root = np.sqrt(np.maximum(0.5 * squares - middle**2, 0.0))
        values = np.stack([middle + root, np.maximum(middle - root, 0.0)], axis=1)
        shape = twists.shape[:-1]
        return TwistWithCovariance(
            twist=twists,
            covariance=(_VARIANCE * scales * unit[:, None] * unit).reshape(*shape, 3, 3),
            half_axes=np.sqrt(quantile * values).reshape(*shape, 2),
        )

    def of_twist(
        self, wrench: ArrayLike, twist: Floats, probability: float = 0.9
    ) -> TwistWithCovariance:
        """Return the same of one load whose twist is known already.

        Args:
            wrench: Shape (3,), not zero; its size does not matter.
            twist: What the model's `twist_of_wrench` makes of it, shape (3,).
            probability: Of the region whose half-axes are asked for.

        Raises:
            RangeError: The probability is not between 0 and 1.
        """
        return self._looked_up(wrench, twist, region_quantile(probability))

    def members(self, count: int, seed: int = 0) -> list[Dissipation]:
        """Return surfaces as they may be in one push each, for ensembles of pushes and slides.

        Each begins from what the model would be without one fold of the pushes, in turns; then the
        friction of every term is off by itself, as the t distribution has it. What a push scatters
        besides (`OWN`) is no surface's, and not in them.

        Args:
            count: How many.
            seed: Of what is random.

        Example:
            >>> sphere = np.eye(3)[None]
            >>> uncertain = UncertainSurface(
            ...     Dissipation(sphere), TwistScatter(sphere, (sphere,) * 5)
            ... )
            >>> factors = [each.load_factor([1.0, 0.0, 0.0]) for each in uncertain.members(2000)]
            >>> bool(0.15 < np.std(np.log(factors)) < 0.5)
            True
        """
        rng = np.random.default_rng(seed)
        folds, found = self.scatter.folds, []
        for number in range(count):
            matrices = folds[number % len(folds)]
            heavy = FREEDOM / rng.chisquare(FREEDOM) * np.exp(self.scatter.log_scale)
            off = FRICTION * np.sqrt(heavy) * rng.normal(size=len(matrices))
            off = SATURATED * np.tanh(off / SATURATED)
            factors = np.exp(2.0 * off)
            found.append(Dissipation(matrices * factors[:, None, None], self.surface.scaling))
        return found

    def border(self, wrench: ArrayLike, probability: float = 0.9, count: int = 24) -> Floats:
        """Return twists around the region in which that of a load lies at a probability.

        Args:
            wrench: Shape (3,), (fx, fy, tau_z) [N, N, N m].
            probability: Of the region.
            count: How many twists.

        Returns:
            (vx, vy, omega_z), unit in scaled variables, shape (count, 3).

        Raises:
            RangeError: The probability is not between 0 and 1.
            ZeroVectorError: The wrench is zero.

        Example:
            >>> sphere = np.eye(3)[None]
            >>> uncertain = UncertainSurface(
            ...     Dissipation(sphere), TwistScatter(sphere, (sphere,) * 5)
            ... )
            >>> twists = uncertain.border([2.0, 0.0, 0.0], probability=0.9)
            >>> np.arccos(twists @ [1.0, 0.0, 0.0]).round(3)[:3].tolist()
            [0.177, 0.177, 0.177]
        """
        quantile = region_quantile(probability)
        unit = self.surface.scaling.twist_unit
        units = (np.asarray(self.surface.twist_of_wrench(wrench)) / unit)[None]
        plane = tangent_basis(units)
        values, axes = np.linalg.eigh(quantile * self.scatter.plane_scale(units, plane)[0])
        angles = 2.0 * np.pi * np.arange(count) / count
        round_it = np.stack([np.cos(angles), np.sin(angles)], axis=1)
        away = round_it * np.sqrt(np.maximum(values, 0.0)) @ axes.T @ plane[0]
        # No farther than the antipode, and there for any direction.
        size = np.minimum(np.linalg.norm(away, axis=1, keepdims=True), np.pi)
        ahead = away / np.maximum(np.linalg.norm(away, axis=1, keepdims=True), _TINY)
        return np.asarray((np.cos(size) * units + np.sin(size) * ahead) * unit)

    def prepare(self) -> None:
        """Make the table; later calls do not wait for it."""
        _ = self._table

    @cached_property
    def _table(self) -> list[list[list[list[float]]]]:
        """S over directions of load, on three faces of a cube since S(-f) = S(f).

        Indexed by face, the two smaller components in parts of the largest, and the six distinct
        entries; of plain numbers, which one load at a time is quicker with.
        """
        side = np.linspace(-1.0, 1.0, _NODES)
        x, y = np.meshgrid(side, side, indexing="ij")
        ones = np.ones_like(x)
        axes = [(ones, x, y), (x, ones, y), (x, y, ones)]
        faces = np.stack([np.stack(each, axis=-1) for each in axes]).reshape(-1, 3)
        scaling = self.surface.scaling
        twists = self.surface.twist_of_wrench(faces * scaling.wrench_unit) / scaling.twist_unit
        entries = self.scatter.scale(np.asarray(twists))[:, _UPPER[0], _UPPER[1]]
        table: list[list[list[list[float]]]] = entries.reshape(3, _NODES, _NODES, 6).tolist()
        return table

    def _looked_up(self, wrench: ArrayLike, twist: Floats, quantile: float) -> TwistWithCovariance:
        """Return what is asked for of one load, in plain numbers."""
        fx, fy, tau = np.asarray(wrench, dtype=np.float64).tolist()
        length = self.surface.scaling.characteristic_length
        tau /= length
        ux, uy, uz = twist.tolist()
        uz *= length
        sizes = (abs(fx), abs(fy), abs(tau))
        face = sizes.index(max(sizes))
        along, first, second = ((fx, fy, tau), (fy, fx, tau), (tau, fx, fy))[face]
        half = 0.5 * (_NODES - 1)
        x, y = half * (1.0 + first / along), half * (1.0 + second / along)
        i, j = min(int(x), _NODES - 2), min(int(y), _NODES - 2)
        x, y = x - i, y - j
        low, high = self._table[face][i], self._table[face][i + 1]
        w00, w01, w10, w11 = (1.0 - x) * (1.0 - y), (1.0 - x) * y, x * (1.0 - y), x * y
        xx, xy, xz, yy, yz, zz = [
            w00 * a + w01 * b + w10 * c + w11 * d
            for a, b, c, d in zip(low[j], low[j + 1], high[j], high[j + 1], strict=True)
        ]
        # Between nodes the twist is another one: the scatter is in the plane across it.
        sx, sy, sz = (
            xx * ux + xy * uy + xz * uz,
            xy * ux + yy * uy + yz * uz,
            xz * ux + yz * uy + zz * uz,
        )
        own = sx * ux + sy * uy + sz * uz
        sx, sy, sz = sx - 0.5 * own * ux, sy - 0.5 * own * uy, sz - 0.5 * own * uz
        xx, yy, zz = xx - 2.0 * sx * ux, yy - 2.0 * sy * uy, zz - 2.0 * sz * uz
        xy, xz, yz = xy - sx * uy - sy * ux, xz - sx * uz - sz * ux, yz - sy * uz - sz * uy
        middle = 0.5 * (xx + yy + zz)
        squares = xx * xx + yy * yy + zz * zz + 2.0 * (xy * xy + xz * xz + yz * yz)
        root = math.sqrt(max(0.5 * squares - middle * middle, 0.0))
        axes = [math.sqrt(quantile * max(each, 0.0)) for each in (middle + root, middle - root)]
        v, turn = _VARIANCE, _VARIANCE / length
        xz, yz, zz = turn * xz, turn * yz, turn * zz / length
        rows = [[v * xx, v * xy, xz], [v * xy, v * yy, yz], [xz, yz, zz]]
        return TwistWithCovariance(twist, np.array(rows), np.array(axes))


def tangent_basis(units: Floats) -> Floats:
    """Return orthonormal bases of the planes across unit vectors, shape (n, 2, 3)."""
    least = np.zeros_like(units)
    least[np.arange(len(units)), np.abs(units).argmin(axis=1)] = 1.0
    first = np.cross(units, least)
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    return np.stack([first, np.cross(units, first)], axis=1)


def log_map(units: Floats, measured: Floats, plane: Floats) -> Floats:
    """Return where unit vectors lie as seen from others, as tangent vectors [rad], shape (n, 2).

    Args:
        units: Where from, shape (n, 3).
        measured: Where to, shape (n, 3).
        plane: Tangent bases at `units`, shape (n, 2, 3).
    """
    flat = np.einsum("nij,nj->ni", plane, measured)
    size = np.linalg.norm(flat, axis=1)
    angle = np.arctan2(size, np.sum(units * measured, axis=1))
    # Straight on it is the identity; at the antipode any direction will do.
    factor = np.where(size > _TINY, angle / np.maximum(size, _TINY), 1.0)
    flat = np.where((size <= _TINY)[:, None] & (angle > 1.0)[:, None], [1.0, 0.0], flat)
    factor = np.where((size <= _TINY) & (angle > 1.0), np.pi, factor)
    return np.asarray(flat * factor[:, None])


def _loads(matrices: Floats, units: Floats) -> tuple[Floats, Floats, Floats]:
    """Return grad D, the loads of the terms, shape (k, n, 3), and the Hessian of D."""
    products = np.einsum("kij,nj->kni", matrices, units)
    speeds = np.sqrt(np.maximum(np.einsum("kni,ni->kn", products, units), _TINY**2))
    parts = products / speeds[:, :, None]
    hessian = np.einsum("kij,kn->nij", matrices, 1.0 / speeds)
    hessian -= np.einsum("kni,knj->nij", parts / speeds[:, :, None], parts)
    return parts.sum(axis=0), parts, hessian


def _saturated(matrices: Floats, most: float) -> Floats:
    """Return M inv(I + M / most^2) of symmetric 2x2 matrices, shape (n, 2, 2)."""
    inner = np.eye(2) + matrices / most**2
    return np.asarray(np.linalg.solve(inner, matrices))
