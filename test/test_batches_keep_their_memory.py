# SPDX-License-Identifier: Apache-2.0
"""Batches do not ask the system for the same memory again and again."""

import platform
import subprocess
import sys

import pytest

PROGRAM = """
import resource
import numpy as np
from limit_surface_ros.surface.kinds.power_sum import PowerSum

def faults():
    return resource.getrusage(resource.RUSAGE_SELF).ru_minflt

surface = PowerSum.norms(np.array([np.eye(3), 2.0 * np.eye(3), 3.0 * np.eye(3)]))
loads = np.random.default_rng(0).standard_normal((10_000, 3))
for _ in range(3):
    surface.twist_of_wrench(loads)
before = faults()
for _ in range(20):
    surface.twist_of_wrench(loads)
print((faults() - before) / 20)
"""


@pytest.mark.skipif(platform.libc_ver()[0] != "glibc", reason="another allocator than glibc's")
def test_a_batch_finds_the_memory_of_the_one_before():
    ended = subprocess.run(
        [sys.executable, "-c", PROGRAM], capture_output=True, text=True, check=True
    )
    # Some 500 pages otherwise.
    assert float(ended.stdout) < 50
