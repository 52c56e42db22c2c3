# SPDX-License-Identifier: Apache-2.0
"""replay_learning shows how predictions improve, and writes what was learnt."""

import numpy as np
import pytest

from limit_surface_ros.files.surface_file import (
    SurfaceModel,
    read_surface_model,
    write_surface_model,
)
from limit_surface_ros.fitting.few_pushes.online import OnlineSurface
from limit_surface_ros.surface.kinds.dissipation import Dissipation
from limit_surface_ros.surface.kinds.point_contacts import PointContacts
from limit_surface_ros.surface.measures import mean_angle
from limit_surface_ros.surface.pairs import Pairs
from limit_surface_ros.surface.sampling import random_loads
from limit_surface_ros.surface.scaling import Scaling
from limit_surface_ros.tools.replay_learning import main

SCALING = Scaling(0.08, 5.0)
BODY = PointContacts([[-0.04, -0.04], [-0.04, 0.08], [0.08, -0.04]], [2.0, 1.0, 1.5], SCALING)


@pytest.fixture
def pushes(tmp_path):
    """A CSV of 20 pushes, one of them reversed."""
    pairs = random_loads(BODY, 20, 2)
    twists = np.array(pairs.twists)
    twists[7] *= -1.0
    rows = np.hstack([Pairs(pairs.wrenches, twists).wrenches, twists])
    lines = [",".join(map(repr, row.tolist())) for row in rows]
    path = tmp_path / "pushes.csv"
    path.write_text("\n".join(["fx_N,fy_N,tau_Nm,vx,vy,omega", *lines]))
    return path


def test_the_curve_falls_and_the_learnt_model_predicts(pushes, tmp_path, capsys):
    prior, output = tmp_path / "prior.yaml", tmp_path / "learnt.yaml"
    wrong = Dissipation(np.eye(3)[None], SCALING)
    write_surface_model(SurfaceModel("wrong", wrong, frame_id="box"), prior)
    assert main([str(pushes), "--prior", str(prior), "-o", str(output)]) == 0
    printed = capsys.readouterr().out
    rows = [line.split() for line in printed.splitlines() if " to " in line]
    assert float(rows[-1][3]) < 0.7 * float(rows[-1][4])
    assert "refused     1 push: its power is not positive" in printed
    model = read_surface_model(output)
    assert (model.name, model.frame_id) == ("learnt", "box")
    test = random_loads(BODY, 200, 9)
    assert mean_angle(model.surface, test) < 0.5 * mean_angle(wrong, test)
    assert (model.uncertain.twist_with_covariance([1.0, 0.2, 0.01]).half_axes > 0.0).all()
    again = OnlineSurface.restored(model.fit["online"], wrong)
    assert again.count == 19


def test_without_a_prior_it_begins_with_a_sphere_and_draws(pushes, tmp_path, capsys):
    pytest.importorskip("matplotlib")
    picture = tmp_path / "curve.png"
    arguments = [str(pushes), "--picture", str(picture), "--keep", "10", "--forgetting", "0.9"]
    assert main(arguments) == 0
    assert picture.stat().st_size > 1000
    assert f"written     {picture}" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--forgetting", "much"], "--forgetting must be a number or blend, got 'much'"),
        (["--forgetting", "2"], "forgetting must be above 0 and at most 1"),
        (["--keep", "1"], "window must be at least 2, got 1"),
        (["--wrench-topic", "/w"], "--wrench-topic does nothing here"),
        (["-o", "model.txt"], "model.txt"),
        (["--prior", "absent.yaml"], "absent.yaml"),
    ],
)
def test_what_cannot_be_replayed_is_refused(pushes, capsys, options, message):
    assert main([str(pushes), *options]) == 2
    assert message in capsys.readouterr().err
