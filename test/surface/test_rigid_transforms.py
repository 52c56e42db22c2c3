# SPDX-License-Identifier: Apache-2.0
"""Wrenches and twists seen from another frame: the lever arm counts, and power is what it was."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from limit_surface_ros.errors import NotFiniteError, ShapeError, ZeroVectorError
from limit_surface_ros.surface.frames import RigidTransform, out_of_plane, planar, power

numbers = st.floats(-10.0, 10.0)
sixes = st.lists(numbers, min_size=6, max_size=6).map(np.array)
poses = st.builds(
    RigidTransform.from_euler,
    st.lists(numbers, min_size=3, max_size=3),
    st.lists(numbers, min_size=3, max_size=3),
)


def test_a_wrench_is_turned_and_moved_as_geometry2_does_it():
    # Acceptance vector of geometry2, TfGeometry.Wrench.
    pose = RigidTransform.from_euler([0.0, -2.0, 0.0], [0.0, 0.0, -np.pi / 2])
    moved = pose.wrench([2.0, 1.0, 3.0, 2.0, 1.0, 3.0])
    np.testing.assert_allclose(moved, [1.0, -2.0, 3.0, -5.0, -2.0, 5.0], atol=1e-12)


@given(poses, sixes, sixes)
def test_power_does_not_depend_on_the_frame(pose, wrench, twist):
    before, after = wrench @ twist, pose.wrench(wrench) @ pose.twist(twist)
    assert after == pytest.approx(before, abs=1e-9 * (1.0 + 1e4))


@given(poses, poses, sixes)
def test_one_transform_after_another_is_their_product(first, second, wrench):
    np.testing.assert_allclose(
        (second @ first).wrench(wrench), second.wrench(first.wrench(wrench)), atol=1e-9
    )
    np.testing.assert_allclose(
        (second @ first).twist(wrench), second.twist(first.twist(wrench)), atol=1e-9
    )


@given(poses, sixes)
def test_the_inverse_brings_back(pose, six):
    np.testing.assert_allclose(pose.inverse.wrench(pose.wrench(six)), six, atol=1e-9)
    np.testing.assert_allclose(pose.inverse.twist(pose.twist(six)), six, atol=1e-9)


@given(poses)
def test_rotations_are_proper(pose):
    np.testing.assert_allclose(pose.rotation @ pose.rotation.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(pose.rotation) == pytest.approx(1.0)


def test_euler_angles_turn_about_the_fixed_axes_x_y_z():
    roll, pitch, yaw = 0.3, -0.7, 1.1
    single = [
        RigidTransform.from_euler(np.zeros(3), angles)
        for angles in ([roll, 0, 0], [0, pitch, 0], [0, 0, yaw])
    ]
    together = RigidTransform.from_euler(np.zeros(3), [roll, pitch, yaw])
    expected = (single[2] @ single[1] @ single[0]).rotation
    np.testing.assert_allclose(together.rotation, expected, atol=1e-12)


def test_many_are_transformed_as_one_by_one():
    pose = RigidTransform.from_euler([1.0, 2.0, 3.0], [0.1, 0.2, 0.3])
    many = np.random.default_rng(0).normal(size=(2, 5, 6))
    for method in (pose.wrench, pose.twist):
        whole = method(many)
        assert whole.shape == many.shape
        np.testing.assert_allclose(whole[1, 3], method(many[1, 3]), atol=1e-12)


def test_what_is_no_pose_or_six_vector_is_refused():
    with pytest.raises(ZeroVectorError, match="quaternion"):
        RigidTransform.from_quaternion([0, 0, 0], [0, 0, 0, 0])
    with pytest.raises(ShapeError, match="quaternion"):
        RigidTransform.from_quaternion([0, 0], [0, 0, 0, 1])
    with pytest.raises(ShapeError, match="roll"):
        RigidTransform.from_euler([0, 0, 0], [0, 0])
    pose = RigidTransform.from_quaternion([0, 0, 0], [0, 0, 0, 2.0])
    with pytest.raises(ShapeError, match="6"):
        pose.wrench([1.0, 2.0, 3.0])
    with pytest.raises(NotFiniteError, match="twist"):
        pose.twist([np.nan] * 6)


def test_planar_parts_and_what_they_leave_out():
    six = (3.0, 4.0, 12.0, 0.0, 0.0, 0.0)
    assert planar(six) == (3.0, 4.0, 0.0)
    assert out_of_plane(six, 10.0) == pytest.approx(12.0 / 5.0)
    assert out_of_plane(six, 10.0, pressing=True) == 0.0
    # A torque of 0.5 N m weighs as 5 N at 1 / rho = 10 / m.
    assert out_of_plane((3.0, 4.0, 0.0, 0.3, 0.4, 0.0), 10.0) == pytest.approx(1.0)
    assert out_of_plane((0.0,) * 6, 10.0) == 0.0
    assert power(np.array([[1.0, 2.0, 3.0]]), np.array([[4.0, 5.0, 6.0]])).tolist() == [32.0]
