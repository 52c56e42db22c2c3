# SPDX-License-Identifier: Apache-2.0
"""The course of one slide: legs from rest to rest, on and off the creases of the dissipation.

A load may set the body moving again after a rest, or reverse it, a rest of no length. On a leg
the equations of motion are integrated in a scaled time; where the motion of a support point has
died away while the body turns on about it, the equations change.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from limit_surface_ros.errors import SolverError, UnstableError
from limit_surface_ros.motion.sliding.creases import Creases
from limit_surface_ros.motion.sliding.dormand_prince import DormandPrince
from limit_surface_ros.motion.sliding.equations import FreeMotion, HeldMotion, State
from limit_surface_ros.motion.sliding.friction import NormFriction
from limit_surface_ros.motion.sliding.rest import (
    acceleration,
    final_direction,
)
from limit_surface_ros.motion.sliding.result import Recorder, Slide

if TYPE_CHECKING:
    from collections.abc import Generator

    from limit_surface_ros.checks import Floats
    from limit_surface_ros.motion.sliding.body import SlidingBody
    from limit_surface_ros.motion.sliding.equations import Motion
    from limit_surface_ros.motion.sliding.load import Load

# Steps between two pauses, some 4 ms.
STEPS_AT_ONCE = 40
# Part of a leg's greatest energy norm below which it ends along its last direction, and where a
# load is about to reverse it.
_END, _REVERSED = 1e-5, 1e-9
# Part of the time that may hang on how its direction still turns, and by how much slower a body
# is looked at next.
_SETTLED, _NEXT = 3e-8, 0.5
# Part of the net force that may change meanwhile.
_STEADY = 1e-3
# Part of the slide's greatest energy norm with which a body leaves rest, and of the load's
# shortest time that this takes at most.
_FIRST, _SHORT = 1e-5, 4e-3
# Times at which the load is looked at for the scale of a slide, and headings.
_LOOKS, _HEADINGS = 257, 16


class Run:
    """One slide."""

    def __init__(
        self,
        body: SlidingBody,
        load: Load | None,
        horizon: float,
        tolerance: float,
        most_steps: int,
    ) -> None:
        """Take what `slide` has checked."""
        self._body, self._load, self._horizon = body, load, horizon
        self._tolerance, self._steps = tolerance, most_steps
        self._friction, self._matrix = body.friction, body.inertia.matrix
        self._evaluations = 0
        self._creases: Creases | None = None
        self._path = Recorder()
        self._rests: list[tuple[float, float]] = []

    def stages(self, twist: Floats, pose: Floats) -> Generator[None, None, Slide]:
        """Slide from a twist and a pose to rest, with a pause every `STEPS_AT_ONCE` steps."""
        x, y, heading = pose.tolist()
        state = State(0.0, (x, y, heading), tuple(twist.tolist()))
        self._speed = max(self._body.energy_norm(twist), self._speed_by_load(heading))
        if isinstance(self._friction, NormFriction) and self._body.creases:
            self._creases = Creases(
                self._friction,
                self._body.creases,
                self._body.inertia,
                self._load,
                self._speed,
                self._tolerance,
            )
        energy = 0.5 * self._body.energy_norm(twist) ** 2
        direction = np.zeros(3)
        moves = bool(twist.any())
        if not moves:
            self._path.stay(state)
        while True:
            if not moves:
                started = self._leave_rest(state)
                if started is None:
                    break
                state = started
            state, direction = yield from self._slide_to_rest(state)
            moves = False
        total = energy + abs(state.load_work) + state.friction_work
        residual = energy + state.load_work - state.friction_work
        scaled = direction / self._body.surface.scaling.twist_unit
        length = float(np.linalg.norm(scaled))
        return Slide(
            time=state.time,
            pose=np.array(state.pose),
            path=self._path.path(),
            final_direction=direction / length if length else direction,
            rests=np.array(self._rests).reshape(-1, 2),
            energy_residual=abs(residual) / total if total else 0.0,
            evaluations=self._evaluations,
        )

    def _speed_by_load(self, heading: float) -> float:
        """Return about the greatest energy norm to which the load brings the body from rest."""
        load = self._load
        if load is None:
            return 0.0
        turns = np.arange(_HEADINGS) * (2.0 * math.pi / _HEADINGS) if load.in_world else [0.0]
        wrenches = np.array([load.in_body(heading + turn) for turn in turns])
        if not wrenches.any():
            return 0.0
        factors = self._body.surface.load_factor(wrenches)
        factor = float(np.max(factors))
        if float(np.min(factors)) * abs(load.last_fraction) >= 1.0:
            raise UnstableError(
                f"the load never falls below {float(np.min(factors)) * abs(load.last_fraction):g} "
                "times what friction can hold: the body never rests for good"
            )
        level = abs(load.decay.start) / max(factor, 1e-12)
        end = load.decay.time_to_level(level)
        if not 0.0 < end < math.inf:
            end = 5.0 * load.shortest_time if end else 0.0
        times = np.linspace(0.0, end, _LOOKS)
        excess = factor * np.abs(load.decay(times) / load.decay.start) - 1.0
        gained = np.concatenate([[0.0], np.cumsum(0.5 * (excess[1:] + excess[:-1]))]) * times[1]
        return float((gained - np.minimum.accumulate(gained)).max()) * self._body.largest

    def _wrench(self, state: State) -> Floats:
        if self._load is None:
            return np.zeros(3)
        return self._load.fraction(state.time) * self._load.in_body(state.pose[2])

    def _leave_rest(self, state: State) -> State | None:
        """Return the state shortly after the load has moved the body; None if it never does."""
        load = self._load
        if load is None or not load.wrench.any():
            return None
        onset = load.in_body(state.pose[2])
        along, against = self._body.surface.load_factor(np.array([onset, -onset])).tolist()
        needed = (1.0 / along if along else math.inf, 1.0 / against if against else math.inf)
        time, began = state.time, state.time
        while True:
            following = load.next_above(needed[0], needed[1], time)
            if following is None:
                return None
            self._check(following)
            started = self._first_step(state, following, onset, along, against)
            if started is not None:
                if following > began or self._evaluations:
                    self._rests.append((began, following))
                return started
            # The load exceeds friction too briefly to move anything.
            time = following + _SHORT * load.shortest_time

    def _first_step(
        self, state: State, time: float, onset: Floats, along: float, against: float
    ) -> State | None:
        """Return the state after the impulse of the load in a first short step."""
        load = self._load
        assert load is not None
        goal = _FIRST * self._speed
        span = min(_SHORT * load.shortest_time, self._speed / self._body.largest)
        last = None
        for _ in range(40):
            left = load.mean_fraction(time, time + span)
            if (along if left > 0.0 else against) * abs(left) > 1.0:
                wrench = left * onset
                direction = self._body.surface.twist_of_wrench(wrench)
                a = acceleration(self._friction, self._matrix, wrench, direction)
                speed = span * self._body.energy_norm(a)
                if last is None or speed >= 1e-3 * goal:
                    last = (span, a, wrench)
                if speed <= 2.0 * goal:
                    break
                span *= max(goal / speed, 1e-4)
            else:
                if last is not None:
                    break
                span *= 0.25
        if last is None:
            return None
        span, a, wrench = last
        twist = span * a
        rested = State(time, state.pose, (0.0, 0.0, 0.0), state.friction_work, state.load_work)
        x, y, heading = state.pose
        c, s = math.cos(heading), math.sin(heading)
        vx, vy, turn = (0.5 * span * twist).tolist()
        self._path.depart(rested, (c * a[0] - s * a[1], s * a[0] + c * a[1], float(a[2])))
        given = 0.5 * span * float(wrench @ twist)
        return State(
            time + span,
            (x + c * vx - s * vy, y + s * vx + c * vy, heading + turn),
            tuple(twist.tolist()),
            state.friction_work + given - 0.5 * self._body.energy_norm(twist) ** 2,
            state.load_work + given,
        )

    def _check(self, time: float) -> None:
        if not time <= self._horizon:
            raise SolverError(f"the body still slides at the horizon of {self._horizon:g} s")

    def _slide_to_rest(self, state: State) -> Generator[None, None, tuple[State, Floats]]:
        """Return the state at the next rest, and the direction in which it was reached."""
        peak, below = 0.0, _END
        held: tuple[int, ...] = ()
        creases = self._creases
        while True:
            if creases is not None:
                state, held = creases.resting(state, held)
            motion = self._motion(held)
            stepper = self._stepper(motion, state)
            if not peak:
                self._path.add(state, motion.acceleration(stepper.y, stepper.slope))
            while True:
                stepper.step()
                self._steps -= 1
                if self._steps % STEPS_AT_ONCE == 0:
                    yield
                if self._steps < 0:
                    raise SolverError(
                        "the slide took too many steps; it reached "
                        f"{state.time:g} s and a heading of {state.pose[2]:g} rad"
                    )
                changed = creases.left(motion, stepper) if creases is not None else None
                state = motion.read(stepper.y)
                self._check(state.time)
                self._path.add(state, motion.acceleration(stepper.y, stepper.slope))
                speed = self._body.energy_norm(state.twist)
                peak = max(peak, speed)
                if speed < below * peak:
                    below *= _NEXT
                    end = self._at_rest(state, speed, speed < _REVERSED * peak, held)
                    if end is not None:
                        self._evaluations += stepper.evaluations
                        return end
                if changed is not None:
                    state, held = changed
                    break
                if creases is not None and creases.near(state, held):
                    break
                if stepper.stiff:
                    self._evaluations += stepper.evaluations
                    stepper = self._implicit(motion, stepper.y)
            self._evaluations += stepper.evaluations

    def _motion(self, held: tuple[int, ...]) -> FreeMotion | HeldMotion:
        if not held:
            return FreeMotion(self._friction, self._body.inertia, self._load)
        assert isinstance(self._friction, NormFriction)
        return HeldMotion(self._friction, self._body.inertia, self._load, held)

    def _stepper(self, motion: Motion, state: State) -> DormandPrince:
        return DormandPrince(motion.slope, motion.begin(state), self._scale(motion))

    def _scale(self, motion: Motion) -> list[float]:
        time = self._speed / self._body.largest
        return [self._tolerance * each for each in motion.scale(self._speed, time)]

    def _implicit(self, motion: Motion, y: list[float]) -> DormandPrince:
        # Only here, where explicit steps are held back by stability: it costs most of a second.
        from limit_surface_ros.motion.sliding.implicit import Implicit

        return Implicit(motion.slope, y, self._scale(motion))

    def _at_rest(
        self, state: State, speed: float, last: bool, held: tuple[int, ...]
    ) -> tuple[State, Floats] | None:
        """Return state and direction at rest, which a slow body is about to reach; None if not."""
        n = np.array(state.twist) / speed
        power = float(self._friction.wrenches(n[np.newaxis])[0] @ n)
        slowing = power - float(self._wrench(state) @ n)
        if not slowing > 0.0:
            return None
        span = speed / slowing
        x, y, heading = state.pose
        c, s = math.cos(heading), math.sin(heading)
        vx, vy, turn = (0.5 * span * speed * n).tolist()
        rest = State(
            state.time + span,
            (x + c * vx - s * vy, y + s * vx + c * vy, heading + turn),
            (0.0, 0.0, 0.0),
            state.friction_work + 0.5 * speed * speed,
            state.load_work,
        )
        wrench = self._wrench(rest)
        if self._load is not None and not last:
            if span * power > _STEADY * slowing * self._load.shortest_time:
                return None
            if float(self._body.surface.load_factor(wrench)) > 1.0:
                return None
        self._check(rest.time)
        g = n if held else final_direction(self._friction, self._matrix, wrench, n)
        turned = float((self._friction.wrenches(g[np.newaxis])[0] - wrench) @ g)
        if not last and abs(turned - slowing) * span > _SETTLED * slowing * rest.time:
            return None
        ax, ay, turning = (-slowing * n).tolist()
        self._path.arrive(rest, (c * ax - s * ay, s * ax + c * ay, turning))
        return rest, g
