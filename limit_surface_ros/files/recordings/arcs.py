# SPDX-License-Identifier: Apache-2.0
"""The twist of a body over one run of its motion, from noisy poses, with its covariance.

The twist in the body's frame is piecewise linear between knots; integrated along the yaw it gives
the poses, so that a constant twist is an exact arc. Its changes are a random walk, whose size,
beside the speed, is the one number that the data choose (by the restricted likelihood): a quiet
recording is followed closely, a noisy one is smoothed. Where the body rests before and after the
run it tells where the run began and ended, which no difference of neighbouring poses could.

The yaw is fitted first, then the positions along it: each is linear in its knots. The method is
the smoothing spline of Wahba, SIAM 1990, doi 10.1137/1.9781611970128, as Bayesian regression.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from limit_surface_ros.files.recordings.motion import LEAST_NOISE

if TYPE_CHECKING:
    from limit_surface_ros.checks import Bools, Floats
    from limit_surface_ros.files.recordings.motion import Motion

# Distance of knots [s]; increments within _RAMP of the ends may be as large as the speed, since a
# push begins and ends within so short a time.
_KNOTS, _RAMP, _RAMP_VARIANCE = 0.06, 0.12, 0.5
_FEWEST_KNOTS, _NODES = 4, 3
# Variance of the change of the twist in a second, beside the speed squared.
WALKS = np.geomspace(1e-3, 30.0, 14)
# Keeps factors of matrices positive where knots have no sample.
_JITTER = 1e-12


@dataclass(frozen=True)
class Span:
    """When a body moves.

    Attributes:
        start: [s].
        end: [s].
        before: From when on it rests before; `start` if it does not.
        after: Until when it rests after; `end` if it does not.
    """

    start: float
    end: float
    before: float
    after: float


@dataclass(frozen=True, eq=False)
class TwistCurve:
    """The twist of a body over a run, with its uncertainty.

    Attributes:
        span: Of the run.
        knots: Shape (k,) [s].
        linear: (vx, vy) at the knots in the body's frame, shape (k, 2) [m/s].
        angular: omega at the knots, shape (k,) [rad/s].
        linear_covariance: Of the linear parts in the order of their rows, shape (2 k, 2 k).
        angular_covariance: Shape (k, k).
    """

    span: Span
    knots: Floats
    linear: Floats
    angular: Floats
    linear_covariance: Floats
    angular_covariance: Floats

    def mean(self, start: float, end: float) -> tuple[Floats, Floats]:
        """Return the mean twist between two times, shape (3,), and its covariance, (3, 3)."""
        return self.combined(self.weights(start, end))

    def combined(self, weights: Floats) -> tuple[Floats, Floats]:
        """Return a linear combination of the knots' twists, and its covariance."""
        pairs = np.kron(weights[:, None], np.eye(2))
        covariance = np.zeros((3, 3))
        covariance[:2, :2] = pairs.T @ self.linear_covariance @ pairs
        covariance[2, 2] = weights @ self.angular_covariance @ weights
        return np.array([*(weights @ self.linear), weights @ self.angular]), covariance

    def weights(self, start: float, end: float) -> Floats:
        """Return how much each knot counts in the mean between two times, shape (k,)."""
        times = np.linspace(start, end, 101)
        share = np.ones(101)
        share[[0, -1]] = 0.5
        return np.asarray(share @ _hats(times, self.knots) / share.sum())

    def at(self, times: Floats) -> Floats:
        """Return the twist at times in the run, shape (n, 3)."""
        hats = _hats(times, self.knots)
        return np.column_stack([hats @ self.linear, hats @ self.angular])


def fit_curves(motion: Motion, spans: list[Span], lever: float) -> list[TwistCurve]:
    """Return the twist over each span in which the body moves.

    Args:
        motion: Poses.
        spans: When it moves.
        lever: Turns angular speed into speed [m].
    """
    runs = [_Run(motion, span, lever) for span in spans]
    runs = [run for run in runs if run.sound]
    if not runs:
        return []
    likelihood = np.sum([run.likelihood for run in runs], axis=0)
    best = int(np.argmax(likelihood))
    return [run.curve(best) for run in runs]


class _Posterior:
    """Knots of one part of the twist, for each size of the random walk."""

    def __init__(
        self, design: Floats, values: Floats, noise: float, increments: Floats, free: int
    ) -> None:
        """Fit.

        Args:
            design: Shape (n, free + k): of the start, and of the knots.
            values: Shape (n,).
            noise: Of the values.
            increments: Variance of each increment for each size of the walk, shape (w, k - 1).
            free: How many numbers the start has; the knots' vectors have as many.
        """
        gram = design.T @ design / noise**2
        moment, power = design.T @ values / noise**2, float(values @ values) / noise**2
        knots = (design.shape[1] - free) // free
        steps = np.kron(np.diff(np.eye(knots), axis=0), np.eye(free))
        self.factors, self.means, likelihoods = [], [], []
        for variances in increments:
            stiffness = np.repeat(1.0 / variances, free)
            normal = gram.copy()
            normal[free:, free:] += steps.T @ (stiffness[:, None] * steps)
            normal[np.diag_indices_from(normal)] *= 1.0 + _JITTER
            factor = cho_factor(normal)
            mean = cho_solve(factor, moment)
            volume = 2.0 * np.log(np.diag(factor[0])).sum() - np.log(stiffness).sum()
            self.factors.append(factor)
            self.means.append(mean)
            likelihoods.append(-0.5 * (volume + power - moment @ mean))
        self.likelihoods = np.array(likelihoods)

    def covariance(self, which: int, free: int) -> Floats:
        """Return the covariance of the knots."""
        size = len(self.means[which])
        return np.asarray(cho_solve(self.factors[which], np.eye(size))[free:, free:])


