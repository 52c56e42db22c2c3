# SPDX-License-Identifier: Apache-2.0
"""Maps and fits of the first release beside those of this tree, in turns on this machine.

The first release is taken out of git; without its history nothing is measured. Each of both runs
in processes of its own, by turns, and the least processor time of all turns counts, so that other
work on the machine tells little.
"""

from __future__ import annotations

import io
import json
import os
import subprocess
import sys
import tarfile
import tempfile
import time
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable

ROOT = Path(__file__).resolve().parents[1]
# Of the first release.
BEFORE = "5eda7c7"
TURNS = 3
# How long one measurement lasts at least [s], and how many there are of each thing in a turn.
LEAST, ROUNDS = 0.01, 9
SIZES = (1, 100, 10_000)
MAPS = {"wrench -> twist": "twist_of_wrench", "twist -> wrench": "wrench_of_twist"}
# Vectors after which the first release had its tables, too.
MANY = 50_000
# The largest ratio that needs no reason.
SLOWER = 1.3
GOALS = {
    "thesis, 3 terms, wrench -> twist, alone": "20 us",
    "thesis, 3 terms, wrench -> twist, 10000 rows": "250 ns",
    "3 norms, wrench -> twist, alone": "8 us",
    "3 norms, wrench -> twist, 10000 rows": "100 ns",
}


def least_time(call: Callable[[], object]) -> float:
    """Return the least processor time of a call [s]."""
    begin = time.thread_time()
    call()
    repeats = 1 + int(LEAST / max(time.thread_time() - begin, 1e-6))
    times = []
    for _ in range(ROUNDS):
        begin = time.thread_time()
        for _ in range(repeats):
            call()
        times.append((time.thread_time() - begin) / repeats)
    return min(times)


def measure() -> dict[str, float]:
    """Return times [s] by what takes them, of the package and benchmarks that are imported."""
    import bench_fit_speed as fits
    import bench_maps as maps
    import numpy as np

    rows = np.random.default_rng(0).standard_normal((MANY, 3)) * [1.0, 1.0, 0.1]
    found = {}
    for kind, surface in maps.kinds().items():
        for map_name, method in MAPS.items():
            call = getattr(surface, method)
            call(rows)
            getattr(surface, "prepare", lambda: None)()
            for size in SIZES:
                some = rows[0].copy() if size == 1 else rows[:size]
                told = "alone" if size == 1 else f"{size} rows"
                found[f"{kind}, {map_name}, {told}"] = (
                    least_time(lambda c=call, s=some: c(s)) / size
                )
        weighed = least_time(lambda s=surface: s.scaled(1.7).twist_of_wrench(rows[0]))
        found[f"{kind}, wrench -> twist under a weight of its own, alone"] = weighed
    pairs, search = fits.simulated_pairs(fits.TRIANGLE), fits.Search(fits.STARTS)
    exponents = fits.thesis_exponents(fits.TERMS)
    found["fit of 3 terms, J2, 2900 pairs, 8 starts"] = least_time(
        lambda: fits.fit_power_sum(pairs, exponents, scaling=fits.SCALING, search=search)
    )
    return found


def measured_in(tree: Path) -> dict[str, float]:
    """Return what `measure` finds in another process, with the package of a tree."""
    folders = str(tree), str(tree / "benchmarks")
    program = (
        "import sys, json, runpy; "
        f"found = runpy.run_path({__file__!r})['measure'](); print(json.dumps(found))"
    )
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(folders)}
    done = subprocess.run(
        [sys.executable, "-c", program],
        env=environment,
        cwd=tree,
        capture_output=True,
        text=True,
        check=False,
    )
    if done.returncode:
        raise RuntimeError(done.stderr)
    times: dict[str, float] = json.loads(done.stdout.splitlines()[-1])
    return times


def take_out(folder: str) -> bool:
    """Write the first release into a folder; False if git does not have it."""
    packed = subprocess.run(
        ["git", "-C", str(ROOT), "archive", BEFORE], capture_output=True, check=False
    )
    if packed.returncode:
        return False
    with tarfile.open(fileobj=io.BytesIO(packed.stdout)) as archive:
        archive.extractall(folder)
    return True


def told(seconds: float) -> str:
    """Return a time in a unit that fits it."""
    for unit, size in (("s", 1.0), ("ms", 1e-3), ("us", 1e-6)):
        if seconds >= size:
            return f"{seconds / size:.3g} {unit}"
    return f"{seconds * 1e9:.3g} ns"


def main() -> int:
    """Print the table."""
    with tempfile.TemporaryDirectory() as folder:
        if not take_out(folder):
            print("The first release is not in this repository: nothing was measured.")
            return 0
        times: dict[str, dict[str, float]] = {"before": {}, "after": {}}
        for _ in range(TURNS):
            for name, tree in (("before", Path(folder)), ("after", ROOT)):
                for row, seconds in measured_in(tree).items():
                    times[name][row] = min(seconds, times[name].get(row, seconds))
    print("| each vector, or fit | first release | now | now / before | goal |")
    print("|---|---|---|---|---|")
    slower = 0
    for row, before in times["before"].items():
        after = times["after"][row]
        ratio = after / before
        slower += ratio > SLOWER
        mark = " slower" if ratio > SLOWER else ""
        goal = GOALS.get(row, "")
        print(f"| {row} | {told(before)} | {told(after)} | {ratio:.2f}{mark} | {goal} |")
    print(f"\nRows more than {SLOWER} times slower: {slower}.")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
