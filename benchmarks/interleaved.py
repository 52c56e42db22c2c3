# SPDX-License-Identifier: Apache-2.0
"""Times of several ways to do one thing, measured in turns so that they share what disturbs."""

from __future__ import annotations

import gc
import time
from statistics import median
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping


def interleaved(
    ways: Mapping[str, Callable[[], object]],
    rounds: int = 7,
    least: float = 0.02,
    clock: Callable[[], float] = time.perf_counter,
) -> dict[str, float]:
    """Return the median time [s] of one call of each way.

    Args:
        ways: What to call, by name.
        rounds: Turns that each way gets after a first that does not count.
        least: How long a turn lasts at least [s]; short calls are repeated within it.
        clock: `time.thread_time` leaves out what other programs take.
    """
    repeats = {}
    for name, call in ways.items():
        call()
        begin = clock()
        call()
        repeats[name] = 1 + int(least / max(clock() - begin, 1e-7))
    times: dict[str, list[float]] = {name: [] for name in ways}
    collects = gc.isenabled()
    gc.disable()
    try:
        for _ in range(rounds):
            for name, call in ways.items():
                begin = clock()
                for _ in range(repeats[name]):
                    call()
                times[name].append((clock() - begin) / repeats[name])
    finally:
        if collects:
            gc.enable()
    return {name: median(values) for name, values in times.items()}
