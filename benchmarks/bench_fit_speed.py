"""How fast a surface is fitted: gradients by matrix calculus against finite differences.

The work: three terms, J2, 2900 pairs of three support points (thesis 3.4). The peer is scipy's
BFGS with finite differences on the very same cost function, from the same starts; start by start,
ours and the peer take turns.
"""

from __future__ import annotations

import os

for _variable in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS"):
    os.environ.setdefault(_variable, "1")

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import time

import numpy as np
from scipy.optimize import minimize

from limit_surface_ros.fitting.multi_start import Search, descend, process_pool
from limit_surface_ros.fitting.power_sum import fit_power_sum
from limit_surface_ros.fitting.power_sum_objective import PowerSumObjective
from limit_surface_ros.fitting.scaled_pairs import scale_pairs
from limit_surface_ros.fitting.simulation import simulated_pairs
from limit_surface_ros.surface.point_contacts import PointContacts
from limit_surface_ros.surface.power_sum import thesis_exponents
from limit_surface_ros.surface.scaling import Scaling

SCALING = Scaling(0.15, 1.0)
TRIANGLE = PointContacts(
    np.array([[-0.04, -0.04], [-0.04, 0.08], [0.08, -0.04]]), np.full(3, 0.5), SCALING
)
STARTS = 8


def main() -> int:
    """Print the table."""
    pairs = simulated_pairs(TRIANGLE)
    scaled = scale_pairs(pairs, SCALING)
    objective = PowerSumObjective(scaled, thesis_exponents(3), 1.0)
    rows = []
    for index in range(STARTS):
        start = objective.start(np.random.default_rng([0, index]))
        begin = time.perf_counter()
        ours = descend(objective, start)
        middle = time.perf_counter()
        peer = minimize(objective.cost, start, method="BFGS")
        end = time.perf_counter()
        rows.append((middle - begin, ours.cost, end - middle, float(peer.fun)))
    mine, costs, theirs, peer_costs = (np.array(column) for column in zip(*rows, strict=True))
    print("### One start: three terms, J2, 2900 pairs\n")
    print("| start | ours [ms] | cost | BFGS, finite differences [ms] | cost | ratio |")
    print("|---|---|---|---|---|---|")
    for index in range(STARTS):
        print(
            f"| {index} | {1e3 * mine[index]:.1f} | {costs[index]:.4f} | "
            f"{1e3 * theirs[index]:.0f} | {peer_costs[index]:.4f} | "
            f"{theirs[index] / mine[index]:.1f} |"
        )
    print(
        f"| all | {1e3 * mine.sum():.0f} | | {1e3 * theirs.sum():.0f} | | "
        f"{theirs.sum() / mine.sum():.1f} (goal 20) |"
    )
    print(f"\n### The whole fit of {STARTS} starts, none left out\n")
    print("| workers | seconds (goal 2.0 on 2) | cost |\n|---|---|---|")
    for workers in (1, 2):
        begin = time.perf_counter()
        with process_pool(workers) as executor:
            search = Search(STARTS, executor=executor, stop_early=False)
            result = fit_power_sum(pairs, thesis_exponents(3), scaling=SCALING, search=search)
        print(f"| {workers} | {time.perf_counter() - begin:.2f} | {result.cost:.4f} |")
    return 0


if __name__ == "__main__":
    sys.exit(main())
