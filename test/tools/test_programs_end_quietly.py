"""A program whose output goes nowhere ends without a traceback."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

PROGRAM = [sys.executable, "-m", "limit_surface_ros.tools.fit_decay"]
FIT = [*PROGRAM, "f1", "--terms", "1", "--method", "esprit"]


def test_a_reader_that_goes_away_is_no_error_to_tell():
    unread, output = os.pipe()
    os.close(unread)
    try:
        ended = subprocess.run(FIT, stdout=output, stderr=subprocess.PIPE, text=True, check=False)
    finally:
        os.close(output)
    assert ended.returncode == 1
    assert "Error" not in ended.stderr
    assert "Traceback" not in ended.stderr


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="there is no /dev/full")
def test_a_full_disk_is_told_in_one_line():
    with Path("/dev/full").open("w") as full:
        ended = subprocess.run(FIT, stdout=full, stderr=subprocess.PIPE, text=True, check=False)
    assert ended.returncode == 1
    assert ended.stderr.splitlines()[-1].startswith("fit_decay: error: ")
    assert "Traceback" not in ended.stderr
