# SPDX-License-Identifier: Apache-2.0
"""Derivatives of the maps: what they cost beside the maps alone, and how far JAX's are from them.

`twist_jacobian` and `wrench_jacobian` return map and Jacobian together, and that is what counts.
Times are processor times of the calling thread, ratios medians of turns. JAX differentiates the
definitions of the kinds, written down in `test/jax_maps.py`; smooth models of the tests.
"""

from __future__ import annotations

import sys
import time
from functools import partial
from pathlib import Path

import numpy as np
from bench_maps import kinds
from interleaved import interleaved

TESTS = Path(__file__).resolve().parents[1] / "test"
ROWS = 10_000
GOAL, ACCURATE = 3.0, 1e-12
WAYS = {"twist": ("twist_of_wrench", "twist_jacobian")}
WAYS["wrench"] = ("wrench_of_twist", "wrench_jacobian")


def costs() -> None:
    """Time of map and Jacobian together, in parts of that of the map."""
    print(f"### Map and Jacobian, times the map alone (goal: at most {GOAL:g})\n")
    print(f"In brackets the map's time: batches of {ROWS:.0e} [ns a vector], alone [us].\n")
    print(f"| kind | twist, {ROWS:.0e} | wrench, {ROWS:.0e} | twist, alone | wrench, alone |")
    print("|---|---|---|---|---|")
    rows = np.random.default_rng(0).standard_normal((ROWS, 3)) * [1.0, 1.0, 0.1]
    for name, surface in kinds().items():
        surface.prepare()
        cells = []
        for given, unit in ((rows, 1e9 / ROWS), (rows[0].copy(), 1e6)):
            for plain, both in WAYS.values():
                ways = {way: partial(getattr(surface, way), given) for way in (plain, both)}
                times = interleaved(ways, 21, 0.005, time.thread_time)
                ratio = times[both] / times[plain]
                missed = " missed" if ratio > GOAL else ""
                cells.append(f"{ratio:.2f}{missed} ({unit * times[plain]:.3g})")
        print(f"| {name} | {' | '.join(cells)} |", flush=True)
    print()


def accuracy() -> None:
    """Largest errors beside JAX's automatic derivatives, on 2000 draws."""
    print(f"### Largest error beside JAX, in parts of each Jacobian (goal: {ACCURATE:g})\n")
    sys.path.insert(0, str(TESTS))
    try:
        import jax  # noqa: F401, what the test needs
    except ImportError:
        print("skipped: JAX is not installed (requirements/exports.txt)")
        return
    from export.test_derivatives_are_those_of_jax import SMOOTH, errors

    print("| model | twist by wrench | wrench by twist | K | K times its inverse, less one |")
    print("|---|---|---|---|---|")
    for name in SMOOTH:
        cells = [f"{error:.0e}" for error in errors(name)]
        print(f"| {name} | {' | '.join(cells)} |", flush=True)


def main() -> int:
    """Print the tables."""
    print(__doc__)
    costs()
    accuracy()
    return 0


if __name__ == "__main__":
    sys.exit(main())
