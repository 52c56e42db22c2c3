# SPDX-License-Identifier: Apache-2.0
"""Run a program that people end with Ctrl-C, without `make` taking the key for itself."""

import os
import signal
import subprocess
from collections.abc import Mapping, Sequence

TERMINAL = 0


def has_terminal() -> bool:
    """Tell whether this program may hand its terminal on: it has one, and is in front."""
    return os.isatty(TERMINAL) and os.tcgetpgrp(TERMINAL) == os.getpgrp()


def run_in_foreground(command: Sequence[str], env: Mapping[str, str]) -> int:
    """Run `command` as the terminal's foreground job and return its exit status.

    make, which waits for us, ends with an error on Ctrl-C whatever its recipe returns. In a
    foreground process group of its own, the command alone hears the key.
    """

    def come_to_front() -> None:
        os.setpgrp()
        # Until this call we are in the background, where taking the terminal would stop us.
        signal.signal(signal.SIGTTOU, signal.SIG_IGN)
        os.tcsetpgrp(TERMINAL, os.getpgrp())
        signal.signal(signal.SIGTTOU, signal.SIG_DFL)
        # Nobody would be in front to continue a job that Ctrl-Z stopped.
        signal.signal(signal.SIGTSTP, signal.SIG_IGN)

    group = os.getpgrp()
    process = subprocess.Popen(command, env=dict(env), preexec_fn=come_to_front)
    signal.signal(signal.SIGTERM, lambda *_: process.terminate())
    try:
        return process.wait()
    finally:
        signal.signal(signal.SIGTTOU, signal.SIG_IGN)
        os.tcsetpgrp(TERMINAL, group)
