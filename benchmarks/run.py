# SPDX-License-Identifier: Apache-2.0
"""Run benchmarks and keep what they print, with date and machine, in benchmarks/RESULTS.md.

Usage: python benchmarks/run.py [NAME...]

Each `bench_NAME.py` beside this file is a program of its own that prints Markdown (headings
from ### down); like this one it needs the package installed, which `make bench` sees to. Without
names all are run; the sections of those that are not run stay as they were. The exit code is 1
when a benchmark failed; its section then keeps its last good result.
"""

from __future__ import annotations

import datetime
import os
import platform
import re
import subprocess
import sys
import time
from importlib import metadata
from pathlib import Path

from limit_surface_ros.runtime import use_one_blas_thread

FOLDER = Path(__file__).resolve().parent
RESULTS = FOLDER / "RESULTS.md"
HEADING = """# Results of the benchmarks

Written by `python benchmarks/run.py`; each part says when and where it was measured. Ours and the
peer are measured interleaved in one run: ratios hold elsewhere, absolute times do not.
"""


def benchmarks() -> dict[str, Path]:
    """Return the benchmark programs by name."""
    return {path.stem.removeprefix("bench_"): path for path in sorted(FOLDER.glob("bench_*.py"))}


def processor() -> str:
    """Return the processor's name as the system gives it."""
    cpuinfo = Path("/proc/cpuinfo")
    if cpuinfo.exists():
        match = re.search(r"^model name\s*:\s*(.+)$", cpuinfo.read_text(), re.MULTILINE)
        if match:
            return match[1]
    return platform.processor() or platform.machine()


def machine() -> str:
    """Return one line on the machine and the versions that matter."""
    versions = ", ".join(f"{name} {metadata.version(name)}" for name in ("numpy", "scipy"))
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    return f"{cores} cores of {processor()}, Python {platform.python_version()}, {versions}"


def kept_sections() -> dict[str, str]:
    """Return the sections of the present results by the benchmark's name."""
    if not RESULTS.exists():
        return {}
    parts = re.split(r"^## (\S+)\n", RESULTS.read_text(encoding="utf-8"), flags=re.MULTILINE)
    return dict(zip(parts[1::2], parts[2::2], strict=True))


def run(path: Path) -> str | None:
    """Run one benchmark, show what it prints, and return it; None if it failed."""
    lines: list[str] = []
    with subprocess.Popen(
        [sys.executable, str(path)], stdout=subprocess.PIPE, text=True, cwd=FOLDER.parent
    ) as process:
        assert process.stdout is not None
        for line in process.stdout:
            print(line, end="", flush=True)
            lines.append(line)
    return "".join(lines) if process.returncode == 0 else None


def main(names: list[str]) -> int:
    """Run the named benchmarks, or all, and rewrite the results."""
    programs = benchmarks()
    unknown = [name for name in names if name not in programs]
    if unknown:
        print(f"no benchmark {unknown[0]!r}; there are {', '.join(programs)}", file=sys.stderr)
        return 2
    sections = kept_sections()
    use_one_blas_thread()
    failed = []
    for name in names or programs:
        print(f"\n== {name}", flush=True)
        start = time.perf_counter()
        printed = run(programs[name])
        seconds = time.perf_counter() - start
        if printed is None:
            failed.append(name)
            continue
        today = datetime.datetime.now(datetime.timezone.utc).date()
        sections[name] = f"\n{today}, {machine()}; took {seconds:.0f} s.\n\n{printed.strip()}\n\n"
        ordered = (f"## {key}\n{sections[key]}" for key in programs if key in sections)
        RESULTS.write_text(f"{HEADING}\n{''.join(ordered)}".rstrip() + "\n", encoding="utf-8")
    for name in failed:
        print(f"benchmark {name} failed", file=sys.stderr)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
