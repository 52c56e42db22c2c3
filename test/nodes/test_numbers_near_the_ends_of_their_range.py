# SPDX-License-Identifier: Apache-2.0
"""Numbers that are legal and near the ends of their range get an answer or a code, not a defect.

Products of numbers near 1e100 overflow, and quotients of those near 1e-100 divide by zero, inside
surfaces, slides and estimators alike.
"""

from __future__ import annotations

import contextlib
import itertools

import numpy as np
import pytest

pytest.importorskip("rclpy", reason="rclpy is not installed")
pytest.importorskip("limit_surface_interfaces", reason="the interfaces are not built")

from builtin_interfaces.msg import Time
from geometry_msgs.msg import (
    InertiaStamped,
    TwistStamped,
    TwistWithCovarianceStamped,
    WrenchStamped,
)
from limit_surface_interfaces.msg import DecayForecast, ErrorCode, NormalForce, TimeLeft
from limit_surface_interfaces.srv import (
    EvaluateDecay,
    PredictSlide,
    PredictSlip,
    PredictStop,
    RequiredNormalForce,
    TimeToLevel,
    TwistsToWrenches,
    TwistToWrench,
    WrenchesToTwists,
    WrenchToTwist,
)
from rclpy.parameter import Parameter

from decay_helpers import Bench, load_message
from limit_surface_ros.files.surface_file import SurfaceModel, write_surface_model
from limit_surface_ros.nodes import decay_node
from limit_surface_ros.nodes.limit_surface_node import LimitSurfaceNode
from limit_surface_ros.nodes.messages import convert
from limit_surface_ros.nodes.serving import answers
from limit_surface_ros.nodes.serving.answers import FiniteCheck
from limit_surface_ros.surface.kinds.dissipation import Dissipation
from limit_surface_ros.surface.kinds.dissipation_scatter import TwistScatter
from limit_surface_ros.surface.kinds.point_contacts import PointContacts
from limit_surface_ros.surface.scaling import Scaling
from node_helpers import planar_twist, twist_message, wrench_message

pytestmark = pytest.mark.filterwarnings("ignore::RuntimeWarning")

ENDS = [1e100, -1e99, 1e50, 1e12, 1e-12, 1e-50, 1e-99, 5e-324]
FACTORS = np.random.default_rng(4).normal(size=(3, 3, 3))
MATRICES = FACTORS @ FACTORS.transpose(0, 2, 1)
SCALING = Scaling(0.08, 5.0)
SCATTER = TwistScatter(MATRICES, tuple(MATRICES * scale for scale in (0.9, 1.0, 1.1)), 0.1)
MODELS = [
    SurfaceModel("body", Dissipation(MATRICES, SCALING), fit={"uncertainty": SCATTER.stored()}),
    SurfaceModel("far", Dissipation(MATRICES, SCALING), reference_point=(1e99, -1e99)),
    SurfaceModel(
        "feet", PointContacts([[0, 0], [1e90, 0], [0, 1e-90]], [1, 1e90, 1e-90], Scaling(1e-3, 1))
    ),
]
# Where static transforms put tools; the last is beyond all numbers.
TOOLS = {"near": 1e-300, "away": 1e99, "lost": 1e300}


def ends(count, length, seed=0):
    """Yield rows in which one or two of the usual numbers are at an end."""
    rng = np.random.default_rng(seed)
    for _ in range(count):
        row = rng.normal(size=length)
        places = rng.choice(length, size=rng.integers(1, 3))
        row[places] = rng.choice(ENDS, size=len(places))
        yield row


def handled(health, name):
    """Messages of a topic that were accepted or refused."""
    refused = sum(count for (where, _), count in health.refused.items() if where == name)
    return health.accepted[name] + refused


def send(ros, publisher, message, health, name):
    """Publish until the node has it: of a stream a busy machine may lose some."""
    before = handled(health, name)
    while handled(health, name) == before:
        publisher.publish(message)
        with contextlib.suppress(AssertionError):
            ros.wait(lambda: handled(health, name) > before, 20.0)


def held(call, kind, request, unbounded=()):
    """Ask, and check that a number or a code comes back."""
    answer = call(request)
    assert answer.error_code != ErrorCode.INTERNAL, (answer.error_msg, request)
    assert bool(answer.error_msg) == (answer.error_code != ErrorCode.NONE)
    FiniteCheck(kind.Response, unbounded)(answer)
    return answer.error_code


