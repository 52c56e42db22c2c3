# SPDX-License-Identifier: Apache-2.0
"""The modules that a wrench, a batch, a file and an onset pass are those that the page lists."""

from __future__ import annotations

import re
import sys
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("rclpy", reason="rclpy is not installed")
pytest.importorskip("limit_surface_interfaces", reason="the interfaces are not built")

from builtin_interfaces.msg import Time
from geometry_msgs.msg import WrenchStamped

import limit_surface_ros
from limit_surface_ros.files.surface_file import SurfaceModel, write_surface_model
from limit_surface_ros.surface.kinds.power_sum import PowerSum
from limit_surface_ros.surface.scaling import Scaling

PACKAGE = Path(limit_surface_ros.__file__).parent
PAGE = Path(__file__).resolve().parents[2] / "docs" / "architecture.md"
SURFACE = PowerSum.norms([np.eye(3), np.diag([1.0, 2.0, 3.0])], Scaling(0.05, 2.0))


def told() -> dict[str, list[str]]:
    """Return the ways that the page tells, each with its modules in order."""
    section = PAGE.read_text(encoding="utf-8").split("\n## Ways", 1)[1].split("\n## ", 1)[0]
    ways = {}
    for part in section.split("\n### ")[1:]:
        title, _, text = part.partition("\n")
        ways[title] = re.findall(r"^\d+\. `([a-z_.]+)`", text, re.MULTILINE)
    return ways


class Entered:
    """The package's modules whose functions this thread enters inside the block, in order."""

    def __init__(self, within: str = "") -> None:
        """Note modules, or only those entered while a function of this name runs."""
        self.modules: list[str] = []
        self._within = within
        self._inside = not within

    def __enter__(self) -> list[str]:
        sys.setprofile(self._note)
        return self.modules

    def __exit__(self, *_: object) -> None:
        sys.setprofile(None)

    def _note(self, frame, event, _) -> None:
        code = frame.f_code
        if self._within and code.co_name == self._within and event in ("call", "return"):
            self._inside = event == "call"
        if event != "call" or not self._inside or not code.co_filename.startswith(str(PACKAGE)):
            return
        parts = Path(code.co_filename).relative_to(PACKAGE).with_suffix("").parts
        name = ".".join(parts).removesuffix(".__init__")
        # What a module does when it is imported is no way.
        if code.co_name != "<module>" and name not in self.modules:
            self.modules.append(name)


@pytest.fixture
def surface_file(tmp_path):
    path = tmp_path / "body.yaml"
    write_surface_model(SurfaceModel("body", SURFACE), path)
    return path


def entered_by_a_call(
    ros, node_class, service, name, request, within: str = "", **parameters
) -> list[str]:
    """Return the modules that a node enters to answer a request, and for nothing else.

    Of five calls the first may have more to make, and a timer may be due during any: the shortest.
    """
    import rclpy
    from rclpy.executors import SingleThreadedExecutor

    node = node_class(context=ros.context, parameter_overrides=overrides_of(parameters))
    executor = SingleThreadedExecutor(context=ros.context)
    executor.add_node(node)
    client_node = ros.add(lambda **options: rclpy.create_node("asks", **options))
    client = client_node.create_client(service, name)
    while not client.service_is_ready():
        executor.spin_once(timeout_sec=0.05)
    while not node.host.prepared:
        executor.spin_once(timeout_sec=0.05)
    try:
        ways = []
        for _ in range(5):
            future = client.call_async(request)
            with Entered(within) as modules:
                while not future.done():
                    executor.spin_once(timeout_sec=0.05)
            assert future.result().error_code == 0, future.result().error_msg
            ways.append(modules)
    finally:
        executor.shutdown()
        node.destroy_node()
    return min(ways, key=len)


def check(way: str, entered: list[str]) -> None:
    """Compare what was entered with what the page tells, however often the order differs."""
    listed = told()[way]
    assert sorted(entered) == sorted(listed), f"{way}: entered {entered}"


