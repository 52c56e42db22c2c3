# SPDX-License-Identifier: Apache-2.0
"""Where every installed program starts: Ctrl-C ends it quietly, even while it still imports.

A console script names `tools.PROGRAM` or `nodes.PROGRAM` of this module. What a program needs
takes some tenths of a second to import; only then can it look after interrupts by itself.
"""

from __future__ import annotations

import functools
import importlib
import sys
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable

# Exit code of a program that was interrupted: that of a shell for SIGINT.
INTERRUPTED = 130


def run(package: str, name: str) -> int:
    """Import a program and run it.

    Args:
        package: Its package.
        name: Its module there, which has a function `main`.

    Returns:
        The exit code: what `main` returns, or 130 after an interrupt that it did not see to.
    """
    try:
        return int(importlib.import_module(f"{package}.{name}").main())
    except KeyboardInterrupt:
        sys.stderr.write(f"{name}: interrupted\n")
        return INTERRUPTED


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
