# SPDX-License-Identifier: Apache-2.0
"""The equations of a sliding body: free, and while one of its points rests.

Both are written in a scaled time s with dt = ds / rate, in which a body comes to rest at infinity
and the Lipschitz constant of the motion is about 1. A state is a list of floats of which the last
five are heading, place (2), time, and two more: work of friction and of the load.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, sin, sqrt
from typing import TYPE_CHECKING, Protocol

import numpy as np

from limit_surface_ros.motion.sliding.rest import null_space

if TYPE_CHECKING:
    from collections.abc import Sequence

    from limit_surface_ros.checks import Floats
    from limit_surface_ros.motion.sliding.friction import MapFriction, NormFriction
    from limit_surface_ros.motion.sliding.inertia import Inertia
    from limit_surface_ros.motion.sliding.load import Load


@dataclass(frozen=True)
class State:
    """Where a body is and how it moves.

    Attributes:
        time: [s].
        pose: x, y of the reference point in the world [m] and heading [rad].
        twist: (vx, vy, omega) at the reference point, in the body's frame.
        friction_work: What friction has taken so far [J].
        load_work: What the load has given so far [J].
    """

    time: float
    pose: tuple[float, float, float]
    twist: tuple[float, float, float]
    friction_work: float = 0.0
    load_work: float = 0.0


class Motion(Protocol):
    """One set of equations."""

    def begin(self, state: State) -> list[float]:
        """Return the components of a state."""
        ...

    def read(self, y: Sequence[float]) -> State:
        """Return the state of components."""
        ...

    def slope(self, y: Sequence[float]) -> Sequence[float]:
        """Return the derivatives of the components by the scaled time."""
        ...

    def scale(self, speed: float, time: float) -> list[float]:
        """Return the sizes of the components for an energy norm and a time."""
        ...

    def acceleration(self, y: Sequence[float], slope: Sequence[float]) -> tuple[float, ...]:
        """Return the second derivatives of the pose by time, in the world."""
        ...


class FreeMotion:
    """A body none of whose points rests: velocities of its centre of mass in the world's axes.

    In these there are no gyroscopic terms, and they change slowly even when the body spins.
    """

    def __init__(
        self, friction: NormFriction | MapFriction, inertia: Inertia, load: Load | None
    ) -> None:
        """Prepare the equations."""
        self._mass, self._moment = inertia.mass, inertia.moment
        self._cx, self._cy = inertia.centre.tolist()
        self._law = friction.law(np.linalg.cholesky(inertia.matrix).T)
        self._load = load
        self._wrench = (0.0, 0.0, 0.0) if load is None else tuple(load.wrench.tolist())

    def begin(self, state: State) -> list[float]:
        """Return (Vx, Vy, omega, heading, X, Y, time, works) of the centre of mass."""
        x, y, heading = state.pose
        vx, vy, turn = state.twist
        c, s = cos(heading), sin(heading)
        bx, by = vx - turn * self._cy, vy + turn * self._cx
        return [
            c * bx - s * by,
            s * bx + c * by,
            turn,
            heading,
            x + c * self._cx - s * self._cy,
            y + s * self._cx + c * self._cy,
            state.time,
            state.friction_work,
            state.load_work,
        ]

    def read(self, y: Sequence[float]) -> State:
        """Return the state of components."""
        wx, wy, turn, heading, x, z, time, friction_work, load_work = y
        c, s = cos(heading), sin(heading)
        return State(
            time,
            (x - c * self._cx + s * self._cy, z - s * self._cx - c * self._cy, heading),
            (c * wx + s * wy + turn * self._cy, c * wy - s * wx - turn * self._cx, turn),
            friction_work,
            load_work,
        )

    def slope(self, y: Sequence[float]) -> Sequence[float]:
        """Return the derivatives of the components by the scaled time."""
        wx, wy, turn, heading, _, _, time, _, _ = y
        c, s = cos(heading), sin(heading)
        cx, cy = self._cx, self._cy
        vx, vy = c * wx + s * wy + turn * cy, c * wy - s * wx - turn * cx
        fx, fy, torque, rate = self._law(vx, vy, turn)
        pace = 1.0 / rate
        power = 0.0
        gx, gy, gz = -fx, -fy, -torque
        load = self._load
        if load is not None:
            px, py, pz = self._wrench
            if load.in_world:
                px, py = c * px + s * py, c * py - s * px
            left = load.fraction(time)
            px, py, pz = left * px, left * py, left * pz
            power = px * vx + py * vy + pz * turn
            gx, gy, gz = gx + px, gy + py, gz + pz
        push = pace / self._mass
        return (
            push * (c * gx - s * gy),
            push * (s * gx + c * gy),
            pace * (gz - cx * gy + cy * gx) / self._moment,
            pace * turn,
            pace * wx,
            pace * wy,
            pace,
            pace * (fx * vx + fy * vy + torque * turn),
            pace * power,
        )

    def scale(self, speed: float, time: float) -> list[float]:
        """Return the sizes of the components for an energy norm and a time."""
        straight, turning = speed / sqrt(self._mass), speed / sqrt(self._moment)
        return [
            straight,
            straight,
            turning,
            turning * time,
            straight * time,
            straight * time,
            time,
            speed * speed,
            speed * speed,
        ]

    def acceleration(self, y: Sequence[float], slope: Sequence[float]) -> tuple[float, ...]:
        """Return the second derivatives of the pose by time, in the world."""
        c, s = cos(y[3]), sin(y[3])
        rx, ry = c * self._cx - s * self._cy, s * self._cx + c * self._cy
        ax, ay, turning = (each / slope[6] for each in slope[:3])
        square = y[2] * y[2]
        return ax + turning * ry + square * rx, ay - turning * rx + square * ry, turning


class HeldMotion:
    """A body some of whose terms rest: its twist stays in the span of a basis Z, q = Z u.

    In the body's frame, M q' = load - friction + gyroscopic terms + forces of the resting terms;
    those have no power along Z.

    Attributes:
        held: The resting terms.
        basis: Z, shape (3, d).
    """

    def __init__(
        self, friction: NormFriction, inertia: Inertia, load: Load | None, held: Sequence[int]
    ) -> None:
        """Prepare the equations."""
        self.held = tuple(held)
        self._matrix = inertia.matrix
        self._load = load
        rows = [friction.roots[term][: friction.ranks[term]] for term in held]
        stacked = np.concatenate(rows)
        self._parts = np.cumsum([len(each) for each in rows])[:-1]
        self._forces = np.linalg.pinv(stacked.T)
        self.basis = null_space(stacked)
        reduced = self.basis.T @ self._matrix @ self.basis
        self._inverse = np.linalg.inv(reduced) @ self.basis.T
        self._into = self._inverse @ self._matrix
        self._size = np.sqrt(np.diag(reduced))
        rest = friction.without(held)
        self._law = rest.law(np.linalg.cholesky(self._matrix).T) if len(rest.roots) else None

    def begin(self, state: State) -> list[float]:
        """Return (u, heading, x, y, time, works) of the nearest motion in the span of Z."""
        x, y, heading = state.pose
        u = (self._into @ state.twist).tolist()
        return [*u, heading, x, y, state.time, state.friction_work, state.load_work]

    def read(self, y: Sequence[float]) -> State:
        """Return the state of components."""
        *u, heading, x, z, time, friction_work, load_work = y
        vx, vy, turn = (self.basis @ u).tolist()
        return State(time, (x, z, heading), (vx, vy, turn), friction_work, load_work)

    def _wrenches(self, y: Sequence[float]) -> tuple[Floats, Floats, Floats, Floats, float]:
        """Return twist, friction of the moving terms, load, gyroscopic terms, and the rate."""
        *u, heading, _, _, time, _, _ = y
        q = self.basis @ u
        vx, vy, turn = q.tolist()
        if self._law is None:
            raise ZeroDivisionError("nothing resists the motion about the resting terms")
        fx, fy, torque, rate = self._law(vx, vy, turn)
        px, py, _ = (self._matrix @ q).tolist()
        gyroscopic = np.array([turn * py, -turn * px, vy * px - vx * py])
        load = np.zeros(3)
        if self._load is not None:
            load = self._load.fraction(time) * self._load.in_body(heading)
        return q, np.array([fx, fy, torque]), load, gyroscopic, rate

    def slope(self, y: Sequence[float]) -> Sequence[float]:
        """Return the derivatives of the components by the scaled time."""
        q, friction, load, gyroscopic, rate = self._wrenches(y)
        rise = (self._inverse @ (load - friction + gyroscopic)).tolist()
        vx, vy, turn = q.tolist()
        c, s = cos(y[-6]), sin(y[-6])
        pace = 1.0 / rate
        return [
            *(pace * each for each in rise),
            pace * turn,
            pace * (c * vx - s * vy),
            pace * (s * vx + c * vy),
            pace,
            pace * float(friction @ q),
            pace * float(load @ q),
        ]

    def forces(self, y: Sequence[float]) -> list[Floats]:
        """Return the force of each held term, of size up to 1 while it rests."""
        _, friction, load, gyroscopic, _ = self._wrenches(y)
        net = load - friction + gyroscopic
        return np.split(
            self._forces @ (net - self._matrix @ (self.basis @ (self._inverse @ net))), self._parts
        )

    def scale(self, speed: float, time: float) -> list[float]:
        """Return the sizes of the components for an energy norm and a time."""
        turning = speed / sqrt(self._matrix[2, 2])
        place = speed / sqrt(self._matrix[0, 0]) * time
        sizes = (speed / self._size).tolist()
        return [*sizes, turning * time, place, place, time, speed**2, speed**2]

    def acceleration(self, y: Sequence[float], slope: Sequence[float]) -> tuple[float, ...]:
        """Return the second derivatives of the pose by time, in the world."""
        vx, vy, turn = (self.basis @ y[:-6]).tolist()
        ax, ay, turning = (self.basis @ slope[:-6] / slope[-3]).tolist()
        c, s = cos(y[-6]), sin(y[-6])
        bx, by = ax - turn * vy, ay + turn * vx
        return c * bx - s * by, s * bx + c * by, turning


def released(
    friction: NormFriction, matrix: Floats, others: Sequence[int], term: int, force: Floats
) -> tuple[Floats, Floats]:
    """Return how fast the motion R q of a term leaves rest, and what that makes of the twist.

    The term's motion u = R q obeys u' = A (force - u / |u|) with A = R Z (Z'M Z)^-1 Z'R', Z the
    twists that the other resting terms allow: it leaves along b with A^-1 b + b / |b| = force.

    Args:
        friction: All terms.
        matrix: M, shape (3, 3).
        others: Terms that go on resting.
        term: That which leaves.
        force: What would hold it, shape (rank,); of a size up to 1 it stays at rest.

    Returns:
        b, shape (rank,), and the change of twist per change of u, shape (3, rank).
    """
    basis = np.eye(3)
    if others:
        stacked = np.concatenate([friction.roots[k][: friction.ranks[k]] for k in others])
        basis = null_space(stacked)
    rows = friction.roots[term][: friction.ranks[term]] @ basis
    into = np.linalg.solve(basis.T @ matrix @ basis, rows.T)
    sizes, vectors = np.linalg.eigh(rows @ into)
    back = np.asarray(basis @ into @ np.linalg.inv(rows @ into))
    if not float(np.linalg.norm(force)) > 1.0:
        return np.zeros(len(rows)), back
    parts = vectors.T @ force
    # |(beta A^-1 + 1)^-1 force| = 1 for some beta > 0, by Newton's method on its inverse.
    beta = 0.0
    for _ in range(50):
        shrunk = parts / (1.0 + beta / sizes)
        length = float(np.linalg.norm(shrunk))
        slope = float((shrunk**2 / (sizes + beta)).sum()) / length**3
        step = (1.0 - 1.0 / length) / slope
        beta += step
        if step <= 1e-14 * beta:
            break
    return np.asarray(beta * (vectors @ (parts / (1.0 + beta / sizes)))), back
