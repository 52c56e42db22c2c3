# SPDX-License-Identifier: Apache-2.0
"""Whatever is sent, each service answers with a code and no input ends or fills the node."""

from __future__ import annotations

import signal
import threading
from array import array
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("rclpy", reason="rclpy is not installed")
pytest.importorskip("limit_surface_interfaces", reason="the interfaces are not built")

from builtin_interfaces.msg import Time
from geometry_msgs.msg import TwistStamped, WrenchStamped
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from limit_surface_interfaces.msg import ErrorCode
from limit_surface_interfaces.srv import (
    DescribeModel,
    ListModels,
    Push,
    SimulatePushes,
    TwistsToWrenches,
    TwistToWrench,
    WrenchesToTwists,
    WrenchToTwist,
)
from rclpy.serialization import serialize_message
from std_msgs.msg import Header

from limit_surface_ros.files.surface_file import SurfaceModel, write_surface_model
from limit_surface_ros.motion.outline import Polygon
from limit_surface_ros.nodes.limit_surface_node import LimitSurfaceNode
from limit_surface_ros.nodes.messages import convert
from limit_surface_ros.nodes.serving.answers import FiniteCheck
from limit_surface_ros.surface.kinds.dissipation import Dissipation
from limit_surface_ros.surface.scaling import Scaling
from node_helpers import Program, handled, planar_twist, processor_ticks, wrench_message
from process_helpers import WAIT

PUSHES = 40
CODES = {
    ErrorCode.NONE,
    ErrorCode.NOT_FINITE,
    ErrorCode.ZERO_VECTOR,
    ErrorCode.BAD_SHAPE,
    ErrorCode.OUT_OF_RANGE,
    ErrorCode.UNKNOWN_MODEL,
    ErrorCode.UNKNOWN_FRAME,
    ErrorCode.NO_CONVERGENCE,
}
numbers = st.floats(width=64) | st.sampled_from([0.0, 1e308, -1e308, 5e-324, 1e-310, 1.0, -1.0])
texts = st.sampled_from(["", "object", "box", "tool", "x" * 100_000]) | st.text(
    st.characters(blacklist_categories=["Cs"], blacklist_characters="\x00"), max_size=20
)
sixes = st.lists(numbers, min_size=6, max_size=6)
flats = st.lists(numbers, max_size=12).map(lambda values: array("d", values))
many = settings(
    max_examples=20,
    suppress_health_check=[HealthCheck.function_scoped_fixture],
    deadline=None,
)


@st.composite
def wrenches(draw):
    message = WrenchStamped()
    message.header.frame_id = draw(texts)
    force, torque = message.wrench.force, message.wrench.torque
    force.x, force.y, force.z, torque.x, torque.y, torque.z = draw(sixes)
    return message


@st.composite
def twists(draw):
    message = TwistStamped()
    message.header.frame_id = draw(texts)
    linear, angular = message.twist.linear, message.twist.angular
    linear.x, linear.y, linear.z, angular.x, angular.y, angular.z = draw(sixes)
    return message


@st.composite
def pushes(draw):
    asked = Push.Request(model=draw(texts), friction=draw(numbers))
    asked.header = draw(headers())
    for vector in (asked.contact, asked.normal, asked.velocity):
        vector.x, vector.y, vector.z = draw(numbers), draw(numbers), draw(numbers)
    return asked


@st.composite
def headers(draw):
    stamp = Time(
        sec=draw(st.integers(-(2**31), 2**31 - 1)), nanosec=draw(st.integers(0, 2**32 - 1))
    )
    return Header(frame_id=draw(texts), stamp=draw(st.sampled_from([Time(), stamp])))


REQUESTS = {
    "wrench_to_twist": (
        WrenchToTwist,
        st.builds(WrenchToTwist.Request, model=texts, wrench=wrenches()),
    ),
    "twist_to_wrench": (
        TwistToWrench,
        st.builds(TwistToWrench.Request, model=texts, twist=twists()),
    ),
    "wrenches_to_twists": (
        WrenchesToTwists,
        st.builds(WrenchesToTwists.Request, header=headers(), model=texts, wrenches=flats),
    ),
    "twists_to_wrenches": (
        TwistsToWrenches,
        st.builds(TwistsToWrenches.Request, header=headers(), model=texts, twists=flats),
    ),
    "push": (Push, pushes()),
    "list_models": (ListModels, st.builds(ListModels.Request)),
    "describe_model": (DescribeModel, st.builds(DescribeModel.Request, model=texts)),
}
MODES = [
    {},
    {"assume_model_frame": True, "static_transforms": ["object tool 1 2 3 0.1 0.2 0.3"]},
    {"normal_force_from": "wrench"},
]


