# SPDX-License-Identifier: Apache-2.0
"""How far batches of maps are from a plain C loop, whether cost stays linear, and peak memory."""

from __future__ import annotations

import time
import tracemalloc

import numpy as np
from bench_maps import kinds
from c_maps import compiled, map_in_c
from interleaved import interleaved

SIZES = (100, 1_000, 10_000, 100_000, 1_000_000)
LARGE = 1_000_000
# Longest large batch [s].
PATIENCE = 8.0


def rows_of(count: int):
    """Return vectors of all directions, shape (count, 3)."""
    return np.random.default_rng(1).normal(size=(count, 3)) * [1.0, 1.0, 0.1]


def against_c() -> None:
    """Compare the map in closed form of each kind with the C loop."""
    library = compiled()
    print("### Maps in closed form against a plain C loop, ours / C by the size of the batch\n")
    if library is None:
        print("There is no C compiler here: not measured.\n")
        return
    print("One thread. Goal: at most 3 times the loop's time.\n")
    print(f"| kind | map | {' | '.join(f'{n:.0e}' for n in SIZES)} | ours, C at most [M/s] |")
    print(f"|---|---|{'---|' * len(SIZES)}---|")
    check = rows_of(1000)
    for name, surface in kinds().items():
        method, loop = map_in_c(library, surface)
        ours = getattr(surface, method)
        difference = np.abs(ours(check) - loop(check)).max()
        if not difference <= 1e-8 * np.abs(loop(check)).max():
            raise RuntimeError(f"{name}: the C loop differs by {difference:g}")
        cells, rates = [], []
        for count in SIZES:
            rows = rows_of(count)
            times = interleaved(
                {"ours": lambda f=ours, r=rows: f(r), "c": lambda f=loop, r=rows: f(r)},
                rounds=5 if count == SIZES[-1] else 9,
            )
            ratio = times["ours"] / times["c"]
            cells.append(f"{ratio:.2f}{'' if ratio <= 3.0 else ' missed'}")
            rates.append([count / times[key] / 1e6 for key in ("ours", "c")])
        best = ", ".join(f"{rate:.3g}" for rate in np.max(rates, axis=0))
        print(f"| {name} | {method} | {' | '.join(cells)} | {best} |", flush=True)
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
    for name, surface in kinds().items():
        surface.prepare()
        for method in ("load_factor", "twist_of_wrench", "wrench_of_twist"):
            call = getattr(surface, method)
            count = LARGE if timed(call, rows_of(1000)) / 1000 * LARGE < PATIENCE else LARGE // 10
            few, many = rows_of(count // 100), rows_of(count)
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
