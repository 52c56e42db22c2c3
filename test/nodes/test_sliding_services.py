# SPDX-License-Identifier: Apache-2.0
"""What the decay node tells of sliding bodies and slipping grasps is what the library finds."""

from __future__ import annotations

import math

import numpy as np
import pytest

pytest.importorskip("rclpy", reason="rclpy is not installed")
pytest.importorskip("limit_surface_interfaces", reason="the interfaces are not built")

from geometry_msgs.msg import InertiaStamped, PoseStamped, WrenchStamped
from limit_surface_interfaces.msg import ErrorCode, NormalForce
from limit_surface_interfaces.srv import (
    PredictSlide,
    PredictSlip,
    PredictStop,
    RequiredNormalForce,
)
from rclpy.qos import QoSProfile

from decay_helpers import SECOND, time_of, write_decay
from limit_surface_ros.decay.exponential_sum import ExponentialSum
from limit_surface_ros.files.surface_file import SurfaceModel, write_surface_model
from limit_surface_ros.motion.sliding.body import SlidingBody
from limit_surface_ros.motion.sliding.inertia import Inertia
from limit_surface_ros.motion.sliding.load import Load
from limit_surface_ros.motion.sliding.slide import slide, slide_stages, stop_bracket
from limit_surface_ros.motion.slip import load_factors, predict_slip, required_share
from limit_surface_ros.motion.stages import finish
from limit_surface_ros.nodes.decay_node import DecayNode
from limit_surface_ros.surface.kinds.dissipation import Dissipation
from limit_surface_ros.surface.kinds.point_contacts import PointContacts
from limit_surface_ros.surface.kinds.power_sum import PowerSum
from limit_surface_ros.surface.scaling import Scaling
from node_helpers import STAMP, planar_twist, twist_message, wrench_message

FADING = ExponentialSum([-1.0], [2.0])
RELAXING = ExponentialSum([0.0, -0.5], [6.0, 4.0])
STAYING = ExponentialSum([0.0, -1.0], [1.0, 1.0])
MAX_ERROR = 0.02
REFERENCE = (0.02, -0.01)
BOX = SurfaceModel(
    "box",
    Dissipation(
        [np.diag([0.3, 0.2, 0.2]), [[0.2, 0.0, 0.0], [0.0, 0.3, 0.05], [0.0, 0.05, 0.2]]],
        Scaling(0.05, 1.5),
    ),
    "object",
    reference_point=REFERENCE,
)
PAD = SurfaceModel(
    "pad", PowerSum([np.eye(3)], [1.0], Scaling(0.0036, 8.0)), "object", normal_force=10.0
)
POINT = SurfaceModel("point", PointContacts(np.array([[0.0, 0.0]]), [1.0]), "object")
SHOVE = (0.8, 0.2, 12.0)
PUSH = (4.0, 1.0, 0.1)
GRIP = (5.0, 1.0, 0.01)


@pytest.fixture
def node(ros, tmp_path):
    files = [
        write_decay(tmp_path, "fading", FADING, MAX_ERROR),
        write_decay(tmp_path, "relaxing", RELAXING, 0.05),
        write_decay(tmp_path, "staying", STAYING),
        write_decay(tmp_path, "late", ExponentialSum([-1.0, -2.0], [1.0, -1.0])),
    ]
    surfaces = []
    for model in (BOX, PAD, POINT):
        surfaces.append(tmp_path / f"surface_{model.name}.yaml")
        write_surface_model(model, surfaces[-1])
    parameters = {
        "surface_files": [str(path) for path in surfaces],
        "grip_surface": "pad",
        "grip_margin": 1.2,
        "contact_exponent": 0.25,
    }
    return ros.add(DecayNode, files=files, parameters=parameters)


@pytest.fixture
def predict_slide(ros, client_node, node):
    return ros.client(client_node, PredictSlide, "/decay/predict_slide")


@pytest.fixture
def predict_stop(ros, client_node, node):
    return ros.client(client_node, PredictStop, "/decay/predict_stop")


@pytest.fixture
def slip(ros, client_node, node):
    return ros.client(client_node, PredictSlip, "/decay/predict_slip")


@pytest.fixture
def required(ros, client_node, node):
    return ros.client(client_node, RequiredNormalForce, "/decay/required_normal_force")


def inertia_message(mass=0.3, moment=5e-4, centre=(0.03, -0.01)):
    message = InertiaStamped()
    message.inertia.m, message.inertia.izz = mass, moment
    message.inertia.com.x, message.inertia.com.y = centre
    return message


