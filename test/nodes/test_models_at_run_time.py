# SPDX-License-Identifier: Apache-2.0
"""Models are read all or none and swapped in one step; the old ones serve until then."""

from __future__ import annotations

import math
import os
import threading
import warnings
from pathlib import Path

import numpy as np
import pytest
import yaml

pytest.importorskip("rclpy", reason="rclpy is not installed")
pytest.importorskip("limit_surface_interfaces", reason="the interfaces are not built")

from diagnostic_msgs.msg import DiagnosticArray
from limit_surface_interfaces.msg import ErrorCode
from limit_surface_interfaces.srv import DescribeModel, ListModels, WrenchToTwist
from rclpy.parameter import Parameter
from std_srvs.srv import Trigger

from limit_surface_ros.files.surface_file import (
    SurfaceModel,
    read_surface_model,
    write_surface_model,
)
from limit_surface_ros.nodes.limit_surface_node import LimitSurfaceNode
from limit_surface_ros.nodes.models.model_host import ModelHost
from limit_surface_ros.surface.kinds.point_contacts import PointContacts
from limit_surface_ros.surface.kinds.polynomial import Polynomial
from limit_surface_ros.surface.kinds.power_sum import PowerSum
from limit_surface_ros.surface.scaling import Scaling
from node_helpers import planar_twist, wrench_message
from process_helpers import WAIT

WRENCH = [3.0, 1.0, 0.1]


@pytest.fixture
def running(ros, client_node, model_file):
    """A node with one model, and what is asked of it."""
    model, path = model_file("box", seed=0)
    node = ros.add(LimitSurfaceNode, files=[path])
    reload = ros.client(client_node, Trigger, "/limit_surface/reload")
    ask = ros.client(client_node, WrenchToTwist, "/limit_surface/wrench_to_twist")
    return node, model, path, lambda: reload(Trigger.Request()), ask


def twist_now(ask):
    answer = ask(WrenchToTwist.Request(wrench=wrench_message(WRENCH)))
    assert answer.error_code == ErrorCode.NONE, answer.error_msg
    return planar_twist(answer.twist)


def test_what_is_to_be_said_of_a_model_goes_into_the_log_in_plain_words(tmp_path):
    path = tmp_path / "cross.yaml"
    # x^4 + y^4 + m^4 + 12 x^2 y^2 bends inward.
    cross = [1, 0, 0, 12, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 1]
    write_surface_model(SurfaceModel("cross", Polynomial(cross)), path)

    class Parameters:
        def on_change(self, names, prepare, **_):
            prepare(dict(zip(names, ([str(path)], ""), strict=True)))()

    said = []
    with warnings.catch_warnings():
        warnings.simplefilter("always")
        ModelHost(Parameters(), read_surface_model, said.append)
    (line,) = said
    assert line.startswith("limit surface 'cross' is not convex")


def test_reloads_that_are_asked_for_during_one_share_the_next(
    ros, client_node, running, model_file, monkeypatch
):
    node, _, _, _, ask = running
    read, reads, gate = node._read_anew, [], threading.Event()

    def read_later():
        reads.append(None)
        gate.wait(WAIT)
        return read()

    monkeypatch.setattr(node, "_read_anew", read_later)
    client = client_node.create_client(Trigger, "/limit_surface/reload")
    assert client.wait_for_service(timeout_sec=WAIT)
    futures = [client.call_async(Trigger.Request()) for _ in range(6)]
    ros.wait(lambda: node.endpoints.under_way == len(futures))
    changed, _ = model_file("box", seed=1)
    gate.set()
    for future in futures:
        assert ros.done(future, WAIT)
        assert future.result().success
    assert len(reads) == 2
    np.testing.assert_allclose(twist_now(ask), changed.surface.twist_of_wrench(WRENCH), atol=1e-12)


def test_reload_takes_what_the_files_hold_now(running, model_file):
    _, model, _, reload, ask = running
    np.testing.assert_allclose(twist_now(ask), model.surface.twist_of_wrench(WRENCH))
    changed, _ = model_file("box", seed=5)
    np.testing.assert_allclose(twist_now(ask), model.surface.twist_of_wrench(WRENCH))
    answer = reload()
    assert answer.success
    assert "box" in answer.message
    np.testing.assert_allclose(twist_now(ask), changed.surface.twist_of_wrench(WRENCH))


@pytest.mark.parametrize("share", [0.0, 0.3, 0.6, 0.9, 0.99])
def test_a_file_that_is_half_written_is_not_taken(running, share):
    _, model, path, reload, ask = running
    text = path.read_text()
    path.write_text(text[: int(share * len(text))])
    answer = reload()
    assert not answer.success
    assert str(path) in answer.message
    assert "keep serving" in answer.message
    np.testing.assert_allclose(twist_now(ask), model.surface.twist_of_wrench(WRENCH))
    path.write_text(text)
    assert reload().success


def test_a_bad_file_is_told_with_file_and_key(running):
    _, model, path, reload, ask = running
    text = path.read_text()
    path.write_text(text.replace("friction_force: 2.0", "friction_force: '0.001'"))
    answer = reload()
    assert not answer.success
    assert str(path) in answer.message
    assert "friction_force" in answer.message
    np.testing.assert_allclose(twist_now(ask), model.surface.twist_of_wrench(WRENCH))


