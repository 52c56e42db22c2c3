# SPDX-License-Identifier: Apache-2.0
"""The loop that moves pushed bodies along the paths of their pushers.

A body's pose q follows dq/ds = R(theta) V(p, n, u) with s the length of the tip's path: without
inertia there is no time. While the tip touches, both modes keep its distance to the outline, so
that the first touch alone must be located; stick and slip, edges and vertices are kinks, and the
rate falls steadily to zero where the tip leaves. Steps are those of Bogacki and Shampine (1989,
doi:10.1016/0893-9659(89)90079-7), third order with an embedded second, each push with its own
length.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from limit_surface_ros.errors import SolverError
from limit_surface_ros.motion.inward_corner import TWO_PLACES, Scene, push_in_corner
from limit_surface_ros.motion.outcomes import MODES
from limit_surface_ros.motion.push_batch import Contacts, PushBatch, contact_velocities
from limit_surface_ros.motion.push_checks import as_complex, as_vectors_of
from limit_surface_ros.motion.push_roots import SEPARATE

if TYPE_CHECKING:
    from collections.abc import Iterator

    from limit_surface_ros.checks import Bools, Complexes, Floats, Places
    from limit_surface_ros.motion.outline import Nearest

# Phases of a push: its tip is on its way, touches at one place, or at two, or has arrived.
_FREE, _TOUCH, _CORNER, _DONE = range(4)
# A step is as long as its error allows, within these factors of the last.
_CAUTION, _SHORTEST, _LONGEST = 0.9, 0.2, 5.0
# Beside kinks of an outline steps of so many tolerances are taken whatever their error.
_LEAST_STEPS = 2.0
_MOST_ROUNDS = 100_000
# A gap of this part of the outline's size is a touch.
_TOUCHING = 1e-12


class Steps(NamedTuple):
    """States of pushes after steps, one row each, in the order in which they were taken.

    Tips and directions are complex; the rest as in `rollout.PushRun`.
    """

    pushes: Places
    lengths: Floats
    poses: Floats
    rates: Floats
    tips: Complexes
    directions: Complexes


class Rollout:
    """Pushes under way, as columns of numbers."""

    def __init__(
        self, scene: Scene, poses: Floats, paths: Floats, radii: Floats, *, record: bool
    ) -> None:
        """Begin pushes.

        Args:
            scene: What they share.
            poses: Of the bodies, x, y, angle, shape (n, 3).
            paths: Of the tips' centres, shape (n, m, 2).
            radii: Distances from the outline at which the tips touch [m], shape (n,).
            record: Whether to keep the steps.
        """
        count = len(poses)
        self._scene, self.radii = scene, radii
        self._batch = PushBatch(scene.surface)
        self._size = scene.outline.mean_radius
        self._exact = float(np.clip(0.05 * scene.tolerance / self._size, 4e-15, 1e-4))
        self._is_convex = scene.outline.is_convex
        self.paths: Complexes = as_complex(paths.reshape(-1, 2)).reshape(paths.shape[:2])
        ways = np.diff(self.paths, axis=1)
        self._lengths = np.abs(ways)
        self._directions = ways / np.where(self._lengths > 0.0, self._lengths, 1.0)
        self.poses = poses.copy()
        self._part, self._place = np.zeros(count, dtype=np.intp), np.zeros(count)
        self._done_lengths = np.zeros(count)
        self._phase = np.full(count, _FREE)
        first = self._size * (scene.tolerance / self._size) ** (1.0 / 3.0)
        self._step = np.full(count, first)
        self._rates, self._fresh = np.zeros((count, 3)), np.ones(count, dtype=bool)
        self._closing = np.zeros(count)
        self._starts = np.full(count, np.nan)
        self.touched_at, self.left_at = np.full(count, np.nan), np.full(count, np.nan)
        self.evaluations, self.errors = np.zeros(count, dtype=np.intp), np.zeros(count)
        self._record: list[Steps] | None = [] if record else None

    def rounds(self) -> Iterator[None]:
        """Move all pushes to the ends of their paths, and yield after each round of steps.

        Raises:
            SolverError: Steps became so short that a path does not end.
        """
        self._keep(np.arange(len(self.poses)))
        for _ in range(_MOST_ROUNDS):
            free = np.flatnonzero(self._phase == _FREE)
            if len(free):
                self._approach(free)
            touching = np.flatnonzero(self._phase == _TOUCH)
            cornered = np.flatnonzero(self._phase == _CORNER)
            if not len(touching) and not len(cornered):
                if (self._phase == _DONE).all():
                    return
                continue
            for rows, corner in ((touching, False), (cornered, True)):
                if len(rows):
                    self._take_steps(rows, corner)
            yield
        raise SolverError(
            "the path of a push needs more than 100000 steps: ask for less accuracy, or take a "
            "tip of a larger radius"
        )

    @property
    def recorded(self) -> Steps:
        """The steps that were taken."""
        assert self._record is not None
        return Steps(*(np.concatenate(each) for each in zip(*self._record, strict=True)))

    def _ways(self, rows: Places) -> tuple[Complexes, Complexes, Floats]:
        """Return where tips are, in which direction they move, and how far a part still goes."""
        part, place = self._part[rows], self._place[rows]
        direction = self._directions[rows, part]
        tip = self.paths[rows, part] + place * direction
        return tip, direction, self._lengths[rows, part] - place

    def _advance(self, rows: Places, moved: Floats, ends: Bools) -> None:
        """Move tips along their paths, some to the ends of straight parts."""
        self._done_lengths[rows] += moved
        self._place[rows] += moved
        over = rows[ends]
        self._part[over] += 1
        self._place[over] = 0.0
        self._fresh[over] = True
        arrived = over[self._part[over] == self._lengths.shape[1]]
        self._phase[arrived] = _DONE
        # What has arrived keeps a valid place.
        self._part[arrived] -= 1
        self._place[arrived] = self._lengths[arrived, self._part[arrived]]

    def _approach(self, rows: Places) -> None:
        """Move tips that do not touch to where they do, or to the ends of straight parts."""
        tip, direction, rest = self._ways(rows)
        turn, centre = in_body_frames(self.poses[rows], tip)
        heading = direction * turn
        near = self._scene.outline.nearest(as_vectors_of(centre))
        closing = -(np.conj(as_complex(near.normals)) * heading).real
        gap = near.distances - self.radii[rows]
        touches = (gap <= _TOUCHING * self._size) & (closing > 0.0)
        cornered = np.zeros(len(rows), dtype=bool)
        if not self._is_convex:
            # Of two places that it touches a tip may leave one, and push the other.
            for place in np.flatnonzero(self._at_two_places(rows)):
                pushed = push_in_corner(
                    self._scene, centre[place], heading[place], float(self.radii[rows[place]])
                )
                cornered[place] = pushed.twist.any()
        touches |= cornered
        moved = np.zeros(len(rows))
        away = np.flatnonzero(~touches)
        if len(away):
            moved[away] = self._scene.outline.first_touch(
                as_vectors_of(centre[away]),
                as_vectors_of(heading[away]),
                self.radii[rows[away]],
            )
        touches &= rest > 0.0
        hits = touches | (moved < rest)
        moved = np.where(hits, moved, rest)
        self._advance(rows, moved, ~hits)
        hit = rows[hits]
        self._phase[hit] = np.where(cornered[hits], _CORNER, _TOUCH)
        self._fresh[hit] = True
        new = hit[np.isnan(self.touched_at[hit])]
        self.touched_at[new] = self._done_lengths[new]
        self.left_at[hit] = np.nan
        self._rates[rows] = 0.0
        self._keep(rows)

    def _take_steps(self, rows: Places, corner: bool) -> None:
        """Try one step of each push, and keep those that are good enough."""
        fresh = rows[self._fresh[rows]]
        if len(fresh):
            tip, direction, _ = self._ways(fresh)
            rate, closing = self._rate(fresh, self.poses[fresh], tip, direction, corner)
            self._rates[fresh], self._closing[fresh] = rate, closing
            self._fresh[fresh] = False
            self._keep(fresh)
        tip, direction, rest = self._ways(rows)
        step = np.minimum(self._step[rows], rest)
        h, way = step[:, np.newaxis], step * direction
        pose, k1 = self.poses[rows], self._rates[rows]
        k2, _ = self._rate(rows, pose + 0.5 * h * k1, tip + 0.5 * way, direction, corner)
        k3, _ = self._rate(rows, pose + 0.75 * h * k2, tip + 0.75 * way, direction, corner)
        end = pose + h / 9.0 * (2.0 * k1 + 3.0 * k2 + 4.0 * k3)
        k4, closing = self._rate(rows, end, tip + way, direction, corner)
        wrong = h * (-5.0 / 72.0 * k1 + k2 / 12.0 + k3 / 9.0 - k4 / 8.0)
        error = np.maximum(np.hypot(wrong[:, 0], wrong[:, 1]), self._size * np.abs(wrong[:, 2]))
        tolerance = self._scene.tolerance
        good = (error <= tolerance) | (step <= _LEAST_STEPS * tolerance)
        factor = _CAUTION * np.cbrt(tolerance / np.maximum(error, 1e-30))
        longer = step * np.clip(factor, _SHORTEST, _LONGEST)
        # The end of a straight part may have cut a step short: that is no reason to go on so.
        planned = np.where(good & (step < self._step[rows]), self._step[rows], 0.0)
        self._step[rows] = np.maximum.reduce(
            [longer, planned, np.full(len(rows), _LEAST_STEPS * tolerance)]
        )
        taken = rows[good]
        if not len(taken):
            return
        self.poses[taken], self._rates[taken] = end[good], k4[good]
        self.errors[taken] += error[good]
        self._advance(taken, step[good], step[good] >= rest[good])
        self._keep(taken)
        self._follow_up(taken, closing[good], step[good])

    def _follow_up(self, rows: Places, closing: Floats, steps: Floats) -> None:
        """Find which tips have left, and which now touch at two places."""
        on = self._phase[rows] != _DONE
        two = np.zeros(len(rows), dtype=bool)
        if not self._is_convex:
            two = self._at_two_places(rows) & on
            # The nearer place may open while the body turns into the tip at the other.
            closing = np.where(two & (self._phase[rows] == _TOUCH), 1.0, closing)
        parted = np.flatnonzero(closing <= 0.0)
        left = rows[parted]
        if len(left):
            # Where between the ends of the step the tip ceased to close in.
            before, after = np.maximum(self._closing[left], 0.0), closing[parted]
            share = -after / np.where(before > after, before - after, 1.0)
            self.left_at[left] = self._done_lengths[left] - share * steps[parted]
            free = left[on[parted]]
            self._phase[free] = _FREE
            if self._is_convex and len(free):
                # Nothing bends back into the way of a tip that goes straight on.
                _, _, rest = self._ways(free)
                self._advance(free, rest, np.ones(len(free), dtype=bool))
                self._keep(free)
                on = self._phase[rows] != _DONE
        self._closing[rows] = closing
        # A new direction may lead away.
        turned = rows[on & self._fresh[rows] & (closing > 0.0)]
        self._phase[turned] = _FREE
        self.left_at[turned] = self._done_lengths[turned]
        stays = (self._phase[rows] == _TOUCH) | (self._phase[rows] == _CORNER)
        changed = stays & (two != (self._phase[rows] == _CORNER))
        self._fresh[rows[changed]] = True
        self._phase[rows[changed]] = np.where(two[changed], _CORNER, _TOUCH)

    def _at_two_places(self, rows: Places) -> Bools:
        """Return which tips touch the outline at two places, or more."""
        tip, _, _ = self._ways(rows)
        centre = as_vectors_of(in_body_frames(self.poses[rows], tip)[1])
        slack = TWO_PLACES * self._scene.tolerance
        counts = self._scene.outline.touch_counts(centre, self.radii[rows], slack)
        return np.asarray(counts > 1)

    def _rate(
        self, rows: Places, poses: Floats, tips: Complexes, directions: Complexes, corner: bool
    ) -> tuple[Floats, Floats]:
        """Return rates of poses (m, 3) by the tips' lengths, and how fast tips close in (m,)."""
        self.evaluations[rows] += 1
        turn, centre = in_body_frames(poses, tips)
        heading = directions * turn
        near = self._scene.outline.nearest(as_vectors_of(centre))
        inward = -as_complex(near.normals)
        closing = (np.conj(inward) * heading).real
        twists = np.zeros((len(rows), 3))
        if corner:
            for place in range(len(rows)):
                radius = float(self.radii[rows[place]])
                twists[place] = push_in_corner(
                    self._scene, centre[place], heading[place], radius
                ).twist
                closing[place] = 1.0 if twists[place].any() else closing[place]
        else:
            contacts, some = self._contacts(near, inward, heading, closing > 0.0)
            if len(contacts.points):
                pushed = rows[some]
                found = self._batch.solve(
                    contacts, starts=self._starts[pushed], exact=self._exact, wrenches=False
                )
                twists[some] = found.twists
                self._starts[pushed] = found.starts
        # The body's origin moves otherwise than the surface's reference point.
        moved = contact_velocities(np.full(len(rows), -self._scene.reference_point), twists)
        moved *= np.conj(turn)
        rates = np.empty((len(rows), 3))
        rates[:, 0], rates[:, 1], rates[:, 2] = moved.real, moved.imag, twists[:, 2]
        return rates, closing

    def _contacts(
        self, near: Nearest, inward: Complexes, heading: Complexes, pushes: Bools
    ) -> tuple[Contacts, Places | slice]:
        """Return the contacts of tips that push, and which they are."""
        points = as_complex(near.points) - self._scene.reference_point
        edges = np.full(len(points), self._scene.edge)
        contacts = Contacts(points, inward, edges, heading)
        if pushes.all():
            return contacts, slice(None)
        some = np.flatnonzero(pushes)
        return contacts.take(some), some

    def _keep(self, rows: Places) -> None:
        if self._record is None:
            return
        tip, direction, _ = self._ways(rows)
        self._record.append(
            Steps(
                rows,
                self._done_lengths[rows],
                self.poses[rows],
                self._rates[rows],
                tip,
                direction,
            )
        )

    def outcomes(self, steps: Steps) -> tuple[Floats, Places, Floats, Floats]:
        """Return twists (m, 3) [per m/s of the tip], modes (m,), wrenches (m, 3), contacts (m, 2).

        In the body's frame, about the surface's reference point; contacts in the body's frame.
        """
        turn, centre = in_body_frames(steps.poses, steps.tips)
        heading = steps.directions * turn
        near = self._scene.outline.nearest(as_vectors_of(centre))
        inward = -as_complex(near.normals)
        # Points that the tip has not reached are no contacts, whichever way it moves.
        gap = near.distances - self.radii[steps.pushes]
        pushes = (np.conj(inward) * heading).real > 0.0
        pushes &= gap <= 1e3 * self._scene.tolerance
        twists, wrenches = np.zeros((len(centre), 3)), np.zeros((len(centre), 3))
        modes = np.full(len(centre), SEPARATE)
        contacts, some = self._contacts(near, inward, heading, pushes)
        if len(contacts.points):
            found = self._batch.solve(contacts)
            assert found.wrenches is not None
            twists[some], modes[some], wrenches[some] = found.twists, found.modes, found.wrenches
        if not self._is_convex:
            slack = 2.0 * TWO_PLACES * self._scene.tolerance
            radii = self.radii[steps.pushes]
            counts = self._scene.outline.touch_counts(as_vectors_of(centre), radii, slack)
            for row in np.flatnonzero((counts > 1) & pushes):
                pushed = push_in_corner(self._scene, centre[row], heading[row], float(radii[row]))
                twists[row], wrenches[row] = pushed.twist, pushed.wrench
                modes[row] = MODES.index(pushed.mode)
        return twists, modes, wrenches, near.points


def in_body_frames(poses: Floats, tips: Complexes) -> tuple[Complexes, Complexes]:
    """Return what turns vectors into the frames of bodies with poses (m, 3), and tips in them."""
    turn = np.exp(-1j * poses[:, 2])
    arms = tips.copy()
    arms.real -= poses[:, 0]
    arms.imag -= poses[:, 1]
    return turn, arms * turn