class _Run:
    """One run, fitted for each size of the random walk."""

    def __init__(self, motion: Motion, span: Span, lever: float) -> None:
        self.span = span
        inside: Bools = (motion.times >= span.before) & (motion.times <= span.after)
        times, poses = motion.times[inside], motion.values[inside]
        moving = (times >= span.start) & (times <= span.end)
        self.sound = int(moving.sum()) > _FEWEST_KNOTS
        if not self.sound:
            return
        noise = np.maximum(motion.noise, LEAST_NOISE)
        count = max(_FEWEST_KNOTS, math.ceil((span.end - span.start) / _KNOTS) + 1)
        self.knots = np.linspace(span.start, span.end, count)
        cells = _Cells(np.clip(times, span.start, span.end), self.knots)
        middle = poses.mean(axis=0)
        speed = _speed_over(times[moving], poses[moving], noise, lever)
        increments = self._increments()
        self.yaw = _Posterior(
            np.column_stack([np.ones(len(times)), cells.integrals(1.0)]),
            poses[:, 2] - middle[2],
            float(noise[2]),
            increments * (speed / lever) ** 2,
            1,
        )
        likely = self.yaw.means[int(np.argmax(self.yaw.likelihoods))]
        yaw = middle[2] + likely[0] + cells.turned(likely[1:])
        along, across = cells.integrals(np.cos(yaw)), cells.integrals(np.sin(yaw))
        design = np.zeros((2, len(times), 2 + 2 * count))
        design[0, :, 0] = design[1, :, 1] = 1.0
        design[0, :, 2::2], design[0, :, 3::2] = along, -across
        design[1, :, 2::2], design[1, :, 3::2] = across, along
        self.position = _Posterior(
            design.reshape(2 * len(times), -1),
            (poses[:, :2] - middle[:2]).T.ravel(),
            float(noise[:2].max()),
            increments * speed**2,
            2,
        )
        self.likelihood = self.yaw.likelihoods + self.position.likelihoods

    def _increments(self) -> Floats:
        """Return the variance of each increment beside the speed squared, shape (w, k - 1)."""
        step = float(self.knots[1] - self.knots[0])
        middles = 0.5 * (self.knots[1:] + self.knots[:-1])
        at_ends = (middles - self.knots[0] < _RAMP) | (self.knots[-1] - middles < _RAMP)
        ramp = np.where(at_ends, _RAMP_VARIANCE / max(1.0, at_ends.sum() / 2.0), 0.0)
        return np.asarray(WALKS[:, None] * step + ramp)

    def curve(self, which: int) -> TwistCurve:
        """Return the twist for one size of the walk."""
        return TwistCurve(
            self.span,
            self.knots,
            self.position.means[which][2:].reshape(-1, 2),
            self.yaw.means[which][1:],
            self.position.covariance(which, 2),
            self.yaw.covariance(which, 1),
        )


class _Cells:
    """Integrals over the knots' functions up to each sample, by Gauss's rule between the samples.

    Knots bound cells, too, so that the functions are straight lines inside: their own integrals
    are exact, those along a yaw that turns evenly to the rounding.
    """

    def __init__(self, times: Floats, knots: Floats) -> None:
        bounds = np.unique(np.concatenate([times, knots]))
        self._ends = np.searchsorted(bounds, times)
        self._lengths = np.diff(bounds)
        nodes, self._shares = np.polynomial.legendre.leggauss(_NODES)
        self._places = 0.5 * (1.0 + nodes)
        self._starts, self._knots = bounds[:-1], knots
        inside = self._starts[:, None] + self._lengths[:, None] * self._places
        self._hats = _hats(inside.ravel(), knots)

    def integrals(self, factor: Floats | float) -> Floats:
        """Return the integrals up to each sample of the functions times a factor at the nodes."""
        values = (self._hats.T * factor).T.reshape(len(self._lengths), _NODES, -1)
        areas = 0.5 * self._lengths[:, None] * np.tensordot(self._shares, values, (0, 1))
        total = np.concatenate([np.zeros((1, areas.shape[1])), np.cumsum(areas, axis=0)])
        return np.asarray(total[self._ends])

    def turned(self, rates: Floats) -> Floats:
        """Return how far a turning rate, given at the knots, has turned at each node."""
        at_starts = _hats(self._starts, self._knots) @ rates
        at_nodes = (self._hats @ rates).reshape(-1, _NODES)
        mean = 0.5 * (at_starts[:, None] + at_nodes)
        parts = mean * self._lengths[:, None] * self._places
        ends = 0.5 * self._lengths * (at_nodes @ self._shares)
        before = np.concatenate([[0.0], np.cumsum(ends)[:-1]])
        return np.asarray((before[:, None] + parts).ravel())


def _hats(times: Floats, knots: Floats) -> Floats:
    """Return the piecewise linear functions of the knots at times, shape (n, k)."""
    step = knots[1] - knots[0]
    return np.asarray(np.maximum(0.0, 1.0 - np.abs(times[:, None] - knots) / step))


def _speed_over(times: Floats, poses: Floats, noise: Floats, lever: float) -> float:
    """Return the speed of straight motion over a run, not below what noise makes of it [m/s]."""
    centred = times - times.mean()
    rates = centred @ (poses - poses.mean(axis=0)) / (centred @ centred)
    speed = math.hypot(rates[0], rates[1]) + lever * abs(rates[2])
    least = math.hypot(noise[0], lever * noise[2]) / math.sqrt(centred @ centred)
    return max(float(speed), float(least))
