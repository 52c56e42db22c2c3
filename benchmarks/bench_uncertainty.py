# SPDX-License-Identifier: Apache-2.0
"""How sure predicted twists are: held-out pushes in their regions, and the density they had.

The sets and splits of `bench_real_pushes`. "auto" is the distribution that `--auto` stores, whose
constants were fitted once to 32 sets; "constant" a Gaussian about the same twists, of the one
covariance (towards turning, and across) that the held-out pushes of its cross-validation have;
"GP" a Gaussian process of the motion's residuals about f / |f|, one length for each part of the
load, and noise (scikit-learn, if it is there). A set's share is the mean over its splits.
Densities are per steradian, as negative logarithms.
"""

from __future__ import annotations

import argparse
import sys
import time
import warnings
from concurrent.futures import ProcessPoolExecutor

import numpy as np
from bench_real_pushes import SHARED, Split, splits

from limit_surface_ros.fitting.few_pushes.automatic import fit_automatically
from limit_surface_ros.fitting.few_pushes.calibration import squared_residuals
from limit_surface_ros.surface.kinds.dissipation import Dissipation
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
    scale = surface.scaling.twist_unit
    units = surface.twist_of_wrench(part.test.wrenches) / scale
    measured = unit(part.test.twists / scale)
    plane = tangent_basis(units)
    residuals = log_map(units, measured, plane)
    angle = np.linalg.norm(residuals, axis=1)
    onto_the_sphere = log_area(angle)
    determinant = np.linalg.det(scatter.plane_scale(units, plane))
    density = np.log(2.0 * np.pi) + 0.5 * np.log(determinant) + onto_the_sphere
    density = density + (0.5 * FREEDOM + 1.0) * np.log1p(squares / FREEDOM)
    found = {"auto": (shares(squares, region_quantile), float(density.mean()))}
    covariance = constant_covariance(result, part)
    residuals = log_map(units, measured, turning_basis(units))
    squares = np.einsum("ni,ij,nj->n", residuals, np.linalg.inv(covariance), residuals)
    found["constant"] = gaussian(squares, np.linalg.det(covariance), onto_the_sphere)
    process = gaussian_process(part, measured)
    if process is not None:
        found["GP"] = process
    return found


def unit(vectors):
    """Return unit vectors."""
    return vectors / np.linalg.norm(vectors, axis=1, keepdims=True)


def turning_basis(units):
    """Return tangent bases whose first vector points towards turning, shape (n, 2, 3)."""
    first = np.array([0.0, 0.0, 1.0]) - units[:, 2:] * units
    # Any will do at pure turning.
    first[np.linalg.norm(first, axis=1) < 1e-9] = [1.0, 0.0, 0.0]
    first = unit(first)
    return np.stack([first, np.cross(units, first)], axis=1)


def constant_covariance(result, part: Split):
    """Return the second moment of what the folds' models missed of the pushes they held out."""
    surface, scale = result.surface, part.scaling.twist_unit
    folds = scatter_of(result.details["uncertainty"], surface).folds
    order = np.random.default_rng(0).permutation(len(part.training))
    missed = []
    for matrices, rows in zip(folds, np.array_split(order, len(folds)), strict=True):
        held_out = part.training.take(rows)
        of_fold = Dissipation(matrices, part.scaling)
        units = of_fold.twist_of_wrench(held_out.wrenches) / scale
        missed.append(log_map(units, unit(held_out.twists / scale), turning_basis(units)))
    residuals = np.concatenate(missed)
    return residuals.T @ residuals / len(residuals)


def gaussian(squares, determinants, onto_the_sphere) -> tuple[list[float], float]:
    """Return shares and mean negative log density of normal distributions in the plane."""
    density = np.log(2.0 * np.pi) + 0.5 * (np.log(determinants) + squares) + onto_the_sphere
    return shares(squares, lambda p: -2.0 * np.log(1.0 - p)), float(density.mean())


def gaussian_process(part: Split, measured):
    """Return how a Gaussian process about f / |f| does; None without scikit-learn."""
    try:
        from sklearn.gaussian_process import GaussianProcessRegressor
        from sklearn.gaussian_process.kernels import RBF, ConstantKernel, WhiteKernel
    except ImportError:
        return None
    loads = unit(part.training.wrenches / part.scaling.wrench_unit)
    motions = unit(part.training.twists / part.scaling.twist_unit)
    kernel = ConstantKernel(0.1) * RBF([1.0] * 3) + WhiteKernel(0.02)
    process = GaussianProcessRegressor(kernel, n_restarts_optimizer=1, random_state=0)
    with warnings.catch_warnings():
        # A length at its bound says that this part of the load does not count.
        warnings.simplefilter("ignore")
        # A load turned round turns the motion round.
        process.fit(np.vstack([loads, -loads]), np.vstack([motions - loads, loads - motions]))
    queries = unit(part.test.wrenches / part.scaling.wrench_unit)
    mean, spread = process.predict(queries, return_std=True)
    variance = np.mean(np.reshape(spread, (len(queries), -1)) ** 2, axis=1)
    predicted = unit(queries + mean)
    angle = np.linalg.norm(log_map(predicted, measured, tangent_basis(predicted)), axis=1)
    return gaussian(angle**2 / variance, variance**2, log_area(angle))


def log_area(angle):
    """Return the logarithm of an area on the sphere in parts of that in the tangent plane."""
    return np.log(np.maximum(np.sin(angle), 1e-9) / np.maximum(angle, 1e-9))


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
