# SPDX-License-Identifier: Apache-2.0
"""No number that is NaN or infinite leaves a node as good, whatever a model answers."""

from __future__ import annotations

import math

import numpy as np
import pytest

pytest.importorskip("rclpy", reason="rclpy is not installed")
pytest.importorskip("limit_surface_interfaces", reason="the interfaces are not built")

from geometry_msgs.msg import PoseStamped, TwistStamped, WrenchStamped
from limit_surface_interfaces.msg import DecayForecast, ErrorCode
from limit_surface_interfaces.srv import (
    EvaluateDecay,
    PredictStop,
    Push,
    TimeToLevel,
    TwistsToWrenches,
    TwistToWrench,
    WrenchesToTwists,
    WrenchToTwist,
)
from nav_msgs.msg import Path

from decay_helpers import Bench
from limit_surface_ros.errors import SolverError
from limit_surface_ros.nodes.limit_surface_node import LimitSurfaceNode
from limit_surface_ros.nodes.serving.answers import FiniteCheck
from limit_surface_ros.surface.base import LimitSurface
from node_helpers import twist_message, wrench_message

TWIST, WRENCH = twist_message([0.1, 0.2, 1.0]), wrench_message([9.0, 3.0, 0.1])
ROWS = [9.0, 3.0, 0.1, 1.0, 2.0, 0.1]


def push():
    asked = Push.Request(friction=0.3)
    asked.contact.x, asked.normal.x, asked.velocity.x = -0.05, 1.0, 0.1
    return asked


SURFACE_CALLS = {
    "wrench_to_twist": (WrenchToTwist, WrenchToTwist.Request(wrench=WRENCH)),
    "twist_to_wrench": (TwistToWrench, TwistToWrench.Request(twist=TWIST)),
    "wrenches_to_twists": (WrenchesToTwists, WrenchesToTwists.Request(wrenches=ROWS)),
    "twists_to_wrenches": (TwistsToWrenches, TwistsToWrenches.Request(twists=ROWS)),
    "push": (Push, push()),
}


@pytest.fixture(params=[math.nan, math.inf])
def broken(request, monkeypatch):
    """Surfaces whose answers hold one number that is not finite."""

    def spoil(values):
        values = np.array(values, dtype=float)
        values[..., -1] = request.param
        return values

    twist_and_factor = LimitSurface.twist_and_load_factor
    monkeypatch.setattr(
        LimitSurface,
        "twist_and_load_factor",
        lambda self, w: (spoil(twist_and_factor(self, w)[0]), twist_and_factor(self, w)[1]),
    )
    twist_of_wrench, wrench_of_twist = LimitSurface.twist_of_wrench, LimitSurface.wrench_of_twist
    monkeypatch.setattr(
        LimitSurface, "twist_of_wrench", lambda self, w: spoil(twist_of_wrench(self, w))
    )
    monkeypatch.setattr(
        LimitSurface, "wrench_of_twist", lambda self, t: spoil(wrench_of_twist(self, t))
    )


@pytest.mark.parametrize("name", [name for name in SURFACE_CALLS if name != "push"])
def test_services_of_surfaces_say_that_they_found_no_answer(
    ros, client_node, model_file, broken, name
):
    node = ros.add(LimitSurfaceNode, files=[model_file()[1]])
    kind, request = SURFACE_CALLS[name]
    answer = ros.client(client_node, kind, f"/limit_surface/{name}")(request)
    assert answer.error_code == ErrorCode.NO_CONVERGENCE
    assert "finite" in answer.error_msg
    assert node.health.refused[name, "NO_CONVERGENCE"] == 1


def test_topics_publish_nothing_then(ros, client_node, model_file, broken):
    node = ros.add(LimitSurfaceNode, files=[model_file()[1]])
    answers = ros.listen(client_node, TwistStamped, "/limit_surface/predicted_twist")
    answers += ros.listen(client_node, WrenchStamped, "/limit_surface/required_wrench")
    for kind, name, message in (
        (WrenchStamped, "wrench", WRENCH),
        (TwistStamped, "twist", TWIST),
    ):
        publisher = client_node.create_publisher(kind, f"/limit_surface/{name}", 10)
        ros.matched(publisher)
        publisher.publish(message)
        ros.wait(lambda name=name: node.health.refused[name, "NO_CONVERGENCE"] == 1)
    assert not answers


def test_a_push_whose_numbers_are_not_finite_is_refused(ros, client_node, model_file, monkeypatch):
    from limit_surface_ros.nodes import limit_surface_node

    honest = limit_surface_node.push

    def broken_push(*contact):
        pushed = honest(*contact)
        object.__setattr__(pushed, "wrench", np.array([math.nan, 0.0, 0.0]))
        return pushed

    monkeypatch.setattr(limit_surface_node, "push", broken_push)
    ros.add(LimitSurfaceNode, files=[model_file()[1]])
    answer = ros.client(client_node, Push, "/limit_surface/push")(push())
    assert answer.error_code == ErrorCode.NO_CONVERGENCE


@pytest.mark.parametrize(
    ("kind", "name", "request_"),
    [
        (EvaluateDecay, "evaluate", EvaluateDecay.Request(times=[0.0, 1.0])),
        (PredictStop, "predict_stop", PredictStop.Request(wrench=WRENCH)),
    ],
)
def test_services_of_decays_say_so_too(
    ros, client_node, tmp_path, monkeypatch, kind, name, request_
):
    bench = Bench(ros, client_node, tmp_path, sim_time=False)
    call = ros.client(client_node, kind, f"/decay/{name}")
    monkeypatch.setattr(
        type(bench.node.host.models[""].sum),
        "__call__",
        lambda _, times: np.full(len(times), math.nan),
    )
    assert call(request_).error_code == ErrorCode.NO_CONVERGENCE


def test_never_is_an_answer_where_the_interface_says_so(ros, client_node, tmp_path):
    Bench(ros, client_node, tmp_path, sim_time=False)
    call = ros.client(client_node, TimeToLevel, "/decay/time_to_level")
    answer = call(TimeToLevel.Request(level=0.0))
    assert answer.error_code == ErrorCode.NONE
    assert math.isinf(answer.time)
    assert not answer.reached


def test_the_check_looks_at_every_number_and_every_array():
    forecast = DecayForecast(times=[0.0, 1.0], values=[1.0, 0.5], bounds=[0.0, math.inf])
    with pytest.raises(SolverError, match=r"bounds\[1\] would be inf"):
        FiniteCheck(DecayForecast)(forecast)
    FiniteCheck(DecayForecast, ("bounds",))(forecast)
    forecast.bounds = [0.0, math.nan]
    with pytest.raises(SolverError, match="bounds would be nan"):
        FiniteCheck(DecayForecast, ("bounds",))(forecast)
    forecast.bounds = [0.0, 1.0]
    forecast.onset.torque.z = math.nan
    with pytest.raises(SolverError, match=r"onset\.torque\.z"):
        FiniteCheck(DecayForecast)(forecast)
    huge = WrenchStamped()
    huge.wrench.force.x = huge.wrench.force.y = 1.7e308
    FiniteCheck(WrenchStamped)(huge)
    path = Path(poses=[PoseStamped(), PoseStamped()])
    FiniteCheck(Path)(path)
    path.poses[1].pose.position.y = math.nan
    with pytest.raises(SolverError, match=r"poses\[1\].*pose\.position\.y"):
        FiniteCheck(Path)(path)