@pytest.fixture(params=MODES, ids=["plain", "frames", "pressed"])
def fuzzed(ros, client_node, model_file, request):
    _, path = model_file(terms=2, normal_force=10.0)
    return ros.add(LimitSurfaceNode, files=[path], parameters=request.param)


@pytest.mark.nightly
@pytest.mark.parametrize("name", REQUESTS)
def test_three_thousand_requests_of_each_kind_get_codes_of_the_package(
    ros, client_node, model_file, name
):
    _, path = model_file(terms=2, normal_force=10.0)
    transforms = ["object tool 1 2 3 0.1 0.2 0.3"]
    node = ros.add(LimitSurfaceNode, files=[path], parameters={"static_transforms": transforms})
    service_type, requests = REQUESTS[name]
    call = ros.client(client_node, service_type, f"/limit_surface/{name}")

    @settings(many, max_examples=3000)
    @given(request=requests)
    def check(request):
        answer = call(request)
        assert answer.error_code in CODES, answer.error_msg
        FiniteCheck(service_type.Response)(answer)

    check()
    assert not [code for _, code in node.health.refused if code == "INTERNAL"]


@pytest.mark.parametrize("name", REQUESTS)
def test_every_request_gets_a_code_that_explains_it(ros, client_node, fuzzed, name):
    service_type, requests = REQUESTS[name]
    call = ros.client(client_node, service_type, f"/limit_surface/{name}")

    @many
    @given(request=requests)
    def check(request):
        answer = call(request)
        assert answer.error_code in CODES, answer.error_msg
        assert bool(answer.error_msg) == (answer.error_code != ErrorCode.NONE)
        if answer.error_code == ErrorCode.NONE and name == "wrench_to_twist":
            assert np.isfinite([*planar_twist(answer.twist), answer.load_factor]).all()

    check()


@pytest.mark.parametrize(
    ("topic", "answered", "kind", "messages"),
    [
        ("wrench", "predicted_twist", TwistStamped, wrenches()),
        ("twist", "required_wrench", WrenchStamped, twists()),
    ],
)
def test_every_message_is_answered_or_counted(
    ros, client_node, fuzzed, topic, answered, kind, messages
):
    answers = ros.listen(client_node, kind, f"/limit_surface/{answered}")
    sent_kind = {TwistStamped: WrenchStamped, WrenchStamped: TwistStamped}[kind]
    publisher = client_node.create_publisher(sent_kind, f"/limit_surface/{topic}", 10)
    ros.matched(publisher)
    ros.wait(lambda: client_node.count_publishers(f"/limit_surface/{answered}") == 1)
    health = fuzzed.health

    @many
    @given(message=messages)
    def check(message):
        before = handled(health, topic)
        publisher.publish(message)
        ros.wait(lambda: handled(health, topic) == before + 1)

    check()
    assert not [code for _, code in health.refused if code == "INTERNAL"], health.last_error
    for answer in answers:
        part = answer.twist if kind is TwistStamped else answer.wrench
        assert np.isfinite([part.linear.x if kind is TwistStamped else part.force.x]).all()