@pytest.fixture
def surfaces(ros, tmp_path):
    paths = [tmp_path / f"{model.name}.yaml" for model in MODELS]
    for model, path in zip(MODELS, paths, strict=True):
        write_surface_model(model, path)
    tools = [f"object {name} {x} {x} 0 0 0 0.5" for name, x in TOOLS.items()]
    return ros.add(LimitSurfaceNode, files=paths, parameters={"static_transforms": tools})


def test_surfaces_answer_or_say_that_they_cannot(ros, client_node, surfaces):
    kinds = {
        "wrench_to_twist": WrenchToTwist,
        "twist_to_wrench": TwistToWrench,
        "wrenches_to_twists": WrenchesToTwists,
        "twists_to_wrenches": TwistsToWrenches,
    }
    calls = {
        name: ros.client(client_node, kind, f"/limit_surface/{name}")
        for name, kind in kinds.items()
    }
    frames = itertools.cycle(["object", *TOOLS])
    codes = set()
    for model, row in itertools.product([each.name for each in MODELS], ends(12, 3)):
        frame = next(frames)
        load, motion = wrench_message(row, frame), twist_message(row, frame)
        loads = WrenchesToTwists.Request(model=model, wrenches=convert.flat_of(row))
        motions = TwistsToWrenches.Request(model=model, twists=convert.flat_of(row))
        loads.header.frame_id = motions.header.frame_id = frame
        for name, request in (
            ("wrench_to_twist", WrenchToTwist.Request(model=model, wrench=load)),
            ("twist_to_wrench", TwistToWrench.Request(model=model, twist=motion)),
            ("wrenches_to_twists", loads),
            ("twists_to_wrenches", motions),
        ):
            codes.add(held(calls[name], kinds[name], request))
    assert ErrorCode.NONE in codes
    assert len(codes) > 1


def test_twists_and_covariances_are_published_finite_or_not_at_all(ros, client_node, surfaces):
    top = "/limit_surface"
    twists = ros.listen(client_node, TwistStamped, f"{top}/predicted_twist", 100)
    scattered = ros.listen(
        client_node, TwistWithCovarianceStamped, f"{top}/predicted_twist_with_covariance", 100
    )
    loads = client_node.create_publisher(WrenchStamped, f"{top}/wrench", 100)
    ros.matched(loads)
    ros.matched(surfaces._twists)
    ros.matched(surfaces._scattered)
    health = surfaces.health
    rows = [(90.0, 1.0, 0.1), *ends(20, 3, seed=1)]
    for row, frame in zip(rows, itertools.cycle(["object", *TOOLS])):
        send(ros, loads, wrench_message(row, frame), health, "wrench")
    ros.wait(lambda: len(twists) >= health.accepted["wrench"] == len(scattered))
    assert scattered[0].twist.covariance.any()
    for message in twists:
        FiniteCheck(TwistStamped)(message)
    for message in scattered:
        FiniteCheck(TwistWithCovarianceStamped)(message)
    assert not [code for _, code in health.refused if code == "INTERNAL"], health.last_error


def test_a_covariance_that_is_not_finite_is_not_published(ros, client_node, surfaces, monkeypatch):
    monkeypatch.setattr(
        "limit_surface_ros.nodes.limit_surface_node.covariance_at_origin",
        lambda *_: np.full(36, np.nan),
    )
    scattered = ros.listen(
        client_node,
        TwistWithCovarianceStamped,
        "/limit_surface/predicted_twist_with_covariance",
    )
    loads = client_node.create_publisher(WrenchStamped, "/limit_surface/wrench", 10)
    ros.matched(loads)
    ros.matched(surfaces._scattered)
    send(ros, loads, wrench_message((90.0, 1.0, 0.1)), surfaces.health, "wrench")
    assert surfaces.health.refused["wrench", "NO_CONVERGENCE"]
    ask = ros.client(client_node, WrenchToTwist, "/limit_surface/wrench_to_twist")
    answer = ask(WrenchToTwist.Request(wrench=wrench_message((9.0, 1.0, 0.1))))
    assert answer.error_code == ErrorCode.NO_CONVERGENCE
    assert not scattered


