# SPDX-License-Identifier: Apache-2.0
"""Recorded pushes: how well the automatic fit predicts pushes that it has not seen.

Five sets of 50 pushes with their fixed splits (../shared/data/pushing). Mean angle [deg] between
measured and predicted twist of the test rows, the mean over the splits; the choice is made by
cross-validation on the training rows alone. With `support`, the stated support points are a
prior; the set with its full face on the ground states none. `--splits N` takes the first N of 20.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import numpy as np

from limit_surface_ros.errors import LimitSurfaceError, MissingExtraError
from limit_surface_ros.files.pushes_csv import read_pushes
from limit_surface_ros.fitting.few_pushes.automatic import fit_automatically
from limit_surface_ros.fitting.pairs import scaling_of_pairs
from limit_surface_ros.fitting.polynomial import fit_polynomial
from limit_surface_ros.fitting.power_sum import fit_power_sum
from limit_surface_ros.fitting.search import Search
from limit_surface_ros.surface.kinds.point_contacts import PointContacts
from limit_surface_ros.surface.kinds.power_sum import thesis_exponents
from limit_surface_ros.surface.measures import mean_angle

DATA = Path(__file__).resolve().parents[2] / "shared" / "data" / "pushing"
METHODS = ("ellipsoid", "convex 4th order", "auto", "auto with support")
GOALS = {"auto": {"15": 10.8, "25": 9.6}, "auto with support": {"25": 8.5}}


def test_angle(task: tuple[str, str, list[int]]) -> tuple[float, float]:
    """Return the mean test angle [deg] of one method on one split, and the time of its fit [s]."""
    method, name, rows = task
    pushes = read_pushes(DATA / f"{name}.csv")
    training, test = pushes.rows(rows), pushes.rest(rows)
    scaling = scaling_of_pairs(training, pushes.number("rho_m"))
    support = pushes.support()
    known = None if support is None else PointContacts(*support)
    begin = time.perf_counter()
    if method == "ellipsoid":
        search = Search(starts=2)
        surface = fit_power_sum(
            training, thesis_exponents(1), scaling=scaling, search=search
        ).surface
    elif method == "convex 4th order":
        try:
            surface = fit_polynomial(
                training, velocity_weight=1.0, convex=True, scaling=scaling
            ).surface
        except MissingExtraError:
            raise
        except LimitSurfaceError:
            return np.nan, 0.0
    else:
        prior = known if method == "auto with support" else None
        surface = fit_automatically(training, scaling=scaling, support=prior).surface
    seconds = time.perf_counter() - begin
    return float(np.degrees(mean_angle(surface, test))), seconds


def main() -> int:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--splits", type=int, default=8)
    splits = parser.parse_args().splits
    print(__doc__)
    if not DATA.is_dir():
        print(f"skipped: the recorded pushes are not at {DATA.parent}")
        return 0
    chosen = json.loads((DATA / "splits.json").read_text(encoding="utf-8"))
    names = sorted(chosen)
    print(f"### Mean test angle [deg], first {splits} splits\n")
    short = [name.removeprefix("hardboard_") for name in names]
    print(f"| method | pairs | {' | '.join(short)} | mean of five | goal | s a fit |")
    print(f"|---|---|{'---|' * len(names)}---|---|---|")
    with ProcessPoolExecutor(2) as executor:
        for method in METHODS:
            for count in ("15", "25"):
                tasks = [
                    (method, name, rows) for name in names for rows in chosen[name][count][:splits]
                ]
                results = np.array(list(executor.map(test_angle, tasks)))
                angles = np.nanmean(results[:, 0].reshape(len(names), -1), axis=1)
                goal = GOALS.get(method, {}).get(count, "")
                cells = " | ".join(f"{angle:.2f}" for angle in angles)
                print(
                    f"| {method} | {count} | {cells} | {angles.mean():.2f} | {goal} | "
                    f"{results[:, 1].mean():.1f} |",
                    flush=True,
                )
    return 0


if __name__ == "__main__":
    sys.exit(main())
