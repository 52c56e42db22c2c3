# SPDX-License-Identifier: Apache-2.0
"""Progress of long work on a terminal, by tqdm where it is installed (extra `progress`)."""

from __future__ import annotations

import sys
from contextlib import contextmanager
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterator
    from typing import Protocol

    class Progress(Protocol):
        """Shows how far long work has come."""

        def __call__(self, done: int, total: int, failed: int = 0) -> None:
            """Show that `done` of `total` are done, `failed` of them without success."""
            ...


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
