# SPDX-License-Identifier: Apache-2.0
"""Parameters: described, validated when set, applied afterwards, all or none."""

from __future__ import annotations

import math

import pytest

pytest.importorskip("rclpy", reason="rclpy is not installed")
pytest.importorskip("limit_surface_interfaces", reason="the interfaces are not built")

from limit_surface_interfaces.msg import ErrorCode
from limit_surface_interfaces.srv import WrenchToTwist
from rcl_interfaces.msg import Parameter as ParameterMessage
from rcl_interfaces.msg import ParameterType, ParameterValue
from rcl_interfaces.srv import SetParameters, SetParametersAtomically
from rclpy.parameter import Parameter
from std_srvs.srv import Trigger

from limit_surface_ros.nodes.limit_surface_node import SETTINGS, LimitSurfaceNode
from limit_surface_ros.nodes.models.model_node import COMMON_SETTINGS
from node_helpers import wrench_message

TABLE = [*SETTINGS, *COMMON_SETTINGS]


@pytest.fixture
def node(ros, model_file):
    return ros.add(LimitSurfaceNode, files=[model_file()[1]])


def test_every_parameter_is_described(node):
    for setting in TABLE:
        descriptor = node.describe_parameter(setting.name)
        assert descriptor.description == setting.description
        assert descriptor.read_only == setting.read_only, setting.name
        assert descriptor.type != ParameterType.PARAMETER_NOT_SET, setting.name
        for choice in setting.choices:
            assert choice in descriptor.additional_constraints, setting.name
        if setting.minimum is not None:
            (span,) = [*descriptor.floating_point_range, *descriptor.integer_range]
            assert (span.from_value, span.to_value) == (setting.minimum, setting.maximum)


def test_every_parameter_starts_at_its_default(node):
    for setting in TABLE:
        if setting.name != "model_files":
            assert node.values[setting.name] == setting.default, setting.name
            value = node.get_parameter(setting.name).value
            found = list(value) if isinstance(setting.default, list) else value
            assert found == setting.default, setting.name


@pytest.mark.parametrize(
    ("name", "value", "told"),
    [
        ("input_timeout", -1.0, "range"),
        ("input_timeout", math.nan, "nan"),
        ("normal_force", math.inf, "inf"),
        ("normal_force", 0.0, "range"),
        ("max_batch_rows", 0, "range"),
        ("normal_force_from", "moon", "model, wrench, parameter"),
        ("static_transforms", ["a b 1"], "accepted"),
        ("static_transforms", ["a b 0 0 nan 0 0 0"], "finite"),
        ("model_files", ["/nowhere.yaml"], "/nowhere.yaml"),
        ("model_files", ["package://nowhere/models"], "nowhere"),
        ("default_model", "sofa", "sofa"),
        ("executor", "events", "read-only"),
        ("model_files", "/nowhere.yaml", "write ['/nowhere.yaml']"),
    ],
)
def test_a_bad_value_is_refused_and_the_old_one_stays(node, name, value, told):
    before, used = node.get_parameter(name).value, node.values[name]
    (result,) = node.set_parameters([Parameter(name, value=value)])
    assert not result.successful
    assert told in result.reason
    assert node.get_parameter(name).value == before
    assert node.values[name] == used


def test_a_defect_that_a_new_value_meets_is_answered_and_the_old_value_stays(node):
    def broken_for_two(values):
        if values["input_timeout"] == 2.0:
            raise OSError("the disk is gone")
        return lambda: None

    node.values.on_change(["input_timeout"], broken_for_two)
    (result,) = node.set_parameters([Parameter("input_timeout", value=2.0)])
    assert not result.successful
    assert "please report it: OSError: the disk is gone" in result.reason
    assert node.values["input_timeout"] == node.get_parameter("input_timeout").value == 0.5


def test_a_whole_number_does_for_one_with_a_point(node):
    (result,) = node.set_parameters([Parameter("normal_force", value=5)])
    assert result.successful, result.reason
    assert node.values["normal_force"] == node.get_parameter("normal_force").value == 5.0
    assert isinstance(node.get_parameter("normal_force").value, float)
    (result,) = node.set_parameters([Parameter("normal_force", value=0)])
    assert not result.successful


@pytest.mark.parametrize(
    "names", [("model_files", "default_model"), ("default_model", "model_files")]
)
def test_files_and_default_change_together_in_any_order_of_one_request(
    ros, client_node, node, model_file, names
):
    _, path = model_file("crate", seed=1)
    node.set_parameters([Parameter("default_model", value="box")])
    values = {"model_files": [str(path)], "default_model": "crate"}
    # As `ros2 param load` asks.
    load = ros.client(client_node, SetParameters, "/limit_surface/set_parameters")
    given = [Parameter(name, value=values[name]).to_parameter_msg() for name in names]
    answer = load(SetParameters.Request(parameters=given))
    assert [result.successful for result in answer.results] == [True, True], answer.results
    assert node.host.models.default == "crate"
    others = [Parameter("input_timeout", value=-1.0), Parameter("normal_force", value=2.0)]
    given = [parameter.to_parameter_msg() for parameter in others]
    answer = load(SetParameters.Request(parameters=given))
    assert [result.successful for result in answer.results] == [False, True]


