# SPDX-License-Identifier: Apache-2.0
"""Call services from a program: a node spun in a thread, plain calls that wait for the answer."""

from __future__ import annotations

import sys
import threading
import time
from typing import TYPE_CHECKING, Any

import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.task import Future

from limit_surface_ros.checks import check_utf_8

if TYPE_CHECKING:
    from collections.abc import Callable
    from types import TracebackType


# A server that has not discovered this client's side yet drops its answer (rmw_fastrtps): ask
# again after so long [s].
AGAIN = 2.0


class ServiceClient:
    """A client node of its own; use it in a `with` block, which ends its thread.

    Calls may be repeated, so that only services that change nothing should be called.

    Args:
        name: Name of the node.
        patience: How long a call waits for a service and for its answer, if not told [s].
        alive: Tells whether whoever serves still runs; nobody is waited for who does not.
    """

    def __init__(
        self, name: str, patience: float = 10.0, alive: Callable[[], bool] = lambda: True
    ) -> None:
        """Start the node and its thread.

        Raises:
            RangeError: An argument of the process is not UTF-8.
        """
        self.patience = patience
        self.alive = alive
        self._context = rclpy.Context()
        check_utf_8(sys.argv)
        rclpy.init(context=self._context)
        self.node = rclpy.create_node(name, context=self._context)
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self.node)
        self._over = Future()
        spin = self._executor.spin_until_future_complete
        self._thread = threading.Thread(target=spin, args=(self._over,))
        self._thread.start()
        self._clients: dict[str, Any] = {}

    def __enter__(self) -> ServiceClient:
        """Return itself."""
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """End the thread first: a process that ends while it spins aborts.

        Only then the executor: rclpy's `shutdown` takes from one that spins what it needs.
        """
        self._over.set_result(None)
        self._thread.join()
        self._executor.shutdown()
        self.node.destroy_node()
        self._context.try_shutdown()

    def call(
        self, service_type: Any, name: str, request: Any, timeout: float | None = None
    ) -> Any:
        """Call a service and return its answer.

        Raises:
            TimeoutError: There is no such service, or it does not answer in time [s].
        """
        timeout = self.patience if timeout is None else timeout
        end = time.monotonic() + timeout
        client = self._clients.get(name)
        if client is None:
            client = self.node.create_client(service_type, name)
            while not client.wait_for_service(timeout_sec=min(timeout, AGAIN)):
                if time.monotonic() > end or not self.alive():
                    raise TimeoutError(f"there is no service {name} after {timeout:g} s")
            self._clients[name] = client
            end = time.monotonic() + timeout
        while (left := end - time.monotonic()) > 0.0 and self.alive():
            answered = threading.Event()
            future = client.call_async(request)
            future.add_done_callback(lambda _, event=answered: event.set())
            if answered.wait(min(left, AGAIN)):
                return future.result()
            client.remove_pending_request(future)
        raise TimeoutError(f"service {name} did not answer within {timeout:g} s")
