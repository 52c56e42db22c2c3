"""A node's health on /diagnostics, once a second if not asked otherwise."""

from __future__ import annotations

from typing import TYPE_CHECKING

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rclpy.clock import Clock, ClockType

from limit_surface_ros.nodes.settings import Setting

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from rclpy.node import Node

    from limit_surface_ros.nodes.health import Health
    from limit_surface_ros.nodes.parameters import Parameters

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
        describe: Further values, by key.
    """

    def __init__(
        self,
        node: Node,
        parameters: Parameters,
        health: Health,
        describe: Callable[[], Mapping[str, str]],
    ) -> None:
        """Start the timer."""
        self._node = node
        self._health = health
        self._describe = describe
        self._parameters = parameters
        self._publisher = node.create_publisher(DiagnosticArray, "/diagnostics", 10)
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        period = parameters["diagnostics_period"]
        self._timer = node.create_timer(period, self._publish, clock=steady)

    def _publish(self) -> None:
        message = DiagnosticArray(status=[self._status()])
        message.header.stamp = self._node.get_clock().now().to_msg()
        self._publisher.publish(message)
        self._health.restart_window()

    def _status(self) -> DiagnosticStatus:
        health = self._health
        now = self._node.get_clock().now().nanoseconds
        stale = health.stale(now, self._parameters["input_timeout"])
        level, summary = DiagnosticStatus.OK, "serving"
        if stale:
            level, summary = DiagnosticStatus.STALE, f"no input on {', '.join(stale)}"
        elif health.news:
            level, summary = DiagnosticStatus.WARN, f"{health.news} inputs refused"
        elif health.qos_mismatches:
            level = DiagnosticStatus.WARN
            summary = f"incompatible QoS on {', '.join(health.qos_mismatches)}"
        values = {**self._describe(), **_numbers(health, now)}
        return DiagnosticStatus(
            level=level,
            name=self._node.get_fully_qualified_name().lstrip("/"),
            message=summary,
            values=[KeyValue(key=key, value=value) for key, value in values.items()],
        )


def _numbers(health: Health, now: int) -> dict[str, str]:
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
    values["QoS mismatches"] = str(sum(health.qos_mismatches.values()))
    values["last error"] = health.last_error
    return values