def test_what_is_learnt_of_such_measurements_answers_finite_or_not_at_all(
    ros, client_node, tmp_path
):
    path = tmp_path / "body.yaml"
    write_surface_model(SurfaceModel("body", Dissipation(np.eye(3)[None], SCALING)), path)
    tools = [f"object {name} {x} {x} 0 0 0 0.5" for name, x in TOOLS.items()]
    parameters = {"learn": True, "static_transforms": tools}
    node = ros.add(LimitSurfaceNode, files=[path], parameters=parameters)
    top = "/limit_surface"
    wrenches = client_node.create_publisher(WrenchStamped, f"{top}/measured_wrench", 100)
    twists = client_node.create_publisher(TwistStamped, f"{top}/measured_twist", 100)
    ros.matched(wrenches)
    ros.matched(twists)
    health, time = node.health, 10.0

    def sample(wrench, twist, frame="object"):
        nonlocal time
        time += 0.01
        stamp = Time(sec=int(time), nanosec=int(1e9 * (time % 1.0)))
        wrench, twist = wrench_message(wrench, frame, stamp), twist_message(twist, frame, stamp)
        send(ros, wrenches, wrench, health, "measured_wrench")
        send(ros, twists, twist, health, "measured_twist")

    pushes = [(wrench, twist) for wrench, twist in zip(ends(9, 3), ends(9, 3, 1), strict=True)]
    for frame, (wrench, twist) in zip(itertools.cycle(["object", *TOOLS]), pushes):
        for _ in range(4):
            sample(wrench, twist, frame)
        time += 1.0
    known = node.learner.count
    # A push like others is learnt after them.
    for _ in range(8):
        sample((5.0, 1.0, 0.1), (0.02, 0.004, 0.05))
    sample((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    ros.wait(lambda: node.learner.count > known)
    assert not [code for _, code in health.refused if code == "INTERNAL"], health.last_error
    assert not node.learner._stopped
    ask = ros.client(client_node, WrenchToTwist, f"{top}/wrench_to_twist")
    request = WrenchToTwist.Request(model="body_learnt", wrench=wrench_message((9.0, 3.0, 0.1)))
    assert held(ask, WrenchToTwist, request) == ErrorCode.NONE
    assert planar_twist(ask(request).twist).any()


@pytest.fixture
def decays(ros, client_node, tmp_path):
    return Bench(ros, client_node, tmp_path, sim_time=False)


def inertia(mass=1.0, moment=0.01, x=0.0):
    body = InertiaStamped()
    body.header.frame_id = "object"
    body.inertia.m, body.inertia.izz, body.inertia.com.x = mass, moment, x
    return body


HARD_BODIES = [
    inertia(x=-2e51),
    inertia(x=1e99),
    inertia(mass=1e100),
    inertia(mass=1e-78),
    inertia(moment=1e-99),
    inertia(moment=1e100),
]
UNBOUNDED = {each.name: each.unbounded for each in decay_node.SERVICES}


def test_slides_and_grips_are_answered_or_refused_with_a_code(ros, client_node, decays):
    loads = [load_message(0, (9.0, 3.0, 0.0, 0.0, 0.0, 0.1))]
    loads += [load_message(0, (x, y, 0.0, 0.0, 0.0, tau)) for x, y, tau in ends(6, 3)]
    bodies = [inertia(), *HARD_BODIES]
    pairs = [(loads[0], body) for body in bodies] + [(load, bodies[0]) for load in loads]

    def client(name, kind):
        return ros.client(client_node, kind, f"/decay/{name}")

    stop, slide = client("predict_stop", PredictStop), client("predict_slide", PredictSlide)
    slip = client("predict_slip", PredictSlip)
    required = client("required_normal_force", RequiredNormalForce)
    for load, body in pairs:
        asked = PredictStop.Request(wrench=load, inertia=body)
        held(stop, PredictStop, asked, UNBOUNDED["predict_stop"])
        motion = twist_message((0.1, 0.0, 1.0))
        asked = PredictSlide.Request(wrench=load, inertia=body, twist=motion)
        held(slide, PredictSlide, asked, UNBOUNDED["predict_slide"])
    for twist in ends(6, 3, seed=2):
        asked = PredictSlide.Request(inertia=inertia(), twist=twist_message(twist))
        held(slide, PredictSlide, asked, UNBOUNDED["predict_slide"])
    for load, margin, exponent in itertools.product(loads[:3], (1e-310, 1e-99, 1e99), (0.0, 0.3)):
        given = {"wrench": load, "margin": margin, "contact_exponent": exponent}
        held(slip, PredictSlip, PredictSlip.Request(**given), UNBOUNDED["predict_slip"])
        held(required, RequiredNormalForce, RequiredNormalForce.Request(**given))
    assert not [code for _, code in decays.refused if code == "INTERNAL"]


@pytest.mark.parametrize(
    ("onset", "measured", "refused"),
    [
        (1e-90, 1e99, True),
        (1e-100, 1e100, True),
        (1.0, 1e100, True),
        (1.0, 1e11, False),
        (1e99, 1e-99, False),
        (1.0, 5e-324, False),
    ],
)
def test_a_running_decay_goes_on_whatever_is_measured_of_it(
    ros, client_node, decays, onset, measured, refused
):
    left = ros.listen(client_node, TimeLeft, "/decay/time_left", 1000)
    decays.onset(decays.now, (onset, 0.0, 0.0, 0.0, 0.0, 0.0))
    for place in range(6):
        load = np.full(6, measured) if place % 2 else np.array([measured, 0, 0, 0, 0, 0])
        decays.measure((decays.now, load))
    count = decays.refused["measurement", "OUT_OF_RANGE"]
    assert count == (6 if refused else 0)
    assert not [code for _, code in decays.refused if code != "OUT_OF_RANGE"], decays.refused
    # All of its topics go on, and its services answer.
    streams = decays.wrenches, decays.values, left
    before = [len(stream) for stream in streams]
    ros.wait(
        lambda: (
            not decays.node._stream.running
            or all(len(now) > then + 3 for now, then in zip(streams, before, strict=True))
        )
    )
    assert decays.node._stream.running or not refused
    evaluate = ros.client(client_node, EvaluateDecay, "/decay/evaluate")
    asked = EvaluateDecay.Request(running=True, times=[0.0, 0.1, 1e10, 1e300, 5e-324])
    assert held(evaluate, EvaluateDecay, asked, UNBOUNDED["evaluate"]) == ErrorCode.NONE
    level = ros.client(client_node, TimeToLevel, "/decay/time_to_level")
    asked = TimeToLevel.Request(running=True, level=0.1)
    assert held(level, TimeToLevel, asked, ("time",)) == ErrorCode.NONE
    for check, messages in (
        (FiniteCheck(WrenchStamped), decays.wrenches),
        (FiniteCheck(TimeLeft, ("time_left", "end_time")), left),
        (FiniteCheck(DecayForecast, ("bounds", "end_time", "known_until")), decays.forecasts),
    ):
        for message in messages:
            check(message)


def test_held_wrenches_get_a_force_or_are_refused(ros, client_node, tmp_path, model_file):
    _, grip = model_file(normal_force=10.0)
    bench = Bench(ros, client_node, tmp_path, sim_time=False)
    (result,) = bench.node.set_parameters([Parameter("surface_files", value=[str(grip)])])
    assert result.successful, result.reason
    forces = ros.listen(client_node, NormalForce, "/decay/required_normal_force", 100)
    loads = client_node.create_publisher(WrenchStamped, "/decay/held_wrench", 100)
    ros.matched(loads)
    ros.matched(bench.node._required)
    health = bench.node.health
    for row in ends(20, 3, seed=5):
        send(ros, loads, wrench_message(row), health, "held_wrench")
    ros.wait(lambda: len(forces) == health.accepted["held_wrench"])
    for message in forces:
        FiniteCheck(NormalForce)(message)
    assert not [code for _, code in health.refused if code == "INTERNAL"], health.last_error


def test_a_stream_whose_numbers_are_not_finite_is_counted_and_goes_on(
    ros, client_node, decays, monkeypatch
):
    decays.onset(decays.now)
    ros.wait(lambda: decays.wrenches)
    response = type(decays.node.onset.response)
    honest = response.fractions
    monkeypatch.setattr(response, "fractions", lambda self, times: np.nan * honest(self, times))
    ros.wait(lambda: decays.refused["wrench", "NO_CONVERGENCE"] > 2)
    monkeypatch.setattr(response, "fractions", honest)
    left = ros.listen(client_node, TimeLeft, "/decay/time_left", 100)
    ros.wait(lambda: left)


@pytest.mark.parametrize(
    "error",
    [ZeroDivisionError("division"), OverflowError("range"), np.linalg.LinAlgError("singular")],
)
def test_arithmetic_that_breaks_off_is_no_answer_and_no_defect(error):
    assert answers.error_code(error) == ErrorCode.NO_CONVERGENCE
    assert str(error) in answers.sentence(error)
    assert "report" not in answers.sentence(error)
