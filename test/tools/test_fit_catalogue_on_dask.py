# SPDX-License-Identifier: Apache-2.0
"""fit_catalogue --dask: a real scheduler and two workers in processes of their own."""

import signal
import socket
import subprocess
from importlib.util import find_spec

import pytest

from catalogue_helpers import OPTIONS, matrices, write_objects
from limit_surface_ros.tools import fit_catalogue
from process_helpers import WAIT, started, started_python, until

pytestmark = pytest.mark.skipif(
    find_spec("distributed") is None, reason="Dask is not installed (extra: cluster)"
)


@pytest.fixture
def dask(tmp_path, monkeypatch):
    """Start Dask programs, and end them after the test."""
    programs = []
    monkeypatch.setenv("DASK_TEMPORARY_DIRECTORY", str(tmp_path / "scratch"))

    def start(program, *arguments):
        quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
        module = f"distributed.cli.dask_{program}"
        programs.append(started(module, *arguments, **quiet))
        return programs[-1]

    yield start
    for program in programs:
        program.kill()
        program.wait()


@pytest.fixture
def address(dask):
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    dask("scheduler", "--host", "127.0.0.1", "--port", port, "--no-dashboard")
    return f"tcp://127.0.0.1:{port}"


def started_worker(dask, address):
    # Without a nanny, so that a worker that is killed stays dead.
    return dask("worker", address, "--no-nanny", "--no-dashboard", "--nthreads", "1")


def started_fit(*arguments, connect=WAIT, worker=WAIT, **options):
    """Start fit_catalogue, which waits so long [s] for the scheduler, and for a worker."""
    program = (
        "import sys; from limit_surface_ros.tools import fit_catalogue;"
        "from limit_surface_ros.tools.common import executors;"
        f"executors._CONNECT_TIME, executors._WORKER_TIME = {connect}, {worker};"
        "sys.exit(fit_catalogue.main(sys.argv[1:]))"
    )
    return started_python("-c", program, *arguments, stderr=subprocess.PIPE, **options)


def test_nothing_is_lost_when_a_worker_is_killed(dask, address, tmp_path):
    names = write_objects(tmp_path / "pushes", 24)
    assert (
        fit_catalogue.main([str(tmp_path / "pushes"), "-o", str(tmp_path / "here"), *OPTIONS]) == 0
    )
    workers = [started_worker(dask, address) for _ in range(2)]
    output = tmp_path / "models"
    arguments = [tmp_path / "pushes", "-o", output, *OPTIONS, "--dask", address]
    program = started_fit(*arguments, stdout=subprocess.PIPE)
    until(lambda: output.is_dir() and len(list(output.glob("*.yaml"))) >= 6, "some models")
    workers[0].send_signal(signal.SIGKILL)
    printed, errors = program.communicate()
    assert program.returncode == 0, errors
    assert "24 fitted, 0 kept, 0 failed" in printed
    assert errors == ""
    assert matrices(output, names) == matrices(tmp_path / "here", names)


def refusal(folder, address, **patience):
    """Run fit_catalogue where it must fail; return its exit code and errors."""
    write_objects(folder / "pushes", 1)
    arguments = [folder / "pushes", "-o", folder / "models", "--dask", address]
    process = started_fit(*arguments, **patience)
    errors = process.communicate()[1]
    return process.returncode, errors


def test_a_scheduler_that_is_not_there_is_one_clear_line(tmp_path):
    code, errors = refusal(tmp_path, "tcp://127.0.0.1:9", connect=0.5)
    assert code == 2
    (line,) = errors.splitlines()
    assert "no Dask scheduler answers at tcp://127.0.0.1:9" in line


def test_a_cluster_without_workers_is_one_clear_line(tmp_path, address):
    code, errors = refusal(tmp_path, address, worker=0.5)
    assert code == 2
    (line,) = errors.splitlines()
    assert "has no worker" in line
