# SPDX-License-Identifier: Apache-2.0
"""Recorded pairs that cannot be what their columns say: slips of units, axes, signs and bias.

A sliding body has one length, the ratio of its largest moment to its largest force. Loads show it
by their sizes, motions by which way loads turn them: (f / F)^2 + (tau / M)^2 = 1 and v : omega =
f / F^2 : tau / M^2 hold of every body, if roughly. Where the two disagree, or the length is none
of a body that is pushed, each slip of units leaves its own mark.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from limit_surface_ros.checks import Floats
    from limit_surface_ros.surface.pairs import Pairs

# Bodies that are pushed have lengths in this range [m]; both of a body's agree within this factor
# (real pushes: 0.65 to 1.3), and with the length that is stated within that one.
SHORTEST, LONGEST = 2e-3, 3.0
_AGREE, _AGREE_WITH_STATED = 2.8, 5.0
# Fewer pairs show nothing.
FEWEST = 6
# Forces turned by more than the first against the motion are in another frame, and by the second
# over the root of their number more where there are few [rad]. Moments point against turning
# rates if their correlation is below the last.
_TURNED, _TURNED_OF_FEW, _AGAINST = math.radians(30.0), math.radians(60.0), -0.4
# A bias is told from this part of the friction force on, and so many deviations.
_BIAS, _DEVIATIONS = 0.2, 6.0
_FEWEST_FOR_BIAS, _ONE_WAY = 15, 0.6
# The two lengths disagree if they do by so many deviations, taken from groups of pairs left out.
_CERTAIN, _GROUPS = 4.0, 10
# Pushes turn the body if this part of their motion turns it, and lever arms below this part of the
# length are those of pushes through the centre.
_TURNS, _ARM, _USUAL_LENGTH = 0.05, 0.05, 0.05
_ROUNDS = 100
# Two columns are swapped if each follows the other's partner by more than the first correlation
# and its own by less than the second.
_FOLLOWS, _FOLLOWS_NOT = 0.5, 0.25
_NAMES = (("fx", "fy", "tau"), ("vx", "vy", "omega"))

# What columns may hold instead, and what turns it into what they should.
_SLIPS: tuple[tuple[str, tuple[float, float, float]], ...] = (
    ("omega is in deg/s", (1.0, 1.0, math.pi / 180.0)),
    ("tau is in N mm", (1e-3, 1.0, 1.0)),
    ("vx, vy are in mm/s", (1.0, 1e-3, 1.0)),
    ("tau is in N mm and vx, vy are in mm/s", (1e-3, 1e-3, 1.0)),
    ("omega is in deg/s and vx, vy are in mm/s", (1.0, 1e-3, math.pi / 180.0)),
    ("tau is in N mm and omega in deg/s", (1e-3, 1.0, math.pi / 180.0)),
)


@dataclass(frozen=True)
class Doubt:
    """Why pairs may not be what they seem.

    Attributes:
        text: One sentence.
        grave: Whether a fit to such pairs is wrong, and not only less sure.
    """

    text: str
    grave: bool


@dataclass(frozen=True)
class Lengths:
    """The ratio of the largest moment to the largest force, NaN where pairs do not show it.

    Attributes:
        of_loads: By the sizes of the loads [m].
        of_motions: By how motions follow loads [m].
    """

    of_loads: float
    of_motions: float

    @property
    def agree(self) -> bool:
        """Whether both are known and alike."""
        return abs(math.log(self.of_motions / self.of_loads)) <= math.log(_AGREE)

    @property
    def possible(self) -> bool:
        """Whether they are alike, and of a body that is pushed."""
        return self.agree and SHORTEST <= self.of_loads <= LONGEST


def doubts_of_pairs(pairs: Pairs, characteristic_length: float | None = None) -> list[Doubt]:
    """Return what speaks against recorded pairs, the gravest first; nothing of sound ones.

    Args:
        pairs: Recorded wrenches and twists.
        characteristic_length: What is stated of the body [m].

    Examples:
        >>> from limit_surface_ros.surface.kinds.point_contacts import PointContacts
        >>> from limit_surface_ros.surface.pairs import Pairs
        >>> from limit_surface_ros.surface.sampling import random_motions
        >>> feet = [[-0.04, -0.04], [-0.04, 0.08], [0.08, -0.04]]
        >>> pushes = random_motions(PointContacts(feet, [1.4, 1.4, 1.4]), 50)
        >>> doubts_of_pairs(pushes)
        []
        >>> in_millimetres = Pairs(pushes.wrenches * [1, 1, 1000], pushes.twists)
        >>> "tau is in N mm" in doubts_of_pairs(in_millimetres)[0].text
        True
    """
    if len(pairs) < FEWEST:
        return []
    wrenches, twists = pairs.wrenches, pairs.twists
    length = characteristic_length or _USUAL_LENGTH
    frames = _doubts_of_columns(wrenches, twists) or _doubts_of_frames(wrenches, twists)
    if frames:
        return frames
    still = _never_turns(wrenches, twists, length)
    if still is not None:
        return [still]
    known = lengths_of(wrenches, twists)
    if math.isfinite(known.of_motions):
        length = known.of_motions
    found = _doubts_of_units(wrenches, twists, known, characteristic_length)
    return found or _doubts_of_bias(wrenches, twists, length)


def lengths_of(wrenches: Floats, twists: Floats) -> Lengths:
    """Return the two lengths that pairs show."""
    squares = np.column_stack([np.sum(wrenches[:, :2] ** 2, axis=1), wrenches[:, 2] ** 2])
    sizes = squares.max(axis=0)
    of_loads = of_motions = math.nan
    if (sizes > 0.0).all():
        ones = np.ones(len(squares))
        found = np.linalg.lstsq(squares / sizes, ones, rcond=None)[0] / sizes
        if (found > 0.0).all():
            of_loads = float(np.sqrt(found[0] / found[1]))
        of_motions = _length_of_motions(wrenches, twists, math.sqrt(sizes[1] / sizes[0]))
    return Lengths(of_loads, of_motions)


def _length_of_motions(wrenches: Floats, twists: Floats, length: float) -> float:
    """Return c of f = F v, tau = F c^2 omega on unit twists (v, c omega); NaN if there is none."""
    for _ in range(_ROUNDS):
        unit = _unit(twists, length)
        squares = max(float(np.sum(unit[:, :2] ** 2)), 1e-300)
        forces = float(np.sum(wrenches[:, :2] * unit[:, :2])) / squares
        turns = unit[:, 2] / length
        moments = float(wrenches[:, 2] @ turns) / max(float(turns @ turns), 1e-300)
        if not (forces > 0.0 and moments > 0.0):
            return math.nan
        before, length = length, math.sqrt(moments / forces)
        if abs(math.log(length / before)) < 1e-6:
            break
    return length


def _unit(twists: Floats, length: float) -> Floats:
    """Return unit twists in scaled variables, shape (n, 3)."""
    scaled = twists * np.array([1.0, 1.0, length])
    return np.asarray(scaled / np.linalg.norm(scaled, axis=1, keepdims=True))


def _doubts_of_columns(wrenches: Floats, twists: Floats) -> list[Doubt]:
    """Return that two columns of wrench or twist are swapped, by what follows what."""
    parts = []
    for rows in (wrenches, twists):
        sizes = np.sqrt(np.mean(rows**2, axis=0))
        if not (sizes > 0.0).all():
            return []
        # Of each pair the direction counts, with all columns alike.
        scaled = rows / sizes
        scaled = scaled / np.linalg.norm(scaled, axis=1, keepdims=True)
        parts.append(scaled / np.sqrt(np.sum(scaled**2, axis=0)))
    follows = parts[0].T @ parts[1]
    for i, j in ((0, 1), (0, 2), (1, 2)):
        crossed, own = (follows[i, j], follows[j, i]), (follows[i, i], follows[j, j])
        if min(crossed) > _FOLLOWS and max(own) < _FOLLOWS_NOT:
            loads, motions = ((names[i], names[j]) for names in _NAMES)
            return [
                Doubt(
                    f"{loads[0]} follows {motions[1]} and {loads[1]} follows {motions[0]}: by all "
                    f"appearance the columns {' and '.join(loads)}, or {' and '.join(motions)}, "
                    "are swapped",
                    True,
                )
            ]
    return []


def _doubts_of_frames(wrenches: Floats, twists: Floats) -> list[Doubt]:
    """Return what speaks against signs and axes, by how forces follow velocities."""
    # Whatever turns, forces in the plane follow velocities there.
    sizes = np.linalg.norm(twists[:, :2], axis=1)
    moving = sizes > 0.0
    if np.count_nonzero(moving) < FEWEST:
        return []
    scale = np.where(moving, sizes, 1.0)[:, None]
    velocities, turns = twists[:, :2] / scale, twists[:, 2:] / scale
    weight = 1.0 / np.sqrt(1.0 + (_USUAL_LENGTH * turns) ** 2) * moving[:, None]
    columns = weight * np.hstack([velocities, turns / max(float(np.abs(turns).max()), 1e-300)])
    matrix = np.linalg.lstsq(columns, weight * wrenches[:, :2], rcond=None)[0].T[:, :2]
    left, strengths, right = np.linalg.svd(matrix)
    if strengths[1] < 0.2 * strengths[0]:
        return []  # pushes along one line do not show which way forces are turned
    turn = left @ right
    if np.linalg.det(turn) < 0.0:
        axis = "x" if turn[0, 0] < 0.0 else "y"
        return [
            Doubt(
                "forces are mirrored against velocities: an axis of the two has opposite signs "
                f"(by all appearance {axis}): are wrench and twist in one right-handed frame?",
                True,
            )
        ]
    angle = math.atan2(turn[1, 0], turn[0, 0])
    most = _TURNED + _TURNED_OF_FEW / math.sqrt(len(wrenches))
    if abs(angle) > math.pi - most:
        against = int(np.count_nonzero(np.sum(wrenches * twists, axis=1) < 0.0))
        return [
            Doubt(
                f"{against} of {len(wrenches)} pushes have negative power, their forces point "
                "against velocities: are the wrenches those on the pusher, or are the twists "
                "reversed? A body that slides takes power in",
                True,
            )
        ]
    if abs(angle) > most:
        return [
            Doubt(
                f"forces are turned by about {math.degrees(angle):.0f} deg against velocities: "
                "the sensor's axes are not the body's; bring wrenches into the body's frame",
                True,
            )
        ]
    return []


def _never_turns(wrenches: Floats, twists: Floats, length: float) -> Doubt | None:
    """Return that pushes never turn the body, so that nothing tells its moments."""
    forces = np.linalg.norm(wrenches[:, :2], axis=1)
    arms = np.abs(wrenches[:, 2]) / np.maximum(forces, 1e-300)
    turning = np.abs(_unit(twists, length)[:, 2])
    if np.quantile(arms, 0.9) > _ARM * length or np.quantile(turning, 0.9) > _TURNS:
        return None
    return Doubt(
        "pushes never turn the body: their lever arms are "
        f"{1e3 * float(np.quantile(arms, 0.9)):.2g} mm at most, so that nothing tells which "
        "moment the ground holds; push off the centre, to both sides, too",
        True,
    )


def _doubts_of_units(
    wrenches: Floats, twists: Floats, known: Lengths, stated: float | None
) -> list[Doubt]:
    """Return which slips of units or columns would make the lengths those of a body."""
    if known.possible:
        return _doubt_of_stated(known, stated)
    if not math.isfinite(known.of_motions):
        moments, turns = wrenches[:, 2], twists[:, 2]
        sizes = float(np.linalg.norm(moments) * np.linalg.norm(turns))
        if float(moments @ turns) > _AGAINST * sizes:
            return []
        return [
            Doubt(
                "moments point against turning rates: has one of the two z axes the other sign?",
                True,
            )
        ]
    of_body = [
        not math.isfinite(length) or SHORTEST <= length <= LONGEST
        for length in (known.of_loads, known.of_motions)
    ]
    if all(of_body) and not _certainly_apart(wrenches, twists, known):
        return []
    causes = []
    swapped = lengths_of(twists, wrenches)
    if swapped.possible and not SHORTEST <= known.of_loads <= LONGEST:
        causes.append("the columns of wrench and twist are swapped")
    for cause, (moment, velocity, turn) in _SLIPS:
        loads = wrenches * np.array([1.0, 1.0, moment])
        motions = twists * np.array([velocity, velocity, turn])
        if lengths_of(loads, motions).possible:
            causes.append(cause)
            break
    found = (
        f"loads are those of a body of length {_metres(known.of_loads)} (largest moment over "
        f"largest force), motions those of one of {_metres(known.of_motions)}"
    )
    if causes:
        return [Doubt(f"{found}: by all appearance {', or '.join(causes)}", True)]
    if not known.agree and SHORTEST <= known.of_loads <= LONGEST:
        return [Doubt(f"{found}: is one of the units, or the reference point, another?", False)]
    return [Doubt(f"{found}: are the units N, N m, m/s and rad/s?", True)]


def _certainly_apart(wrenches: Floats, twists: Floats, known: Lengths) -> bool:
    """Tell whether the two lengths disagree by more than the scatter of the pairs makes them."""
    if not math.isfinite(known.of_loads):
        return False
    groups = min(_GROUPS, len(wrenches))
    numbers = np.arange(len(wrenches)) % groups
    ratios = []
    for group in range(groups):
        left = numbers != group
        some = lengths_of(wrenches[left], twists[left])
        ratios.append(math.log(some.of_motions / some.of_loads))
    if not np.isfinite(ratios).all():
        return False
    spread = float(np.sum((np.array(ratios) - np.mean(ratios)) ** 2))
    deviation = math.sqrt((groups - 1) / groups * spread)
    ratio = abs(math.log(known.of_motions / known.of_loads))
    return ratio > max(math.log(_AGREE), _CERTAIN * deviation)


def _doubt_of_stated(known: Lengths, stated: float | None) -> list[Doubt]:
    if stated is None:
        return []
    shown = math.sqrt(known.of_loads * known.of_motions)
    if abs(math.log(stated / shown)) <= math.log(_AGREE_WITH_STATED):
        return []
    unit = "; it is in millimetres" if 200.0 <= stated / shown <= 5000.0 else ""
    return [
        Doubt(
            f"the characteristic length is stated as {_metres(stated)}, loads and motions show "
            f"{_metres(shown)}{unit}",
            True,
        )
    ]


def _doubts_of_bias(wrenches: Floats, twists: Floats, length: float) -> list[Doubt]:
    """Return that loads of opposite motions are not opposite, by the same amount everywhere."""
    if len(wrenches) < _FEWEST_FOR_BIAS:
        return []
    unit = _unit(twists, length)
    basis = np.column_stack([unit, unit * np.abs(unit), np.ones(len(unit))])
    loads = wrenches / np.array([1.0, 1.0, length])
    found, _, rank, _ = np.linalg.lstsq(basis, loads, rcond=None)
    if rank < basis.shape[1] or float(np.linalg.norm(unit.mean(axis=0))) > _ONE_WAY:
        return []  # hardly any motion has an opposite one
    left = loads - basis @ found
    spread = np.sum(left**2, axis=0) / (len(loads) - basis.shape[1])
    deviation = np.sqrt(np.linalg.pinv(basis.T @ basis)[-1, -1] * spread)
    bias, size = found[-1], float(np.sqrt(np.mean(np.sum(loads**2, axis=1))))
    certain = np.abs(bias) > _DEVIATIONS * deviation
    if not (certain & (np.abs(bias) > _BIAS * size)).any():
        return []
    fx, fy, moment = bias * np.array([1.0, 1.0, length])
    return [
        Doubt(
            "loads of opposite motions are not opposite: by all appearance the sensor has a bias "
            f"of about ({fx:.2g}, {fy:.2g}) N and {moment:.2g} N m; take away what it shows while "
            "nothing touches the body",
            True,
        )
    ]


def _metres(length: float) -> str:
    return f"{length:.3g} m" if math.isfinite(length) else "no certain size"
