# SPDX-License-Identifier: Apache-2.0
"""How sure predicted twists are: held-out pushes in their regions, and the density they had.

The sets and splits of `bench_real_pushes`. "auto" is the distribution that `--auto` stores, whose
constants were fitted once to 32 sets; "constant of training" a Gaussian of one covariance from the
training residuals; GP a Gaussian process of the residuals about f / |f| (scikit-learn, if it is
there). A set's share is the mean over its splits. Densities are per steradian, as negative
logarithms.
"""

from __future__ import annotations

import argparse
import sys
import time
from concurrent.futures import ProcessPoolExecutor

import numpy as np
from bench_real_pushes import SHARED, Split, splits

from limit_surface_ros.fitting.few_pushes.automatic import fit_automatically
from limit_surface_ros.fitting.few_pushes.calibration import squared_residuals
from limit_surface_ros.surface.kinds.dissipation_scatter import (
    FREEDOM,
    UncertainSurface,
    log_map,
    region_quantile,
    scatter_of,
    tangent_basis,
)

GOAL = {15: -1.05, 25: -1.2, 100: -1.3}
LEVELS = (0.5, 0.9, 0.95)


def judged(part: Split) -> dict[str, tuple[list[float], float]]:
    """Return shares inside the regions and the mean negative log density of each method."""
    result = fit_automatically(part.training, scaling=part.scaling)
    surface = result.surface
    scatter = scatter_of(result.details["uncertainty"], surface)
    squares = squared_residuals(scatter, surface, part.test)
    unit = surface.scaling.twist_unit
    units = surface.twist_of_wrench(part.test.wrenches) / unit
    measured = part.test.twists / unit
    measured = measured / np.linalg.norm(measured, axis=1, keepdims=True)
    plane = tangent_basis(units)
    residuals = log_map(units, measured, plane)
    angle = np.linalg.norm(residuals, axis=1)
    onto_the_sphere = np.log(np.maximum(np.sin(angle), 1e-9) / np.maximum(angle, 1e-9))
    determinant = np.linalg.det(scatter.plane_scale(units, plane))
    density = np.log(2.0 * np.pi) + 0.5 * np.log(determinant) + onto_the_sphere
    density = density + (0.5 * FREEDOM + 1.0) * np.log1p(squares / FREEDOM)
    found = {"auto": (shares(squares, region_quantile), float(density.mean()))}
    fitted = log_map(*seen(surface, part))
    spread = float(np.mean(fitted**2)) * 2.0
    squares = angle**2 / spread
    density = np.log(2.0 * np.pi * spread) + 0.5 * squares + onto_the_sphere
    found["constant of training"] = (
        shares(squares, lambda p: -2.0 * np.log(1.0 - p)),
        float(density.mean()),
    )
    gaussian = gaussian_process(part, units, measured)
    if gaussian is not None:
        found["GP"] = gaussian
    return found


def seen(surface, part: Split):
    """Return predicted and measured unit twists of the training pairs, and tangent bases."""
    unit = surface.scaling.twist_unit
    units = surface.twist_of_wrench(part.training.wrenches) / unit
    measured = part.training.twists / unit
    return units, measured / np.linalg.norm(measured, axis=1, keepdims=True), tangent_basis(units)


def gaussian_process(part: Split, units, measured):
    """Return how a Gaussian process about f / |f| does; None without scikit-learn."""
    try:
        from sklearn.gaussian_process import GaussianProcessRegressor
        from sklearn.gaussian_process.kernels import RBF, ConstantKernel, WhiteKernel
    except ImportError:
        return None
    load_unit, twist_unit = part.scaling.wrench_unit, part.scaling.twist_unit

    def unit(vectors):
        return vectors / np.linalg.norm(vectors, axis=1, keepdims=True)

    loads, motions = (
        unit(part.training.wrenches / load_unit),
        unit(part.training.twists / twist_unit),
    )
    kernel = ConstantKernel(0.1) * RBF([1.0] * 3) + WhiteKernel(0.02)
    process = GaussianProcessRegressor(kernel, n_restarts_optimizer=1, random_state=0)
    process.fit(np.vstack([loads, -loads]), np.vstack([motions - loads, loads - motions]))
    queries = unit(part.test.wrenches / load_unit)
    mean, spread = process.predict(queries, return_std=True)
    variance = np.broadcast_to(np.atleast_2d(spread.T).T, (len(queries), 3)).mean(axis=1) ** 2
    predicted = unit(queries + mean)
    angle = np.linalg.norm(log_map(predicted, measured, tangent_basis(predicted)), axis=1)
    squares = angle**2 / variance
    onto_the_sphere = np.log(np.maximum(np.sin(angle), 1e-9) / np.maximum(angle, 1e-9))
    density = np.log(2.0 * np.pi * variance) + 0.5 * squares + onto_the_sphere
    return shares(squares, lambda p: -2.0 * np.log(1.0 - p)), float(density.mean())


def shares(squares, quantile) -> list[float]:
    """Return the share of squared residuals within the regions of each level."""
    return [float(np.mean(squares <= quantile(level))) for level in LEVELS]


def cost_of_a_covariance() -> None:
    """Print what the covariance of one twist costs beside the twist, interleaved."""
    part = splits(25, 1)[0]
    result = fit_automatically(part.training, scaling=part.scaling)
    uncertain = UncertainSurface(
        result.surface, scatter_of(result.details["uncertainty"], result.surface)
    )
    begin = time.perf_counter()
    uncertain.prepare()
    made = time.perf_counter() - begin
    loads, each = part.test.wrenches, {"map": [], "with covariance": []}
    for _ in range(40):
        for name, call in (
            ("map", result.surface.twist_of_wrench),
            ("with covariance", uncertain.twist_with_covariance),
        ):
            begin = time.perf_counter()
            for load in loads:
                call(load)
            each[name].append((time.perf_counter() - begin) / len(loads))
    best = {name: 1e6 * min(times) for name, times in each.items()}
    more = best["with covariance"] - best["map"]
    print(f"\nOne load: {best['map']:.0f} us, {more:.0f} us more with its covariance (goal <= 10)")
    print(f"after a table that takes {1e3 * made:.0f} ms to make.")


def main() -> int:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--splits", type=int, default=3)
    options = parser.parse_args()
    print(__doc__)
    if not SHARED.is_dir():
        print(f"skipped: the recorded pushes are not at {SHARED}")
        return 0
    print(
        "| pairs | method | sets | 50 % | 90 % | worst set at 90 % | 95 % | -log density | goal |"
    )
    print("|---|---|---|---|---|---|---|---|---|")
    with ProcessPoolExecutor(2) as executor:
        for count in (15, 25, 100):
            parts = splits(count, options.splits)
            results = list(executor.map(judged, parts))
            names = list(dict.fromkeys(part.name for part in parts))
            for method in results[0]:
                of_sets = np.array(
                    [
                        np.mean(
                            [
                                [*each[method][0], each[method][1]]
                                for part, each in zip(parts, results, strict=True)
                                if part.name == name
                            ],
                            axis=0,
                        )
                        for name in names
                    ]
                )
                half, most, nearly, density = of_sets.mean(axis=0)
                goal = GOAL[count] if method == "auto" else ""
                print(
                    f"| {count} | {method} | {len(names)} | {half:.3f} | {most:.3f} | "
                    f"{of_sets[:, 1].min():.3f} | {nearly:.3f} | {density:.3f} | {goal} |",
                    flush=True,
                )
    cost_of_a_covariance()
    return 0


if __name__ == "__main__":
    sys.exit(main())
