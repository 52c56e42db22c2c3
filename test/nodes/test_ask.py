# SPDX-License-Identifier: Apache-2.0
"""The program `ask` says what a node answers, where there is no `ros2`."""

from __future__ import annotations

import sys
import threading

import numpy as np
import pytest
import yaml

pytest.importorskip("rclpy", reason="rclpy is not installed")
pytest.importorskip("limit_surface_interfaces", reason="the interfaces are not built")

from limit_surface_ros.motion.linear_push import linearise_push
from limit_surface_ros.motion.outline import Polygon
from limit_surface_ros.nodes.ask import main
from limit_surface_ros.nodes.clients.service_client import ServiceClient
from limit_surface_ros.nodes.decay_node import DecayNode
from limit_surface_ros.nodes.limit_surface_node import LimitSurfaceNode
from process_helpers import WAIT


@pytest.fixture
def ask(capsys):
    """Return a function that asks, and returns exit code, answers and what was told."""

    def call(*arguments):
        code = main([*arguments, "--wait", str(WAIT)])
        printed = capsys.readouterr()
        return code, printed.out, printed.err

    return call


@pytest.fixture
def box(ros, model_file):
    model, path = model_file("box", seed=1)
    node = ros.add(LimitSurfaceNode, files=[path])
    return model, node


def planar(mapping, first, second):
    return [mapping[first]["x"], mapping[first]["y"], mapping[second]["z"]]


def test_a_load_is_asked_for_with_options(box, ask):
    surface = box[0].surface
    code, answer, told = ask("wrench_to_twist", "--force", "3", "0", "--torque", "0.1")
    assert (code, told) == (0, "")
    given = yaml.safe_load(answer)
    twist = planar(given["twist"]["twist"], "linear", "angular")
    np.testing.assert_allclose(twist, surface.twist_of_wrench([3.0, 0.0, 0.1]), rtol=1e-6)
    assert given["load_factor"] == pytest.approx(surface.load_factor([3.0, 0.0, 0.1]), rel=1e-6)


def test_a_client_that_ends_while_its_thread_works_ends_without_a_traceback(monkeypatch):
    failures, begun = [], threading.Event()
    monkeypatch.setattr(threading, "excepthook", failures.append)
    with ServiceClient("leaves") as client:
        nodes = client._executor.get_nodes

        def slow_nodes():
            begun.set()
            # Long enough for the client to begin its end meanwhile.
            threading.Event().wait(0.2)
            return nodes()

        monkeypatch.setattr(client._executor, "get_nodes", slow_nodes)
        client._executor.wake()
        assert begun.wait(WAIT)
    assert not failures


def test_fields_may_be_given_in_yaml_as_to_ros2(box, ask):
    fields = "{twist: {header: {frame_id: object}, twist: {linear: {x: 1}, angular: {z: 0.5}}}}"
    code, answer, _ = ask("/limit_surface/twist_to_wrench", fields)
    assert code == 0
    wrench = planar(yaml.safe_load(answer)["wrench"]["wrench"], "force", "torque")
    np.testing.assert_allclose(wrench, box[0].surface.wrench_of_twist([1.0, 0.0, 0.5]), rtol=1e-6)


CORNERS = [[-0.05, -0.05], [0.05, -0.05], [0.05, 0.05], [-0.05, 0.05]]


def test_lists_of_messages_may_be_given_in_yaml(box, ask):
    points = ", ".join(f"{{x: {x}, y: {y}}}" for x, y in CORNERS)
    place = "contact: {x: -0.05, y: 0.01}, input: [0.02, 0.0]"
    fields = f"{{outline: {{points: [{points}]}}, {place}}}"
    code, answer, told = ask("linearise_push", fields, "--friction", "0.3")
    assert (code, told) == (0, "")
    expected = linearise_push(
        box[0].surface,
        Polygon(CORNERS),
        0.3,
        [0.0, 0.0, 0.0],
        [-0.05, 0.01],
        [0.02, 0.0],
        reference_point=box[0].reference_point,
    )
    found = yaml.safe_load(answer)
    np.testing.assert_allclose(found["rates"], expected.rates, rtol=1e-6, atol=1e-12)


def test_a_path_in_a_request_is_in_the_frame_of_the_request(box, ask):
    points = ", ".join(f"{{x: {x}, y: {y}}}" for x, y in CORNERS)
    poses = "{pose: {position: {x: -0.07}}}, {pose: {position: {x: -0.05}}}"
    fields = f"{{outline: {{points: [{points}]}}, tip_radius: 0.01, tip_path: {{poses: [{poses}]}}"
    for given in ((fields + ", header: {frame_id: table}}",), (fields + "}", "--frame", "table")):
        code, answer, told = ask("simulate_push", *given)
        assert (code, told) == (0, "")
        assert yaml.safe_load(answer)["end"]["header"]["frame_id"] == "table"


