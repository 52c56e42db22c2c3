# SPDX-License-Identifier: Apache-2.0
"""A node's health on /diagnostics, once a second if not asked otherwise."""

from __future__ import annotations

from typing import TYPE_CHECKING

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rclpy.clock import Clock, ClockType
from rclpy.event_handler import PublisherEventCallbacks

from limit_surface_ros.nodes.settings import Setting

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from rclpy.node import Node

    from limit_surface_ros.nodes.health import Health
    from limit_surface_ros.nodes.parameters import Parameters
    from limit_surface_ros.nodes.peers import Mismatch, Peers

SETTINGS = (
    Setting(
        "input_timeout",
        0.5,
        "Longest silence of a topic input in node time before it is reported as stale [s]; "
        "0: never",
        minimum=0.0,
        maximum=1e6,
    ),
    Setting(
        "diagnostics_period",
        1.0,
        "Time between two messages on /diagnostics [s]",
        minimum=0.01,
        maximum=60.0,
        read_only=True,
    ),
)


class Diagnostics:
    """Publishes a node's health.

    The timer runs in steady time, so that a paused or jumping simulated clock does not silence it.

    Args:
        node: The node.
        parameters: Its parameters, which include `SETTINGS`.
        health: What it has seen.
        peers: Those on its topics.
        describe: Further values, by key.
    """

    def __init__(
        self,
        node: Node,
        parameters: Parameters,
        health: Health,
        peers: Peers,
        describe: Callable[[], Mapping[str, str]],
    ) -> None:
        """Start the timer."""
        self._node = node
        self._health = health
        self._peers = peers
        self._strangers: list[Mismatch] = []
        self._looks: dict[tuple[str, tuple[int, ...]], int] = {}
        self._namesakes = 0
        self._crowded = 0
        self._describe = describe
        self._parameters = parameters
        self._publisher = node.create_publisher(
            DiagnosticArray,
            "/diagnostics",
            10,
            event_callbacks=PublisherEventCallbacks(use_default_callbacks=False),
        )
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        period = parameters["diagnostics_period"]
        self._timer = node.create_timer(period, self._publish, clock=steady)

    def _publish(self) -> None:
        self._look_at_peers()
        self._look_at_namesakes()
        message = DiagnosticArray(status=[self._status()])
        message.header.stamp = self._node.get_clock().now().to_msg()
        self._publisher.publish(message)
        self._health.restart_window()

    def _look_at_namesakes(self) -> None:
        count = self._peers.namesakes()
        self._crowded = self._crowded + 1 if count else 0
        self._namesakes = count
        # At the first look a node that has just ended may still be in the graph.
        if self._crowded == 2:
            self._node.get_logger().warning(self._crowd)

    @property
    def _crowd(self) -> str:
        return (
            f"{self._namesakes} other node(s) named {self._node.get_fully_qualified_name()}: all "
            "of them answer (one that was killed counts for some seconds); give one another "
            "name, -r __node:=NAME, or namespace, -r __ns:=/NAMESPACE"
        )

    def _look_at_peers(self) -> None:
        before, self._looks = self._looks, {}
        self._strangers = [*self._peers.mismatched()]
        for peer in self._strangers:
            key = peer.topic, peer.identity
            self._looks[key] = looks = before.get(key, 0) + 1
            # At the first look a peer that has just come may not have its name yet.
            if looks == 2:
                self._node.get_logger().warning(peer.sentence)

    def _status(self) -> DiagnosticStatus:
        health = self._health
        now = self._node.get_clock().now().nanoseconds
        stale = health.stale(now, self._parameters["input_timeout"])
        level, summary = DiagnosticStatus.OK, "serving"
        if stale:
            level, summary = DiagnosticStatus.STALE, f"no input on {', '.join(stale)}"
        elif health.news:
            level, summary = DiagnosticStatus.WARN, f"{health.news} inputs refused"
        elif self._strangers:
            level, summary = DiagnosticStatus.WARN, self._strangers[0].sentence
        elif self._namesakes:
            level, summary = DiagnosticStatus.WARN, self._crowd
        values = {**self._describe(), **_counts_and_times(health, now)}
        values["mismatched peers"] = str(len(self._strangers))
        values["namesakes"] = str(self._namesakes)
        return DiagnosticStatus(
            level=level,
            name=self._node.get_fully_qualified_name().lstrip("/"),
            message=summary,
            values=[KeyValue(key=key, value=value) for key, value in values.items()],
        )


def _counts_and_times(health: Health, now: int) -> dict[str, str]:
    values = {f"accepted {name}": str(count) for name, count in health.accepted.items()}
    for (name, code), count in health.refused.items():
        values[f"refused {name} {code}"] = str(count)
    for what, count in health.reported.items():
        values[what] = str(count)
    for name, age in health.inputs.items():
        seconds = age.seconds(now)
        values[f"input age {name} [s]"] = "none yet" if seconds is None else f"{seconds:.3f}"
    values["callback time mean [ms]"] = f"{health.times.mean * 1e3:.3f}"
    values["callback time max [ms]"] = f"{health.times.longest * 1e3:.3f}"
    values["last error"] = health.last_error
    return values
