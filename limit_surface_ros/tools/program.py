# SPDX-License-Identifier: Apache-2.0
"""What the command line programs share: errors and warnings as one line, quiet interrupts."""

from __future__ import annotations

import os
import sys
import warnings
from contextlib import contextmanager
from typing import TYPE_CHECKING

from limit_surface_ros.errors import LimitSurfaceError
from limit_surface_ros.start import INTERRUPTED

if TYPE_CHECKING:
    import argparse
    from collections.abc import Callable, Iterator, Sequence
    from typing import TextIO

FAILED = 1
USAGE_ERROR = 2


def run_program(
    parser: argparse.ArgumentParser,
    run: Callable[[argparse.Namespace], int | None],
    argv: Sequence[str] | None,
    interrupted: str = "interrupted, nothing was written",
) -> int:
    """Parse arguments, run, and return the exit code.

    Args:
        parser: Of the command line.
        run: What the program does; it may return an exit code of its own.
        argv: The command line; that of the process if not given.
        interrupted: What to say after Ctrl-C.

    Returns:
        0, or what `run` returns; 2 with one line on standard error when the input is at fault;
        1 when nobody reads on, without a word, or the system refuses something; 130 when
        interrupted.
    """
    arguments = parser.parse_args(argv)
    try:
        with _plain_warnings(parser.prog):
            code = run(arguments)
        sys.stdout.flush()
    except LimitSurfaceError as error:
        print(f"{parser.prog}: error: {error}", file=sys.stderr)
        return USAGE_ERROR
    except KeyboardInterrupt:
        print(f"{parser.prog}: {interrupted}", file=sys.stderr)
        return INTERRUPTED
    except BrokenPipeError:
        _give_up_unwritten_output()
        return FAILED
    except OSError as error:
        _give_up_unwritten_output()
        print(f"{parser.prog}: error: {error}", file=sys.stderr)
        return FAILED
    return code or 0


@contextmanager
def _plain_warnings(program: str) -> Iterator[None]:
    """Print warnings as one line each inside the block, without the place in the code."""

    def show(
        message: Warning | str,
        category: type[Warning],
        filename: str,
        lineno: int,
        file: TextIO | None = None,
        line: str | None = None,
    ) -> None:
        print(f"{program}: warning: {message}", file=sys.stderr)

    # Tests and libraries get warnings as they asked for them again after the block.
    before = warnings.showwarning
    warnings.showwarning = show
    try:
        yield
    finally:
        warnings.showwarning = before


def _give_up_unwritten_output() -> None:
    """Let the interpreter end without trying, and failing, once more to write what is left."""
    try:
        sys.stdout.flush()
    except OSError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
