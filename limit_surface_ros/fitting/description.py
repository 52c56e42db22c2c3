# SPDX-License-Identifier: Apache-2.0
"""What a person would check of a fitted model: its size in SI units, and what its data cover."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from limit_surface_ros.checks import Floats
    from limit_surface_ros.surface.base import LimitSurface
    from limit_surface_ros.surface.convexity import Convexity
    from limit_surface_ros.surface.pairs import Pairs
    from limit_surface_ros.surface.scaling import Scaling

# Component of a unit scaled motion below which it hardly turns, or hardly goes anywhere.
_HARDLY = 0.1
# Share of the motions that turn one way below which that way is not known.
_FEW = 0.05
# Angle [deg] without a direction of motion from which on a body is known from one side only.
_ONE_SIDED = 170.0
_HALF_TURN, _WHOLE_TURN = 180.0, 360.0
_DIRECTIONS = 72
# What hardly any body has: characteristic lengths [m], coefficients of friction.
_LONG, _ROUGH = 5.0, 2.0
# Share of directions of load that bend inward which is worth a word.
_INWARD = 1e-3


@dataclass(frozen=True)
class Coverage:
    """Which motions and loads pairs have.

    Attributes:
        count: How many pairs.
        left: How many of them turn to the left, counter-clockwise, by more than hardly.
        right: How many turn to the right.
        motion_gap: Largest angle [deg] between neighbouring directions of velocity.
        load_gap: Largest angle [deg] between neighbouring directions of force.
    """

    count: int
    left: int
    right: int
    motion_gap: float
    load_gap: float

    def __str__(self) -> str:
        """Return the coverage in words."""
        hardly = self.count - self.left - self.right
        turns = f"{self.left} turn left, {self.right} right, {hardly} hardly"
        return f"{turns}; velocities {_sides(self.motion_gap)}, forces {_sides(self.load_gap)}"

    def doubts(self) -> list[str]:
        """Return what the pairs cannot tell, sentences."""
        found = []
        if self.left + self.right <= _FEW * self.count:
            found.append(
                "hardly any push turns the body: how large a moment friction holds is a guess; "
                "push it off its middle, to both sides"
            )
        elif min(self.left, self.right) <= _FEW * self.count:
            way = "right" if self.right < self.left else "left"
            found.append(
                f"hardly any push turns the body to the {way}: that side of the model follows "
                "from the other by symmetry alone"
            )
        if self.motion_gap >= _ONE_SIDED:
            within = f"{_WHOLE_TURN - self.motion_gap:.0f} deg"
            found.append(
                f"all velocities lie within {within} of each other: the model is a guess for "
                "pushes from other sides; push from all sides (--auto guesses more carefully than "
                "a plain fit)"
            )
        return found


def coverage_of(pairs: Pairs, scaling: Scaling) -> Coverage:
    """Return which motions and loads pairs have, in scaled variables."""
    motions = pairs.twists / scaling.twist_unit
    motions = motions / np.linalg.norm(motions, axis=1, keepdims=True)
    loads = pairs.wrenches / scaling.wrench_unit
    loads = loads / np.linalg.norm(loads, axis=1, keepdims=True)
    return Coverage(
        count=len(pairs),
        left=int(np.count_nonzero(motions[:, 2] > _HARDLY)),
        right=int(np.count_nonzero(motions[:, 2] < -_HARDLY)),
        motion_gap=_gap(motions[:, :2]),
        load_gap=_gap(loads[:, :2]),
    )


@dataclass(frozen=True)
class Description:
    """The size of a fitted surface, and what it was fitted to.

    Attributes:
        friction_force: Least and largest force [N] that slides the body without turning it, over
            all directions.
        friction_coefficient: The larger in parts of the normal force, if that is known.
        largest_moment: Moment [N m] of a pure turn about the reference point.
        characteristic_length: rho [m].
        inward: Share of the directions of load in which the surface bends inward.
        coverage: Of the pairs.
        doubts: What looks like a slip, or is not known; sentences.
    """

    friction_force: tuple[float, float]
    friction_coefficient: float | None
    largest_moment: float
    characteristic_length: float
    inward: float
    coverage: Coverage
    doubts: tuple[str, ...]

    def summary(self) -> dict[str, Any]:
        """Return plain values for a model file."""
        values: dict[str, Any] = {
            "friction_force_N": [_short(force) for force in self.friction_force],
            "largest_moment_Nm": _short(self.largest_moment),
            "characteristic_length_m": _short(self.characteristic_length),
            "bends_inward_percent": round(100.0 * self.inward, 2),
            "coverage": str(self.coverage),
        }
        return values | ({"doubts": list(self.doubts)} if self.doubts else {})

    def lines(self) -> list[tuple[str, str]]:
        """Return label and text of each line of the block that a program prints."""
        least, most = self.friction_force
        force = f"{most:.3g}" if most - least < 5e-3 * most else f"{least:.3g} to {most:.3g}"
        convex = (
            f"bends inward in {100.0 * self.inward:.2g} % of the directions of load"
            if self.inward > 0.0
            else "convex"
        )
        force += " N"
        if self.friction_coefficient is not None:
            force += f" ({self.friction_coefficient:.2g} of the normal force)"
        return [
            (
                "slides at",
                f"{force} without turning, turns on the spot at {self.largest_moment:.3g} N m",
            ),
            ("length", f"rho {self.characteristic_length:.3g} m; surface {convex}"),
            ("coverage", str(self.coverage)),
        ]


def describe_fit(
    surface: LimitSurface,
    convexity: Convexity,
    training: Pairs,
    *,
    recorded: bool,
    normal_force: float | None = None,
) -> Description:
    """Return what a person would check of a fit.

    Args:
        surface: The fitted surface.
        convexity: What `is_convex` says of it.
        training: The pairs that it was fitted to.
        recorded: Whether the pairs were measured; what they leave out is doubted only then.
        normal_force: [N], if it is known.
    """
    angles = np.arange(_DIRECTIONS) * (2.0 * np.pi / _DIRECTIONS)
    straight = np.stack([np.cos(angles), np.sin(angles), np.zeros(_DIRECTIONS)], axis=1)
    forces = np.sum(surface.wrench_of_twist(straight) * straight, axis=1)
    coverage = coverage_of(training, surface.scaling)
    largest = float(forces.max())
    friction = None if normal_force is None else largest / normal_force
    doubts = coverage.doubts() if recorded else []
    if recorded:
        doubts += _doubts_of_size(surface.scaling.characteristic_length, friction)
    if convexity.dented_share > _INWARD:
        doubts.append(
            f"the surface bends inward in {100.0 * convexity.dented_share:.1f} % of the "
            "directions of load, where a real one cannot: --family norms and --kind dissipation "
            "never do"
        )
    return Description(
        friction_force=(float(forces.min()), largest),
        friction_coefficient=friction,
        largest_moment=float(surface.wrench_of_twist([0.0, 0.0, 1.0])[2]),
        characteristic_length=surface.scaling.characteristic_length,
        inward=convexity.dented_share,
        coverage=coverage,
        doubts=tuple(doubts),
    )


def _doubts_of_size(length: float, friction: float | None) -> list[str]:
    """Return what of a size looks like other units, sentences."""
    found = []
    if length > _LONG:
        found.append(
            f"moments are those of forces {length:.3g} m off the reference point: are moments in "
            "N m, lengths in metres and angular velocities in rad/s?"
        )
    if friction is not None and friction > _ROUGH:
        found.append(
            f"the largest friction force is {friction:.2g} times the normal force: are both in "
            "newtons?"
        )
    return found


def _gap(vectors: Floats) -> float:
    """Return the largest angle [deg] between neighbouring directions of vectors, shape (n, 2)."""
    moving = vectors[np.linalg.norm(vectors, axis=1) > _HARDLY]
    if len(moving) < 2:
        return _WHOLE_TURN
    angles = np.sort(np.degrees(np.arctan2(moving[:, 1], moving[:, 0])))
    return float(np.diff(angles, append=angles[0] + _WHOLE_TURN).max())


def _sides(gap: float) -> str:
    if gap < 0.5 * _HALF_TURN:
        return f"to all sides (largest gap {gap:.0f} deg)"
    if gap < _ONE_SIDED:
        return f"with a gap of {gap:.0f} deg"
    return f"within {_WHOLE_TURN - gap:.0f} deg of each other"


def _short(value: float) -> float:
    return float(f"{value:.4g}")
