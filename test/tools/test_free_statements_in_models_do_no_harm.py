# SPDX-License-Identifier: Apache-2.0
"""What stands under `fit` in a model file is free: whatever it is, programs work or say so."""

import pytest

from limit_surface_ros.tools import compare_surfaces, plot_decay

CONTACT = """schema: 1
name: feet
points: [[-0.04, -0.04], [-0.04, 0.08], [0.08, -0.04]]
friction_limits: [1.4, 1.4, 1.4]
"""
SURFACE = """schema: 1
name: feet
kind: point_contacts
frame_id: object
characteristic_length: 0.05
friction_force: 4.0
fit: {FREE}
points: [[-0.04, -0.04], [-0.04, 0.08], [0.08, -0.04]]
friction_limits: [1.4, 1.4, 1.4]
"""
DECAY = """schema: 1
kind: exponential_sum
name: soft
fit: {FREE}
time_span: [0.0, 6.0]
norm: inf
max_error: 0.02
rates: [[-1.0, 0.0]]
coefficients: [[1.0, 0.0]]
"""


@pytest.mark.parametrize(
    ("free", "code"),
    [
        ("wall_time_s: soon", 0),
        ("wall_time_s: [1]", 0),
        ("bootstrap: 5", 2),
        ("bootstrap: [1, 2]", 2),
        ("bootstrap: {kind: dissipation, matrices: x}", 2),
        ("uncertainty: x, description: 7", 0),
    ],
)
def test_surfaces_are_compared_whatever_their_files_state(tmp_path, capsys, free, code):
    (tmp_path / "contact.yaml").write_text(CONTACT)
    model = tmp_path / "model.yaml"
    model.write_text(SURFACE.replace("FREE", free))
    arguments = [str(tmp_path / "contact.yaml"), "--models", str(model), "--motions", "20"]
    assert compare_surfaces.main([*arguments, "--facet-loads", "0"]) == code
    printed = capsys.readouterr()
    assert ("point_contacts" in printed.out) == (code == 0)
    assert len(printed.err.splitlines()) == (1 if code else 0)


@pytest.mark.parametrize(
    "free", ["outlier_times: late", "outlier_times: [x, 1.0]", "source: [1], start: a, offset: {}"]
)
def test_decays_are_drawn_whatever_their_files_state(tmp_path, free):
    pytest.importorskip("matplotlib", reason="matplotlib draws the pictures")
    path, picture = tmp_path / "decay.yaml", tmp_path / "decay.png"
    path.write_text(DECAY.replace("FREE", free))
    assert plot_decay.main([str(path), "--output", str(picture)]) == 0
    assert picture.exists()
