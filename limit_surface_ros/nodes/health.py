# SPDX-License-Identifier: Apache-2.0
"""What a node has seen since it started: the numbers behind its diagnostics. ROS-free."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field


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
        times: Time spent in callbacks since the last report.
        last_error: The last refusal's sentence.
        news: Refusals since the last report.
    """

    accepted: Counter[str] = field(default_factory=Counter)
    refused: Counter[tuple[str, str]] = field(default_factory=Counter)
    reported: Counter[str] = field(default_factory=Counter)
    inputs: dict[str, InputAge] = field(default_factory=dict)
    times: CallbackTimes = field(default_factory=CallbackTimes)
    last_error: str = ""
    news: int = 0

    def refuse(self, where: str, code: str, sentence: str) -> None:
        """Count a refusal."""
        self.refused[where, code] += 1
        self.last_error = f"{where}: {sentence}"
        self.news += 1

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
        self.news = 0
