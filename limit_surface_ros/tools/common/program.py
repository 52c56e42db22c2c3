# SPDX-License-Identifier: Apache-2.0
"""What all programs share: errors and warnings in one line, quiet interrupts, a progress bar."""

from __future__ import annotations

import argparse
import sys
import textwrap
import warnings
from contextlib import contextmanager
from typing import TYPE_CHECKING

from limit_surface_ros.errors import LimitSurfaceError
from limit_surface_ros.runtime import INTERRUPTED, discard_unwritten_output, mend_standard_streams

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence
    from typing import Protocol, TextIO

    class Progress(Protocol):
        """Shows how far long work has come."""

        def __call__(self, done: int, total: int, failed: int = 0) -> None:
            """Show that `done` of `total` are done, `failed` of them without success."""
            ...


# Where all of the files is told, in a clone and in the documentation.
FILES_PAGE = "docs/reference/files.md"
# What the files hold that programs read, for their help.
FILES = {
    "contact": "contact (.yaml): `points` [m] with the `friction_limits` [N] of a few feet, or a "
    "`shape` with its `pressure`, `friction_coefficient` and `normal_force` [N]",
    "body": "robot description (.urdf, .sdf): the link that stands on the ground, its collision "
    "shapes, mass and friction",
    "pushes": "pushes (.csv): columns fx_N, fy_N, tau_Nm, the load about the reference point, and "
    "vx, vy, omega, the motion that it caused",
    "bag": "bag (a folder, .mcap, .db3, .bag): messages of loads, motions or poses, or of numbers",
    "surface": "surface model (.yaml): a limit surface, as fit_surface writes it",
    "decay": "decay model (.yaml): a sum of exponentials, as fit_decay writes it",
    "response": "response (.csv): a column of times [s] and one of the value that dies away",
}
FAILED = 1
USAGE_ERROR = 2


def program_parser(
    name: str, description: str, epilog: str, *files: str
) -> argparse.ArgumentParser:
    """Return a parser whose help ends in an epilog and in what the program's files hold.

    Args:
        name: Of the program.
        description: What it does, a module's docstring.
        epilog: Examples and remarks.
        files: What it reads, keys of `FILES`.
    """
    wrap = textwrap.TextWrapper(96, initial_indent="  ", subsequent_indent="      ")
    described = "\n".join(wrap.fill(FILES[each]) for each in files)
    page = f"\nfiles (all keys, columns and units: {FILES_PAGE}):\n{described}\n" if files else ""
    return argparse.ArgumentParser(
        prog=name,
        description=description,
        epilog=epilog + page,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )


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
        What `run` returns, or 0. After a fault of the input 2, with one line on standard error;
        after one of the system, such as a full disk, 1 with a line; 1 without a line if whoever
        read the output has closed it; 130 after an interrupt.
    """
    mend_standard_streams()
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
        discard_unwritten_output()
        return FAILED
    except OSError as error:
        discard_unwritten_output()
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


@contextmanager
def progress_bar(what: str) -> Iterator[Progress]:
    """Give a function that takes (done, in all, failed) and draws a bar on standard error.

    It draws nothing where standard error is no terminal or tqdm is not installed.
    """
    try:
        from tqdm import tqdm
    except ImportError:
        yield lambda done, total, failed=0: None
        return
    # Its thread would keep pools of processes from forking, and watches for what we do not do.
    tqdm.monitor_interval = 0
    with tqdm(desc=what, disable=None, leave=False, file=sys.stderr) as bar:

        def show(done: int, total: int, failed: int = 0) -> None:
            bar.total = total
            if failed:
                bar.set_postfix(failed=failed, refresh=False)
            bar.update(done - bar.n)

        yield show
