# SPDX-License-Identifier: Apache-2.0
"""The promise of `--to mujoco` and `--to ellipsoid`: stand-ins, and how far off they are."""

import numpy as np
import pytest

from export_models import TRIANGLE
from limit_surface_ros.errors import RangeError
from limit_surface_ros.export.mjcf import mujoco_model
from limit_surface_ros.export.simulators import (
    audit,
    fit_ellipsoid,
    fit_spheres,
    match_single_contact,
)
from limit_surface_ros.surface import PointContacts, PowerSum, Scaling

TICKS = (np.arange(20) + 0.5) / 20 * 0.1 - 0.05
SQUARE = PointContacts(
    np.array([each.ravel() for each in np.meshgrid(TICKS, TICKS)]).T,
    np.full(400, 3.5 / 400),
    Scaling(0.05, 3.5),
)
# Joints of the plane, then those out of it, each driven or free.
AXES = ("slide", "1 0 0"), ("slide", "0 1 0"), ("hinge", "0 0 1"), ("slide", "0 0 1")
TILTS = ("hinge", "1 0 0"), ("hinge", "0 1 0")
SPEED = 0.02  # [m/s]


def test_four_spheres_stand_for_a_square_patch():
    found = fit_spheres(SQUARE, 4)
    assert found.audit.mean <= 1.5
    assert found.audit.high <= 2.5
    assert found.limits.sum() == pytest.approx(3.5, rel=0.01)
    assert np.hypot(*found.points.T) == pytest.approx(np.full(4, 0.03381), rel=0.02)
    assert found.torsion_length == pytest.approx(0.01862, rel=0.03)


def test_support_points_are_taken_as_they_are():
    found = fit_spheres(TRIANGLE, 4)
    assert found.points.tolist() == TRIANGLE.points.tolist()
    assert found.torsion_length == 0.0
    assert found.audit.mean == 0.0


def test_another_number_of_spheres_is_refused():
    for count in (0, 33):
        with pytest.raises(RangeError, match="1 to 32"):
            fit_spheres(SQUARE, count)


def test_one_contact_is_told_to_be_far_off():
    single = match_single_contact(SQUARE)
    assert single.force == pytest.approx(3.5, rel=1e-6)
    # The mean arm of a square of side a is 0.382598 a.
    assert single.moment == pytest.approx(3.5 * 0.0382598, rel=2e-3)
    assert 4.0 < single.ellipsoid.mean < 8.0
    assert 20.0 < single.prism.mean < 30.0


def test_an_ellipsoid_is_found_again_and_another_surface_is_audited():
    matrix = np.array([[2.0, 0.3, 0.1], [0.3, 1.0, -0.2], [0.1, -0.2, 1.5]])
    surface = PowerSum(matrix[np.newaxis], [1.0], Scaling(0.05, 2.0))
    found = fit_ellipsoid(surface)
    unit = surface.scaling.wrench_unit
    assert np.allclose(found.matrix * np.multiply.outer(unit, unit), matrix, rtol=1e-6)
    assert found.audit.mean < 1e-4
    assert 3.0 < fit_ellipsoid(SQUARE).audit.mean < 6.0
    assert audit(SQUARE, SQUARE.wrench_of_twist).mean < 1e-5


@pytest.mark.parametrize(("surface", "spheres", "most"), [(SQUARE, 4, 1.5), (TRIANGLE, 3, 0.2)])
def test_the_simulator_moves_the_body_as_the_surface_says(surface, spheres, most):
    mujoco = pytest.importorskip("mujoco", reason="mujoco is not installed: make test_exports")
    joints = "".join(
        f'<joint name="joint{i}" type="{kind}" axis="{axis}"/>'
        for i, (kind, axis) in enumerate((*AXES, *TILTS))
    )
    rho = surface.scaling.characteristic_length
    gains = (200.0, 200.0, 200.0 * rho * rho)
    motors = "".join(f'<velocity joint="joint{i}" kv="{kv}"/>' for i, kv in enumerate(gains))
    text = mujoco_model(surface, "body", "A body.", 7.0, spheres)
    text = text.replace("<freejoint/>", joints)
    text = text.replace("</mujoco>", f"<actuator>{motors}</actuator></mujoco>")
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    unit = surface.scaling.twist_unit
    angles = []
    for wanted in np.random.default_rng(0).normal(size=(30, 3)):
        twist = SPEED * wanted / np.linalg.norm(wanted) * unit
        mujoco.mj_resetData(model, data)
        for _ in range(400):
            cosine, sine = np.cos(data.qpos[2]), np.sin(data.qpos[2])
            turned = np.array([[cosine, -sine], [sine, cosine]])
            data.ctrl[:] = [*turned @ twist[:2], twist[2]]
            mujoco.mj_step(model, data)
        cosine, sine = np.cos(data.qpos[2]), np.sin(data.qpos[2])
        turned = np.array([[cosine, -sine], [sine, cosine]])
        load = np.append(turned.T @ data.actuator_force[:2], data.actuator_force[2])
        motion = np.append(turned.T @ data.qvel[:2], data.qvel[2]) / unit
        motion /= np.linalg.norm(motion)
        right = surface.twist_of_wrench(load) / unit
        angles.append(np.degrees(np.arccos(np.clip(motion @ right, -1.0, 1.0))))
    assert np.mean(angles) < most
