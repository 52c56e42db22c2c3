# SPDX-License-Identifier: Apache-2.0
"""The method of Dormand and Prince of order 8 for one autonomous differential equation.

Step control is by embedded methods of orders 5 and 3 against an absolute error scale. The
coefficients are those of E. Hairer, S. P. Norsett and G. Wanner, "Solving Ordinary Differential
Equations I", 2nd edition, section II.5, 1993, doi:10.1007/978-3-540-78862-1. This module needs
numpy alone: importing scipy.integrate costs a node most of a second.
"""

from __future__ import annotations

from math import sqrt
from typing import TYPE_CHECKING

import numpy as np

from limit_surface_ros.errors import SolverError

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from typing import TypeAlias

    from limit_surface_ros.checks import Floats

    Slope: TypeAlias = Callable[[Sequence[float]], Sequence[float]]

STAGES = 12

# fmt: off
# What each stage but the first takes of the slopes before it.
COEFFICIENTS: tuple[tuple[float, ...], ...] = (
    (0.05260015195876773,),
    (0.0197250569845379, 0.0591751709536137),
    (0.02958758547680685, 0.0, 0.08876275643042054),
    (0.2413651341592667, 0.0, -0.8845494793282861, 0.924834003261792),
    (0.037037037037037035, 0.0, 0.0, 0.17082860872947386, 0.12546768756682242),
    (0.037109375, 0.0, 0.0, 0.17025221101954405, 0.06021653898045596, -0.017578125),
    (0.03709200011850479, 0.0, 0.0, 0.17038392571223998, 0.10726203044637328,
     -0.015319437748624402, 0.008273789163814023),
    (0.6241109587160757, 0.0, 0.0, -3.3608926294469414, -0.868219346841726, 27.59209969944671,
     20.154067550477894, -43.48988418106996),
    (0.47766253643826434, 0.0, 0.0, -2.4881146199716677, -0.590290826836843, 21.230051448181193,
     15.279233632882423, -33.28821096898486, -0.020331201708508627),
    (-0.9371424300859873, 0.0, 0.0, 5.186372428844064, 1.0914373489967295, -8.149787010746927,
     -18.52006565999696, 22.739487099350505, 2.4936055526796523, -3.0467644718982196),
    (2.273310147516538, 0.0, 0.0, -10.53449546673725, -2.0008720582248625, -17.9589318631188,
     27.94888452941996, -2.8589982771350235, -8.87285693353063, 12.360567175794303,
     0.6433927460157636),
)
# What a step takes of them.
WEIGHTS: Floats = np.array([
    0.054293734116568765, 0.0, 0.0, 0.0, 0.0, 4.450312892752409, 1.8915178993145003,
    -5.801203960010585, 0.3111643669578199, -0.1521609496625161, 0.20136540080403034,
    0.04471061572777259,
])
# The difference to the embedded method of order 5, and to that of order 3.
ERROR_5: Floats = np.array([
    0.01312004499419488, 0.0, 0.0, 0.0, 0.0, -1.2251564463762044, -0.4957589496572502,
    1.6643771824549864, -0.35032884874997366, 0.3341791187130175, 0.08192320648511571,
    -0.022355307863886294,
])

ERROR_3: Floats = np.array([
    -0.18980075407240762, 0.0, 0.0, 0.0, 0.0, 4.450312892752409, 1.8915178993145003,
    -5.801203960010585, -0.4226823213237919, -0.1521609496625161, 0.20136540080403034,
    0.02265179219836082,
])
# fmt: on

_SAFETY, _ORDER = 0.9, 8.0
_SHRINK, _GROW = 0.2, 8.0
# Step times Lipschitz constant beyond which the method is no longer stable (Hairer and Wanner,
# "Solving Ordinary Differential Equations II", section IV.2), and how many steps in a row are
# taken for stiffness.
_UNSTABLE, _STIFF_STEPS = 6.1, 100
_ROWS = tuple(np.array(row) for row in COEFFICIENTS)
_ERRORS = np.array([ERROR_5, ERROR_3])


class DormandPrince:
    """Steps along a solution of y' = f(y).

    Attributes:
        y: Where the solution is, a list of floats.
        slope: f there.
        before: Where the last step began.
        width: Of the last step.
        stiff: Whether stability and not accuracy has held the last steps back.
        evaluations: How often f was called.
    """

    def __init__(
        self, function: Slope, y: Sequence[float], scale: Sequence[float], width: float = 0.1
    ) -> None:
        """Begin at a place.

        Args:
            function: f of a list of floats, as many floats.
            y: Where to begin.
            scale: Error of each component that one step may make.
            width: Of the first step.
        """
        self._function = function
        self._inverse_scale = 1.0 / np.asarray(scale)
        self.y = list(y)
        self.slope = function(self.y)
        self.before, self._slope_before = self.y, self.slope
        self.width = 0.0
        self.evaluations = 1
        self._next = width
        self._stages = np.empty((STAGES, len(self.y)))
        self._unstable_steps = 0

    @property
    def stiff(self) -> bool:
        """Whether stability and not accuracy has held the last steps back."""
        return self._unstable_steps >= _STIFF_STEPS

    def step(self) -> None:
        """Advance by one step whose error is within the scale.

        Raises:
            SolverError: No step is small enough.
        """
        start = np.array(self.y)
        stages = self._stages
        stages[0] = self.slope
        width, shrunk = self._next, False
        while True:
            end, last = self._advance(start, width)
            five, three = (_ERRORS @ stages) * self._inverse_scale
            square = float(five @ five)
            error = (
                width * square / sqrt((square + 0.01 * float(three @ three)) * len(five))
                if square
                else 0.0
            )
            if error <= 1.0:
                break
            if not width > 1e-14:
                raise SolverError("the step of the integration of a slide has become too small")
            shrunk = True
            width *= max(_SHRINK, _SAFETY * error ** (-1.0 / _ORDER)) if error < 1e300 else _SHRINK
        grow = min(_GROW, _SAFETY * error ** (-1.0 / _ORDER)) if error else _GROW
        self._next = width * (min(1.0, grow) if shrunk else grow)
        self._accept(end, width)
        # The last two stages are at one time: their difference tells the Lipschitz constant.
        run = (end - last) * self._inverse_scale
        square = float(run @ run)
        if square > 0.0:
            rise = (np.array(self.slope) - stages[-1]) * self._inverse_scale
            fast = width * sqrt(float(rise @ rise) / square) > _UNSTABLE
            self._unstable_steps = self._unstable_steps + 1 if fast else 0

    def redo(self, width: float) -> None:
        """Repeat the last step with a width between 0 and its own, without error control."""
        self._stages[0] = self._slope_before
        end, _ = self._advance(np.array(self.before), width)
        self.y, self.slope = self.before, self._slope_before
        self._accept(end, width)

    def _accept(self, end: Floats, width: float) -> None:
        self.before, self._slope_before = self.y, self.slope
        self.y = end.tolist()
        self.slope = self._function(self.y)
        self.evaluations += STAGES
        self.width = width

    def _advance(self, start: Floats, width: float) -> tuple[Floats, Floats]:
        """Return where a step leads, and the place of its last stage."""
        stages, function = self._stages, self._function
        place = start
        for count, row in enumerate(_ROWS, 1):
            place = start + width * (row @ stages[:count])
            stages[count] = function(place.tolist())
        return start + width * (WEIGHTS @ stages), place
