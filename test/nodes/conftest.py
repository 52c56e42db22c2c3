# SPDX-License-Identifier: Apache-2.0
"""Real nodes in this process, spun in a thread; tests wait on what happens, never on time."""

from __future__ import annotations

import os
import threading
from pathlib import Path

import numpy as np
import pytest

from limit_surface_ros.files.surface_file import SurfaceModel, write_surface_model
from limit_surface_ros.surface.kinds.power_sum import PowerSum
from limit_surface_ros.surface.scaling import Scaling
from process_helpers import WAIT, own_domain

os.environ |= own_domain("nodes of this process")


class Spinner:
    """A context with an executor in a thread."""

    def __init__(self) -> None:
        import rclpy
        from rclpy.executors import SingleThreadedExecutor

        self.context = rclpy.Context()
        rclpy.init(context=self.context)
        self.executor = SingleThreadedExecutor(context=self.context)
        self.nodes: list = []
        self._changed = threading.Condition()
        self._closing = threading.Event()
        self._thread = threading.Thread(target=self._spin)
        self._thread.start()

    def _spin(self) -> None:
        while not self._closing.is_set():
            self.executor.spin_once()

    def add(self, make, *args, parameters=None, files=None, remap=(), namespace=None):
        """Make a node with parameters (a dict) and spin it."""
        from rclpy.parameter import Parameter

        values = dict(parameters or {})
        if files is not None:
            values["model_files"] = [str(path) for path in files]
        overrides = []
        for name, value in values.items():
            kind = Parameter.Type.STRING_ARRAY if value == [] else None
            overrides.append(Parameter(name, kind, value))
        cli = ["--ros-args", *(part for rule in remap for part in ("-r", rule))]
        node = make(
            *args,
            context=self.context,
            parameter_overrides=overrides,
            namespace=namespace,
            cli_args=cli if remap else None,
        )
        self.nodes.append(node)
        self.executor.add_node(node)
        return node

    def client(self, node, service_type, name):
        """Return a function that calls a service and waits for the answer."""
        client = node.create_client(service_type, name)
        assert client.wait_for_service(timeout_sec=WAIT), f"no service {name}"

        def call(request, timeout=WAIT):
            # Under load a server may drop an answer to a client that it has not discovered yet.
            for _ in range(10):
                future = client.call_async(request)
                if self.done(future, timeout / 10):
                    return future.result()
                client.remove_pending_request(future)
            raise AssertionError(f"no answer from {name}")

        return call

    def done(self, future, timeout):
        """Wait for a future, outside the executor's thread."""
        done = threading.Event()
        future.add_done_callback(lambda _: done.set())
        return done.wait(timeout)

    def listen(self, node, message_type, topic, qos=10):
        """Subscribe and return the list that the messages are put in; see `wait`."""
        received: list = []

        def take(message) -> None:
            with self._changed:
                received.append(message)
                self._changed.notify_all()

        node.create_subscription(message_type, topic, take, qos)
        return received

    def wait(self, condition, timeout=WAIT):
        """Wait until a condition holds; it is looked at when a message came, or 50 times a second.

        What a node counts cannot notify, hence the second.
        """
        import time

        end = time.monotonic() + timeout
        with self._changed:
            while not condition():
                left = end - time.monotonic()
                assert left > 0.0, "the condition did not come true"
                self._changed.wait(min(left, 0.02))

    def matched(self, publisher, count=1):
        """Wait until a publisher has its subscribers."""
        self.wait(lambda: publisher.get_subscription_count() >= count)

    def close(self) -> None:
        """End the thread first: a process must not end while one spins.

        It ends between two callbacks: rclpy's `shutdown` takes from one that runs what it needs.
        """
        self.executor.create_task(self._closing.set)
        self._thread.join()
        self.executor.shutdown()
        for node in self.nodes:
            node.destroy_node()
        self.context.try_shutdown()


@pytest.fixture
def ros():
    pytest.importorskip("rclpy", reason="rclpy is not installed: source a Jazzy or use make test")
    pytest.importorskip(
        "limit_surface_interfaces", reason="the interfaces are not built: use make test"
    )
    spinner = Spinner()
    yield spinner
    spinner.close()


@pytest.fixture
def client_node(ros):
    import rclpy

    return ros.add(lambda **options: rclpy.create_node("client", **options))


def surface_of(seed: int, terms: int) -> PowerSum:
    """Return a random surface of the thesis's family, of one term an ellipsoid."""
    rng = np.random.default_rng(seed)
    factors = rng.normal(size=(terms, 3, 3))
    matrices = factors @ factors.transpose(0, 2, 1) + 0.1 * np.eye(3)
    return PowerSum.thesis(matrices, Scaling(0.05, 2.0))


@pytest.fixture
def model_file(tmp_path):
    """Return a function that writes a model file and returns model and path.

    An ellipsoid does where any surface does: of others each node makes a table, in a third of a
    second.
    """

    def write(name="box", seed=0, folder: Path = tmp_path, terms=1, **fields):
        model = SurfaceModel(name=name, surface=surface_of(seed, terms), **fields)
        path = folder / f"{name}.yaml"
        write_surface_model(model, path)
        return model, path

    return write
