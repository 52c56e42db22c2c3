"""What the command line programs share: errors as one line, interrupts without a traceback."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING

from limit_surface_ros.errors import LimitSurfaceError

if TYPE_CHECKING:
    import argparse
    from collections.abc import Callable, Sequence

USAGE_ERROR = 2
INTERRUPTED = 130


def run_program(
    parser: argparse.ArgumentParser,
    run: Callable[[argparse.Namespace], None],
    argv: Sequence[str] | None,
) -> int:
    """Parse arguments, run, and return the exit code.

    Returns:
        0; 2 with one line on standard error when the input is at fault; 130 when interrupted.
    """
    arguments = parser.parse_args(argv)
    try:
        run(arguments)
    except LimitSurfaceError as error:
        print(f"{parser.prog}: error: {error}", file=sys.stderr)
        return USAGE_ERROR
    except KeyboardInterrupt:
        print(f"{parser.prog}: interrupted, nothing was written", file=sys.stderr)
        return INTERRUPTED
    return 0
