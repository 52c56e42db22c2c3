# SPDX-License-Identifier: Apache-2.0
"""What our node is measured against: the same interfaces with handlers that do nothing.

Usage: python bare_node.py NAME
"""

from __future__ import annotations

import signal
import sys
from array import array
from typing import Any

import rclpy
from geometry_msgs.msg import TwistStamped, WrenchStamped
from limit_surface_interfaces.srv import (
    EvaluateDecay,
    ListDecays,
    ListModels,
    PredictStop,
    Push,
    TimeToLevel,
    TwistsToWrenches,
    TwistToWrench,
    WrenchesToTwists,
    WrenchToTwist,
)
from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy
from rclpy.signals import SignalHandlerOptions

# Times in an answer of our decay node with its default parameters.
STOP_POINTS = 201


class BareNode(Node):
    """Answers everything with what was prepared, and relays wrenches as twists."""

    def __init__(self, name: str) -> None:
        """Serve all services of both nodes but reload, and one topic."""
        super().__init__(name)
        self._zeros: dict[int, array[float]] = {}
        for kind, service in (
            (WrenchToTwist, "wrench_to_twist"),
            (TwistToWrench, "twist_to_wrench"),
            (Push, "push"),
            (ListModels, "list_models"),
            (TimeToLevel, "time_to_level"),
            (ListDecays, "list_decays"),
        ):
            self.create_service(
                kind,
                f"~/{service}",
                lambda _, response: response,
                qos_profile=QoSProfile(depth=1000),
            )
        self.create_service(WrenchesToTwists, "~/wrenches_to_twists", self._wrenches)
        self.create_service(TwistsToWrenches, "~/twists_to_wrenches", self._twists)
        self.create_service(EvaluateDecay, "~/evaluate", self._values)
        self.create_service(PredictStop, "~/predict_stop", self._stop)
        self._publisher = self.create_publisher(TwistStamped, "~/predicted_twist", 10)
        best_effort = QoSProfile(depth=10, reliability=ReliabilityPolicy.BEST_EFFORT)
        self.create_subscription(WrenchStamped, "~/wrench", self._relay, best_effort)

    def _wrenches(self, request: Any, response: Any) -> Any:
        count = len(request.wrenches)
        response.twists = self._prepared(count)
        response.load_factors = self._prepared(count // 3)
        return response

    def _twists(self, request: Any, response: Any) -> Any:
        count = len(request.twists)
        response.wrenches = self._prepared(count)
        response.powers = self._prepared(count // 3)
        return response

    def _values(self, request: Any, response: Any) -> Any:
        response.values = self._prepared(len(request.times))
        return response

    def _stop(self, _: Any, response: Any) -> Any:
        response.times = response.load_factors = self._prepared(STOP_POINTS)
        return response

    def _prepared(self, count: int) -> array[float]:
        if count not in self._zeros:
            self._zeros[count] = array("d", bytes(8 * count))
        return self._zeros[count]

    def _relay(self, message: WrenchStamped) -> None:
        answer = TwistStamped()
        answer.header = message.header
        self._publisher.publish(answer)


def main() -> None:
    """Serve until a signal ends it."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
    rclpy.spin(BareNode(sys.argv[1]))


if __name__ == "__main__":
    main()
