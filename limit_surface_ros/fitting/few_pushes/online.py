# SPDX-License-Identifier: Apache-2.0
"""A surface that is learnt while the robot pushes: a short window of pairs, fitted as it moves.

Which of several models predicts next is decided by what each predicted before (prequential; Dawid
1984, doi:10.2307/2981683): the prior, the window, and with forgetting a window of younger pushes.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from limit_surface_ros.checks import as_directions, as_floats
from limit_surface_ros.errors import DataError, LimitSurfaceError, RangeError
from limit_surface_ros.fitting.few_pushes.mixture import ELLIPSOID, as_dissipation, mixed
from limit_surface_ros.fitting.few_pushes.recipe import ROBUST_SCALE, FitContext
from limit_surface_ros.fitting.few_pushes.window import Window
from limit_surface_ros.fitting.motion_cost import direction_loss
from limit_surface_ros.surface.kinds.dissipation import Dissipation
from limit_surface_ros.surface.pairs import Pairs

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import ArrayLike

    from limit_surface_ros.checks import Floats
    from limit_surface_ros.surface.base import LimitSurface

# Share of the window's ellipsoid up to so many pushes, and pushes from which on it has none.
_ELLIPSOID_SHARE, _ELLIPSOID_UNTIL, _ELLIPSOID_GONE = 0.3, 10, 25
# How much larger the prior's losses count: a little, so that a wrong one is left soon, for a right
# one is hard to tell from luck with the first few pushes.
_DISTRUST = 1.25
# What a past loss counts with every push, how sharply losses are told apart, and the weight below
# which a model is left out.
_DISCOUNT, _SHARPNESS, _NEGLIGIBLE = 0.9, 24.0, 0.02
# Forgetting of the younger window where two are blended.
_YOUNGER = 0.87
# Terms of a prior beyond which it is not mixed into the surface that is served.
_MOST_PRIOR_TERMS = 16
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
                one forgets, blended by how well each predicts.

        Raises:
            RangeError: The window is shorter than two pushes, or the forgetting out of (0, 1].
        """
        if window < 2:
            raise RangeError(f"window must be at least 2 pushes, got {window}")
        if forgetting == "blend":
            rates = [1.0, _YOUNGER]
        else:
            rates = [float(as_floats("forgetting", forgetting))]
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
            as_directions("wrench", wrench).reshape(1, 3),
            as_directions("twist", twist).reshape(1, 3),
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
        losses = 2.0 * direction_loss(np.minimum(cosines, 1.0), ROBUST_SCALE)[0]
        self._losses = _DISCOUNT * self._losses + losses
        self.count += 1
        self._wrenches = np.vstack([self._wrenches, pair.wrenches])[-self._window :]
        self._twists = np.vstack([self._twists, pair.twists])[-self._window :]
        for window in self._windows:
            window.learn(load, motion, self.count)
        return Update(True, "", angle, prior_angle)

    def surface(self, terms: int = 8) -> LimitSurface:
        """Return what is predicted now: the prior before the first push, else a dissipation model.

        Args:
            terms: That sum up the contacts of a window.
        """
        if not self.count:
            return self._prior
        weights = self._weights()
        parts: list[tuple[float, LimitSurface]] = []
        prior = self._prior_terms()
        if weights[0] > _NEGLIGIBLE and prior is not None:
            parts.append((float(weights[0]), prior))
        for weight, window in zip(weights[1:].tolist(), self._windows, strict=True):
            if weight > _NEGLIGIBLE:
                parts.append((weight, window.surface(terms)))
        if not parts:
            parts = [(1.0, self._windows[0].surface(terms))]
        share = self._ellipsoid_share()
        ellipsoid = self._ellipsoid() if share > 0.0 else None
        total = sum(weight for weight, _ in parts) / (1.0 - share if ellipsoid else 1.0)
        parts = [(weight / total, surface) for weight, surface in parts]
        if ellipsoid is not None:
            parts.append((share, ellipsoid))
        return mixed(parts)

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
        try:
            if state["version"] != _VERSION:
                raise DataError(f"the state has version {state['version']}, read is {_VERSION}")
            rows = as_floats("pushes", state["pushes"]).reshape(-1, 6)
            for row in rows:
                online.add(row[:3], row[3:])
        except (KeyError, TypeError, ValueError) as error:
            raise DataError(f"this is no state of a learnt surface: {error}") from None
        return online

    def _weights(self) -> Floats:
        """Return how much each model counts: the prior, and the windows."""
        if not self.count:
            return np.asarray(np.eye(len(self._losses))[0])
        losses = self._losses * np.array([_DISTRUST] + [1.0] * len(self._windows))
        weights = np.exp(-_SHARPNESS * (losses - losses.min()))
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


def _blended(predictions: list[Floats], weights: Floats) -> Floats:
    total = sum(weight * each for weight, each in zip(weights.tolist(), predictions, strict=True))
    return np.asarray(total / np.linalg.norm(total))


def _angle(first: Floats, second: Floats) -> float:
    return float(2.0 * np.arcsin(min(0.5 * float(np.linalg.norm(first - second)), 1.0)))