def at_reference(vector, what):
    """Return a planar wrench or twist of the frame's origin as it is at the reference point."""
    x, y = REFERENCE
    a, b, c = vector
    return (a, b, c - (x * b - y * a)) if what == "wrench" else (a - c * y, b + c * x, c)


def origin(pose):
    """Return the pose of the frame whose reference point is at a pose."""
    x, y, heading = pose
    c, s = math.cos(heading), math.sin(heading)
    rx, ry = REFERENCE
    return np.array([x - c * rx + s * ry, y - s * rx - c * ry, heading])


def planar_pose(stamped):
    position, turn = stamped.pose.position, stamped.pose.orientation
    return np.array([position.x, position.y, 2.0 * math.atan2(turn.z, turn.w)])


def expected_slide(load=None, twist=SHOVE):
    inertia = Inertia(0.3, 5e-4, (0.01, 0.0))
    start = at_reference(twist, "twist")
    return slide(BOX.surface, inertia, start, load, pose=(*REFERENCE, 0.0))


def test_a_shoved_body_slides_as_the_library_says(predict_slide):
    pose = PoseStamped()
    pose.header.frame_id, pose.header.stamp = "table", STAMP
    pose.pose.position.x, pose.pose.position.y, pose.pose.position.z = 1.0, 2.0, 0.7
    pose.pose.orientation.z, pose.pose.orientation.w = math.sin(0.4), math.cos(0.4)
    answer = predict_slide(
        PredictSlide.Request(
            inertia=inertia_message(), twist=twist_message(SHOVE), pose=pose, points=21
        )
    )
    assert (answer.error_code, answer.error_msg) == (ErrorCode.NONE, "")
    found = expected_slide()
    assert answer.stop_time == pytest.approx(found.time, rel=1e-12)
    assert answer.earliest_stop_time == answer.latest_stop_time == answer.stop_time
    x, y, heading = origin(found.pose)
    c, s = math.cos(0.8), math.sin(0.8)
    place = [1.0 + c * x - s * y, 2.0 + s * x + c * y, 0.8 + heading]
    np.testing.assert_allclose(planar_pose(answer.final_pose), place, atol=1e-9)
    assert answer.final_pose.pose.position.z == 0.7
    path = answer.path.poses
    assert len(path) == len(answer.times) == 21
    assert answer.path.header.frame_id == path[7].header.frame_id == "table"
    np.testing.assert_allclose(planar_pose(path[0]), [1.0, 2.0, 0.8], atol=1e-12)
    begin = STAMP.sec * SECOND + STAMP.nanosec
    assert [time_of(each) - begin for each in path] == [
        round(each * SECOND) for each in np.linspace(0.0, found.time, 21)
    ]
    twists = np.array(answer.twists).reshape(-1, 3)
    np.testing.assert_allclose(twists[0], SHOVE, atol=1e-9)
    assert not twists[-1].any()
    direction = at_reference(planar_twist(answer.final_direction), "twist")
    np.testing.assert_allclose(direction, found.final_direction, atol=1e-9)
    assert answer.final_direction.header.frame_id == "object"
    assert len(answer.rests) == 0
    assert answer.energy_residual < 1e-7


@pytest.mark.parametrize("in_world", [False, True])
def test_a_load_that_dies_away_moves_the_body(predict_slide, in_world):
    answer = predict_slide(
        PredictSlide.Request(
            inertia=inertia_message(), wrench=wrench_message(PUSH), load_in_world=in_world
        )
    )
    assert answer.error_code == ErrorCode.NONE
    load = Load(at_reference(PUSH, "wrench"), FADING, in_world=in_world)
    found = expected_slide(load, (0.0, 0.0, 0.0))
    assert answer.stop_time == pytest.approx(found.time, rel=1e-12)
    np.testing.assert_allclose(planar_pose(answer.final_pose)[:2], origin(found.pose)[:2])
    body = SlidingBody(BOX.surface, Inertia(0.3, 5e-4, (0.01, 0.0)))
    bracket = stop_bracket(body, (0.0, 0.0, 0.0), load, MAX_ERROR, (*REFERENCE, 0.0))
    np.testing.assert_allclose([answer.earliest_stop_time, answer.latest_stop_time], bracket)
    assert answer.earliest_stop_time < answer.stop_time < answer.latest_stop_time
    assert answer.path.header.frame_id == "object"


