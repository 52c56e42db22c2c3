# SPDX-License-Identifier: Apache-2.0
"""Handlers that wait: one runs to its `await Waiting()`, and on from there once that is settled.

They are resumed here and not by rclpy: of its executors one looks at each coroutine that waits
whenever anything happens, and the other knows none.
"""

from __future__ import annotations

import functools
import inspect
import time
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import collections
    from collections.abc import Callable, Coroutine, Iterator


class Waiting:
    """Something that a coroutine waits for until somebody settles it."""

    def __init__(self) -> None:
        """Wait."""
        self.settled = False
        self.refused_by: Exception | None = None
        # Set by who drives the coroutine.
        self.resume: Callable[[], None] | None = None

    def settle(self, refused_by: Exception | None = None) -> None:
        """End the waiting, by raising if there is an error; only the first call counts."""
        if self.settled:
            return
        self.settled, self.refused_by = True, refused_by
        # Let go of it: requests and answers of megabytes hang on it, in a circle.
        resume, self.resume = self.resume, None
        if resume is not None:
            resume()

    def __await__(self) -> Iterator[Waiting]:
        """Suspend the coroutine until this is settled."""
        while not self.settled:
            yield self
        if self.refused_by is not None:
            raise self.refused_by


class Handling:
    """One request or message on its way through a handler.

    Args:
        count_time: Called with each stretch of time [s] in which nobody else had a turn.
        handler: Function or coroutine function.
        arguments: What it is called with.
        ended: Called at the end, with an error or None.
        queue: Where those that wait are kept, the oldest first.
    """

    def __init__(
        self,
        count_time: Callable[[float], None],
        handler: Callable[..., Any],
        arguments: tuple[Any, ...],
        ended: Callable[[Exception | None], None],
        queue: collections.deque[Waiting] | None = None,
    ) -> None:
        """Keep what is to be called."""
        self._count_time = count_time
        self._handler = handler
        self._arguments = arguments
        self._ended = ended
        self._queue = queue
        self._running: Coroutine[Any, Any, None] | None = None

    def begin(self) -> None:
        """Call the handler."""
        start = time.perf_counter()
        error = None
        try:
            self._running = self._handler(*self._arguments)
        except Exception as raised:
            error = raised
        if error is not None or not inspect.iscoroutine(self._running):
            self._end(start, error)
        else:
            self._step(start)

    def _step(self, start: float) -> None:
        """Run the coroutine to its end, or to where it waits."""
        error = None
        try:
            waiting: Waiting = self._running.send(None)
        except StopIteration:
            pass
        except Exception as raised:
            error = raised
        else:
            self._count_time(time.perf_counter() - start)
            waiting.resume = functools.partial(self._resume, waiting)
            if self._queue is not None:
                self._queue.append(waiting)
            return
        self._end(start, error)

    def _resume(self, waiting: Waiting) -> None:
        if self._queue is not None:
            self._queue.remove(waiting)
        self._step(time.perf_counter())

    def _end(self, start: float, error: Exception | None) -> None:
        self._count_time(time.perf_counter() - start)
        self._running, self._arguments = None, ()
        self._ended(error)
