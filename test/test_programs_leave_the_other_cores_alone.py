# SPDX-License-Identifier: Apache-2.0
"""Programs and nodes keep BLAS to one thread, unless their user says otherwise."""

import os
import subprocess
import sys

import pytest

from limit_surface_ros.runtime import BLAS_VARIABLES

SHOW = (
    "import os, sys, importlib; importlib.import_module(sys.argv[1]);"
    f"print('numpy' in sys.modules, *[os.environ[name] for name in {BLAS_VARIABLES}])"
)


def shown(package: str, **environment: str) -> list[str]:
    kept = {key: value for key, value in os.environ.items() if key not in BLAS_VARIABLES}
    command = [sys.executable, "-c", SHOW, package]
    done = subprocess.run(command, env=kept | environment, capture_output=True, check=True)
    return done.stdout.decode().split()


@pytest.mark.parametrize("package", ["limit_surface_ros.tools", "limit_surface_ros.nodes"])
def test_one_thread_is_asked_for_before_numpy_is_there(package):
    assert shown(package) == ["False", "1", "1", "1"]
    assert shown(package, OPENBLAS_NUM_THREADS="4") == ["False", "4", "1", "1"]