def test_texts_of_several_lines_are_printed_line_by_line(box, ask):
    code, answer, _ = ask("describe_model")
    assert code == 0
    assert "summary: |-\n  kind: " in answer
    assert "\n  frame: object\n" in answer


def test_what_a_node_refuses_is_told_by_its_code_alone(box, ask):
    code, answer, told = ask("wrench_to_twist", "--force", "0", "0")
    assert (code, answer) == (1, "")
    assert told.startswith("ask: refused: ZERO_VECTOR (101): ")
    code, _, told = ask("wrench_to_twist", "--force", "1", "0", "--model", "sofa")
    assert code == 1
    assert "UNKNOWN_MODEL" in told


def test_a_refusal_that_has_no_code_is_told_alone_too(ros, box, model_file, ask):
    model_file("box", seed=1)[1].write_text("kind: none\n")
    code, answer, told = ask("limit_surface/reload")
    assert (code, answer) == (1, "")
    assert told.startswith("ask: refused: ")
    assert told.endswith("the old models keep serving\n") or "box.yaml" in told


def test_without_a_name_it_lists_what_can_be_asked(box, ask):
    code, answer, _ = ask()
    assert code == 0
    assert "service  /limit_surface/wrench_to_twist" in answer
    assert "topic    /limit_surface/wrench" in answer
    assert "parameter" not in answer


def test_a_topic_is_sent_to_and_listened_to(ros, box, ask):
    outcome = []
    sender = threading.Thread(
        target=lambda: outcome.append(main(["predicted_twist", "--wait", str(WAIT)]))
    )
    sender.start()
    ros.wait(lambda: box[1].count_subscribers("/limit_surface/predicted_twist"))
    while sender.is_alive():
        code, _, _ = ask("limit_surface/wrench", "--send", "--force", "9", "0")
        assert code == 0
        sender.join(0.1)
    assert outcome == [0]


def test_a_name_that_two_nodes_have_must_be_told_apart(ros, box, ask, tmp_path):
    ros.add(DecayNode)
    ros.wait(lambda: box[1].get_service_names_and_types_by_node("decay", "/"))
    code, _, told = ask("list_models")
    assert code == 2
    assert "/decay/list_models, /limit_surface/list_models" in told
    code, answer, _ = ask("decay/list_models")
    assert code == 0
    assert "hockey_stick" in answer


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (["wrench_to_twist", "--velocity", "1", "0"], "--velocity is not for this: its fields"),
        (["wrench_to_twist", "--force", "1"], "--force takes x and y"),
        (["wrench_to_twist", "{sofa: 1}"], "has no field sofa; it has model, wrench"),
        (["wrench_to_twist", "{model: 1}"], "model must be of the type string, got 1"),
        (["wrench_to_twist", "{wrench: 3}"], "fields are a mapping such as {header: ...}"),
        (["linearise_push", "{outline: {points: [{sofa: 1}]}}"], "Point32 has no field sofa"),
        (["linearise_push", "{outline: {points: [3]}}"], "fields are a mapping such as {x: ...}"),
        (["linearise_push", "{outline: {points: 3}}"], "points must be of the type sequence"),
        (["reload", "{model: a}"], "has no field model; it has none"),
        (["wrench_to_twist", "{"], "the fields are not YAML"),
        (["wrench_to_twist", "7"], "fields are a mapping such as"),
        (["wrench_to_twist", "--count", "0"], "--count must be at least 1"),
    ],
)
def test_what_cannot_be_asked_is_told_in_one_line(box, ask, arguments, told):
    code, answer, error = ask(*arguments)
    assert (code, answer) == (2, "")
    assert told in error


def test_an_argument_that_is_not_utf_8_is_told_in_one_line(monkeypatch, capsys):
    monkeypatch.setattr(sys, "argv", ["ask", "caf\udce9"])
    assert main() == 2
    told = capsys.readouterr().err
    assert told.startswith(r"ask: error: argument 'caf\\udce9' is not UTF-8, and ROS 2 takes no")
    assert told.count("\n") == 1


def test_what_is_not_there_is_told_with_what_is(box, capsys):
    assert main(["nothing", "--wait", "0.5"]) == 1
    error = capsys.readouterr().err
    assert "no service nothing after 0.5 s; there are" in error
