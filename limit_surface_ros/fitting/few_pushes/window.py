# SPDX-License-Identifier: Apache-2.0
"""Contacts that follow a window of pushes: the pressure of `pressure`, fitted as pushes come.

Friction limits m_k = exp(q_k) of small contacts are what is learnt, the cost is that of `pressure`
over the window,

    J = sum_i w_i (log(s_i)^2 + 2 rho(|u_i - v_i|)) + eps sum_k (m_k log(m_k / n_k) - m_k + n_k)

and a few damped Gauss-Newton steps a push follow its minimum from where they stood. With the
unit motion u of each load, its plane z1, z2 and the Hessian H of D in it,

    d log s / dq_k = -m_k s_k / D      du / dq_k = -(I - u u') (z1 z2) H^-1 (z1.g_k, z2.g_k)' / |v|

Contacts lie on two discs about the prior's reference point; every few pushes they are compared
with a fit from scratch on the disc that the window's own loads suggest, whose steps are spread
over the next pushes. Filters that keep a mean and a covariance alone cannot take back a limit
that was driven to zero; a window can.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from limit_surface_ros.fitting.few_pushes.pressure import SmallContacts
from limit_surface_ros.fitting.few_pushes.recipe import ROBUST_SCALE
from limit_surface_ros.fitting.motion_cost import SmoothSupportSolver, direction_loss
from limit_surface_ros.fitting.pairs import ScaledPairs
from limit_surface_ros.surface.kinds.dissipation import Dissipation

if TYPE_CHECKING:
    from limit_surface_ros.checks import Floats
    from limit_surface_ros.surface.base import LimitSurface
    from limit_surface_ros.surface.scaling import Scaling

# Radii, in characteristic lengths, and rings of the discs of contacts that a prior suggests.
_DISCS = ((2.4, 5), (0.9, 4))
# Radius within which the prior expects the friction, and share of a limit beyond it.
_EXPECTED, _BEYOND = 1.5, 0.05
_ENTROPY_WEIGHT = 0.05
_STEPS = 4
# First push after which contacts are placed anew and compared, pushes between comparisons, and
# steps a push that the new ones take.
_FIRST_PLACING, _PLACING_EVERY, _PLACING_STEPS = 6, 4, 3
_FARTHEST_STEP = 2.0
_DAMPING, _LEAST_DAMPING, _MORE, _LESS = 0.03, 1e-4, 5.0, 0.4


class Window:
    """The pushes that are kept, with the weights of their ages, and the contacts that fit them."""

    def __init__(self, prior: LimitSurface, length: int, forgetting: float) -> None:
        """Begin with the friction force of a prior, spread over a disc, and no push.

        Args:
            prior: What is known of size and friction.
            length: How many pushes are kept.
            forgetting: Weight of a push relative to the next.
        """
        self._length, self._forgetting = length, forgetting
        self._scaling: Scaling = prior.scaling
        contacts = SmallContacts.around(_DISCS)
        inside = np.linalg.norm(contacts.points, axis=1) <= _EXPECTED
        limits = np.where(inside, 1.0, _BEYOND)
        straight = prior.wrench_of_twist([1.0, 0.0, 0.0])
        force = float(straight[0]) / prior.scaling.friction_force
        self._fit = _Fit(
            SmallContacts(contacts.points, limits * force / limits.sum(), contacts.radii)
        )
        self._challenger: _Fit | None = None
        self._challenged = 0
        self._loads = np.empty((0, 3))
        self._motions = np.empty((0, 3))

    def learn(self, load: Floats, motion: Floats, count: int) -> None:
        """Take a push in, and let the contacts follow."""
        self._loads = np.vstack([self._loads, load])[-self._length :]
        self._motions = np.vstack([self._motions, motion])[-self._length :]
        ages = np.arange(len(self._loads))[::-1]
        pairs = ScaledPairs(
            self._loads, self._motions, self._scaling, self._forgetting ** ages.astype(np.float64)
        )
        self._fit.follow(pairs, _STEPS)
        if self._challenger is not None:
            self._challenger.follow(pairs, _PLACING_STEPS)
            if count - self._challenged >= _PLACING_EVERY - 1:
                if self._challenger.cost < self._fit.cost:
                    self._fit = self._challenger
                self._challenger = None
        elif count >= _FIRST_PLACING and (count - _FIRST_PLACING) % _PLACING_EVERY == 0:
            self._challenger = _Fit(SmallContacts.on_a_disc(pairs))
            self._challenged = count
            self._challenger.follow(pairs, _PLACING_STEPS)

    def motion(self, load: Floats) -> Floats:
        """Return the unit motion of one scaled load."""
        return self._fit.motion(load)

    def surface(self, terms: int) -> Dissipation:
        """Return the contacts summed up in so many terms."""
        contacts = self._fit.contacts.loaded().merged(terms)
        return Dissipation(contacts.matrices, self._scaling)


class _Fit:
    """Friction limits of contacts that follow a window by damped Gauss-Newton steps."""

    def __init__(self, usual: SmallContacts) -> None:
        self._usual = usual
        self._speeds = usual.speeds
        self._parameters = np.log(usual.limits)
        self._damping = _DAMPING
        self.cost = math.inf

    @property
    def contacts(self) -> SmallContacts:
        """The contacts with their limits as they are now."""
        return SmallContacts(self._usual.points, np.exp(self._parameters), self._usual.radii)

    def motion(self, load: Floats) -> Floats:
        """Return the unit motion of one scaled load."""
        solver = SmoothSupportSolver(np.ascontiguousarray(load[:, None]))
        solver.solve(self._matrices(self._parameters))
        motion = solver.motions[:, 0]
        return np.asarray(motion / np.linalg.norm(motion))

    def follow(self, pairs: ScaledPairs, steps: int) -> None:
        """Take steps towards the minimum over these pairs."""
        solver = SmoothSupportSolver(np.ascontiguousarray(pairs.wrenches.T))
        directions = np.ascontiguousarray(pairs.directions.T)
        here = self._evaluate(self._parameters, solver, directions, pairs.weights)
        for _ in range(steps):
            cost, hessian, slope = here
            damped = hessian + self._damping * np.eye(len(slope))
            step = np.clip(-np.linalg.solve(damped, slope), -_FARTHEST_STEP, _FARTHEST_STEP)
            trial = self._parameters + step
            there = self._evaluate(trial, solver, directions, pairs.weights)
            if there[0] < cost:
                self._parameters, here = trial, there
                self._damping = max(_LESS * self._damping, _LEAST_DAMPING)
            else:
                self._damping *= _MORE
        self.cost = here[0]

    def _matrices(self, parameters: Floats) -> Floats:
        return np.asarray(self._speeds * np.exp(2.0 * parameters)[:, None, None])

    def _evaluate(
        self,
        parameters: Floats,
        solver: SmoothSupportSolver,
        directions: Floats,
        weights: Floats,
    ) -> tuple[float, Floats, Floats]:
        """Return the cost, the Gauss-Newton Hessian (halved) and the slope (halved)."""
        limits = np.exp(parameters)
        matrices = self._matrices(parameters)
        solver.solve(matrices)
        motions, speeds, dissipation = solver.motions, solver.speeds, solver.dissipation
        norms = np.sqrt(np.einsum("cn,cn->n", motions, motions))
        units = motions / norms
        chords = units - directions
        cosines = np.einsum("cn,cn->n", units, directions)
        log_factors = -np.log(dissipation)
        loss, _ = direction_loss(cosines, ROBUST_SCALE)
        surprise = np.log(limits / self._usual.limits)
        cost = float(weights @ (log_factors**2 + 2.0 * loss))
        entropy = limits @ surprise - limits.sum() + self._usual.limits.sum()
        cost += _ENTROPY_WEIGHT * float(entropy)
        # Loads of the contacts, and how each turns the motion.
        parts = (matrices.reshape(-1, 3) @ motions).reshape(-1, 3, len(weights))
        parts /= speeds[:, None]
        turned = solver.response(parts) / norms
        turned -= np.einsum("kcn,cn->kn", turned, units)[:, None] * units
        robust = 2.0 * ROBUST_SCALE / np.sqrt(np.sum(chords**2, axis=0) + ROBUST_SCALE**2)
        of_size, of_chord = np.sqrt(weights), np.sqrt(weights * robust)
        of_direction = (turned * of_chord).reshape(len(limits), -1)
        rows = np.concatenate([-speeds / dissipation * of_size, of_direction], axis=1)
        residuals = np.concatenate([log_factors * of_size, (chords * of_chord).ravel()])
        hessian = rows @ rows.T
        hessian[np.diag_indices_from(hessian)] += 0.5 * _ENTROPY_WEIGHT * limits
        slope = rows @ residuals + 0.5 * _ENTROPY_WEIGHT * limits * surprise
        return cost, hessian, slope
