# SPDX-License-Identifier: Apache-2.0
"""Long work as a generator that pauses every few milliseconds, for who has more to do meanwhile.

What the work finds is the value of the StopIteration that ends the generator.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeVar

if TYPE_CHECKING:
    from collections.abc import Generator

Found = TypeVar("Found")


def finish(stages: Generator[None, None, Found]) -> Found:
    """Run a generator to its end without a pause, and return what it returns."""
    while True:
        try:
            next(stages)
        except StopIteration as end:
            found: Found = end.value
            return found
