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

import copy
import math
from typing import TYPE_CHECKING

import numpy as np
from scipy.linalg.lapack import dposv

from limit_surface_ros.fitting.few_pushes.pressure import SmallContacts
from limit_surface_ros.fitting.few_pushes.recipe import ROBUST_SCALE
from limit_surface_ros.fitting.motion_cost import SmoothSupportSolver, cross, direction_loss
from limit_surface_ros.fitting.pairs import ScaledPairs
from limit_surface_ros.surface.kinds.dissipation import Dissipation

if TYPE_CHECKING:
    from collections.abc import Sequence

    from limit_surface_ros.checks import Floats, Places
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
# Weight below which a push is left out of a window that forgets.
_FORGOTTEN = 0.02
# Logarithm of the share of the largest limit below which a contact is left out.
_IDLE = math.log(1e-3)
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
        if forgetting < 1.0:
            length = min(length, math.ceil(math.log(_FORGOTTEN) / math.log(forgetting)))
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
        pairs = self._pairs()
        self._fit.follow(pairs, _STEPS)
        if self._challenger is not None:
            self._challenger.follow(pairs, _PLACING_STEPS)
            if count - self._challenged >= _PLACING_EVERY - 1:
                if self._challenger.cost < self._fit.cost:
                    self._fit = self._challenger
                self._challenger = None
        elif count >= _FIRST_PLACING and (count - _FIRST_PLACING) % _PLACING_EVERY == 0:
            self._challenger = _Fit(SmallContacts.on_a_disc(pairs), self._fit.motions[:, :-1])
            self._challenged = count
            self._challenger.follow(pairs, _PLACING_STEPS)

    def begin_anew(self, other: Window, kept: int) -> None:
        """Keep only the last few pushes, and go on from the contacts of another window.

        Args:
            other: Of the same pushes.
            kept: How many of the last are kept.
        """
        self._loads, self._motions = self._loads[-kept:], self._motions[-kept:]
        self._fit, self._challenger = copy.copy(other._fit), None

    def motion(self, load: Floats) -> Floats:
        """Return the unit motion of one scaled load."""
        return self._fit.motion(load)

    def surface(self, terms: int) -> Dissipation:
        """Return the contacts summed up in so many terms."""
        return Dissipation(self._fit.contacts.loaded().merged(terms).matrices, self._scaling)

    def folds(self, terms: int, folds: Sequence[Places]) -> list[Dissipation]:
        """Return what the surface would be without some of the pushes, by one step from it.

        Args:
            terms: That sum up the contacts, the same ones as in `surface`.
            folds: Pushes that each leaves out, as places counted back from the last one, -1.
        """
        contacts = self._fit.contacts
        loaded = contacts.carrying()
        groups = contacts.take(loaded).groups(terms)
        count = len(self._loads)
        parts = [count + places[places >= -count] for places in folds]
        surfaces = []
        for limits in self._fit.limits_without(self._pairs(), parts):
            fold = SmallContacts(contacts.points, limits, contacts.radii).take(loaded)
            surfaces.append(Dissipation(fold.summed(groups).matrices, self._scaling))
        return surfaces

    def _pairs(self) -> ScaledPairs:
        ages = np.arange(len(self._loads))[::-1].astype(np.float64)
        return ScaledPairs(self._loads, self._motions, self._scaling, self._forgetting**ages)


class _Fit:
    """Friction limits of contacts that follow a window by damped Gauss-Newton steps."""

    def __init__(self, usual: SmallContacts, motions: Floats | None = None) -> None:
        """Begin with usual limits.

        Args:
            usual: Contacts with the limits n_k, all above zero.
            motions: Of the last loads before the next one, near which those of the fit are looked
                for, shape (3, m).
        """
        self._usual, self._total = usual, float(usual.limits.sum())
        self._speeds = usual.speeds
        self._parameters = np.log(usual.limits)
        self.motions = np.empty((3, 0)) if motions is None else motions
        # The last load whose motion was asked for, and that motion.
        self._predicted: tuple[Floats, Floats] | None = None
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
        self._predicted = load, motion
        return np.asarray(motion / np.linalg.norm(motion))

    def follow(self, pairs: ScaledPairs, steps: int) -> None:
        """Take steps towards the minimum over these pairs, of which one is new."""
        self._drop_idle()
        load = pairs.wrenches[-1]
        newest = load / (load @ load)
        if self._predicted is not None and np.array_equal(self._predicted[0], load):
            newest = self._predicted[1]
        errors = _Errors(pairs, np.hstack([self.motions, newest[:, None]]))
        self.cost = self._cost(self._parameters, errors)
        equations: tuple[Floats, Floats] | None = None
        for _ in range(steps):
            if equations is None:
                equations = self._normal_equations(*errors.rows())
            hessian, slope = equations
            step = _damped_step(hessian, slope, self._damping)
            cost = self._cost(self._parameters + step, errors)
            if cost < self.cost:
                self._parameters = self._parameters + step
                self.cost = cost
                self._damping = max(_LESS * self._damping, _LEAST_DAMPING)
                equations = None
            else:
                self._damping *= _MORE
        self.motions = errors.motions

    def limits_without(self, pairs: ScaledPairs, parts: Sequence[Places]) -> list[Floats]:
        """Return the limits that fit all pairs but a part of them, by one Gauss-Newton step."""
        errors = _Errors(pairs, self.motions)
        self._cost(self._parameters, errors)
        rows, residuals = errors.rows()
        hessian, slope = self._normal_equations(rows, residuals)
        # Each pair has a row for its size, and two for its direction.
        rows = rows.reshape(len(slope), 3, -1)
        residuals = residuals.reshape(3, -1)
        found = []
        for part in parts:
            its = rows[:, :, part].reshape(len(slope), -1)
            rest = hessian - its @ its.T
            missing = its @ residuals[:, part].ravel()
            step = _damped_step(rest, slope - missing, _LEAST_DAMPING)
            found.append(np.exp(self._parameters + step))
        return found

    def _drop_idle(self) -> None:
        """Leave out contacts that carry next to nothing: their slopes are gone with them."""
        carry = self._parameters > self._parameters.max() + _IDLE
        if not carry.all():
            self._usual = self._usual.take(carry)
            self._speeds, self._parameters = self._speeds[carry], self._parameters[carry]

    def _matrices(self, parameters: Floats) -> Floats:
        return np.asarray(self._speeds * np.exp(2.0 * parameters)[:, None, None])

    def _cost(self, parameters: Floats, errors: _Errors) -> float:
        limits, usual = np.exp(parameters), self._usual.limits
        entropy = limits @ (parameters - np.log(usual)) - limits.sum() + self._total
        return errors.cost(self._matrices(parameters)) + _ENTROPY_WEIGHT * float(entropy)

    def _normal_equations(self, rows: Floats, residuals: Floats) -> tuple[Floats, Floats]:
        """Return the Gauss-Newton Hessian and the slope, halved, where the rows were taken."""
        limits = np.exp(self._parameters)
        surprise = self._parameters - np.log(self._usual.limits)
        hessian = rows @ rows.T
        hessian[np.diag_indices_from(hessian)] += 0.5 * _ENTROPY_WEIGHT * limits
        return hessian, rows @ residuals + 0.5 * _ENTROPY_WEIGHT * limits * surprise