def test_a_bad_file_whose_name_is_no_utf_8_is_told_and_diagnostics_go_on(
    ros, client_node, model_file, tmp_path
):
    _, path = model_file("box", seed=0)
    ros.add(LimitSurfaceNode, files=[tmp_path], parameters={"diagnostics_period": 0.1})
    reload = ros.client(client_node, Trigger, "/limit_surface/reload")
    # As it comes out of an archive that was packed in Latin-1.
    bad = Path(os.fsdecode(os.fsencode(tmp_path) + b"/caf\xe9.yaml"))
    bad.write_text("schema: 1\nname: bad\n")
    answer = reload(Trigger.Request())
    assert not answer.success
    assert rf"{tmp_path}/caf\udce9.yaml: kind: missing" in answer.message
    arrays = ros.listen(client_node, DiagnosticArray, "/diagnostics")
    ros.wait(lambda: any(r"caf\udce9" in v.value for a in arrays for v in a.status[0].values))
    bad.write_bytes(path.read_bytes().replace(b"name: box", b"name: cup"))
    answer = reload(Trigger.Request())
    assert answer.success
    assert "cup" in answer.message


def test_a_file_that_vanished_is_told_and_the_node_goes_on(running):
    _, model, path, reload, ask = running
    path.unlink()
    assert not reload().success
    np.testing.assert_allclose(twist_now(ask), model.surface.twist_of_wrench(WRENCH))


def test_other_files_are_swapped_in_by_the_parameter(running, model_file, tmp_path):
    node, model, path, _, ask = running
    folder = tmp_path / "more"
    folder.mkdir()
    other, _ = model_file("crate", seed=3, folder=folder)
    (result,) = node.set_parameters([Parameter("model_files", value=[str(path), str(folder)])])
    assert result.successful, result.reason
    np.testing.assert_allclose(twist_now(ask), model.surface.twist_of_wrench(WRENCH))
    node.set_parameters([Parameter("default_model", value="crate")])
    np.testing.assert_allclose(twist_now(ask), other.surface.twist_of_wrench(WRENCH))


def test_one_bad_file_among_good_ones_keeps_all_old_models(running, model_file, tmp_path):
    node, model, path, _, ask = running
    _, other = model_file("crate", seed=3)
    bad = tmp_path / "bad.yaml"
    bad.write_text("schema: 1\nname: bad\n")
    files = [str(other), str(bad)]
    (result,) = node.set_parameters([Parameter("model_files", value=files)])
    assert not result.successful
    assert str(bad) in result.reason
    assert list(node.get_parameter("model_files").value) == [str(path)]
    np.testing.assert_allclose(twist_now(ask), model.surface.twist_of_wrench(WRENCH))


def test_models_are_listed_with_what_is_known_of_them(ros, client_node, model_file, tmp_path):
    dented = PowerSum.thesis(
        [np.eye(3), 0.01 * np.eye(3), 0.01 * np.eye(3), np.diag([1.0, 1e-4, 1e-4])], Scaling(0.3)
    )
    known = SurfaceModel("four", dented, fit={"objective": "J2", "cost": 0.25})
    first = tmp_path / "four.yaml"
    write_surface_model(known, first)
    norms, second = model_file("box", terms=2, normal_force=9.0, frame_id="base")
    contacts = SurfaceModel("feet", PointContacts([[0, 0], [0.1, 0], [0, 0.1]], [1.0, 1.0, 2.0]))
    third = tmp_path / "feet.yaml"
    write_surface_model(contacts, third)
    ros.add(LimitSurfaceNode, files=[first, second, third], parameters={"default_model": "box"})
    listed = ros.client(client_node, ListModels, "/limit_surface/list_models")
    models = listed(ListModels.Request()).models
    assert [info.name for info in models] == ["box", "four", "feet"]
    assert [info.is_default for info in models] == [True, False, False]
    assert [info.kind for info in models] == ["power_sum", "power_sum", "point_contacts"]
    assert [info.terms for info in models] == [2, 4, 3]
    assert [info.convex for info in models] == [True, False, True]
    assert models[0].frame_id == norms.frame_id == "base"
    assert models[0].normal_force == 9.0
    assert math.isnan(models[1].normal_force)
    assert models[1].characteristic_length == 0.3
    assert not hasattr(models[1], "fit")
    described = ros.client(client_node, DescribeModel, "/limit_surface/describe_model")
    answer = described(DescribeModel.Request(model="four"))
    assert answer.name == "four"
    assert "objective: J2" in answer.fit
    summary = yaml.safe_load(answer.summary)
    limits = dented.wrench_of_twist(np.eye(3))
    assert summary["largest_moment"] == pytest.approx(limits[2, 2], rel=1e-5)
    assert summary["limit_along_x"][1] == pytest.approx(limits[0, 0], rel=1e-5)
    assert summary["convex"] is False
    assert described(DescribeModel.Request(model="no")).error_code == ErrorCode.UNKNOWN_MODEL
