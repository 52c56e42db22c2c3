# SPDX-License-Identifier: Apache-2.0
"""The process that the package runs in: how programs start, threads of BLAS, kept memory.

A console script names `tools.PROGRAM` or `nodes.PROGRAM` of this module. What a program needs
takes some tenths of a second to import, and only then can the program see to interrupts by itself:
nothing slow is imported here, so that Ctrl-C is quiet from the first moment on.
"""

from __future__ import annotations

import contextlib
import ctypes
import functools
import importlib
import os
import signal
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Callable

# Number of the last of the standard streams: stdin, stdout, stderr.
_LAST_STANDARD = 2
# Exit code of a program that was interrupted: that of a shell for SIGINT.
INTERRUPTED = 130
# What tells a node to end, and the programs that are nodes.
ENDING = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
NODES = ("limit_surface_node", "decay_node", "force_motion_nodes")
# Of malloc.h.
_M_TRIM_THRESHOLD, _M_MMAP_THRESHOLD = -1, -3
# What BLAS libraries read when they are loaded.
BLAS_VARIABLES = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")
# Rows of a batch whose temporaries the allocator keeps in any case.
_FEW = 500
# Temporaries of one block need less than this [bytes]; up to twice as much is then kept.
_SCRATCH = 2**23


def run(package: str, name: str) -> int:
    """Import a program and run it.

    Args:
        package: Its package.
        name: Its module there, which has a function `main`.

    Returns:
        The exit code: what `main` returns, 130 after an interrupt that it did not see to, 1 after
        an error of the system, such as a full disk, with a line, or without one if whoever read
        the output has closed it, as `head` does. A node that is told to end while it is imported
        ends there and then, with 0.
    """
    mend_standard_streams()
    if name in NODES:
        # Nothing has begun yet; whoever runs it takes any other code for a failure.
        on_ending(lambda *_: os._exit(0))
    try:
        try:
            return int(importlib.import_module(f"{package}.{name}").main())
        finally:
            # Also of a parser that ends the program after its help.
            sys.stdout.flush()
    except OSError as error:
        discard_unwritten_output()
        if not isinstance(error, BrokenPipeError):
            sys.stderr.write(f"{name}: error: {error}\n")
        return 1
    except KeyboardInterrupt:
        sys.stderr.write(f"{name}: interrupted\n")
        return INTERRUPTED


def discard_unwritten_output() -> None:
    """Lead standard output to the null device: the interpreter flushes it once more at its end."""
    try:
        sys.stdout.flush()
    except OSError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def mend_standard_streams() -> None:
    """Give a program the standard streams that were closed, and texts that can always be printed.

    Without the former its own files would get their numbers; names of files may hold what the
    terminal's encoding does not.
    """
    while (number := os.open(os.devnull, os.O_RDWR)) <= _LAST_STANDARD:
        pass
    os.close(number)
    for name in ("stdout", "stderr"):
        stream = getattr(sys, name)
        if stream is None:
            # As long as the process lives.
            setattr(sys, name, Path(os.devnull).open("w", encoding="utf-8"))  # noqa: SIM115
        elif stream.errors == "strict" and hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="backslashreplace")


def on_ending(handler: Any) -> None:
    """Have a handler called, or `signal.SIG_IGN`, when a signal tells a node to end.

    Not by SIGHUP under nohup, where a process is to outlive its terminal.
    """
    for number in ENDING:
        if number != signal.SIGHUP or signal.getsignal(number) is not signal.SIG_IGN:
            signal.signal(number, handler)


@dataclass(frozen=True)
class Programs:
    """The programs of a package, as attributes: functions that return an exit code.

    Attributes:
        package: Its dotted name.
    """

    package: str

    def __getattr__(self, name: str) -> Callable[[], int]:
        """Return what runs the program of that name."""
        return functools.partial(run, self.package, name)


tools = Programs("limit_surface_ros.tools")
nodes = Programs("limit_surface_ros.nodes")


def use_one_blas_thread() -> None:
    """Keep BLAS to one thread, unless the environment says otherwise.

    All our products are of small matrices: threads only wait for each other in them, and starve
    the other processes of a fit or of a robot. It takes effect if numpy is not imported yet.
    """
    for variable in BLAS_VARIABLES:
        os.environ.setdefault(variable, "1")


def keep_scratch(rows: int) -> None:
    """Keep the memory that temporaries of a batch of so many rows need, for the batches to come.

    glibc gives freed memory back to the system unless it has seen a large piece freed before, and
    each page that it asks for anew costs as much as hundreds of multiplications: without this a
    process that does nothing else maps batches at a third of the speed.
    """
    if rows > _FEW:
        _raise_trim_threshold()


@functools.cache
def _raise_trim_threshold() -> None:
    """Free a large piece once: glibc then keeps up to twice as much of what is freed later."""
    import numpy as np

    # Its pages are never touched, so that it costs next to nothing.
    np.empty(_SCRATCH, dtype=np.uint8)


def keep_large_pieces() -> None:
    """Have glibc reuse memory of up to 32 MB a piece, and not ask the system anew each time.

    For programs that take and give messages of megabytes again and again: touching fresh pages
    takes several times as long as the copies themselves. Up to 256 MB stay with the process.
    """
    with contextlib.suppress(AttributeError, OSError):
        libc = ctypes.CDLL(None)
        libc.mallopt(_M_MMAP_THRESHOLD, 2**25)
        libc.mallopt(_M_TRIM_THRESHOLD, 2**28)
