# SPDX-License-Identifier: Apache-2.0
"""The decay node's stream against a plain rclpy timer: rate, drift and delay over 10 s.

Both publish WrenchStamped from a process of their own; this one subscribes. The stream runs in
wall time. Rate is messages / 10 s; drift is how far the last stamp is from start + (n - 1) / rate,
which is what adds up over hours; delay is arrival - stamp.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import rclpy
from geometry_msgs.msg import WrenchStamped
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import QoSProfile

from limit_surface_ros.decay.exponential_sum import ExponentialSum
from limit_surface_ros.files.decay_file import DecayModel, write_decay_model
from limit_surface_ros.files.surface_file import SurfaceModel, write_surface_model
from limit_surface_ros.surface.kinds.power_sum import PowerSum

if TYPE_CHECKING:
    from collections.abc import Callable

SECONDS = 6.0
PLAIN_TIMER = """
import sys, rclpy
from geometry_msgs.msg import WrenchStamped
rclpy.init()
node = rclpy.create_node("plain_timer")
publisher = node.create_publisher(WrenchStamped, "plain", 100)
def publish():
    message = WrenchStamped()
    message.header.stamp = node.get_clock().now().to_msg()
    message.wrench.force.x = 1.0
    publisher.publish(message)
node.create_timer(1.0 / float(sys.argv[1]), publish)
rclpy.spin(node)
"""


class Listener:
    """Stamps and arrival times of one topic [ns]."""

    def __init__(self, node: Node, topic: str) -> None:
        """Subscribe."""
        self.rows: list[tuple[int, int]] = []
        self._clock = node.get_clock()
        node.create_subscription(WrenchStamped, topic, self._take, QoSProfile(depth=1000))

    def _take(self, message: WrenchStamped) -> None:
        stamp = message.header.stamp
        now = self._clock.now().nanoseconds
        self.rows.append((stamp.sec * 1_000_000_000 + stamp.nanosec, now))


def write_models(folder: Path) -> list[str]:
    """Write models with which the stream lasts and return the node's arguments for them."""
    slow = DecayModel("slow", ExponentialSum([-0.01, -2 + 5j], [1.0, 0.1]), (0.0, 6.0), "inf", 0.0)
    write_decay_model(slow, folder / "slow.yaml")
    surface = SurfaceModel("ball", PowerSum.thesis([np.eye(3)]), "object")
    write_surface_model(surface, folder / "ball.yaml")
    return [
        "-p",
        f"model_files:=['{folder / 'slow.yaml'}']",
        "-p",
        f"surface_files:=['{folder / 'ball.yaml'}']",
    ]


def wait(condition: Callable[[], object]) -> None:
    """Wait until a condition holds, at most 20 s."""
    end = time.monotonic() + 20.0
    while not condition():
        if time.monotonic() > end:
            raise TimeoutError("nothing came from the publisher within 20 s")
        time.sleep(0.01)


def measure(node: Node, rate: float, program: list[str], topic: str, onset: bool) -> list[str]:
    """Run one publisher for `SECONDS` and return its row of the table."""
    listener = Listener(node, topic)
    process = subprocess.Popen(program, stderr=subprocess.DEVNULL)
    try:
        if onset:
            starter = node.create_publisher(WrenchStamped, "/decay/onset", 10)
            wait(starter.get_subscription_count)
            message = WrenchStamped()
            message.wrench.force.x = 1.0
            starter.publish(message)
        wait(lambda: listener.rows)
        first = listener.rows[0][0]
        time.sleep(SECONDS + 0.5)
    finally:
        process.terminate()
        process.wait()
    rows = np.array([row for row in listener.rows if row[0] - first < SECONDS * 1e9])
    stamps, arrivals = rows[:, 0], rows[:, 1]
    drift = (stamps[-1] - first) * 1e-6 - (len(stamps) - 1) / rate * 1e3
    delays = (arrivals - stamps) * 1e-6
    jitter = np.diff(stamps) * 1e-6 - 1e3 / rate
    return [
        f"{rate:g}",
        f"{len(stamps) / SECONDS:.2f}",
        f"{100.0 * (len(stamps) / SECONDS / rate - 1.0):+.2f} %",
        f"{drift:+.4f}",
        f"{np.abs(jitter).max():.4f}",
        f"{np.median(delays):.2f}",
        f"{np.quantile(delays, 0.99):.2f}",
    ]


def main() -> int:
    """Print the table."""
    os.environ.setdefault("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
    rclpy.init()
    node = rclpy.create_node("bench_decay_node")
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    spinner = threading.Thread(target=executor.spin)
    spinner.start()
    print(
        "| publisher | asked [Hz] | got [Hz] | off | drift [ms] | stamp jitter max [ms] "
        "| delay p50 [ms] | p99 [ms] |"
    )
    print("|---|---|---|---|---|---|---|---|")
    with tempfile.TemporaryDirectory() as folder:
        models = write_models(Path(folder))
        for rate in (100.0, 1000.0):
            ours = [sys.executable, "-m", "limit_surface_ros.nodes.decay_node", "--ros-args"]
            ours += [*models, "-p", f"rate:={rate}", "--log-level", "warn"]
            for name in ("single_threaded", "events"):
                program = [*ours, "-p", f"executor:={name}"]
                row = measure(node, rate, program, "/decay/wrench", onset=True)
                print("| " + " | ".join([f"decay node, {name}", *row]) + " |", flush=True)
            plain = [sys.executable, "-c", PLAIN_TIMER, str(rate)]
            row = measure(node, rate, plain, "/plain", onset=False)
            print("| " + " | ".join(["plain rclpy timer", *row]) + " |")
    executor.shutdown()
    spinner.join()
    node.destroy_node()
    rclpy.try_shutdown()
    return 0


if __name__ == "__main__":
    sys.exit(main())