def overrides_of(parameters):
    from rclpy.parameter import Parameter

    return [Parameter(key, value=value) for key, value in parameters.items()]


def test_the_way_of_a_wrench(ros, surface_file):
    from limit_surface_interfaces.srv import WrenchToTwist

    from limit_surface_ros.nodes.limit_surface_node import LimitSurfaceNode
    from node_helpers import wrench_message

    modules = entered_by_a_call(
        ros,
        LimitSurfaceNode,
        WrenchToTwist,
        "/limit_surface/wrench_to_twist",
        WrenchToTwist.Request(wrench=wrench_message([3.0, 1.0, 0.1])),
        within="wrench_to_twist",
        model_files=[str(surface_file)],
        diagnostics_period=60.0,
    )
    check("A wrench", modules)
    assert len(modules) <= 10


def test_the_way_of_a_batch_of_twists(ros, surface_file):
    from limit_surface_interfaces.srv import TwistsToWrenches

    from limit_surface_ros.nodes.limit_surface_node import LimitSurfaceNode

    twists = np.random.default_rng(0).normal(size=(2000, 3))
    modules = entered_by_a_call(
        ros,
        LimitSurfaceNode,
        TwistsToWrenches,
        "/limit_surface/twists_to_wrenches",
        TwistsToWrenches.Request(twists=twists.ravel().tolist()),
        model_files=[str(surface_file)],
        diagnostics_period=60.0,
        marker_rate=0.1,
    )
    check("A batch of twists", modules)


def test_the_way_of_recorded_pushes_in_a_csv(tmp_path):
    from limit_surface_ros.tools.common.surface_fit import read_input
    from limit_surface_ros.tools.fit_surface import parser

    path = tmp_path / "pushes.csv"
    path.write_text("fx_N,fy_N,tau_Nm,vx,vy,omega\n2.1,0,0,1,0,0\n1.6,0,0.05,0.8,0,12\n")
    options = parser().parse_args([str(path), "--output", str(tmp_path / "model.yaml")])
    with Entered() as modules:
        read_input(path, options)
    check("Recorded pushes in a CSV", modules)


def test_the_way_of_a_decay_record(tmp_path):
    from limit_surface_ros.tools.common.decay_input import read_input
    from limit_surface_ros.tools.fit_decay import parser

    path = tmp_path / "record.csv"
    rows = "".join(f"{0.01 * k:.2f},{np.exp(-0.03 * k):.6f}\n" for k in range(100))
    path.write_text(f"t [s],force\n{rows}")
    options = parser().parse_args([str(path), "--terms", "5", "--output", "model.yaml"])
    with Entered() as modules:
        read_input(options)
    check("A decay record", modules)


def test_the_way_of_an_onset(ros, client_node, tmp_path):
    from rclpy.executors import SingleThreadedExecutor

    from limit_surface_ros.nodes.decay_node import DecayNode
    from node_helpers import wrench_message

    parameters = {"diagnostics_period": 60.0, "rate": 100.0, "horizon": 1.0}
    node = DecayNode(context=ros.context, parameter_overrides=overrides_of(parameters))
    executor = SingleThreadedExecutor(context=ros.context)
    executor.add_node(node)
    onsets = client_node.create_publisher(WrenchStamped, "/decay/onset", 10)
    received = ros.listen(client_node, WrenchStamped, "/decay/wrench", 100)
    try:
        while not (onsets.get_subscription_count() and node.count_subscribers("/decay/wrench")):
            executor.spin_once(timeout_sec=0.02)
        onsets.publish(wrench_message([3.0, 0.0, 0.0], stamp=Time()))
        with Entered() as modules:
            while len(received) < 3:
                executor.spin_once(timeout_sec=0.02)
    finally:
        executor.shutdown()
        node.destroy_node()
    check("An onset", modules)
