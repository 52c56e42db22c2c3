# SPDX-License-Identifier: Apache-2.0
"""check_pushes tells what recorded pushes hold; fit_surface refuses what cannot be a body's."""

import re

import numpy as np
import pytest

from limit_surface_ros.files.recordings.simulation import RecordingPlan, simulate_recording
from limit_surface_ros.files.surface_file import read_surface_model
from limit_surface_ros.surface.kinds.point_contacts import PointContacts
from limit_surface_ros.surface.sampling import random_motions
from limit_surface_ros.surface.scaling import Scaling
from limit_surface_ros.tools import check_pushes, fit_surface

FEET = np.array([[-0.04, -0.04], [-0.04, 0.08], [0.08, -0.04]])
TRIANGLE = PointContacts(FEET, np.full(3, 4.1 / 3), Scaling(0.05, 4.1))
NAMES = "fx_N,fy_N,tau_Nm,vx,vy,omega"


def written(path, scale=(1.0,) * 6, first="", shift=(0.0,) * 6):
    pairs = random_motions(TRIANGLE, 40, 0)
    rows = np.hstack([pairs.wrenches, pairs.twists]) * np.array(scale) + shift
    lines = [",".join(f"{x:.9g}" for x in row) for row in rows]
    path.write_text("\n".join([*([first] if first else []), NAMES, *lines]) + "\n")
    return path


def test_sound_pushes_are_described_and_drawn(tmp_path, capsys):
    pytest.importorskip("matplotlib")
    pushes, picture = written(tmp_path / "pushes.csv"), tmp_path / "pushes.png"
    assert check_pushes.main([str(pushes), "-o", str(picture)]) == 0
    told = capsys.readouterr().out
    for label in ("pairs", "forces", "moments", "length", "coverage", "written", "verdict"):
        assert re.search(rf"^{label} ", told, re.MULTILINE)
    assert picture.read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize(
    ("scale", "first", "cause"),
    [
        ((1, 1, 1e3, 1, 1, 1), "", "tau is in N mm"),
        ((1, 1, 1, 1, 1, 57.3), "", "omega is in deg/s"),
        ((1, 1, 1, 1, 1, 1), '# {"rho_m": 50}', "it is in millimetres"),
        ((-1, -1, -1, 1, 1, 1), "", "wrenches those on the pusher"),
    ],
)
def test_what_cannot_be_a_body_is_told_and_not_fitted(tmp_path, capsys, scale, first, cause):
    pushes, model = written(tmp_path / "pushes.csv", scale, first), tmp_path / "model.yaml"
    assert check_pushes.main([str(pushes)]) == 1
    assert cause in capsys.readouterr().out
    fit = [str(pushes), "--terms", "1", "-o", str(model)]
    assert fit_surface.main(fit) == 2
    told = capsys.readouterr().err
    assert cause in told
    assert "--anyway fits all the same" in told
    assert not model.exists()


def test_what_is_doubted_is_fitted_if_that_is_asked_for(tmp_path, capsys):
    pushes = written(tmp_path / "pushes.csv", shift=(1.5, -1.0, 0.03, 0, 0, 0))
    model = tmp_path / "model.yaml"
    fit = [str(pushes), "--terms", "1", "-o", str(model)]
    assert fit_surface.main(fit) == 2
    assert "the sensor has a bias" in capsys.readouterr().err
    assert fit_surface.main([*fit, "--anyway"]) == 0
    assert "the sensor has a bias" in capsys.readouterr().err
    assert "the sensor has a bias" in str(read_surface_model(model).fit)


def test_other_inputs_and_options_are_refused(tmp_path, capsys):
    contact = tmp_path / "contact.yaml"
    contact.write_text("schema: 1\n")
    assert check_pushes.main([str(contact)]) == 2
    assert "recorded pushes are accepted" in capsys.readouterr().err
    pushes = written(tmp_path / "pushes.csv")
    assert check_pushes.main([str(pushes), "--body", "box"]) == 2
    assert "--body does nothing here: it is for a bag" in capsys.readouterr().err


def test_a_bag_is_corrected_described_and_fitted(tmp_path, capsys):
    pytest.importorskip("rosbags")
    from bag_helpers import POSE, WRENCH, pose, vector, wrench, write_bag

    plan = RecordingPlan(
        pushes=16, pose_noise=1e-4, yaw_noise=1e-3, delay=0.1, bias=(0.4, -0.3, 0.01)
    )
    recording = simulate_recording(TRIANGLE, plan, 0).recording
    loads = []
    for t, six in zip(recording.wrench_times + 100.0, recording.wrenches, strict=True):
        message = wrench(t, 0.0, 0.0, 0.0)
        message.wrench.force, message.wrench.torque = vector(*six[:3]), vector(*six[3:])
        loads.append(message)
    poses = [
        pose(t, float(x), float(y), yaw)
        for t, (x, y, yaw) in zip(recording.motion_times + 100.0, recording.motions, strict=True)
    ]
    bag = str(write_bag(tmp_path / "bag", {"/wrench": (WRENCH, loads), "/pose": (POSE, poses)}))
    topics = ["--wrench-topic", "/wrench", "--motion-topic", "/pose"]
    assert check_pushes.main([bag, *topics]) == 0
    told = capsys.readouterr().out
    for part in ("0.1", "stamped", "bias of the sensor", "rests", "noise of the motion"):
        assert part in told
    output = tmp_path / "model.yaml"
    fit = [bag, *topics, "--kind", "dissipation", "--terms", "3", "-o", str(output)]
    assert fit_surface.main([*fit, "--starts", "8"]) == 0
    model = read_surface_model(output)
    assert model.frame_id == "object"
    assert model.fit["clock_offset"]["delay"] == pytest.approx(0.1, abs=0.01)
    np.testing.assert_allclose(model.fit["tare"]["bias"][:2], [0.4, -0.3], atol=0.02)
    truth = random_motions(TRIANGLE, 300, 5)
    loads = model.surface.wrench_of_twist(truth.twists)
    errors = np.linalg.norm((loads - truth.wrenches) / TRIANGLE.scaling.wrench_unit, axis=1)
    assert errors.mean() < 0.1
    assert fit_surface.main([bag, "-o", str(output)]) == 2
    assert "name --wrench-topic and --motion-topic" in capsys.readouterr().err
