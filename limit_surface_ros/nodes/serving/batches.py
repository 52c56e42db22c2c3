# SPDX-License-Identifier: Apache-2.0
"""Long work in slices between which others are served; of several batches one runs at a time."""

from __future__ import annotations

import collections
import time
from array import array
from math import ceil
from typing import TYPE_CHECKING, TypeVar
from weakref import WeakKeyDictionary

import numpy as np

from limit_surface_ros.errors import UnavailableError
from limit_surface_ros.nodes.serving.waiting import Waiting

if TYPE_CHECKING:
    from collections.abc import Callable, Generator

    from limit_surface_ros.checks import Floats
    from limit_surface_ros.nodes.serving.endpoints import Endpoints

Found = TypeVar("Found")

# Time that one slice may take [s]: how long a topic waits in the middle of long work.
SLICE = 0.003
# Rows of the first slice of all, of which it is learnt how long rows take; a batch of so many is
# answered in one slice and waits for no other.
FIRST_ROWS = 1024
# The same of pushes, which take longer.
FIRST_PUSHES = 64
# Taking so many rows from the middleware, and giving the answer to it, takes a millisecond each:
# others have a turn after the one and before the other.
LARGE_ROWS = 100_000
# Bytes of the requests that wait for their turn; what more come are refused. A row is a vector,
# that of a push a pose and both ends of its path.
MOST_BYTES = 2**28
_ROW_BYTES, _PUSH_BYTES = 3 * 8, (3 + 4) * 8


class Batches:
    """Runs the batches of a node one after the other, each in slices.

    Args:
        endpoints: The node's, which give others their turns.
    """

    def __init__(self, endpoints: Endpoints) -> None:
        """Run nothing yet."""
        self._endpoints = endpoints
        self._running = False
        self._queue: collections.deque[Waiting] = collections.deque()
        self._bytes = 0
        # Rows that a slice may have, by what they are rows for and what is done with them.
        self._counts: WeakKeyDictionary[object, dict[str, int]] = WeakKeyDictionary()
        endpoints.when_ending.append(self._refuse_next)

    async def run(
        self, name: str, model: object, rows: int, work: Callable[[slice], None]
    ) -> None:
        """Do work on all rows, in slices of them.

        Args:
            name: What is done: with `model` it tells how long rows took the last time.
            model: What it is done with.
            rows: Number of rows.
            work: Does the work on a slice of the rows; what it raises ends the batch.

        Raises:
            UnavailableError: Too much waits already, or the node is ending.
        """
        if rows <= FIRST_ROWS:
            work(slice(0, rows))
            return
        await self._wait_for_turn(_ROW_BYTES * rows)
        try:
            if rows > LARGE_ROWS:
                await self._endpoints.give_way()
            counts = self._counts.setdefault(model, {})
            count, begin = max(FIRST_ROWS, counts.get(name, 0)), 0
            while begin < rows:
                # Slices of about the same length: a short one would cost as many calls as others.
                rest = rows - begin
                end = begin + ceil(rest / ceil(rest / count))
                # Of the processor: what other programs take tells nothing of the rows.
                start = time.thread_time()
                work(slice(begin, end))
                elapsed = time.thread_time() - start
                # At most twice as many as before: one fast slice tells little of the next.
                fits = int((end - begin) * SLICE / max(elapsed, 1e-6))
                counts[name] = count = max(64, min(2 * count, fits))
                begin = end
                if begin < rows or rows > LARGE_ROWS:
                    await self._endpoints.give_way()
            self._endpoints.last_large = time.monotonic()
        finally:
            self._begin_next()

    async def run_stages(self, rows: int, stages: Generator[None, None, Found]) -> Found:
        """Return what a generator returns that does long work on all rows at once.

        Args:
            rows: Number of rows; of up to `FIRST_PUSHES` they wait for no other batch.
            stages: Pauses now and then; others have their turns at its pauses.

        Raises:
            UnavailableError: Too much waits already, or the node is ending.
        """
        if rows <= FIRST_PUSHES:
            return await in_turns(self._endpoints, stages)
        await self._wait_for_turn(_PUSH_BYTES * rows)
        try:
            return await in_turns(self._endpoints, stages)
        finally:
            self._begin_next()

    def _begin_next(self) -> None:
        self._running = bool(self._queue)
        if self._queue and not self._endpoints.ending:
            self._queue.popleft().settle()

    async def _wait_for_turn(self, size: int) -> None:
        if not self._running:
            self._running = True
            return
        if self._bytes + size > MOST_BYTES:
            raise UnavailableError(
                f"batches of {self._bytes >> 20} MiB wait already; ask again later"
            )
        waiting = Waiting()
        self._queue.append(waiting)
        self._bytes += size
        try:
            await waiting
        finally:
            self._bytes -= size

    def _refuse_next(self, error: Exception) -> None:
        if self._queue:
            self._queue.popleft().settle(error)


async def in_turns(endpoints: Endpoints, stages: Generator[None, None, Found]) -> Found:
    """Return what a generator returns; others have their turns at its pauses."""
    begin = time.perf_counter()
    while True:
        try:
            next(stages)
        except StopIteration as end:
            found: Found = end.value
            return found
        if time.perf_counter() - begin > SLICE:
            await endpoints.give_way()
            begin = time.perf_counter()


def empty_rows(rows: int, columns: int) -> tuple[array[float], Floats]:
    """Return a float64[] field and a view of it as an array of rows to be filled.

    `array.array` is the one type that rclpy takes without looking at each element.
    """
    flat = array("d", (0.0,)) * (rows * columns)
    view = np.frombuffer(flat, dtype=np.float64) if rows else np.empty(0)
    return flat, view.reshape((rows, columns) if columns > 1 else (rows,))