def _damped_step(hessian: Floats, slope: Floats, damping: float) -> Floats:
    """Return -(H + damping I)^-1 slope, cut to the farthest step, shape (k,).

    Without a step where the matrix is not positive definite, as by rounding.
    """
    damped = hessian.copy()
    damped.flat[:: len(slope) + 1] += damping
    # Of such a matrix there is no Cholesky factor.
    _, step, not_definite = dposv(damped.T, slope, lower=1, overwrite_a=1)
    if not_definite:
        return np.zeros_like(slope)
    return np.asarray(np.clip(-step, -_FARTHEST_STEP, _FARTHEST_STEP))


class _Errors:
    """Errors of load factor and direction at some pairs, and their slopes."""

    def __init__(self, pairs: ScaledPairs, motions: Floats) -> None:
        """Hold the pairs.

        Args:
            pairs: In their order.
            motions: Of the last m of them, to begin the search at; those of pairs before these are
                left out, shape (3, m).
        """
        self._solver = SmoothSupportSolver(np.ascontiguousarray(pairs.wrenches.T))
        self._solver.begin_at(motions[:, -len(pairs) :])
        self._directions = np.ascontiguousarray(pairs.directions.T)
        self._weights = pairs.weights

    @property
    def motions(self) -> Floats:
        """Motions of the pairs' loads where the cost was taken last, shape (3, n)."""
        return self._solver.motions

    def cost(self, matrices: Floats) -> float:
        """Return the cost of the pairs under the terms with these matrices."""
        self._matrices = matrices
        solver = self._solver
        solver.solve(matrices)
        self._norms = np.sqrt(np.einsum("cn,cn->n", solver.motions, solver.motions))
        self._units = solver.motions / self._norms
        cosines = np.einsum("cn,cn->n", self._units, self._directions)
        self._log_factors = -np.log(solver.dissipation)
        loss, _ = direction_loss(cosines, ROBUST_SCALE)
        return float(self._weights @ (self._log_factors**2 + 2.0 * loss))

    def rows(self) -> tuple[Floats, Floats]:
        """Return slopes by the logarithms of the limits, a row for each, and the residuals."""
        solver, weights, units = self._solver, self._weights, self._units
        chords = units - self._directions
        robust = 2.0 * ROBUST_SCALE / np.sqrt(np.sum(chords**2, axis=0) + ROBUST_SCALE**2)
        of_size, of_chord = np.sqrt(weights), np.sqrt(weights * robust)
        # Directions of error: an orthonormal basis across each unit motion.
        across = solver.frame[1] - np.einsum("cn,cn->n", solver.frame[1], units) * units
        across /= np.sqrt(np.einsum("cn,cn->n", across, across))
        basis = np.stack([across, cross(units, across)])
        # How much a change of grad D in the plane moves the unit motion along each of them.
        first, second = solver.response(np.einsum("zcn,bcn->zbn", solver.frame[1:], basis))
        scale = of_chord / self._norms
        rows = np.empty((len(solver.speeds), 3, len(weights)))
        rows[:, 0] = solver.speeds * (-of_size / solver.dissipation)
        rows[:, 1:] = solver.gradients[:, :1] * (first * scale)
        rows[:, 1:] += solver.gradients[:, 1:] * (second * scale)
        chords = np.einsum("bcn,cn->bn", basis, chords) * of_chord
        residuals = np.concatenate([self._log_factors * of_size, chords.ravel()])
        return rows.reshape(len(rows), -1), residuals
