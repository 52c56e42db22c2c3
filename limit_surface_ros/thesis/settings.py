# SPDX-License-Identifier: Apache-2.0
"""How much work goes into the figures."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Settings:
    """Sizes of the studies; the defaults are the thesis's own where it gives them.

    Attributes:
        samples: Points on [0, 6] at which responses are sampled; also half as many (Fig. 2.2).
        roots: Characteristic roots taken from each delay system, of the upper half plane.
        decay_terms: Numbers of real terms at which sums of exponentials are compared.
        motions: Random motions that surfaces are fitted to.
        per_facet: Loads on each facet that join them.
        tests: Fresh random motions that the fits are tested on.
        directions: Directions of load at which errors of force are measured.
        starts: Random starts of each fit of a surface at most.
        noise: Standard deviation of the noise on loads and motions, in scaled variables.
        seed: Of all that is random.
    """

    samples: int = 2000
    roots: int = 62
    decay_terms: tuple[int, ...] = (5, 9, 15, 31, 61)
    motions: int = 2000
    per_facet: int = 150
    tests: int = 2000
    directions: int = 1000
    starts: int = 8
    noise: float = 0.05
    seed: int = 1


FULL = Settings()
# For a look in under a minute: smaller fits; chapter 2 is quick enough to be done in full.
QUICK = Settings(
    decay_terms=(5, 9, 15),
    motions=300,
    per_facet=20,
    tests=400,
    directions=300,
    starts=6,
)
