# SPDX-License-Identifier: Apache-2.0
"""Workers are forked only by a process without other threads, those of its libraries included."""

import os
import subprocess

import pytest

from process_helpers import started_python

# Tells whether a worker has what its parent held when it began: a forked one has.
PROGRAM = """
import sys
{before}
from limit_surface_ros.fitting.workers import worker_processes

HELD = []

def has_what_its_parent_held(_):
    return bool(HELD)

if __name__ == "__main__":
    HELD.append(1)
    with worker_processes(1) as pool:
        print(pool.submit(has_what_its_parent_held, 0).result())
"""
NODE = """
if __name__ == "__main__":
    import rclpy
    rclpy.init()
    node = rclpy.create_node("alone")
"""


def outcome(tmp_path, before: str, **variables: str) -> str:
    """Return what the program prints if warnings are errors."""
    program = tmp_path / "program.py"
    program.write_text(PROGRAM.format(before=before), encoding="utf-8")
    with pytest.MonkeyPatch.context() as patch:
        for name, value in variables.items():
            patch.setenv(name, value)
        process = started_python(
            "-W",
            "error:This process",
            program,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
        )
    answer, errors = process.communicate()
    assert process.returncode == 0, errors
    assert "fork" not in errors
    return answer.strip()


def test_a_process_with_one_thread_forks(tmp_path):
    assert outcome(tmp_path, "import numpy", OPENBLAS_NUM_THREADS="1") == "True"


def test_a_process_with_threads_of_a_library_starts_workers_afresh(tmp_path):
    counts = "import os, numpy; sys.stderr.write(str(len(os.listdir('/proc/self/task'))))"
    program = tmp_path / "count.py"
    program.write_text(f"import sys; {counts}", encoding="utf-8")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("OPENBLAS_NUM_THREADS", "2")
        process = started_python(program, stderr=subprocess.PIPE)
    if process.communicate()[1] == "1" or os.cpu_count() == 1:
        pytest.skip("numpy's BLAS keeps no threads here")
    assert outcome(tmp_path, "import numpy", OPENBLAS_NUM_THREADS="2") == "False"


def test_a_process_with_a_node_starts_workers_afresh(tmp_path):
    pytest.importorskip("rclpy", reason="rclpy is not installed")
    assert outcome(tmp_path, NODE) == "False"
