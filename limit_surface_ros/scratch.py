# SPDX-License-Identifier: Apache-2.0
"""Keeping the memory of temporaries in the process, from one batch to the next.

glibc gives freed memory back to the system unless it has seen a large piece come and go, and each
page that it asks for anew costs as much as hundreds of multiplications: without this a process
that does nothing else maps batches at a third of the speed.
"""

from __future__ import annotations

from functools import cache

import numpy as np

# Rows of a batch whose temporaries fit what is kept anyway.
_FEW = 500
# Temporaries of one block need less [bytes]; up to twice as much is then kept.
_SCRATCH = 2**23


def keep_scratch(rows: int) -> None:
    """Keep what batches like one of so many rows need from now on."""
    if rows > _FEW:
        _let_come_and_go()


@cache
def _let_come_and_go() -> None:
    # It is never touched, and costs next to nothing.
    np.empty(_SCRATCH, dtype=np.uint8)
