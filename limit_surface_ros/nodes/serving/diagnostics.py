# SPDX-License-Identifier: Apache-2.0
"""A node's health: what it has counted since it started, on /diagnostics."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rclpy.clock import Clock, ClockType
from rclpy.event_handler import PublisherEventCallbacks

from limit_surface_ros.nodes.serving.settings import Setting

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from rclpy.node import Node

    from limit_surface_ros.nodes.serving.parameters import Parameters, Values
    from limit_surface_ros.nodes.serving.peers import LostMessages, Mismatch, Peers

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
    ),
)


@dataclass
class InputAge:
    """When the last good message of one input came, in node time.

    Attributes:
        last: Time of the last good message [ns]; None before the first.
    """

    last: int | None = None

    def seconds(self, now: int) -> float | None:
        """Return the age at `now` [ns] in [s]; None before the first message.

        A clock that jumps back (a bag played again) makes the message as old as the jump.
        """
        if self.last is None:
            return None
        self.last = min(self.last, now)
        return (now - self.last) * 1e-9


@dataclass
class CallbackTimes:
    """Mean and maximum of the time spent in callbacks [s] since the last report."""

    count: int = 0
    total: float = 0.0
    longest: float = 0.0

    def add(self, seconds: float) -> None:
        """Count one callback."""
        self.count += 1
        self.total += seconds
        self.longest = max(self.longest, seconds)

    @property
    def mean(self) -> float:
        """Mean time [s]; 0 without callbacks."""
        return self.total / self.count if self.count else 0.0


@dataclass
class Health:
    """Counts, ages and times of one node.

    Attributes:
        accepted: Requests and messages answered, by service or topic.
        refused: Requests and messages refused, by (service or topic, name of the error code).
        reported: Things worth a look that were accepted all the same, by what they are.
        inputs: Age of each topic input.
        lost: Messages of each topic input that the middleware has dropped.
        times: Time spent in callbacks since the last report.
        last_error: The last refusal's sentence.
        news: Refusals since the last report, by (service or topic, name of the error code).
    """

    accepted: Counter[str] = field(default_factory=Counter)
    refused: Counter[tuple[str, str]] = field(default_factory=Counter)
    reported: Counter[str] = field(default_factory=Counter)
    inputs: dict[str, InputAge] = field(default_factory=dict)
    lost: dict[str, LostMessages] = field(default_factory=dict)
    times: CallbackTimes = field(default_factory=CallbackTimes)
    last_error: str = ""
    news: Counter[tuple[str, str]] = field(default_factory=Counter)

    def refuse(self, where: str, code: str, sentence: str) -> None:
        """Count a refusal."""
        self.refused[where, code] += 1
        self.last_error = f"{where}: {sentence}"
        self.news[where, code] += 1

    def news_in_words(self) -> str:
        """Return what was refused since the last report, and why the last was."""
        counts = ", ".join(
            f"{count} on {where}: {code}" for (where, code), count in self.news.most_common(3)
        )
        return f"{sum(self.news.values())} inputs refused ({counts}); last {self.last_error}"

    def stale(self, now: int, timeout: float) -> list[str]:
        """Return the inputs that came once and have been silent for more than `timeout` [s].

        Args:
            now: Node time [ns].
            timeout: Longest silence [s]; 0: none is too long.
        """
        ages = {name: age.seconds(now) for name, age in self.inputs.items()}
        if timeout <= 0.0:
            return []
        return [name for name, age in ages.items() if age is not None and age > timeout]

    def restart_window(self) -> None:
        """Begin the next report's window."""
        self.times = CallbackTimes()
        self.news.clear()