def test_what_stays_at_rest_is_an_answer(predict_slide):
    request = PredictSlide.Request(inertia=inertia_message(), points=2)
    answer = predict_slide(request)
    assert answer.error_code == ErrorCode.NONE
    assert answer.stop_time == 0.0
    assert len(answer.path.poses) == 2


def tilted():
    pose = PoseStamped()
    pose.pose.orientation.x = pose.pose.orientation.w = math.sqrt(0.5)
    return pose


@pytest.mark.parametrize(
    ("fields", "code"),
    [
        ({"inertia": inertia_message(mass=0.0)}, ErrorCode.OUT_OF_RANGE),
        ({"inertia": inertia_message(mass=-1.0)}, ErrorCode.OUT_OF_RANGE),
        ({"inertia": inertia_message(moment=0.0)}, ErrorCode.OUT_OF_RANGE),
        ({"inertia": inertia_message(mass=math.nan)}, ErrorCode.NOT_FINITE),
        ({"inertia": inertia_message(centre=(math.inf, 0.0))}, ErrorCode.NOT_FINITE),
        ({"twist": twist_message((math.nan, 0.0, 0.0))}, ErrorCode.NOT_FINITE),
        ({"twist": twist_message(SHOVE, frame="")}, ErrorCode.UNKNOWN_FRAME),
        ({"wrench": wrench_message(PUSH, frame="nowhere")}, ErrorCode.UNKNOWN_FRAME),
        ({"horizon": 0.01}, ErrorCode.NO_CONVERGENCE),
        ({"horizon": -1.0}, ErrorCode.OUT_OF_RANGE),
        ({"horizon": math.nan}, ErrorCode.NOT_FINITE),
        ({"points": 1}, ErrorCode.OUT_OF_RANGE),
        ({"points": 1_000_000}, ErrorCode.OUT_OF_RANGE),
        ({"pose": tilted()}, ErrorCode.OUT_OF_RANGE),
        ({"surface": "absent"}, ErrorCode.UNKNOWN_MODEL),
        ({"surface": "point"}, ErrorCode.BAD_DATA),
        ({"model": "absent"}, ErrorCode.UNKNOWN_MODEL),
        ({"model": "late", "wrench": wrench_message(PUSH)}, ErrorCode.BAD_MODEL),
        ({"model": "staying", "wrench": wrench_message((9.0, 0.0, 0.0))}, ErrorCode.BAD_MODEL),
    ],
)
def test_slides_that_cannot_be_get_a_code_and_the_node_goes_on(predict_slide, fields, code):
    good = {"inertia": inertia_message(), "twist": twist_message(SHOVE)}
    answer = predict_slide(PredictSlide.Request(**(good | fields)))
    assert answer.error_code == code, answer.error_msg
    assert len(answer.error_msg.split()) > 3
    assert not answer.path.poses
    assert predict_slide(PredictSlide.Request(**good)).error_code == ErrorCode.NONE


def test_a_stop_is_told_only_of_a_body_with_inertia(predict_stop):
    factor = float(BOX.surface.load_factor(at_reference(PUSH, "wrench")))
    without = predict_stop(PredictStop.Request(wrench=wrench_message(PUSH)))
    assert without.error_code == ErrorCode.NONE
    assert without.holds_from == pytest.approx(math.log(factor), abs=1e-9)
    assert not without.has_stop_time
    assert without.stop_time == 0.0
    request = PredictStop.Request(wrench=wrench_message(PUSH), inertia=inertia_message())
    answer = predict_stop(request)
    assert answer.has_stop_time
    body = SlidingBody(BOX.surface, Inertia(0.3, 5e-4, (0.01, 0.0)))
    load = Load(at_reference(PUSH, "wrench"), FADING)
    assert answer.stop_time == pytest.approx(
        finish(slide_stages(body, (0.0, 0.0, 0.0), load)).time
    )
    assert answer.holds_from == without.holds_from < answer.stop_time
    assert answer.earliest_stop_time < answer.stop_time < answer.latest_stop_time
    bad = PredictStop.Request(wrench=wrench_message(PUSH), inertia=inertia_message(mass=-0.1))
    assert predict_stop(bad).error_code == ErrorCode.OUT_OF_RANGE


