# SPDX-License-Identifier: Apache-2.0
"""The decay part of the demonstration: an onset, the falling wrench, and a slide that ends."""

from __future__ import annotations

import math
import threading
import time
from typing import TYPE_CHECKING, Any

import numpy as np
from geometry_msgs.msg import InertiaStamped, WrenchStamped
from limit_surface_interfaces.srv import EvaluateDecay, PredictSlide, PredictStop
from rclpy.qos import QoSProfile

from limit_surface_ros.nodes.messages import convert
from limit_surface_ros.nodes.messages.convert import nanoseconds

if TYPE_CHECKING:
    from collections.abc import Sequence

    from limit_surface_ros.nodes.clients.service_client import ServiceClient

MODEL = "exponential"
TOLERANCE = 1e-6
ROWS = 8
AFTER = 1.25  # of the time until friction can hold the body: how long the wrench is watched
MASS, MOMENT = 0.3, 5e-4  # [kg], [kg m^2]
# How nearly straight the slide is, in parts of its time: the patch is a triangle.
STRAIGHT = 0.05
HEADING = f"{'t [s]':>7}{'fx [N]':>10}{'fy [N]':>10}{'tau [Nm]':>10}{'factor':>9}  friction"
SLIDE_HEADING = f"{'t [s]':>7}{'x [m]':>10}{'y [m]':>10}{'turn [deg]':>11}{'speed [m/s]':>12}"


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
    held = _ask(client, PredictStop, f"{prefix}/predict_stop", model=MODEL, wrench=push)
    factor = held.load_factor
    print(f"\na push of {factor:.3f} times the limit that dies away as exp(-{rate:.3g} t)\n")
    print(HEADING)
    falling = FallingWrench(client, prefix, push)
    times, loads = falling.until(AFTER * held.holds_from)
    factors = factor * np.exp(-rate * times)
    for row in np.linspace(0, len(times) - 1, ROWS).astype(int):
        numbers = f"{times[row]:>7.3f}" + "".join(f"{part:>10.4f}" for part in loads[row])
        friction = "gives way" if factors[row] > 1.0 else "can hold"
        print(f"{numbers}{factors[row]:>9.3f}  {friction}")
    closed_form = math.log(factor) / rate
    error = float(np.abs(loads - np.multiply.outer(factors / factor, load)).max())
    print(
        f"\nfriction can hold it after {held.holds_from:.9f} s; the closed form ln(factor) / rate "
        f"says {closed_form:.9f} s\n{len(times)} wrenches came, at most {error:.1e} N off exp"
    )
    agrees = abs(held.holds_from - closed_form) < TOLERANCE and error < TOLERANCE
    return _show_slide(client, prefix, push, factor, rate) and agrees


def _show_slide(
    client: ServiceClient, prefix: str, push: WrenchStamped, factor: float, rate: float
) -> bool:
    """Let the same load move a body with mass; print its slide and whether its momentum agrees."""
    inertia = InertiaStamped()
    inertia.inertia.m, inertia.inertia.izz = MASS, MOMENT
    found = _ask(
        client,
        PredictSlide,
        f"{prefix}/predict_slide",
        model=MODEL,
        inertia=inertia,
        wrench=push,
        points=ROWS,
    )
    print(f"\na body of {MASS:g} kg that this push sets moving\n")
    print(SLIDE_HEADING)
    twists = np.array(found.twists).reshape(-1, 3)
    for second, stamped, twist in zip(found.times, found.path.poses, twists, strict=True):
        position, turn = stamped.pose.position, stamped.pose.orientation
        heading = math.degrees(2.0 * math.atan2(turn.z, turn.w))
        speed = math.hypot(twist[0], twist[1])
        print(
            f"{second:>7.3f}{position.x:>10.4f}{position.y:>10.4f}{heading:>11.3f}{speed:>12.4f}"
        )
    # The impulse of a straight push is used up by friction: s (1 - exp(-r T)) / r = T.
    used_up = factor * -math.expm1(-rate * found.stop_time) / rate
    print(
        f"\nit rests after {found.stop_time:.6f} s, when friction has used up the momentum of the "
        f"push (straight: {used_up:.6f} s)"
    )
    balanced = found.energy_residual < TOLERANCE
    return balanced and abs(used_up - found.stop_time) < STRAIGHT * found.stop_time


def _ask(client: ServiceClient, service_type: Any, name: str, **fields: Any) -> Any:
    answer = client.call(service_type, name, service_type.Request(**fields))
    if answer.error_code:
        raise RuntimeError(f"{name} answered with error {answer.error_code}: {answer.error_msg}")
    return answer