class Diagnostics:
    """Publishes a node's health.

    The timer runs in steady time, so that a paused or jumping simulated clock does not silence it.

    Args:
        node: The node.
        parameters: Its parameters, which include `SETTINGS`.
        health: Its counts.
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
        self._mismatches: list[Mismatch] = []
        self._times_seen: dict[tuple[str, tuple[int, ...]], int] = {}
        self._duplicates = 0
        self._times_duplicated = 0
        self._describe = describe
        self._parameters = parameters
        self._publisher = node.create_publisher(
            DiagnosticArray,
            "/diagnostics",
            10,
            event_callbacks=PublisherEventCallbacks(use_default_callbacks=False),
        )
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        self._timer = node.create_timer(1.0, self._publish, clock=steady)
        parameters.on_change(["diagnostics_period"], self._prepare_timer)

    def _prepare_timer(self, values: Values) -> Callable[[], None]:
        period = round(1e9 * values["diagnostics_period"])

        def apply() -> None:
            self._timer.timer_period_ns = period

        return apply

    def _publish(self) -> None:
        self._look_at_peers()
        self._look_at_duplicates()
        message = DiagnosticArray(status=[self._status()])
        message.header.stamp = self._node.get_clock().now().to_msg()
        self._publisher.publish(message)
        self._health.restart_window()

    def _look_at_duplicates(self) -> None:
        self._duplicates = self._peers.duplicates()
        self._times_duplicated = self._times_duplicated + 1 if self._duplicates else 0
        # At the first look a node that has just ended may still be in the graph.
        if self._times_duplicated == 2:
            self._node.get_logger().warning(self._duplicate_message)

    @property
    def _duplicate_message(self) -> str:
        return (
            f"{self._duplicates} other node(s) named {self._node.get_fully_qualified_name()}: all "
            "of them answer (one that was killed counts for some seconds); give one another "
            "name, -r __node:=NAME, or namespace, -r __ns:=/NAMESPACE"
        )

    def _look_at_peers(self) -> None:
        before, self._times_seen = self._times_seen, {}
        self._mismatches = [*self._peers.mismatches()]
        for peer in self._mismatches:
            key = peer.topic, peer.identity
            self._times_seen[key] = times = before.get(key, 0) + 1
            # At the first look a peer that has just come may not have its name yet.
            if times == 2:
                self._node.get_logger().warning(peer.sentence)

    def _status(self) -> DiagnosticStatus:
        health = self._health
        now = self._node.get_clock().now().nanoseconds
        stale = health.stale(now, self._parameters["input_timeout"])
        messages = []
        if health.news:
            messages.append(health.news_in_words())
        if stale:
            messages.append(f"no input on {', '.join(stale)}")
        if self._mismatches:
            messages.append(self._mismatches[0].sentence)
        if self._duplicates:
            messages.append(self._duplicate_message)
        if not now:
            messages.append("node time is 0: use_sim_time is true, and /clock has not come yet")
        level = DiagnosticStatus.WARN if messages else DiagnosticStatus.OK
        if stale:
            level = DiagnosticStatus.STALE
        values = {**self._describe(), **_counts_and_times(health, now)}
        values["mismatched peers"] = str(len(self._mismatches))
        values["duplicates"] = str(self._duplicates)
        return DiagnosticStatus(
            level=level,
            name=self._node.get_fully_qualified_name().lstrip("/"),
            message="; ".join(messages) or "serving",
            values=[KeyValue(key=key, value=value) for key, value in values.items()],
        )


def _counts_and_times(health: Health, now: int) -> dict[str, str]:
    values = {f"accepted {name}": str(count) for name, count in health.accepted.items()}
    for (name, code), count in health.refused.items():
        values[f"refused {name} {code}"] = str(count)
    for what, count in health.reported.items():
        values[what] = str(count)
    for name, lost in health.lost.items():
        values[f"lost {name}"] = str(lost.count)
    for name, age in health.inputs.items():
        seconds = age.seconds(now)
        values[f"input age {name} [s]"] = "none yet" if seconds is None else f"{seconds:.3f}"
    values["callback time mean [ms]"] = f"{health.times.mean * 1e3:.3f}"
    values["callback time max [ms]"] = f"{health.times.longest * 1e3:.3f}"
    values["last error"] = health.last_error
    return values
