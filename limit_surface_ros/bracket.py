# SPDX-License-Identifier: Apache-2.0
"""The root of a rising function of one number, by secants and halves."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable

# Every so many steps the bracket is halved, unless the value has fallen to this part of itself.
_STEPS = 4
_PART = 0.5


def root_bracket(
    function: Callable[[float], float],
    low: float,
    high: float,
    width: float,
    exact: float = 0.0,
    straight: float = 0.0,
) -> tuple[float, float]:
    """Return a narrow bracket of the place where a function that never falls changes its sign.

    The method of Anderson and Bjoerck (1973, doi:10.1007/BF01951936) with halves in between, so
    that jumps and flat parts are met as well.

    Args:
        function: Not above 0 at `low`, not below 0 at `high`.
        low: Lower end.
        high: Upper end.
        width: Of a bracket that is narrow enough; 0 for the next number.
        exact: Size of a value that counts as 0.
        straight: If -f(low) f(high) is at most this, stop: the function is straight enough
            between both ends to be interpolated there.

    Returns:
        Both ends; the same place twice if a value there counts as 0.
    """
    below, above = at_low, at_high = function(low), function(high)
    step, side, before, slow = 0, 0.0, float("inf"), False
    while high - low > width and not (straight and -at_low * at_high <= straight):
        secant = not slow and below < 0.0 < above
        place = low + (below / (below - above) if secant else 0.5) * (high - low)
        if not low < place < high:
            place = 0.5 * (low + high)
            if not low < place < high:
                break
        value = function(place)
        if abs(value) <= exact:
            return place, place
        # An end that stays for a second time counts less, so that the next secant moves it.
        if value < 0.0:
            if side < 0.0:
                above *= _weight(value / below)
            low, below, at_low = place, value, value
        else:
            if side > 0.0:
                below *= _weight(value / above)
            high, above, at_high = place, value, value
        side = value
        step += 1
        slow = False
        if step % _STEPS == 0:
            slow, before = abs(value) > _PART * before, abs(value)
    return low, high


def _weight(fallen: float) -> float:
    """Return the weight of the end that stays, as the value at the other fell by this factor.

    With it the next secant meets the parabola through the last three places.
    """
    return 1.0 - fallen if fallen < 1.0 else 0.5
