"""How far batches of maps are from a plain C loop, whether cost stays linear, and peak memory."""

from __future__ import annotations

import sys
import time
import tracemalloc
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from c_maps import compiled, twists_in_c
from interleaved import interleaved

from limit_surface_ros.surface.dissipation import Dissipation
from limit_surface_ros.surface.point_contacts import PointContacts
from limit_surface_ros.surface.power_sum import PowerSum
from limit_surface_ros.surface.scaling import Scaling

SIZES = (100, 1_000, 10_000, 100_000, 1_000_000)
LARGE = 1_000_000
# Longest large batch [s].
PATIENCE = 8.0
SCALING = Scaling(0.1, 5.0)


def random_matrices(count: int, seed: int = 0):
    """Return positive definite matrices, shape (count, 3, 3)."""
    factors = np.random.default_rng(seed).normal(size=(count, 3, 3))
    return factors @ factors.transpose(0, 2, 1) / 3 + 0.1 * np.eye(3)


def wrenches(count: int, seed: int = 1):
    """Return loads of all directions [N, N, N m], shape (count, 3)."""
    return np.random.default_rng(seed).normal(size=(count, 3)) * SCALING.wrench_unit


def surfaces() -> dict[str, object]:
    """Return a surface of each kind that is served."""
    angles = np.linspace(0.0, 2.0 * np.pi, 7)[:-1]
    ring = 0.08 * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    return {
        "ellipsoid": PowerSum.thesis(random_matrices(1), SCALING),
        "thesis, 3 terms": PowerSum.thesis(random_matrices(3), SCALING),
        "3 norms": PowerSum.norms(random_matrices(3), SCALING),
        "dissipation, 4 terms": Dissipation(random_matrices(4), SCALING),
        "6 support points": PointContacts(ring, np.full(6, 0.8), SCALING),
    }


def against_c() -> None:
    """Compare wrench to twist with the C loop."""
    library = compiled()
    print("### Wrench to twist in batches against a plain C loop\n")
    if library is None:
        print("There is no C compiler here: not measured.\n")
        return
    print("One thread. Goal: at most 3 times the loop's time.\n")
    print("| kind | loads | ours [M/s] | C [M/s] | ours / C | goal |")
    print("|---|---|---|---|---|---|")
    for name in ("thesis, 3 terms", "3 norms"):
        surface = surfaces()[name]
        loop = twists_in_c(library, surface)
        check = wrenches(1000)
        assert np.abs(surface.twist_of_wrench(check) - loop(check)).max() < 1e-8 / 0.1
        for count in SIZES:
            rows = wrenches(count)
            times = interleaved(
                {
                    "ours": lambda s=surface, r=rows: s.twist_of_wrench(r),
                    "c": lambda f=loop, r=rows: f(r),
                },
                rounds=5 if count == SIZES[-1] else 9,
            )
            ratio = times["ours"] / times["c"]
            verdict = "3 met" if ratio <= 3.0 else "3 missed"
            ours, theirs = (count / times[key] / 1e6 for key in ("ours", "c"))
            print(
                f"| {name} | {count} | {ours:.2f} | {theirs:.2f} | {ratio:.2f} | {verdict} |",
                flush=True,
            )
    print()


def cost_and_memory() -> None:
    """Measure time per vector in small and large batches, and the peak of memory in these."""
    print("### Cost per vector and peak memory\n")
    print(
        "Time per vector in a large batch over that in one of a hundredth of its size (goal: at "
        "most 1.5, linear but for the caches), and the peak of memory during the large batch over "
        "the size of its result (goal: below 10). Large is 1e6 vectors, or 1e5 where these would "
        f"take more than {PATIENCE:.0f} s; beside 1e5 results the memory of one block, which does "
        "not grow, looks large.\n"
    )
    print("| kind | map | vectors | small [ns] | large [ns] | ratio | peak [MB] | / result |")
    print("|---|---|---|---|---|---|---|---|")
    for name, surface in surfaces().items():
        for method in ("load_factor", "twist_of_wrench", "wrench_of_twist"):
            call = getattr(surface, method)
            count = LARGE if timed(call, wrenches(1000)) / 1000 * LARGE < PATIENCE else LARGE // 10
            few, many = wrenches(count // 100), wrenches(count)
            times = interleaved({"few": lambda c=call, r=few: c(r)}, rounds=5)
            small, large = times["few"] / len(few), timed(call, many) / count
            peak, result = peak_and_result(call, many)
            print(
                f"| {name} | {method} | {count:.0e} | {1e9 * small:.0f} | {1e9 * large:.0f} "
                f"| {large / small:.2f} | {peak / 1e6:.0f} | {peak / result:.1f} |",
                flush=True,
            )


def timed(call, rows) -> float:
    """Return the time of one call [s]."""
    begin = time.perf_counter()
    call(rows)
    return time.perf_counter() - begin


def peak_and_result(call, rows) -> tuple[int, int]:
    """Return the most memory in use during a call, and the size of its result [bytes]."""
    tracemalloc.start()
    result = call(rows)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    return peak, result.nbytes


def main() -> None:
    """Print both tables."""
    against_c()
    cost_and_memory()


if __name__ == "__main__":
    main()
