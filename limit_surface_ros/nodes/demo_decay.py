# SPDX-License-Identifier: Apache-2.0
"""The decay part of the demonstration: an onset, the falling wrench, and when sliding stops."""

from __future__ import annotations

import math
import threading
import time
from typing import TYPE_CHECKING, Any

import numpy as np
from geometry_msgs.msg import WrenchStamped
from limit_surface_interfaces.srv import EvaluateDecay, PredictStop
from rclpy.qos import QoSProfile

from limit_surface_ros.nodes import convert
from limit_surface_ros.nodes.convert import nanoseconds

if TYPE_CHECKING:
    from collections.abc import Sequence

    from limit_surface_ros.nodes.service_client import ServiceClient

MODEL = "exponential"
TOLERANCE = 1e-6
ROWS = 8
AFTER = 1.25  # of the time of the stop: how long the wrench is watched
HEADING = f"{'t [s]':>7}{'fx [N]':>10}{'fy [N]':>10}{'tau [Nm]':>10}{'factor':>9}  body"


class FallingWrench:
    """Gives the decay node an onset and keeps what it publishes.

    Args:
        client: Its node publishes and subscribes.
        prefix: Name of the decay node.
        load: The onset's load.
    """

    def __init__(self, client: ServiceClient, prefix: str, load: WrenchStamped) -> None:
        """Subscribe, and give the onset once the node hears and is heard."""
        self._client = client
        self._rows: list[tuple[int, tuple[float, float, float]]] = []
        self._changed = threading.Condition()
        node = client.node
        node.create_subscription(
            WrenchStamped, f"{prefix}/wrench", self._take, QoSProfile(depth=1000)
        )
        onsets = node.create_publisher(WrenchStamped, f"{prefix}/onset", 1)
        self._wait(
            lambda: onsets.get_subscription_count() and node.count_publishers(f"{prefix}/wrench")
        )
        load.header.stamp = node.get_clock().now().to_msg()
        self.start = nanoseconds(load.header.stamp)
        onsets.publish(load)

    def until(self, latest: float) -> tuple[Any, Any]:
        """Wait until the wrench of a time [s] is there; return all times and planar wrenches."""
        self._wait(lambda: bool(self._rows) and self._seconds(self._rows[-1][0]) >= latest)
        with self._changed:
            stamps, loads = zip(*self._rows, strict=True)
        return np.array([self._seconds(stamp) for stamp in stamps]), np.array(loads)

    def _seconds(self, stamp: int) -> float:
        return (stamp - self.start) * 1e-9

    def _take(self, message: WrenchStamped) -> None:
        wrench = message.wrench
        planar = (wrench.force.x, wrench.force.y, wrench.torque.z)
        with self._changed:
            self._rows.append((nanoseconds(message.header.stamp), planar))
            self._changed.notify_all()

    def _wait(self, condition: Any) -> None:
        end = time.monotonic() + self._client.patience
        while time.monotonic() < end and self._client.alive():
            with self._changed:
                if condition():
                    return
                self._changed.wait(0.05)
        raise TimeoutError("the decay node sends nothing")


def show(client: ServiceClient, namespace: str, frame: str, load: Sequence[float]) -> bool:
    """Push with a load that dies away; print what comes and whether it agrees with logarithms.

    Args:
        client: Calls services.
        namespace: The decay node's namespace.
        frame: The surface's frame.
        load: (fx, fy, tau_z) at the onset, beyond the surface.

    Raises:
        RuntimeError: A service answered with an error.
        TimeoutError: A service or a topic is silent.
    """
    prefix = f"{namespace}/decay"
    values = _ask(
        client, EvaluateDecay, f"{prefix}/evaluate", model=MODEL, times=[0.0, 1.0]
    ).values
    rate = math.log(values[0] / values[1])
    push = WrenchStamped()
    push.header.frame_id = frame
    convert.fill_wrench(push.wrench, load)
    stop = _ask(client, PredictStop, f"{prefix}/predict_stop", model=MODEL, wrench=push)
    factor = stop.load_factor
    print(f"\na push of {factor:.3f} times the limit that dies away as exp(-{rate:.3g} t)\n")
    print(HEADING)
    falling = FallingWrench(client, prefix, push)
    times, loads = falling.until(AFTER * stop.stop_time)
    factors = factor * np.exp(-rate * times)
    for row in np.linspace(0, len(times) - 1, ROWS).astype(int):
        numbers = f"{times[row]:>7.3f}" + "".join(f"{part:>10.4f}" for part in loads[row])
        body = "slides" if factors[row] > 1.0 else "rests"
        print(f"{numbers}{factors[row]:>9.3f}  {body}")
    closed_form = math.log(factor) / rate
    error = float(np.abs(loads - np.multiply.outer(factors / factor, load)).max())
    print(
        f"\nit stops after {stop.stop_time:.9f} s; the closed form ln(factor) / rate says "
        f"{closed_form:.9f} s\n{len(times)} wrenches came, at most {error:.1e} N off exp"
    )
    return abs(stop.stop_time - closed_form) < TOLERANCE and error < TOLERANCE


def _ask(client: ServiceClient, service_type: Any, name: str, **fields: Any) -> Any:
    answer = client.call(service_type, name, service_type.Request(**fields))
    if answer.error_code:
        raise RuntimeError(f"{name} answered with error {answer.error_code}: {answer.error_msg}")
    return answer
