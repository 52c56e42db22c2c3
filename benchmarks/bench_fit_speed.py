# SPDX-License-Identifier: Apache-2.0
"""How fast a surface is fitted: against finite differences, least squares and an SDP; and scale.

The work: three terms, J2, 2900 pairs of three support points (thesis 3.4). The peers get the very
same cost, or its residuals, from the same starts; start by start, ours and the peers take turns.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from statistics import median

import numpy as np
from scipy.optimize import least_squares, minimize

from limit_surface_ros.errors import MissingExtraError
from limit_surface_ros.fitting.dissipation import fit_dissipation
from limit_surface_ros.fitting.factors import factors_of, matrices_of
from limit_surface_ros.fitting.pairs import ScaledPairs, scale_pairs
from limit_surface_ros.fitting.polynomial import fit_polynomial
from limit_surface_ros.fitting.power_sum import PowerSumObjective, fit_power_sum
from limit_surface_ros.fitting.result import FitResult
from limit_surface_ros.fitting.search import Search, descend, process_pool
from limit_surface_ros.fitting.simulation import simulated_pairs
from limit_surface_ros.surface.kinds.point_contacts import PointContacts
from limit_surface_ros.surface.kinds.power_sum import thesis_exponents
from limit_surface_ros.surface.measures import quantiles, velocity_error
from limit_surface_ros.surface.pairs import Pairs
from limit_surface_ros.surface.sampling import random_motions
from limit_surface_ros.surface.scaling import Scaling

SCALING = Scaling(0.15, 1.0)
TRIANGLE = PointContacts(
    np.array([[-0.04, -0.04], [-0.04, 0.08], [0.08, -0.04]]), np.full(3, 0.5), SCALING
)
TERMS = 3
STARTS = 8
# least_squares goes on for hundreds of steps where it is let.
LEAST_SQUARES_STARTS = 4
LEAST_SQUARES_STEPS = 200


def residuals_of(scaled: ScaledPairs, exponents: np.ndarray) -> Callable[..., np.ndarray]:
    """Return the residuals whose squares make up J2: H - 1, and the motion's three components."""
    loads, motions = scaled.wrenches.T, scaled.directions.T

    def residuals(parameters: np.ndarray) -> np.ndarray:
        products = matrices_of(factors_of(parameters)) @ loads
        forms = np.maximum(np.einsum("mcn,cn->mn", products, loads), 1e-100)
        values = forms ** exponents[:, None]
        slopes = exponents[:, None] * values / forms
        normals = np.einsum("mn,mcn->cn", slopes, products)
        off = motions - normals / np.linalg.norm(normals, axis=0)
        return np.concatenate([values.sum(axis=0) - 1.0, off.ravel()])

    return residuals


def one_start_against_finite_differences(
    objective: PowerSumObjective, scaled: ScaledPairs
) -> None:
    """Print the time of each start, ours and that of BFGS with finite differences.

    The peer gets the cost twice: as anybody would write it in numpy, and as our own fit computes
    it, so that nothing but the gradient and the way down make the difference.
    """
    residuals = residuals_of(scaled, thesis_exponents(TERMS))

    def plain(parameters: np.ndarray) -> float:
        return float(np.sum(residuals(parameters) ** 2))

    rows = []
    for index in range(STARTS):
        start = objective.start(np.random.default_rng([0, index]))
        marks = [time.perf_counter()]
        ours = descend(objective, start)
        marks.append(time.perf_counter())
        peers = []
        for cost in (plain, objective.cost):
            peers.append(minimize(cost, start, method="BFGS"))
            marks.append(time.perf_counter())
        rows.append((*np.diff(marks), ours.cost, *(float(peer.fun) for peer in peers)))
    mine, written, fast, *costs = np.array(rows).T
    print("### One start: three terms, J2, 2900 pairs\n")
    print(
        "| start | ours [ms] | cost | BFGS, finite differences, plain numpy [ms] | cost | ratio "
        "| the same on our fast cost [ms] | cost | ratio |"
    )
    print("|---|---|---|---|---|---|---|---|---|")
    for index in range(STARTS):
        own, first, second = (each[index] for each in costs)
        print(
            f"| {index} | {1e3 * mine[index]:.1f} | {own:.4f} "
            f"| {1e3 * written[index]:.0f} | {first:.4f} | {written[index] / mine[index]:.1f} "
            f"| {1e3 * fast[index]:.0f} | {second:.4f} | {fast[index] / mine[index]:.1f} |"
        )
    print(
        f"| all | {1e3 * mine.sum():.0f} | | {1e3 * written.sum():.0f} | "
        f"| {written.sum() / mine.sum():.1f} (goal 20) | {1e3 * fast.sum():.0f} | "
        f"| {fast.sum() / mine.sum():.1f} |\n"
    )


