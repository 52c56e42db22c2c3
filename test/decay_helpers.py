# SPDX-License-Identifier: Apache-2.0
"""A simulated clock, decay models in files, and what tests of the decay node share."""

from __future__ import annotations

import numpy as np
from builtin_interfaces.msg import Time
from geometry_msgs.msg import Vector3Stamped, WrenchStamped
from limit_surface_interfaces.msg import DecayForecast
from rclpy.qos import DurabilityPolicy, QoSProfile
from rosgraph_msgs.msg import Clock

from limit_surface_ros.decay.exponential_sum import ExponentialSum
from limit_surface_ros.files.decay_file import DecayModel, write_decay_model
from limit_surface_ros.files.surface_file import SurfaceModel, write_surface_model
from limit_surface_ros.nodes.decay_node import DecayNode
from limit_surface_ros.surface.kinds.power_sum import PowerSum
from limit_surface_ros.surface.scaling import Scaling

SECOND = 1_000_000_000
LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
LOAD = (3.0, -2.0, 0.5, 0.04, -0.02, 0.1)
SURFACE = SurfaceModel(
    "box", PowerSum.thesis([np.diag([1.0, 1.0, 1.0])], Scaling(0.05, 2.0)), "object"
)
SUM = ExponentialSum([-1.2, -2.0 + 6.0j, -2.4 + 13.0j], [1.4, -0.3 + 0.2j, -0.1 - 0.05j])


def stamp_of(time):
    """Return a time [ns] as a stamp."""
    return Time(sec=time // SECOND, nanosec=time % SECOND)


def time_of(message):
    """Return a message's stamp [ns]."""
    return message.header.stamp.sec * SECOND + message.header.stamp.nanosec


def load_message(time, load=LOAD, frame="object"):
    """Return a stamped wrench of six components."""
    message = WrenchStamped()
    message.header.stamp = stamp_of(time)
    message.header.frame_id = frame
    force, torque = message.wrench.force, message.wrench.torque
    force.x, force.y, force.z, torque.x, torque.y, torque.z = map(float, load)
    return message


def load_of(message):
    """Return the six components of a stamped wrench."""
    force, torque = message.wrench.force, message.wrench.torque
    return np.array([force.x, force.y, force.z, torque.x, torque.y, torque.z])


def write_decay(folder, name="soft", x=SUM, max_error=0.0, span=(0.0, 6.0)):
    """Write a decay model and return its path."""
    path = folder / f"{name}.yaml"
    write_decay_model(DecayModel(name, x, span, "inf", max_error), path)
    return path


class Bench:
    """A decay node on a simulated clock, its inputs and what it has published.

    Args:
        ros: The spinner.
        client: The node of the test.
        folder: Where model files are written.
        sim_time: Whether the test is the clock.
        namespace: Of the decay node.
        files: Decay model files; none: one of `SUM`.
        parameters: Further ones.
    """

    def __init__(
        self, ros, client, folder, *, sim_time=True, namespace="", files=(), **parameters
    ):
        self.ros = ros
        surface = folder / "surface.yaml"
        write_surface_model(SURFACE, surface)
        parameters |= {"use_sim_time": sim_time, "surface_files": [str(surface)]}
        files = files or [write_decay(folder)]
        self.node = ros.add(DecayNode, files=files, parameters=parameters, namespace=namespace)
        top = f"{namespace}/decay" if namespace else "/decay"
        deep = QoSProfile(depth=20_000)
        self.wrenches = ros.listen(client, WrenchStamped, f"{top}/wrench", deep)
        self.values = ros.listen(client, Vector3Stamped, f"{top}/value", deep)
        self.forecasts = ros.listen(client, DecayForecast, f"{top}/forecast", LATCHED)
        self._onsets = client.create_publisher(WrenchStamped, f"{top}/onset", 10)
        self._measurements = client.create_publisher(WrenchStamped, f"{top}/measurement", 1000)
        self._clock = client.create_publisher(Clock, "/clock", 1)
        ros.matched(self._onsets)
        ros.matched(self._measurements)
        for topic in ("wrench", "value", "forecast"):
            ros.wait(lambda topic=topic: self.node.count_subscribers(f"{top}/{topic}"))
        if sim_time:
            ros.matched(self._clock)

    @property
    def now(self):
        """Node time [ns]."""
        return self.node.get_clock().now().nanoseconds

    @property
    def refused(self):
        """Number of refusals, by input and code."""
        return self.node.health.refused

    def tick(self, time):
        """Set the clock to a time [ns] and wait until the node has it."""
        self._clock.publish(Clock(clock=stamp_of(time)))
        self.ros.wait(lambda: self.now == time)

    def run(self, start, end, step=SECOND // 50):
        """Let the clock run, in steps [ns]."""
        for time in range(start, end + 1, step):
            self.tick(time)

    def onset(self, time, load=LOAD, frame="object"):
        """Give an onset and wait until the node has taken or refused it."""
        before = self._taken("onset")
        self._onsets.publish(load_message(time, load, frame))
        self.ros.wait(lambda: self._taken("onset") > before)

    def measure(self, *samples, frame="object"):
        """Give measurements (time [ns], load) and wait until all are taken or refused."""
        before = self._taken("measurement")
        for time, load in samples:
            self._measurements.publish(load_message(time, load, frame))
        self.ros.wait(lambda: self._taken("measurement") >= before + len(samples))

    def _taken(self, name):
        health = self.node.health
        refused = sum(count for (where, _), count in health.refused.items() if where == name)
        return health.accepted[name] + refused
