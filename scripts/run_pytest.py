# SPDX-License-Identifier: Apache-2.0
"""Run pytest on the package as it is installed: the working directory is not importable here.

Tests run in as many processes as there are cores, up to four, a file in one of them: many wait for
nodes to find each other. `-n 0` runs them one after the other, as does a debugger.
"""

import os
import sys

import pytest

MOST_WORKERS = 4


def with_workers(arguments: list[str], cores: int) -> list[str]:
    """Return the arguments, with workers unless they name some or ask for a debugger."""
    chosen = any(
        each.startswith(("-n", "--numprocesses", "--pdb", "--trace")) for each in arguments
    )
    workers = min(cores, MOST_WORKERS)
    return (
        arguments
        if chosen or workers < 2
        else ["-n", str(workers), "--dist", "loadfile", *arguments]
    )


if __name__ == "__main__":
    sys.exit(pytest.main(with_workers(sys.argv[1:], len(os.sched_getaffinity(0)))))
