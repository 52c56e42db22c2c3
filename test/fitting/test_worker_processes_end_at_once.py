# SPDX-License-Identifier: Apache-2.0
"""An interrupt ends a pool of processes at once, whatever its tasks are and whatever they hold."""

import os
import signal
import subprocess

import pytest

from process_helpers import started_python

PROGRAM = """
import sys, time
from limit_surface_ros.fitting.workers import worker_processes

def work(data):
    time.sleep(60)

if __name__ == "__main__":
    with worker_processes(2) as pool:
        # Both have begun, and leave interrupts to their parent, once they have slept.
        for begun in [pool.submit(time.sleep, 0.2) for _ in range(2)]:
            begun.result()
        waiting = [pool.submit(work, bytes(int(sys.argv[1]))) for _ in range(8)]
        print("at work", flush=True)
        try:
            waiting[0].result()
        finally:
            for each in waiting:
                each.cancel()
"""


# The larger tasks fill the pipe to the workers, so that a thread waits to hand them out.
@pytest.mark.parametrize("size", [10, 1_000_000])
def test_an_interrupt_ends_the_pool_also_while_tasks_wait_to_be_handed_out(tmp_path, size):
    program = tmp_path / "program.py"
    program.write_text(PROGRAM, encoding="utf-8")
    process = started_python(program, size, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    assert process.stdout.readline() == "at work\n"
    os.killpg(process.pid, signal.SIGINT)
    errors = process.communicate()[1]
    assert errors.rstrip().endswith("KeyboardInterrupt")
    assert errors.count("Traceback") == 1, "of this program alone"


BEGINS = """
import sys, threading, time
from limit_surface_ros.fitting.workers import worker_processes

if __name__ == "__main__":
    if sys.argv[1] == "spawned":
        threading.Thread(target=time.sleep, args=[3600], daemon=True).start()
    with worker_processes(2) as pool:
        asked = [pool.submit(time.sleep, 0.0) for _ in range(2)]
        print("begins", flush=True)
        for each in asked:
            each.result()
        time.sleep(3600)
"""


@pytest.mark.parametrize("how", ["forked", "spawned"])
def test_workers_that_an_interrupt_meets_while_they_begin_print_nothing(tmp_path, how):
    program = tmp_path / "program.py"
    program.write_text(BEGINS, encoding="utf-8")
    process = started_python(program, how, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    assert process.stdout.readline() == "begins\n"
    os.killpg(process.pid, signal.SIGINT)
    errors = process.communicate()[1]
    assert errors.rstrip().endswith("KeyboardInterrupt")
    assert errors.count("Traceback") == 1, "of this program alone"
