# SPDX-License-Identifier: Apache-2.0
"""Terms that rest while the body moves on: support points about which it turns.

Where the own motion R_k q of a term is zero, the dissipation has a crease. The body stays on it
while the force that holds the term there, in parts of its limit, is at most 1.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from limit_surface_ros.motion.sliding.equations import HeldMotion, State, released
from limit_surface_ros.motion.sliding.rest import LIMIT_TOLERANCE

if TYPE_CHECKING:
    from collections.abc import Sequence

    from limit_surface_ros.checks import Floats
    from limit_surface_ros.motion.sliding.dormand_prince import DormandPrince
    from limit_surface_ros.motion.sliding.equations import Motion
    from limit_surface_ros.motion.sliding.friction import NormFriction
    from limit_surface_ros.motion.sliding.inertia import Inertia
    from limit_surface_ros.motion.sliding.load import Load

# In tolerances: |R_k q| below which a term is looked at, and with which it leaves.
_NEAR, _LEAVE = 5.0, 20.0
# Part of the slide's greatest |R_k q| with which a term leaves rest.
_FIRST_MOTION = 1e-5


class Creases:
    """Which terms rest along one slide.

    Args:
        friction: Under the body.
        creases: Terms that may rest, each with the largest |R_k q| of unit energy norm.
        inertia: Of the body.
        load: On it.
        speed: Greatest energy norm of the slide.
        tolerance: Error of one step, in parts of the slide.
    """

    def __init__(
        self,
        friction: NormFriction,
        creases: Sequence[tuple[int, float]],
        inertia: Inertia,
        load: Load | None,
        speed: float,
        tolerance: float,
    ) -> None:
        """Begin a slide."""
        self._friction, self._creases, self._sizes = friction, creases, dict(creases)
        self._inertia, self._load = inertia, load
        self._speed, self._told = speed, tolerance * speed

    def near(self, state: State, held: tuple[int, ...]) -> list[int]:
        """Return the terms that do not rest and are about to."""
        sizes = self._friction.sizes(np.array(state.twist)).tolist()
        bound = _NEAR * self._told
        return [
            term for term, size in self._creases if term not in held and sizes[term] < bound * size
        ]

    def resting(self, state: State, held: tuple[int, ...]) -> tuple[State, tuple[int, ...]]:
        """Return which terms rest, and the state without the rounding of their motion.

        A term that is near its crease and is not held there is moved off it.
        """
        for term in self.near(state, held):
            candidate = (*held, term)
            motion = HeldMotion(self._friction, self._inertia, self._load, candidate)
            if motion.basis.shape[1] == 0:
                continue
            y = motion.begin(state)
            force = motion.forces(y)[-1]
            if float(np.linalg.norm(force)) <= 1.0 + LIMIT_TOLERANCE:
                return motion.read(y), candidate
            rate, back = released(self._friction, self._inertia.matrix, held, term, force)
            # Of no length but the least: it leaves at once.
            state = self._moved(motion.read(y), term, rate * 1e-30, back)
        return state, held

    def _moved(self, state: State, term: int, motion: Floats, back: Floats) -> State:
        """Return the state with R q of a term, which was 0, set to a motion.

        It is made at least as large as what is told from 0.
        """
        least = _LEAVE * self._told * self._sizes[term]
        length = float(np.linalg.norm(motion))
        vx, vy, turn = (state.twist + back @ (motion * max(1.0, least / length))).tolist()
        return State(state.time, state.pose, (vx, vy, turn), state.friction_work, state.load_work)

    def left(self, motion: Motion, stepper: DormandPrince) -> tuple[State, tuple[int, ...]] | None:
        """Return the state in which a resting term has left rest within the last step, if one did.

        Just past the moment at which it leaves, it moves so slowly that it would be stiff to
        follow: as a body that leaves rest, it is taken to move by the impulse of a short time.
        """
        if not isinstance(motion, HeldMotion) or _excess(motion, stepper.y) <= LIMIT_TOLERANCE:
            return None
        friction, matrix = self._friction, self._inertia.matrix
        low, end = 0.0, stepper.width
        high = end
        for _ in range(30):
            width = 0.5 * (low + high)
            stepper.redo(width)
            if _excess(motion, stepper.y) > LIMIT_TOLERANCE:
                high = width
            else:
                low = width
            if high - low <= 1e-7 * high:
                break
        stepper.redo(high)
        began = motion.read(stepper.y).time
        sizes = [float(np.linalg.norm(force)) for force in motion.forces(stepper.y)]
        place = int(np.argmax(sizes))
        term = motion.held[place]
        others = tuple(other for other in motion.held if other != term)
        goal = _FIRST_MOTION * self._speed * self._sizes[term]

        def rate_at(width: float) -> tuple[Floats, Floats]:
            stepper.redo(width)
            force = motion.forces(stepper.y)[place]
            return released(friction, matrix, others, term, force)

        width = end
        for _ in range(8):
            middle, _ = rate_at(0.5 * (high + width))
            last, back = rate_at(width)
            span = motion.read(stepper.y).time - began
            moved = span / 6.0 * (4.0 * middle + last)
            length = float(np.linalg.norm(moved))
            if length <= 2.0 * goal:
                break
            width = high + max(0.1, math.sqrt(goal / length)) * (width - high)
        if not last.any():
            return None
        state = motion.read(stepper.y)
        return self._moved(state, term, moved if moved.any() else 1e-30 * last, back), others


def _excess(motion: HeldMotion, y: list[float]) -> float:
    return max(float(np.linalg.norm(force)) for force in motion.forces(y)) - 1.0
