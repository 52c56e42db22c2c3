# SPDX-License-Identifier: Apache-2.0
"""Run pytest on the package as it is installed: the working directory is not importable here.

Tests run in one process more than there are cores, up to five: many wait for nodes to find each
other. A process that is done takes tests over from the others (`worksteal`), so that no long file
is left at the end. `-n 0` runs them one after the other, as does a debugger.
"""

import os
import sys

import pytest

MOST_WORKERS = 5


def with_workers(arguments: list[str], cores: int) -> list[str]:
    """Return the arguments, with workers unless they name some or ask for a debugger."""
    chosen = any(
        each.startswith(("-n", "--numprocesses", "--pdb", "--trace")) for each in arguments
    )
    workers = min(cores + 1, MOST_WORKERS)
    return arguments if chosen else ["-n", str(workers), "--dist", "worksteal", *arguments]


if __name__ == "__main__":
    sys.exit(pytest.main(with_workers(sys.argv[1:], len(os.sched_getaffinity(0)))))
