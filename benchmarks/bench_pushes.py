# SPDX-License-Identifier: Apache-2.0
"""Where real pushes end: predicted end poses against recorded ones, a peer, and standing still.

Runs of the MIT push data (../shared/data/mit_pushes, skipped where absent): a round tip pushes a
body along a straight path. Models are fitted to all recorded wrenches and motions of a set by the
package's own recipes, one for each kind and not tuned by set; the tip's friction is the peer's.
The peer is the simulator of Zhou et al. (IJRR 2018, doi:10.1177/0278364917698747) with its convex
polynomial, whose predictions the data hold. metric = |dp| + rho |dtheta| [mm], rho the mean
distance of the outline's vertices. Intervals are percentiles of 4000 bootstrap samples. That an
overlap of tip and body is kept, and not pushed out, was found better on such data.
"""

from __future__ import annotations

import csv
import json
import sys
import time
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np

from limit_surface_ros.fitting.few_pushes.recipe import FitContext, Recipe
from limit_surface_ros.motion.outline import Polygon
from limit_surface_ros.motion.rollout import simulate_pushes
from limit_surface_ros.surface.pairs import Pairs
from limit_surface_ros.surface.scaling import Scaling

DATA = Path(__file__).resolve().parents[2] / "shared" / "data" / "mit_pushes"
RECIPES = {
    "ellipsoid": Recipe("power_sum", 1),
    "3 norms": Recipe("power_sum", 3, prior="ellipsoid", prior_weight=0.5),
    "dissipation, 8 terms": Recipe("dissipation", 8, prior="pressure", prior_weight=5.0),
}
STILL, PEER = "nothing moves", "peer, convex quartic"
SAMPLES = 4000


def read_table(path: Path) -> tuple[dict[str, Any], dict[str, np.ndarray]]:
    """Return what line 1 of a file of the data says, and its columns by name."""
    with path.open(encoding="utf-8", newline="") as stream:
        about = json.loads(stream.readline().lstrip("# "))
        rows = list(csv.reader(stream))
    names = [name.strip() for name in rows[0]]
    return about, dict(zip(names, np.array(rows[1:], dtype=float).T, strict=True))


def columns(table: dict[str, np.ndarray], *names: str) -> np.ndarray:
    """Return columns side by side, shape (n, len(names))."""
    return np.stack([table[name] for name in names], axis=1)


def errors(predicted: np.ndarray, true: np.ndarray, rho: float) -> np.ndarray:
    """Return errors of place [mm], of angle [deg] and the metric [mm], shape (n, 3)."""
    place = 1e3 * np.hypot(*(predicted - true)[:, :2].T)
    turn = predicted[:, 2] - true[:, 2]
    turn = np.abs(np.arctan2(np.sin(turn), np.cos(turn)))
    return np.stack([place, np.degrees(turn), place + 1e3 * rho * turn], axis=1)


def one_set(name: str) -> dict[str, np.ndarray]:
    """Return the errors of each way of prediction, shape (n, 3), for the runs of a set."""
    about, pairs = read_table(DATA / f"{name}_pairs.csv")
    taken = Pairs(columns(pairs, "fx_N", "fy_N", "tau_Nm"), columns(pairs, "vx", "vy", "omega"))
    force = float(np.median(np.hypot(*taken.wrenches[:, :2].T)))
    context = FitContext(taken, Scaling(about["rho_m"], force))
    told, runs = read_table(DATA / f"{name}_runs.csv")
    outline = Polygon(told["outline_m_body_frame"])
    rho = told["rho_m"]
    starts, true = columns(runs, "x0", "y0", "th0"), columns(runs, "x1", "y1", "th1")
    peer = columns(runs, "peer_x1", "peer_y1", "peer_th1")
    found = {STILL: errors(starts, true, rho), PEER: errors(peer, true, rho)}
    ways = columns(runs, "tip_x0", "tip_y0", "tip_x1", "tip_y1").reshape(-1, 2, 2)
    for label, recipe in RECIPES.items():
        surface, _ = context.fit(recipe)
        ends = simulate_pushes(
            surface,
            outline,
            told["tip_radius_m"],
            told["pusher_friction_of_peer"],
            starts,
            ways,
        ).end_poses
        found[label] = errors(ends, true, rho)
    return found


def interval(differences: list[np.ndarray], *, sets_too: bool) -> str:
    """Return the 95 % interval of the mean over sets of the mean difference of a set."""
    rng = np.random.default_rng(0)
    means = np.empty(SAMPLES)
    for sample in range(SAMPLES):
        chosen = (
            rng.integers(len(differences), size=len(differences))
            if sets_too
            else range(len(differences))
        )
        means[sample] = np.mean(
            [rng.choice(differences[place], len(differences[place])).mean() for place in chosen]
        )
    low, high = np.quantile(means, [0.025, 0.975])
    return f"{low:+.2f} .. {high:+.2f}"


def main() -> int:
    """Print the tables."""
    print(__doc__)
    names = sorted(path.name.removesuffix("_runs.csv") for path in DATA.glob("*_runs.csv"))
    if not names:
        print("skipped: the recorded pushes are not at ../shared/data/mit_pushes")
        return 0
    begin = time.perf_counter()
    with ProcessPoolExecutor(2) as executor:
        results = dict(zip(names, executor.map(one_set, names), strict=True))
    labels = [STILL, PEER, *RECIPES]
    runs = sum(len(found[PEER]) for found in results.values())
    print(f"### End poses of {runs} runs of {len(names)} sets, means over the sets\n")
    print(
        "| prediction | mm | deg | metric | median metric | sets better than the peer "
        "| minus peer, 95 % (pushes) | 95 % (sets and pushes) |"
    )
    print("|---|---|---|---|---|---|---|---|")
    for label in labels:
        means = np.array([results[name][label].mean(axis=0) for name in names])
        medians = [np.median(results[name][label][:, 2]) for name in names]
        place, turn, metric = means.mean(axis=0)
        cells = [label, f"{place:.2f}", f"{turn:.2f}", f"{metric:.2f}", f"{np.mean(medians):.2f}"]
        if label == PEER:
            cells += ["", "", ""]
        else:
            differences = [(found[label] - found[PEER])[:, 2] for found in results.values()]
            better = sum(difference.mean() < 0.0 for difference in differences)
            cells.append(f"{better} of {len(names)}")
            cells += [interval(differences, sets_too=more) for more in (False, True)]
        print(f"| {' | '.join(cells)} |")
    print("\n### Mean metric [mm] of each set\n")
    print(f"| prediction | {' | '.join(names)} |")
    print(f"|---|{'---|' * len(names)}")
    for label in labels:
        cells = " | ".join(f"{results[name][label][:, 2].mean():.2f}" for name in names)
        print(f"| {label} | {cells} |")
    print(f"\nFits and runs took {time.perf_counter() - begin:.0f} s on two processes.")
    return 0


if __name__ == "__main__":
    sys.exit(main())