def test_a_grasp_slips_as_the_library_says(slip):
    request = PredictSlip.Request(
        surface="pad",
        model="relaxing",
        wrench=wrench_message(GRIP),
        contact_exponent=0.25,
        margin=1.1,
    )
    answer = slip(request)
    assert answer.error_code == ErrorCode.NONE
    found = predict_slip(PAD.surface, RELAXING, GRIP, 0.25, 1.1, 0.05)
    assert found.slips
    assert answer.slips
    assert (answer.slip_time, answer.earliest_slip_time, answer.latest_slip_time) == (
        found.time,
        found.earliest,
        found.latest,
    )
    assert answer.required_share == found.share
    assert answer.required_normal_force == pytest.approx(10.0 * found.share)
    assert answer.load_factor == found.load_factor
    shares = RELAXING(np.array(answer.times)) / 10.0
    factors = load_factors(PAD.surface, 1.1 * np.array(GRIP), shares, 0.25)
    np.testing.assert_allclose(answer.load_factors, factors)


def test_a_grasp_that_holds_for_ever_is_an_answer(slip):
    answer = slip(
        PredictSlip.Request(surface="pad", model="relaxing", wrench=wrench_message((1.0, 0, 0)))
    )
    assert answer.error_code == ErrorCode.NONE
    assert not answer.slips
    assert answer.slip_time == answer.latest_slip_time == math.inf


def test_the_force_that_is_required_is_the_librarys(required):
    answer = required(
        RequiredNormalForce.Request(
            surface="pad", wrench=wrench_message(GRIP), contact_exponent=0.5, margin=1.3
        )
    )
    assert answer.error_code == ErrorCode.NONE
    found = required_share(PAD.surface, GRIP, 0.5, 1.3)
    told = answer.required
    assert told.normal_force == pytest.approx(10.0 * found.share, rel=1e-14)
    assert (told.load_factor, told.torsional_share) == (found.load_factor, found.torsional_share)
    assert (told.surface, told.margin, told.contact_exponent) == ("pad", 1.3, 0.5)
    assert told.header.frame_id == "object"
    assert told.header.stamp == STAMP


@pytest.mark.parametrize(
    ("fields", "code"),
    [
        ({"surface": "box"}, ErrorCode.OUT_OF_RANGE),
        ({"surface": "absent"}, ErrorCode.UNKNOWN_MODEL),
        ({"margin": -1.0}, ErrorCode.OUT_OF_RANGE),
        ({"margin": math.nan}, ErrorCode.NOT_FINITE),
        ({"contact_exponent": 2.0}, ErrorCode.OUT_OF_RANGE),
        ({"contact_exponent": -0.1}, ErrorCode.OUT_OF_RANGE),
        ({"wrench": wrench_message((math.nan, 0.0, 0.0))}, ErrorCode.NOT_FINITE),
        ({"wrench": wrench_message(GRIP, frame="")}, ErrorCode.UNKNOWN_FRAME),
    ],
)
def test_bad_requests_for_a_force_get_a_code(required, slip, fields, code):
    good = {"surface": "pad", "wrench": wrench_message(GRIP)}
    answer = required(RequiredNormalForce.Request(**(good | fields)))
    assert answer.error_code == code, answer.error_msg
    assert len(answer.error_msg.split()) > 3
    if fields != {"surface": "box"}:
        slipping = slip(PredictSlip.Request(model="relaxing", **(good | fields)))
        assert slipping.error_code == code, slipping.error_msg


def test_a_normal_force_that_cannot_relax_gets_a_code(slip):
    bad = PredictSlip.Request(surface="pad", model="late", wrench=wrench_message(GRIP))
    assert slip(bad).error_code == ErrorCode.BAD_MODEL


def test_each_held_wrench_is_answered_with_the_force_that_holds_it(ros, client_node, node):
    deep = QoSProfile(depth=1000)
    heard = ros.listen(client_node, NormalForce, "/decay/required_normal_force", deep)
    publisher = client_node.create_publisher(WrenchStamped, "/decay/held_wrench", deep)
    ros.matched(publisher)
    ros.wait(lambda: node.count_subscribers("/decay/required_normal_force"))
    loads = np.linspace(0.1, 1.0, 50)[:, np.newaxis] * GRIP
    for load in loads:
        publisher.publish(wrench_message(load))
    ros.wait(lambda: len(heard) == len(loads))
    needed = [10.0 * required_share(PAD.surface, load, 0.25, 1.2).share for load in loads]
    np.testing.assert_allclose([each.normal_force for each in heard], needed, rtol=1e-12)
    assert heard[0].margin == 1.2
