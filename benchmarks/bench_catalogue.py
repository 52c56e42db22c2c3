# SPDX-License-Identifier: Apache-2.0
"""fit_catalogue on one process, two, and Dask; and what an object costs beside its fit."""

from __future__ import annotations

import contextlib
import os
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from statistics import median

import numpy as np

from limit_surface_ros.surface.kinds.point_contacts import PointContacts
from limit_surface_ros.surface.sampling import random_motions
from limit_surface_ros.surface.scaling import Scaling

CORNERS = np.array([[-0.04, -0.04], [-0.04, 0.08], [0.08, -0.04]])
OBJECTS, PAIRS, ROUNDS = 8, 2900, 3
# Many objects of next to no fit each: what is left is reading, handing over and writing.
SMALL_OBJECTS, SMALL_PAIRS = 500, 12
SMALL_FIT = ["--terms", "1", "--objective", "J1", "--starts", "1"]
HEADER = "fx_N,fy_N,tau_Nm,vx,vy,omega"


def write_objects(folder: Path, count: int, pairs: int) -> None:
    """Write exact pushes of `count` triangles of different sizes."""
    folder.mkdir(parents=True)
    for i in range(count):
        body = PointContacts(CORNERS * (1 + i / count), np.full(3, 0.5), Scaling(0.15))
        sample = random_motions(body, pairs, i)
        rows = np.hstack([sample.wrenches, sample.twists])
        np.savetxt(folder / f"{i:05d}.csv", rows, "%.17g", ",", header=HEADER, comments="")


def run(*arguments: object) -> tuple[float, float]:
    """Run fit_catalogue in a process of its own.

    Returns:
        How long it and all its processes took, and the processor's time of these [s].
    """
    command = [sys.executable, "-m", "limit_surface_ros.tools.fit_catalogue"]
    used = processor_time()
    begin = time.perf_counter()
    subprocess.run(
        [*command, *map(str, arguments)],
        check=True,
        stdout=subprocess.DEVNULL,
        env={**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)},
    )
    return time.perf_counter() - begin, processor_time() - used


def processor_time() -> float:
    """Return the processor's time of all processes that this one started and saw end [s]."""
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


def scaling(folder: Path) -> None:
    """Print how long a catalogue takes on more workers."""
    write_objects(folder / "in", OBJECTS, PAIRS)
    ways = {"1 process": ["--workers", 1], "2 processes": ["--workers", 2]}
    with contextlib.ExitStack() as stack:
        address = dask_address(stack)
        if address:
            ways["Dask, 2 workers"] = ["--dask", address]
        times: dict[str, list[tuple[float, float]]] = {name: [] for name in ways}
        for _ in range(ROUNDS):
            for name, options in ways.items():
                times[name].append(run(folder / "in", "-o", folder / "out", "--refit", *options))
    print(f"### {OBJECTS} objects of {PAIRS} pairs, 3 terms, J2, up to 8 starts each\n")
    print("Goal: twice as fast on two processes as on one; at least 1.8 times.\n")
    print("| where | median [s] | each object [s] | processor's time [s] | speed-up |")
    print("|---|---|---|---|---|")
    one = median(times["1 process"])[0]
    for name, values in times.items():
        middle, used = median(values)
        used = "not seen" if "Dask" in name else f"{used:.1f}"
        print(f"| {name} | {middle:.2f} | {middle / OBJECTS:.2f} | {used} | {one / middle:.2f} |")
    if not address:
        print("\nDask is not installed here: not measured.")
    print(flush=True)


def dask_address(stack: contextlib.ExitStack) -> str:
    """Start a Dask cluster of two processes; return its address, or nothing without Dask."""
    try:
        from distributed import LocalCluster
    except ImportError:
        return ""
    cluster = LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None)
    return str(stack.enter_context(cluster).scheduler_address)


def overhead(folder: Path) -> None:
    """Print what an object costs beside its fit."""
    write_objects(folder / "in", SMALL_OBJECTS, SMALL_PAIRS)
    arguments = [folder / "in", "-o", folder / "out", *SMALL_FIT, "--workers"]
    nothing = run(folder / "in", "-o", folder / "out", "--help")[0]
    first = run(*arguments, 2)[0] - nothing
    again = run(*arguments, 2)[0] - nothing
    print(f"### {SMALL_OBJECTS} objects of next to no fit\n")
    print("| what, less the start of the program | each object [ms] |\n|---|---|")
    print(f"| all, on 2 processes | {1e3 * first / SMALL_OBJECTS:.1f} |")
    print(f"| a second run, which finds all finished | {1e3 * again / SMALL_OBJECTS:.1f} |")


def main() -> None:
    """Print both tables."""
    with tempfile.TemporaryDirectory() as name:
        scaling(Path(name) / "scaling")
        overhead(Path(name) / "overhead")


if __name__ == "__main__":
    main()