@pytest.mark.parametrize(
    ("name", "kind", "told"),
    [
        ("normal_forse", 3, "'normal_forse' is not known here; did you mean 'normal_force'?"),
        ("", 3, "parameter '' is not known here"),
        ("x" * 1_000_000, 3, "1000000 characters"),
        # rclpy answers nothing to a type that it does not know.
        ("normal_force", 77, "normal_force: 77 is not a valid"),
    ],
)
def test_what_is_no_parameter_is_said_to_be_none(ros, client_node, node, name, kind, told):
    wrong = ParameterMessage(name=name, value=ParameterValue(type=kind, double_value=2.0))
    right = Parameter("input_timeout", value=2.0).to_parameter_msg()
    one_by_one = ros.client(client_node, SetParameters, "/limit_surface/set_parameters")
    answer = one_by_one(SetParameters.Request(parameters=[wrong, right]))
    assert [result.successful for result in answer.results] == [False, True]
    assert told in answer.results[0].reason
    assert len(answer.results[0].reason) < 400
    at_once = ros.client(
        client_node, SetParametersAtomically, "/limit_surface/set_parameters_atomically"
    )
    right = Parameter("input_timeout", value=3.0).to_parameter_msg()
    answer = at_once(SetParametersAtomically.Request(parameters=[right, wrong]))
    assert not answer.result.successful
    assert told in answer.result.reason
    assert node.values["input_timeout"] == 2.0


def test_thousands_of_parameters_in_one_request_are_answered(ros, client_node, node):
    load = ros.client(client_node, SetParameters, "/limit_surface/set_parameters")
    # With the square of their number this would take minutes.
    unknown = [Parameter(f"p{place}", value=1.0).to_parameter_msg() for place in range(10_000)]
    answer = load(SetParameters.Request(parameters=unknown))
    assert not any(result.successful for result in answer.results)
    assert "'p9999'" in answer.results[-1].reason
    again = [Parameter("normal_force", value=1.0 + n).to_parameter_msg() for n in range(10_000)]
    answer = load(SetParameters.Request(parameters=again))
    assert all(result.successful for result in answer.results)
    assert node.values["normal_force"] == 10_000.0


def test_a_default_that_other_files_do_not_hold_is_refused_with_the_way_to_change_both(
    node, model_file
):
    _, path = model_file("crate", seed=1)
    node.set_parameters([Parameter("default_model", value="box")])
    (result,) = node.set_parameters([Parameter("model_files", value=[str(path)])])
    assert not result.successful
    assert "in one request, as `ros2 param load` does" in result.reason


def test_a_locked_node_takes_no_changes_and_no_reload(ros, client_node, model_file):
    node = ros.add(LimitSurfaceNode, files=[model_file()[1]], parameters={"locked": True})
    for name, value in (("normal_force", 2.0), ("use_sim_time", True), ("locked", False)):
        (result,) = node.set_parameters([Parameter(name, value=value)])
        assert not result.successful
    assert node.values["normal_force"] == 1.0
    reload = ros.client(client_node, Trigger, "/limit_surface/reload")
    answer = reload(Trigger.Request())
    assert not answer.success
    assert "locked" in answer.message
    ask = ros.client(client_node, WrenchToTwist, "/limit_surface/wrench_to_twist")
    asked = WrenchToTwist.Request(wrench=wrench_message([3.0, 1.0, 0.1]))
    assert ask(asked).error_code == ErrorCode.NONE


def test_an_empty_list_of_models_is_refused(node):
    empty = Parameter("model_files", Parameter.Type.STRING_ARRAY, [])
    (result,) = node.set_parameters([empty])
    assert not result.successful
    assert "at least one" in result.reason


def test_a_good_value_counts_at_once(node):
    (result,) = node.set_parameters([Parameter("normal_force_from", value="parameter")])
    assert result.successful
    assert node.values["normal_force_from"] == "parameter"


def test_of_a_set_with_one_bad_value_none_is_taken(node):
    result = node.set_parameters_atomically(
        [Parameter("normal_force", value=3.0), Parameter("default_model", value="sofa")]
    )
    assert not result.successful
    assert node.values["normal_force"] == node.get_parameter("normal_force").value == 1.0
    # Nor does the next good set bring the refused one back.
    assert node.set_parameters_atomically([Parameter("input_timeout", value=2.0)]).successful
    assert node.values["normal_force"] == 1.0
    assert node.values["input_timeout"] == 2.0


def test_simulated_time_can_be_switched_on_and_off(node):
    for value in (True, False):
        (result,) = node.set_parameters([Parameter("use_sim_time", value=value)])
        assert result.successful, result.reason


def test_the_quality_of_service_can_be_overridden(ros, model_file):
    name = "qos_overrides./limit_surface/wrench.subscription.reliability"
    node = ros.add(LimitSurfaceNode, files=[model_file()[1]], parameters={name: "reliable"})
    subscription = next(s for s in node.subscriptions if s.topic_name == "/limit_surface/wrench")
    assert subscription.qos_profile.reliability.name == "RELIABLE"
