# SPDX-License-Identifier: Apache-2.0
"""Every service of both nodes answers whatever it is asked: a code, or numbers that are finite."""

from __future__ import annotations

import copy
from array import array
from operator import attrgetter

import numpy as np
import pytest

pytest.importorskip("rclpy", reason="rclpy is not installed")
pytest.importorskip("limit_surface_interfaces", reason="the interfaces are not built")

import limit_surface_interfaces.srv
from geometry_msgs.msg import PoseStamped
from limit_surface_interfaces.msg import ErrorCode

from decay_helpers import SECOND, Bench, load_message
from limit_surface_ros.motion.outline import Polygon
from limit_surface_ros.nodes import decay_node, limit_surface_node
from limit_surface_ros.nodes.limit_surface import push_services
from limit_surface_ros.nodes.limit_surface_node import LimitSurfaceNode
from limit_surface_ros.nodes.serving.answers import FiniteCheck
from node_helpers import twist_message, wrench_message

CODES = {getattr(ErrorCode, name) for name in dir(type(ErrorCode)) if name.isupper()}
SURFACE = {each.name: each for each in (*limit_surface_node.SERVICES, *push_services.SERVICES)}
DECAY = {each.name: each for each in decay_node.SERVICES}
HARD = [0.0, -0.0, 1.0, -1.0, 1e-310, 5e-324, 1e300, -1e308, np.nan, np.inf, -np.inf]
TEXTS = ["", "object", "tool", "box", "soft", "none", "a/b", "\u00e9\u6f22", "x" * 100_000]
SQUARE = [(-0.1, -0.1), (0.1, -0.1), (0.1, 0.1), (-0.1, 0.1)]


def leaves(message, prefix=""):
    """Yield the dotted name and the type of each field that holds no other message."""
    for name, kind in message.get_fields_and_field_types().items():
        value = getattr(message, name)
        if hasattr(value, "get_fields_and_field_types"):
            yield from leaves(value, f"{prefix}{name}.")
        else:
            yield prefix + name, kind


def spoil(message, name, kind, rng):
    """Put something into one field that was not meant for it."""
    *path, last = name.split(".")
    holder = attrgetter(".".join(path))(message) if path else message
    old = getattr(holder, last)
    if kind in ("double", "float"):
        value = (
            rng.choice(HARD) if rng.random() < 0.6 else rng.normal() * 10.0 ** rng.integers(-9, 9)
        )
        setattr(holder, last, float(value))
    elif kind == "boolean":
        setattr(holder, last, not old)
    elif kind == "string":
        setattr(holder, last, str(rng.choice(TEXTS)))
    elif kind.startswith("sequence<double"):
        values = list(old) + rng.normal(size=rng.integers(0, 7)).tolist()
        for place in range(len(values)):
            if rng.random() < 0.3:
                values[place] = float(rng.choice(HARD))
        setattr(holder, last, array("d", values[: rng.integers(0, len(values) + 1)]))
    elif kind.startswith("double["):
        values = np.array(old, dtype=float)
        values[rng.integers(len(values))] = rng.choice(HARD)
        setattr(holder, last, values)
    elif kind.startswith(("uint", "int")):
        low, high = {"int32": (-(2**31), 2**31 - 1), "uint32": (0, 2**32 - 1)}.get(kind, (0, 255))
        setattr(holder, last, int(rng.integers(low, high + 1)))
    elif isinstance(old, list) and old:
        each = old[rng.integers(len(old))]
        inner = list(leaves(each))
        spoil(each, *inner[rng.integers(len(inner))], rng)


def good(name, kind):
    """Return a request that is answered, or at least begun with."""
    asked = kind.Request()
    for field, value in (
        ("wrench", wrench_message([9.0, 3.0, 0.1])),
        ("twist", twist_message([0.1, 0.2, 1.0])),
        ("wrenches", array("d", [9.0, 3.0, 0.1, 1.0, 2.0, 0.1])),
        ("twists", array("d", [0.1, 0.2, 1.0, 1.0, 2.0, 0.1])),
        ("times", array("d", [0.0, 1.0])),
        ("friction", 0.3),
        ("level", 0.5),
    ):
        if hasattr(asked, field) and isinstance(value, type(getattr(asked, field))):
            setattr(asked, field, value)
    if hasattr(asked, "tip_path"):
        asked.tip_path.poses = [PoseStamped(), PoseStamped()]
        asked.tip_path.poses[0].pose.position.x = -0.12
        asked.tip_path.poses[1].pose.position.x = -0.08
        asked.start.orientation.w = 1.0
    if hasattr(asked, "tip_starts"):
        asked.poses = array("d", [0.0, 0.0, 0.0])
        asked.tip_starts, asked.tip_ends = array("d", [-0.12, 0.0]), array("d", [-0.08, 0.0])
    for field, along in (("contact", -0.05), ("normal", 1.0), ("velocity", 0.1)):
        if hasattr(asked, field) and hasattr(getattr(asked, field), "x"):
            getattr(asked, field).x = along
    if name.startswith(("predict_", "required_")) and hasattr(asked, "wrench"):
        asked.wrench = load_message(10 * SECOND)
    return asked


@pytest.fixture(params=["limit_surface", "decay"])
def serves(request, ros, client_node, tmp_path, model_file):
    """A node that has what it needs to answer, its services, and what makes their clients."""
    if request.param == "decay":
        node = Bench(ros, client_node, tmp_path, sim_time=False).node
        services = DECAY
    else:
        written = model_file(terms=2, normal_force=10.0, outline=Polygon(SQUARE))
        transforms = {"static_transforms": ["object tool 1 2 3 0.1 0.2 0.3"]}
        node = ros.add(LimitSurfaceNode, files=[written[1]], parameters=transforms)
        services = SURFACE
    name = request.param
    return node, services, lambda each: ros.client(client_node, each.type, f"/{name}/{each.name}")


def hold_out(serves, count):
    """Ask so many spoilt requests of each service."""
    node, services, client = serves
    rng = np.random.default_rng(1)
    for service in services.values():
        call = client(service)
        # A list of models says NaN for what their files do not state.
        check = FiniteCheck(service.type.Response, service.unbounded, ("models",))
        fields = list(leaves(service.type.Request()))
        for _ in range(count):
            # Messages share what is put into them, such as a stamp: only a copy may be spoilt.
            asked = copy.deepcopy(good(service.name, service.type))
            for _ in range(rng.integers(0, 4) if fields else 0):
                spoil(asked, *fields[rng.integers(len(fields))], rng)
            answer = call(asked)
            assert answer.error_code in CODES
            assert answer.error_code != ErrorCode.INTERNAL, (answer.error_msg, asked)
            assert bool(answer.error_msg) == (answer.error_code != ErrorCode.NONE)
            assert len(answer.error_msg) < 2100
            check(answer)
    assert not [key for key in node.health.refused if key[1] == "INTERNAL"]


def test_no_service_of_the_interfaces_is_left_out():
    asked = {each.type for each in (*SURFACE.values(), *DECAY.values())}
    names = {name for name in dir(limit_surface_interfaces.srv) if name[0].isupper()}
    assert {kind.__name__ for kind in asked} == {name for name in names if "_" not in name}


def test_spoilt_requests_of_every_service_get_codes(serves):
    hold_out(serves, 15)


@pytest.mark.nightly
def test_a_thousand_spoilt_requests_of_every_service_get_codes(serves):
    hold_out(serves, 1000)
