# SPDX-License-Identifier: Apache-2.0
"""A fit prints what a person would check, stores it, and warns of what its data cannot tell."""

import numpy as np
import pytest

from limit_surface_ros.files.surface_file import read_surface_model
from limit_surface_ros.surface.contact import shapes
from limit_surface_ros.surface.contact.patch import ContactPatch
from limit_surface_ros.surface.pairs import Pairs
from limit_surface_ros.surface.sampling import random_loads
from limit_surface_ros.tools.fit_surface import main

BODY = ContactPatch.of_shape(shapes.rectangle([0.12, 0.07], 400)).surface(0.35, 10.0)
PUSHES = random_loads(BODY, 60, 4)


def fitted(tmp_path, pairs, *options, first=""):
    """Write pairs, fit them, return the model."""
    path, output = tmp_path / "pushes.csv", tmp_path / "model.yaml"
    rows = np.hstack([pairs.wrenches, pairs.twists])
    lines = [",".join(map(repr, row.tolist())) for row in rows]
    path.write_text("\n".join([*first.splitlines(), "fx_N,fy_N,tau_Nm,vx,vy,omega", *lines]))
    assert main([str(path), "-o", str(output), "--starts", "2", *options]) == 0
    return read_surface_model(output)


def some(pairs, which):
    return Pairs(pairs.wrenches[which], pairs.twists[which])


def test_the_block_has_sizes_in_newtons_and_metres(tmp_path, capsys):
    model = fitted(tmp_path, PUSHES, "--terms", "2", first='# {"normal_force_N": 10.0}')
    printed = capsys.readouterr()
    assert "warning" not in printed.err
    moment = BODY.wrench_of_twist([0, 0, 1])[2]
    stored = model.fit["description"]
    assert stored["friction_force_N"][1] == pytest.approx(3.5, rel=0.05)
    assert stored["largest_moment_Nm"] == pytest.approx(moment, rel=0.1)
    assert stored["bends_inward_percent"] == 0.0
    assert "doubts" not in stored
    for words in (
        "about       (0, 0) m in frame object",
        "of the normal force) without turning, turns on the spot at",
        "surface convex",
        "turn left",
        "velocities to all sides",
    ):
        assert words in printed.out


@pytest.mark.parametrize(
    ("change", "options", "words"),
    [
        (
            lambda p: Pairs(p.wrenches * [1, 1, 0.001], p.twists * [1, 1, 0.01]),
            ["--characteristic-length", "0.04"],
            "hardly any push turns the body: how large a moment friction holds is a guess",
        ),
        (
            lambda p: some(p, p.twists[:, 2] > 0),
            [],
            "hardly any push turns the body to the right",
        ),
        (lambda p: some(p, p.twists[:, 0] > 0), [], "all velocities lie within"),
        (
            lambda p: Pairs(p.wrenches * [1, 1, 1000], p.twists * [1, 1, 0.001]),
            [],
            "are moments in N m",
        ),
        (
            lambda p: Pairs(p.wrenches[:, [1, 0, 2]] * [-1, 1, 1], p.twists),
            [],
            "the model misses its own data by",
        ),
    ],
)
def test_what_the_data_do_not_tell_is_warned_about_and_stored(
    tmp_path, capsys, change, options, words
):
    # check_pushes refuses some of these before there is a fit.
    model = fitted(tmp_path, change(PUSHES), "--terms", "1", "--anyway", *options)
    assert words in capsys.readouterr().err
    assert any(words in doubt for doubt in model.fit["description"]["doubts"])


def test_friction_beyond_the_normal_force_is_doubted(tmp_path, capsys):
    fitted(tmp_path, PUSHES, "--terms", "1", first='# {"normal_force_N": 1.0}')
    assert "3.5 times the normal force: are both in newtons?" in capsys.readouterr().err


def test_a_surface_that_bends_inward_is_told_by_its_fit(tmp_path, capsys):
    contact, output = tmp_path / "triangle.yaml", tmp_path / "model.yaml"
    contact.write_text(
        "schema: 1\nname: triangle\npoints: [[-0.04, -0.04], [-0.04, 0.08], [0.08, -0.04]]\n"
        "friction_limits: [0.5, 0.5, 0.5]\n"
    )
    options = ["--family", "thesis", "--terms", "4", "--motions", "600", "--starts", "4"]
    assert main([str(contact), "-o", str(output), *options]) == 0
    printed = capsys.readouterr()
    assert "the surface bends inward in" in printed.err
    assert "surface bends inward in" in printed.out


def test_motions_next_to_a_length_in_millimetres_are_named(tmp_path, capsys):
    path = tmp_path / "pushes.csv"
    rows = np.hstack([PUSHES.wrenches, PUSHES.twists])
    lines = [",".join(map(repr, row.tolist())) for row in rows]
    path.write_text('# {"rho_m": 40}\nfx_N,fy_N,tau_Nm,vx,vy,omega\n' + "\n".join(lines))
    assert main([str(path), "-o", str(tmp_path / "m.yaml"), "--auto", "--anyway"]) == 2
    assert "characteristic length of 40 m the velocities are nothing" in capsys.readouterr().err