def test_ten_clients_at_once_get_their_own_answers(ros, client_node, model_file):
    model, path = model_file()
    ros.add(LimitSurfaceNode, files=[path])
    clients = [
        ros.client(client_node, WrenchToTwist, "/limit_surface/wrench_to_twist") for _ in range(10)
    ]
    wrong = []

    def ask(index, call):
        rng = np.random.default_rng(index)
        for wrench in rng.normal(size=(20, 3)):
            answer = call(WrenchToTwist.Request(wrench=wrench_message(wrench)))
            if not np.allclose(planar_twist(answer.twist), model.surface.twist_of_wrench(wrench)):
                wrong.append((index, wrench))

    threads = [threading.Thread(target=ask, args=item) for item in enumerate(clients)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert not wrong


def test_a_client_that_dies_in_the_middle_of_a_call_harms_nobody(ros, client_node, model_file):
    import rclpy

    _, path = model_file()
    flat = convert.flat_of(np.ones((20_000, 3)))
    with Program("limit_surface_node", "--ros-args", "-p", f"model_files:=['{path}']") as program:
        call = ros.client(client_node, WrenchesToTwists, "/limit_surface/wrenches_to_twists")
        for _ in range(5):
            dying = rclpy.create_node("dying", context=ros.context)
            client = dying.create_client(WrenchesToTwists, "/limit_surface/wrenches_to_twists")
            assert client.wait_for_service(timeout_sec=WAIT)
            client.call_async(WrenchesToTwists.Request(wrenches=flat))
            dying.destroy_node()
        assert call(WrenchesToTwists.Request(wrenches=flat)).error_code == ErrorCode.NONE
        code, output = program.end()
    assert code == 0, output


def resident(pid: int) -> int:
    """Return the resident memory of a process [kB]."""
    status = Path(f"/proc/{pid}/status").read_text()
    return int(status.partition("VmRSS:")[2].split()[0])


def test_requests_of_a_million_rows_leave_no_memory_behind(ros, client_node, model_file):
    _, path = model_file()
    with Program("limit_surface_node", "--ros-args", "-p", f"model_files:=['{path}']") as program:
        call = ros.client(client_node, WrenchesToTwists, "/limit_surface/wrenches_to_twists")
        flat = convert.flat_of(np.ones((1_000_000, 3)))
        sizes = []
        for _ in range(6):
            answer = call(WrenchesToTwists.Request(wrenches=flat))
            assert answer.error_code == ErrorCode.NONE
            sizes.append(resident(program.process.pid))
        code, output = program.end()
    assert code == 0, output
    # Buffers of the middleware are there after the first two; one answer holds 32 MB.
    assert sizes[-1] - sizes[2] < 16_000


@pytest.mark.parametrize(
    ("number", "executor"), [(signal.SIGINT, "single_threaded"), (signal.SIGTERM, "events")]
)
def test_a_signal_during_a_call_ends_the_node_cleanly_after_its_answer(
    ros, client_node, tmp_path, number, executor
):
    # The work is long, so that the signal comes while it is done; the request is short, so that
    # none of it is still on its way when the node stops listening.
    factors = np.random.default_rng(0).normal(size=(24, 3, 2))
    surface = Dissipation(factors @ factors.transpose(0, 2, 1), Scaling(0.05, 2.0))
    path = tmp_path / "slow.yaml"
    square = Polygon([[-0.1, -0.1], [0.1, -0.1], [0.1, 0.1], [-0.1, 0.1]])
    write_surface_model(SurfaceModel(name="slow", surface=surface, outline=square), path)
    heights = np.linspace(-0.08, 0.08, PUSHES)

    def pushes(number: int, accuracy: float) -> SimulatePushes.Request:
        start, end = (
            np.stack([np.full(number, x), heights[:number]], axis=1) for x in (-0.2, 0.2)
        )
        request = SimulatePushes.Request(tip_radius=0.005, friction=0.3, accuracy=accuracy)
        request.header.frame_id = "table"
        request.poses = convert.flat_of(np.zeros((number, 3)))
        request.tip_starts, request.tip_ends = convert.flat_of(start), convert.flat_of(end)
        return request

    options = "-p", f"model_files:=['{path}']", "-p", f"executor:={executor}"
    with Program("limit_surface_node", "--ros-args", *options) as program:
        client = client_node.create_client(SimulatePushes, "/limit_surface/simulate_pushes")
        assert client.wait_for_service(timeout_sec=WAIT)
        # Once it has answered, the node has found this client and prepared its model: what it
        # works at then is the long call.
        while not ros.done(client.call_async(pushes(1, 1e-3)), 5.0):
            pass
        idle = processor_ticks(program.process.pid)
        answered = client.call_async(pushes(PUSHES, 1e-8))
        ros.wait(lambda: processor_ticks(program.process.pid) > idle + 10)
        assert not answered.done()
        code, output = program.end(number)
    assert code == 0, output
    assert ros.done(answered, WAIT), output
    answer = answered.result()
    assert answer.error_code == ErrorCode.NONE, answer.error_msg
    assert len(answer.outcomes) == PUSHES
    assert "Traceback" not in output
    assert "terminate" not in output


def test_a_message_that_rclpy_cannot_read_does_not_end_the_node(ros, client_node, model_file):
    _, path = model_file()
    good = wrench_message([9.0, 0.0, 0.0], frame="object")
    broken = serialize_message(good).replace(b"object", b"\xff\xfe\xff\xfe\xff\xfe")
    assert broken != serialize_message(good)
    with Program("limit_surface_node", "--ros-args", "-p", f"model_files:=['{path}']") as program:
        twists_seen = ros.listen(client_node, TwistStamped, "/limit_surface/predicted_twist")
        publisher = client_node.create_publisher(WrenchStamped, "/limit_surface/wrench", 10)
        ros.matched(publisher)
        ros.wait(lambda: client_node.count_publishers("/limit_surface/predicted_twist") == 1)
        publisher.publish(broken)
        call = ros.client(client_node, WrenchToTwist, "/limit_surface/wrench_to_twist")
        assert call(WrenchToTwist.Request(wrench=good)).error_code == ErrorCode.NONE
        timer = client_node.create_timer(0.05, lambda: publisher.publish(good))
        ros.wait(lambda: twists_seen)
        timer.cancel()
        code, output = program.end()
    assert code == 0, output
