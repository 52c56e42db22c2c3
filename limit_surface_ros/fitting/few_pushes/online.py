# SPDX-License-Identifier: Apache-2.0
"""A surface that is learnt while the robot pushes: a short window of pairs, fitted as it moves.

Which of several models predicts next is decided by what each predicted before (prequential; Dawid
1984, doi:10.2307/2981683): the prior, the window, and with forgetting a window of younger pushes.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from limit_surface_ros.checks import as_count, as_directions, as_floats, as_number, as_vector
from limit_surface_ros.errors import DataError, LimitSurfaceError, RangeError
from limit_surface_ros.fitting.few_pushes.calibration import calibrate
from limit_surface_ros.fitting.few_pushes.mixture import ELLIPSOID, as_dissipation, mixed
from limit_surface_ros.fitting.few_pushes.recipe import FEWEST_PAIRS, FitContext
from limit_surface_ros.fitting.few_pushes.window import Window
from limit_surface_ros.surface.kinds.dissipation import Dissipation
from limit_surface_ros.surface.kinds.dissipation_scatter import FREEDOM
from limit_surface_ros.surface.pairs import Pairs

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from numpy.typing import ArrayLike

    from limit_surface_ros.checks import Floats, Places
    from limit_surface_ros.surface.base import LimitSurface
    from limit_surface_ros.surface.kinds.dissipation_scatter import TwistScatter

# Share of the window's ellipsoid up to so many pushes, and pushes from which on it has none.
_ELLIPSOID_SHARE, _ELLIPSOID_UNTIL, _ELLIPSOID_GONE = 0.3, 10, 25
# How much larger the prior's losses count: a little, so that a wrong one is left soon, for a right
# one is hard to tell from luck with the first few pushes.
_DISTRUST = 1.25
# What past evidence counts with every push, and the weight below which a model is left out.
_DISCOUNT, _NEGLIGIBLE = 0.9, 0.02
# Scale of the errors of predictions [rad], by which evidence is told apart: about that of pushes.
_ERROR = float(np.radians(7.0))
# Forgetting of the younger window where two are blended.
_YOUNGER = 0.8
# Evidence for the younger window at which the other one begins anew with the pushes that gave it,
# and how many of them there must be: by chance alone it comes once in exp(5) = 150 pushes at most.
_LEAD, _FEWEST_YOUNGER = 5.0, 5
# Terms of a prior beyond which it is not mixed into the surface that is served.
_MOST_PRIOR_TERMS = 16
# Of the jackknife that tells what the pushes leave open.
_FOLDS = 5
_VERSION = 1


@dataclass(frozen=True)
class Update:
    """What became of a push.

    Attributes:
        accepted: Whether it was learnt.
        reason: Why not; empty if it was.
        angle_before: Angle [rad] between its twist and what was predicted before it was learnt, in
            scaled variables.
        prior_angle: The same of the prior.
    """

    accepted: bool
    reason: str
    angle_before: float
    prior_angle: float


class OnlineSurface:
    """A limit surface that pushes change one by one.

    Example:
        >>> import numpy as np
        >>> from limit_surface_ros.surface import PointContacts
        >>> from limit_surface_ros.surface.scaling import Scaling
        >>> body = PointContacts([[-0.1, 0.0], [0.1, 0.0]], [1.0, 1.0], Scaling(0.1, 2.0))
        >>> online = OnlineSurface(Dissipation(np.eye(3)[None], Scaling(0.1, 2.0)))
        >>> wrench = np.array([0.5, 1.0, 0.05])
        >>> online.add(wrench, body.twist_of_wrench(wrench)).accepted
        True
    """

    def __init__(
        self, prior: LimitSurface, window: int = 50, forgetting: float | str = 1.0
    ) -> None:
        """Begin with a prior, which is what is predicted until pushes say otherwise.

        Args:
            prior: Its scaling is that of what is learnt: a length of about the body's size and a
                friction force of the right order.
            window: How many pushes are kept.
            forgetting: Weight of a push relative to the next; or "blend", two windows, of which
                one forgets, blended by how well each predicts; the other begins anew where that
                one has predicted better for some time.

        Raises:
            RangeError: The window is shorter than two pushes, or the forgetting out of (0, 1].
        """
        window = as_count("window", window, 2)
        if isinstance(forgetting, str) and forgetting == "blend":
            rates = [1.0, _YOUNGER]
        else:
            rates = [as_number("forgetting", forgetting)]
            if not 0.0 < rates[0] <= 1.0:
                raise RangeError(
                    f'forgetting must be above 0 and at most 1, or "blend", got {forgetting}'
                )
        self._prior = prior
        self._scaling = prior.scaling
        self._window = window
        self._windows = [Window(prior, window, rate) for rate in rates]
        self._wrenches = np.empty((0, 3))
        self._twists = np.empty((0, 3))
        self._losses = np.zeros(1 + len(rates))
        # Evidence for the younger window, and of how many pushes it is.
        self._lead, self._led = 0.0, 0
        self.count = 0
        self.refused: dict[str, int] = {}

    @property
    def prior(self) -> LimitSurface:
        """What was predicted before there were pushes."""
        return self._prior

    def add(self, wrench: ArrayLike, twist: ArrayLike) -> Update:
        """Compare a push with what is predicted, and then learn it.

        Args:
            wrench: (fx, fy, tau_z) [N, N, N m], shape (3,).
            twist: (vx, vy, omega_z) [m/s, m/s, rad/s] that it caused, shape (3,); only its
                direction counts.

        Raises:
            ShapeError: One of them is no vector of three numbers.
            NotFiniteError: A component is NaN or infinite.
            ZeroVectorError: One of them is zero.
        """
        pair = Pairs(
            as_directions("wrench", as_vector("wrench", wrench))[np.newaxis],
            as_directions("twist", as_vector("twist", twist))[np.newaxis],
        )
        load = pair.wrenches[0] / self._scaling.wrench_unit
        motion = pair.twists[0] / self._scaling.twist_unit
        motion = motion / np.linalg.norm(motion)
        predicted = self._predictions(load)
        prior_angle = _angle(predicted[0], motion)
        weights = self._weights()
        blend = _blended(predicted, weights)
        angle = _angle(blend, motion)
        if not float(load @ motion) > 0.0:
            reason = "its power is not positive"
            self.refused[reason] = self.refused.get(reason, 0) + 1
            return Update(False, reason, angle, prior_angle)
        cosines = np.array([float(each @ motion) for each in predicted])
        losses = _surprises(cosines)
        self._losses = _DISCOUNT * self._losses + losses
        self.count += 1
        self._wrenches = np.vstack([self._wrenches, pair.wrenches])[-self._window :]
        self._twists = np.vstack([self._twists, pair.twists])[-self._window :]
        for window in self._windows:
            window.learn(load, motion, self.count)
        if len(self._windows) > 1:
            self._look_for_a_change(float(losses[1] - losses[2]))
        return Update(True, "", angle, prior_angle)

    def surface(self, terms: int = 8) -> LimitSurface:
        """Return what is predicted now: the prior before the first push, else a dissipation model.

        Args:
            terms: That sum up the contacts of a window.
        """
        return self._mixture().surface(terms) if self.count else self._prior

    def surface_and_scatter(self, terms: int = 8) -> tuple[LimitSurface, TwistScatter | None]:
        """Return `surface`, and how far pushes scatter about its twists, as `--auto` has it.

        The folds of the jackknife are what one step makes of the contacts without a fifth of the
        pushes each; None before there are six pushes.
        """
        if self.count < FEWEST_PAIRS:
            return self.surface(terms), None
        mixture = self._mixture()
        surface = mixture.surface(terms)
        kept = len(self._wrenches)
        # By when they came: which fold a push is in does not change with those that come.
        numbers = np.arange(self.count - kept, self.count) % _FOLDS
        parts = [np.flatnonzero(numbers == fold) for fold in range(_FOLDS)]
        folds = mixture.folds(terms, [part - kept for part in parts])
        pairs = self.pairs()
        held_out = [pairs.take(part) for part in parts]
        return surface, calibrate(surface, folds, held_out).scatter

    def pairs(self) -> Pairs:
        """Return the pushes of the window, the oldest first.

        Raises:
            DataError: There are none yet.
        """
        if not len(self._wrenches):
            raise DataError("nothing has been learnt yet")
        return Pairs(self._wrenches, self._twists)

    def state(self) -> dict[str, Any]:
        """Return plain values from which `restored` goes on."""
        return {
            "version": _VERSION,
            "pushes": [
                [float(f"{entry:.9g}") for entry in row]
                for row in np.hstack([self._wrenches, self._twists])
            ],
        }

    @classmethod
    def restored(
        cls,
        state: Mapping[str, Any],
        prior: LimitSurface,
        window: int = 50,
        forgetting: float | str = 1.0,
    ) -> OnlineSurface:
        """Return what has learnt the pushes of a `state` again, in their order.

        Raises:
            DataError: The state is of another version or form.
        """
        online = cls(prior, window, forgetting)
        pairs = pushes_of_state(state)
        for wrench, twist in zip(pairs.wrenches, pairs.twists, strict=True):
            online.add(wrench, twist)
        return online

    def _mixture(self) -> _Mixture:
        """Return what is mixed now, with its weights."""
        weights = self._weights()
        known: list[tuple[float, LimitSurface]] = []
        prior = self._prior_terms()
        if weights[0] > _NEGLIGIBLE and prior is not None:
            known.append((float(weights[0]), prior))
        windows = [
            (weight, window)
            for weight, window in zip(weights[1:].tolist(), self._windows, strict=True)
            if weight > _NEGLIGIBLE
        ]
        if not known and not windows:
            windows = [(1.0, self._windows[0])]
        share = self._ellipsoid_share()
        ellipsoid = self._ellipsoid() if share > 0.0 else None
        if ellipsoid is not None:
            total = sum(weight for weight, _ in (*known, *windows))
            known.append((total * share / (1.0 - share), ellipsoid))
        return _Mixture(known, windows)

    def _look_for_a_change(self, evidence: float) -> None:
        """Let the window that keeps all forget what was before a change.

        Page's test (1954, doi:10.1093/biomet/41.1-2.100): evidence for the younger window is
        summed up, from nothing again wherever the sum falls below it.

        Args:
            evidence: Of the last push, the difference of logarithms of densities.
        """
        self._lead += evidence
        self._led += 1
        if self._lead <= 0.0:
            self._lead, self._led = 0.0, 0
        elif self._lead > _LEAD and self._led >= _FEWEST_YOUNGER:
            self._windows[0].begin_anew(self._windows[1], self._led)
            self._wrenches, self._twists = self._wrenches[-self._led :], self._twists[-self._led :]
            self._losses[1] = self._losses[2]
            self._lead, self._led = 0.0, 0

    def _weights(self) -> Floats:
        """Return how much each model counts: the prior, and the windows."""
        if not self.count:
            return np.asarray(np.eye(len(self._losses))[0])
        losses = self._losses * np.array([_DISTRUST] + [1.0] * len(self._windows))
        weights = np.exp(losses.min() - losses)
        if self._prior_terms() is None:
            weights[0] = 0.0
            if not weights.any():
                weights[1:] = 1.0
        return np.asarray(weights / weights.sum())

    def _predictions(self, load: Floats) -> list[Floats]:
        """Return the unit scaled motions that the prior and the windows predict of a load."""
        twist = self._prior.twist_of_wrench(load * self._scaling.wrench_unit)
        prior = np.asarray(twist) / self._scaling.twist_unit
        if not self.count:
            return [prior] * len(self._losses)
        return [prior, *(window.motion(load) for window in self._windows)]

    def _prior_terms(self) -> Dissipation | None:
        """Return the prior as a dissipation model of few terms, None where it is none."""
        forms = self._prior.scaled_forms
        if forms is None:
            try:
                forms = as_dissipation(self._prior)
            except DataError:
                return None
        if len(forms) > _MOST_PRIOR_TERMS:
            return None
        return Dissipation(forms, self._scaling)

    def _ellipsoid_share(self) -> float:
        way = (self.count - _ELLIPSOID_UNTIL) / (_ELLIPSOID_GONE - _ELLIPSOID_UNTIL)
        return _ELLIPSOID_SHARE * min(1.0, max(0.0, 1.0 - way))

    def _ellipsoid(self) -> LimitSurface | None:
        try:
            return FitContext(self.pairs(), self._scaling).fit(ELLIPSOID)[0]
        except LimitSurfaceError:
            # Too few pushes, or all of one kind: there is none yet.
            return None


def pushes_of_state(state: Mapping[str, Any]) -> Pairs:
    """Return the pushes that `OnlineSurface.state` holds, the oldest first.

    Raises:
        DataError: The state is of another version or form.
    """
    try:
        if state["version"] != _VERSION:
            raise DataError(f"the state has version {state['version']}, read is {_VERSION}")
        rows = as_floats("pushes", state["pushes"]).reshape(-1, 6)
        return Pairs(rows[:, :3], rows[:, 3:])
    except DataError:
        raise
    except (KeyError, TypeError, ValueError) as error:
        raise DataError(f"this is no state of a learnt surface: {error}") from None


@dataclass(frozen=True)
class _Mixture:
    """What is mixed into the surface that is served.

    Attributes:
        known: Surfaces that are in it as they are, with their weights.
        windows: Those of which a few terms are in it, with their weights.
    """

    known: list[tuple[float, LimitSurface]]
    windows: list[tuple[float, Window]]

    def surface(self, terms: int) -> Dissipation:
        """Return the mixture with the windows summed up in so many terms each."""
        return self._mixed(window.surface(terms) for _, window in self.windows)

    def folds(self, terms: int, folds: Sequence[Places]) -> list[Dissipation]:
        """Return the mixtures that do not know some of the pushes; see `Window.folds`."""
        if not self.windows:
            return [self._mixed(())] * len(folds)
        of_windows = [window.folds(terms, folds) for _, window in self.windows]
        return [self._mixed(each) for each in zip(*of_windows, strict=True)]

    def _mixed(self, surfaces: Iterable[LimitSurface]) -> Dissipation:
        weights = [weight for weight, _ in self.windows]
        parts = [*self.known, *zip(weights, surfaces, strict=True)]
        total = sum(weight for weight, _ in parts)
        return mixed((weight / total, surface) for weight, surface in parts)


def _surprises(cosines: Floats) -> Floats:
    """Return negative logarithms of the density of motions, but for a constant, shape (n,).

    Errors follow the t distribution of `dissipation_scatter`, of which an outlier costs little.

    Args:
        cosines: Of the angles between predicted and measured motions.
    """
    squares = np.maximum(2.0 - 2.0 * cosines, 0.0) / _ERROR**2
    return np.asarray((0.5 * FREEDOM + 1.0) * np.log1p(squares / FREEDOM))


def _blended(predictions: list[Floats], weights: Floats) -> Floats:
    total = sum(weight * each for weight, each in zip(weights.tolist(), predictions, strict=True))
    return np.asarray(total / np.linalg.norm(total))


def _angle(first: Floats, second: Floats) -> float:
    return float(2.0 * np.arcsin(min(0.5 * float(np.linalg.norm(first - second)), 1.0)))
