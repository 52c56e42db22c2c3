"""Speed of the maps, in batches and one at a time, against the peers in one run.

The peers are the closed form of the ellipsoid in plain numpy, which no model can beat, and
scipy.optimize.root on the exact equations of support points, which is what users wrote before.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from scipy.optimize import root

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from interleaved import interleaved

from limit_surface_ros.surface import shapes
from limit_surface_ros.surface.contact_patch import ContactPatch
from limit_surface_ros.surface.dissipation import Dissipation
from limit_surface_ros.surface.point_contacts import PointContacts
from limit_surface_ros.surface.polynomial import Polynomial
from limit_surface_ros.surface.power_sum import PowerSum
from limit_surface_ros.surface.scaling import Scaling

SCALING = Scaling(0.1, 5.0)
BATCH = 200_000
GOALS = {"thesis, 3 terms": (4.0, 20.0), "3 norms": (10.0, 8.0)}


def random_matrices(terms: int):
    """Return positive definite matrices, shape (terms, 3, 3)."""
    roots = np.random.default_rng(terms).standard_normal((terms, 3, 3))
    return np.swapaxes(roots, 1, 2) @ roots


def kinds() -> dict[str, object]:
    """Return a surface of each kind."""
    quartic = np.array([1, 0, 0, 1 / 3, 0, 1, 0, 0, 0, 0, 2, 0, 1, 0, 3])
    tripod = [[0.05, 0.0], [-0.03, 0.04], [-0.03, -0.05]]
    return {
        "thesis, 1 term": PowerSum.thesis(random_matrices(1), SCALING),
        "thesis, 2 terms": PowerSum.thesis(random_matrices(2), SCALING),
        "thesis, 3 terms": PowerSum.thesis(random_matrices(3), SCALING),
        "thesis, 4 terms": PowerSum.thesis(random_matrices(4), SCALING),
        "3 norms": PowerSum.norms(random_matrices(3), SCALING),
        "dissipation, 4 terms": Dissipation(random_matrices(4), SCALING),
        "3 support points": PointContacts(tripod, [1.0, 2.0, 1.0], SCALING),
        "polynomial": Polynomial(quartic, SCALING),
    }


def ellipsoid(matrix, loads):
    """Return the twists of an ellipsoid as anybody would write them."""
    twists = loads @ matrix
    return twists / np.linalg.norm(twists, axis=1, keepdims=True)


def batches_and_single_calls() -> None:
    """Both maps of each kind; the slow ones with fewer vectors."""
    print(f"### Both maps of each kind, one thread, batches of up to {BATCH}\n")
    print(
        "| kind | wrench -> twist [M/s] | goal | twist -> wrench [M/s] "
        "| one wrench -> twist [us] | goal | one twist -> wrench [us] |"
    )
    print("|---|---|---|---|---|---|---|")
    rng = np.random.default_rng(0)
    matrix = random_matrices(1)[0]
    for name, surface in kinds().items():
        loads = rng.standard_normal((BATCH, 3)) * SCALING.wrench_unit
        twists = rng.standard_normal((BATCH, 3)) * SCALING.twist_unit
        few = 2_000 if name in ("thesis, 3 terms", "thesis, 4 terms") else 20_000
        slow = 20_000 if name in ("dissipation, 4 terms", "3 support points") else BATCH
        one, other = loads[0].copy(), twists[0].copy()
        times = interleaved(
            {
                "twists": lambda s=surface, f=loads[:slow]: s.twist_of_wrench(f),
                "wrenches": lambda s=surface, v=twists[:few]: s.wrench_of_twist(v),
                "twist": lambda s=surface, f=one: s.twist_of_wrench(f),
                "wrench": lambda s=surface, v=other: s.wrench_of_twist(v),
                "peer": lambda f=loads: ellipsoid(matrix, f),
            },
            rounds=5,
        )
        batch_goal, one_goal = GOALS.get(name, ("", ""))
        print(
            f"| {name} | {slow / times['twists'] / 1e6:.3g} | {batch_goal} "
            f"| {few / times['wrenches'] / 1e6:.3g} | {times['twist'] * 1e6:.1f} | {one_goal} "
            f"| {times['wrench'] * 1e6:.1f} |",
            flush=True,
        )
    print(f"\nThe peer, an ellipsoid in plain numpy: {BATCH / times['peer'] / 1e6:.1f} M/s.\n")


def patch_against_root() -> None:
    """A patch of about 800 support points, wrench to twist, against scipy.optimize.root."""
    surface = ContactPatch.of_shape(shapes.rectangle([0.1, 0.1], 784)).surface(0.3, 10.0)
    unit = surface.scaling.wrench_unit
    rng = np.random.default_rng(1)
    motions = rng.standard_normal((200, 3))
    motions /= np.linalg.norm(motions, axis=1, keepdims=True)
    loads = surface.wrench_of_twist(motions * surface.scaling.twist_unit)
    x, y = surface.points.T / surface.scaling.characteristic_length
    limits = surface.friction_limits / surface.scaling.friction_force

    def residual(twist, load):
        wx, wy = twist[0] - twist[2] * y, twist[1] + twist[2] * x
        grip = limits / np.hypot(wx, wy)
        fx, fy = grip * wx, grip * wy
        sums = np.array([fx.sum(), fy.sum(), (x * fy - y * fx).sum()])
        # The length of the twist is free: its excess over 1 goes along the twist.
        return sums - load + (twist @ twist - 1.0) * twist

    def by_root():
        return np.array([root(residual, load, args=(load,)).x for load in loads / unit])

    many = np.repeat(loads, 20, axis=0)
    times = interleaved({"ours": lambda: surface.twist_of_wrench(many), "root": by_root}, rounds=3)
    found = surface.twist_of_wrench(loads) / surface.scaling.twist_unit
    rooted = by_root()
    rooted /= np.linalg.norm(rooted, axis=1, keepdims=True)
    wrong = [int((np.linalg.norm(t - motions, axis=1) > 1e-6).sum()) for t in (found, rooted)]
    ours, peer = times["ours"] / len(many), times["root"] / len(loads)
    print(f"### A patch of {len(x)} support points, wrench -> twist\n")
    print("| | time for one in a batch [us] | wrong by more than 1e-6, of 200 |\n|---|---|---|")
    print(f"| ours | {ours * 1e6:.0f} | {wrong[0]} |")
    print(f"| scipy.optimize.root | {peer * 1e6:.0f} | {wrong[1]} |")
    print(f"\nRatio {peer / ours:.1f}; the goal is 20 with none wrong.")


def main() -> int:
    """Print the tables."""
    batches_and_single_calls()
    patch_against_root()
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