def one_start_against_least_squares(objective: PowerSumObjective, scaled: ScaledPairs) -> None:
    """Print time and cost of each start, ours and those of scipy's least_squares."""
    residuals = residuals_of(scaled, thesis_exponents(TERMS))
    print(
        "### The same against scipy.optimize.least_squares, finite differences, at most "
        f"{LEAST_SQUARES_STEPS} steps\n"
    )
    print("| start | method | ours [ms] | cost | least_squares [ms] | steps | cost | ratio |")
    print("|---|---|---|---|---|---|---|---|")
    for index in range(LEAST_SQUARES_STARTS):
        start = objective.start(np.random.default_rng([0, index]))
        for method in ("trf", "dogbox", "lm"):
            begin = time.perf_counter()
            ours = descend(objective, start)
            middle = time.perf_counter()
            peer = least_squares(residuals, start, method=method, max_nfev=LEAST_SQUARES_STEPS)
            end = time.perf_counter()
            print(
                f"| {index} | {method} | {1e3 * (middle - begin):.1f} | {ours.cost:.4f} | "
                f"{1e3 * (end - middle):.0f} | {peer.nfev} | {2.0 * peer.cost:.4f} | "
                f"{(end - middle) / (middle - begin):.0f} |",
                flush=True,
            )
    print()


def whole_fit(pairs: Pairs) -> None:
    """Print the time of a fit with all its starts, on one worker and on two."""
    print(f"### The whole fit of {STARTS} starts, none left out\n")
    print("| workers | seconds (goal 2.0 on 2) | cost |\n|---|---|---|")
    for workers in (1, 2):
        begin = time.perf_counter()
        with process_pool(workers) as executor:
            search = Search(STARTS, executor=executor, stop_early=False)
            result = fit_power_sum(pairs, thesis_exponents(TERMS), scaling=SCALING, search=search)
        print(f"| {workers} | {time.perf_counter() - begin:.2f} | {result.cost:.4f} |")
    print()


def against_the_convex_polynomial(pairs: Pairs) -> None:
    """Print time and error of fits of a like number of parameters beside those of the SDP."""

    def power(exponents: np.ndarray) -> FitResult:
        return fit_power_sum(pairs, exponents, scaling=SCALING, search=Search(STARTS))

    ways: dict[str, Callable[[], FitResult]] = {
        "convex polynomial, SDP by cvxpy (15)": lambda: fit_polynomial(
            pairs, velocity_weight=1.0, convex=True, scaling=SCALING
        ),
        "polynomial, least squares (15)": lambda: fit_polynomial(pairs, scaling=SCALING),
        "2 terms, J2 (12)": lambda: power(thesis_exponents(2)),
        "3 terms, J2 (18)": lambda: power(thesis_exponents(3)),
        "3 norms, J2 (18)": lambda: power(np.full(3, 0.5)),
        "dissipation, 3 terms, forces (18)": lambda: fit_dissipation(
            pairs, 3, scaling=SCALING, search=Search(STARTS)
        ),
    }
    test = random_motions(TRIANGLE, 2000, 2)
    print(f"### Against the convex polynomial: whole fits, ours of {STARTS} starts, one worker\n")
    print("| model (numbers) | median of 3 [s] | v 50 / 95 / 100 % |\n|---|---|---|")
    times: dict[str, list[float]] = {name: [] for name in ways}
    errors = {}
    for _ in range(3):
        for name, fit in ways.items():
            begin = time.perf_counter()
            try:
                result = fit()
            except MissingExtraError as error:
                errors[name] = f"skipped: {error}"
                continue
            times[name].append(time.perf_counter() - begin)
            velocity = quantiles(velocity_error(result.surface, test))
            errors[name] = " / ".join(f"{value:.3f}" for value in velocity)
    for name in ways:
        taken = f"{median(times[name]):.3f}" if times[name] else ""
        print(f"| {name} | {taken} | {errors[name]} |")
    print()


def cost_of_many_pairs() -> None:
    """Print how the time of one start grows with the number of pairs."""
    print("### One start against the number of pairs: linear, once there is work to share out\n")
    print("| pairs | cost and gradient, each pair [ns] | one start [s] | each pair [us] | steps |")
    print("|---|---|---|---|---|")
    for power in (3, 4, 5, 6):
        count = 10**power
        facets = count // 10
        pairs = simulated_pairs(TRIANGLE, count - 3 * facets, facets)
        objective = PowerSumObjective(scale_pairs(pairs, SCALING), thesis_exponents(TERMS), 1.0)
        start = objective.start(np.random.default_rng([0, 0]))
        evaluations = []
        for _ in range(5):
            begin = time.perf_counter()
            objective.cost_and_gradient(start)
            evaluations.append(time.perf_counter() - begin)
        begin = time.perf_counter()
        found = descend(objective, start)
        taken = time.perf_counter() - begin
        print(
            f"| 1e{power} | {1e9 * median(evaluations) / count:.0f} | {taken:.3f} | "
            f"{1e6 * taken / count:.2f} | {found.iterations} |",
            flush=True,
        )


def main() -> int:
    """Print the tables."""
    pairs = simulated_pairs(TRIANGLE)
    scaled = scale_pairs(pairs, SCALING)
    objective = PowerSumObjective(scaled, thesis_exponents(TERMS), 1.0)
    one_start_against_finite_differences(objective, scaled)
    one_start_against_least_squares(objective, scaled)
    whole_fit(pairs)
    against_the_convex_polynomial(pairs)
    cost_of_many_pairs()
    return 0


if __name__ == "__main__":
    sys.exit(main())
