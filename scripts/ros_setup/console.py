# SPDX-License-Identifier: Apache-2.0
"""What the set-up tells its user, and commands whose noise goes to a log."""

import os
import subprocess
import sys
import time
from collections import deque
from collections.abc import Mapping, Sequence
from pathlib import Path

TAIL_LINES = 40
PROGRESS_INTERVAL = 10.0  # [s] between signs of life on a terminal that cannot redraw a line


class SetupError(Exception):
    """Set-up cannot go on; the message is one sentence for the user."""


def say(message: str) -> None:
    """Print one line about what is being done."""
    print(f"set-up: {message}", file=sys.stderr, flush=True)


def run_logged(
    command: Sequence[str | Path], log: Path, what: str, env: Mapping[str, str], cwd: Path
) -> None:
    """Run `command` with its output in `log`; show progress, and the log's end if it fails.

    Args:
        command: program and arguments.
        log: file that receives standard output and standard error.
        what: the step's name, for the user.
        env: environment of the command.
        cwd: directory to run in.

    Raises:
        SetupError: the command failed.
    """
    log.parent.mkdir(parents=True, exist_ok=True)
    say(f"{what} ...")
    started = time.monotonic()
    with log.open("w", encoding="utf-8") as sink:
        process = subprocess.Popen(
            [os.fspath(part) for part in command],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            env=dict(env),
            cwd=cwd,
            text=True,
            errors="replace",
        )
        progress = _Progress(started)
        try:
            for line in process.stdout or ():
                sink.write(line)
                progress.update(line)
            status = process.wait()
        except BaseException:
            process.terminate()
            process.wait()
            raise
        finally:
            progress.clear()
    if status:
        with log.open(encoding="utf-8") as lines:
            for line in deque(lines, maxlen=TAIL_LINES):
                print(f"  | {line.rstrip()}", file=sys.stderr)
        raise SetupError(f"{what} failed with exit status {status}; all of its output is in {log}")
    say(f"{what}: done in {time.monotonic() - started:.0f} s")


class _Progress:
    """The last line of output, redrawn in place; a line now and then off a terminal."""

    def __init__(self, started: float) -> None:
        self._started = started
        self._redraw = sys.stderr.isatty()
        self._last = started

    def update(self, line: str) -> None:
        """Show the line if it is time for a sign of life."""
        now = time.monotonic()
        if now - self._last < (0.1 if self._redraw else PROGRESS_INTERVAL):
            return
        if line.startswith(("WARNING", "DEPRECATION")):
            return  # kept in the log, and worrying without need here
        self._last = now
        text = f"  {now - self._started:4.0f} s  {line.strip()[:64]}"
        print(f"\r\033[K{text}" if self._redraw else text, end="", file=sys.stderr, flush=True)
        if not self._redraw:
            print(file=sys.stderr, flush=True)

    def clear(self) -> None:
        """Leave the terminal's line empty."""
        if self._redraw:
            print("\r\033[K", end="", file=sys.stderr, flush=True)
