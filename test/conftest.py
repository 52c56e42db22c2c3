# SPDX-License-Identifier: Apache-2.0
"""Settings that all tests share."""

import signal

import pytest
from hypothesis import settings

from limit_surface_ros.runtime import use_one_blas_thread
from process_helpers import end_all

# Before numpy is imported: on a busy machine threads of BLAS make some tests fifteen times slower.
use_one_blas_thread()

# The same examples on every run, and no verdict on a busy machine's speed.
settings.register_profile("repeatable", derandomize=True, deadline=None, max_examples=50)
settings.load_profile("repeatable")

# A shell's background job ignores SIGINT, and so would the programs that tests interrupt.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.fixture(autouse=True)
def _no_program_outlives_its_test():
    yield
    end_all()
