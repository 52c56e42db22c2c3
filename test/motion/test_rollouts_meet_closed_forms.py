# SPDX-License-Identifier: Apache-2.0
"""Pushes along a path meet what is known in closed form, and converge in their order."""

import numpy as np
import pytest

from limit_surface_ros.motion.outcomes import ContactMode
from limit_surface_ros.motion.outline import Polygon
from limit_surface_ros.motion.push import push, pushes
from limit_surface_ros.motion.rollout import simulate_push
from limit_surface_ros.motion.round_outlines import Ellipse
from limit_surface_ros.surface.kinds.point_contacts import PointContacts
from limit_surface_ros.surface.scaling import Scaling
from push_helpers import ellipsoid

C = 0.035
SQUARE = Polygon([[-0.05, -0.05], [0.05, -0.05], [0.05, 0.05], [-0.05, 0.05]])


def test_a_sticking_push_of_an_ellipsoid():
    rng = np.random.default_rng(0)
    for _ in range(50):
        p, u = 0.05 * rng.standard_normal(2), rng.standard_normal(2)
        found = push(ellipsoid(C), p, u, 1e6, u)
        if found.mode is not ContactMode.STICK:
            continue
        below = C * C + p @ p
        expected = [*((C * C * u + p * (p @ u)) / below), (p[0] * u[1] - p[1] * u[0]) / below]
        np.testing.assert_allclose(found.twist, expected, rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("accuracy", [1e-5, 1e-8, 1e-11])
def test_a_point_that_sticks_turns_into_the_line_of_its_path(accuracy):
    start, length = np.array([-0.05, 0.012]), 0.04
    path = [start, start + np.array([length, 0.0])]
    run = simulate_push(ellipsoid(C), SQUARE, 0.0, np.inf, [0, 0, 0], path, accuracy=accuracy)
    assert set(run.modes) == {ContactMode.STICK}
    arm = path[1] - run.end_pose[:2]
    before, after = np.arctan2(start[1], start[0]), np.arctan2(arm[1], arm[0])
    rate = np.hypot(*start) / (C * C + start @ start)
    assert np.tan(after / 2) == pytest.approx(
        np.tan(before / 2) * np.exp(-rate * length), rel=100 * accuracy
    )
    # The body follows from the arm, which it keeps.
    np.testing.assert_allclose(np.hypot(*arm), np.hypot(*start), atol=3 * accuracy)
    assert run.end_pose[2] == pytest.approx(after - before, abs=100 * accuracy)


def test_the_error_falls_with_the_third_power_of_the_number_of_steps():
    start = np.array([-0.05, 0.012])
    path = [start, start + np.array([0.04, 0.0])]
    rate = np.hypot(*start) / (C * C + start @ start)
    exact = np.tan(np.arctan2(start[1], start[0]) / 2) * np.exp(-rate * 0.04)
    errors, evaluations = [], []
    for accuracy in (1e-7, 1e-9, 1e-11):
        run = simulate_push(ellipsoid(C), SQUARE, 0.0, np.inf, [0, 0, 0], path, accuracy=accuracy)
        arm = path[1] - run.end_pose[:2]
        errors.append(abs(np.tan(np.arctan2(arm[1], arm[0]) / 2) - exact))
        evaluations.append(run.evaluations)
    orders = -np.diff(np.log(errors)) / np.diff(np.log(evaluations))
    assert ((orders > 2.8) & (orders < 3.6)).all(), orders


@pytest.mark.parametrize(("scheme", "order"), [("euler", 1.0), ("midpoint", 2.0)])
def test_fixed_steps_with_single_pushes_converge_to_the_rollout(scheme, order):
    start, length = np.array([-0.05, 0.012]), 0.04
    path = [start, start + np.array([length, 0.0])]
    exact = simulate_push(ellipsoid(C), SQUARE, 0.0, np.inf, [0, 0, 0], path, accuracy=1e-11)

    def rate(pose, tip):
        c, s = np.cos(pose[2]), np.sin(pose[2])
        turn = np.array([[c, -s], [s, c]])
        point, velocity = (tip - pose[:2]) @ turn, np.array([1.0, 0.0]) @ turn
        twist = push(ellipsoid(C), point, [1.0, 0.0], np.inf, velocity).twist
        return np.array([*(turn @ twist[:2]), twist[2]])

    errors = []
    for steps in (20, 40):
        pose, h = np.zeros(3), length / steps
        for step in range(steps):
            tip = start + np.array([step * h, 0.0])
            slope = rate(pose, tip)
            if scheme == "midpoint":
                slope = rate(pose + 0.5 * h * slope, tip + np.array([0.5 * h, 0.0]))
            pose = pose + h * slope
        errors.append(np.abs(pose - exact.end_pose).max())
    assert np.log2(errors[0] / errors[1]) == pytest.approx(order, abs=0.06)


def test_a_round_body_rolls_on_a_round_tip_then_slides_and_is_left():
    body, tip, c, friction, start = 0.0525, 0.00475, 0.035, 0.1, 0.9
    both = body + tip
    centre = -both * np.array([np.cos(start), np.sin(start)])
    run = simulate_push(
        ellipsoid(c),
        Ellipse([body, body]),
        tip,
        friction,
        [0, 0, 0],
        [centre, centre + np.array([0.1, 0.0])],
        accuracy=2e-8,
    )
    # Here it slides from the start: tan(delta) > mu (c^2 + R^2) / c^2.
    phi = np.arctan(friction)

    def turned(delta):
        slope = np.sin(delta) - friction * np.cos(delta)
        return (np.log(slope) - friction * delta) / (1.0 + friction**2)

    leaves = (
        both
        * np.cos(phi)
        * (np.log(np.tan((np.pi / 2 - phi) / 2)) - np.log(np.tan((start - phi) / 2)))
    )
    angle = friction * body / c**2 * both * (turned(np.pi / 2) - turned(start))
    assert leaves == pytest.approx(0.04333, abs=5e-6)
    assert angle == pytest.approx(0.063114, abs=5e-7)
    assert run.left_at == pytest.approx(leaves, abs=1e-7)
    assert run.end_pose[2] == pytest.approx(angle, abs=2e-8)
    assert run.touched_at == 0.0
    assert ContactMode.STICK not in run.modes
    assert run.modes[-1] is ContactMode.SEPARATE


def test_a_round_body_rolls_while_it_sticks():
    body, tip, c, friction, start, length = 0.0525, 0.00475, 0.035, 0.5, 0.2, 0.02
    both = body + tip
    centre = -both * np.array([np.cos(start), np.sin(start)])
    run = simulate_push(
        ellipsoid(c),
        Ellipse([body, body]),
        tip,
        friction,
        [0, 0, 0],
        [centre, centre + np.array([length, 0.0])],
        accuracy=1e-9,
    )
    assert set(run.modes) == {ContactMode.STICK}
    rate = body**2 / ((c**2 + body**2) * both)
    end = 2.0 * np.arctan(np.tan(start / 2) * np.exp(rate * length))
    assert run.end_pose[2] == pytest.approx(both / body * (end - start), abs=1e-9)
    arm = run.end_pose[:2] - (centre + np.array([length, 0.0]))
    assert np.arctan2(arm[1], arm[0]) == pytest.approx(end, abs=1e-9)


def test_without_friction_on_an_edge_through_the_centre_a_quantity_is_kept():
    half = Polygon([[0.0, -0.1], [0.1, -0.1], [0.1, 0.1], [0.0, 0.1]])
    start = np.array([0.0, 0.02])
    run = simulate_push(
        ellipsoid(C),
        half,
        0.0,
        0.0,
        [0, 0, 0],
        [start, start + np.array([0.03, 0.0])],
        accuracy=1e-11,
    )
    c, s = np.cos(run.poses[:, 2]), np.sin(run.poses[:, 2])
    arm = run.tips - run.poses[:, :2]
    y = c * arm[:, 1] - s * arm[:, 0]
    kept = (C**2 + y**2) * c**2
    np.testing.assert_allclose(kept, kept[0], rtol=1e-10)
    assert run.poses[-1, 2] < -0.3


def test_masons_rule_for_the_sense_of_rotation():
    rng = np.random.default_rng(8)
    for _ in range(60):
        count = rng.integers(3, 9)
        limits = rng.uniform(0.1, 1.0, count)
        feet = 0.05 * rng.standard_normal((count, 2))
        feet -= limits @ feet / limits.sum()
        surface = PointContacts(feet, limits, Scaling(0.05, limits.sum()))
        points = 0.08 * rng.standard_normal((300, 2))
        angle, phi = rng.uniform(-np.pi, np.pi, 300), np.arctan(rng.uniform(0.0, 1.5, 300))
        heading = angle + rng.uniform(-1.5, 1.5, 300)
        rays = [
            np.stack([np.cos(a), np.sin(a)], axis=1)
            for a in (angle, angle - phi, angle + phi, heading)
        ]
        found = pushes(surface, points, rays[0], np.tan(phi), rays[3])
        moments = [points[:, 0] * ray[:, 1] - points[:, 1] * ray[:, 0] for ray in rays[1:]]
        votes = np.sign(moments).sum(axis=0)
        np.testing.assert_array_equal(np.sign(found.twists[:, 2]), np.sign(votes))


def test_turns_are_about_as_fast_as_peshkin_and_sanderson_bound_them():
    """Exact for sticking pushes of discs; five percent are left for slides."""
    rng = np.random.default_rng(2)
    radius = 0.06
    for _ in range(20):
        around = rng.uniform(0, 2 * np.pi, 6)
        feet = (
            radius
            * np.sqrt(rng.uniform(0, 1, 6))[:, np.newaxis]
            * np.stack([np.cos(around), np.sin(around)], axis=1)
        )
        limits = rng.uniform(0.2, 1.0, 6)
        centre = limits @ feet / limits.sum()
        # All feet lie in a disc of this radius about the centre of friction.
        reach = np.linalg.norm(feet - centre, axis=1).max()
        surface = PointContacts(feet - centre, limits, Scaling(0.05, limits.sum()))
        points = np.stack([np.full(100, -0.07), rng.uniform(-0.05, 0.05, 100)], axis=1)
        inward = np.tile([1.0, 0.0], (100, 1))
        found = pushes(surface, points, inward, 0.3, inward)
        force = found.wrenches[:, :2]
        offset = np.abs(found.wrenches[:, 2]) / np.linalg.norm(force, axis=1)
        centre_away = np.hypot(found.twists[:, 0], found.twists[:, 1]) / np.maximum(
            np.abs(found.twists[:, 2]), 1e-12
        )
        turning = np.abs(found.twists[:, 2]) > 1e-6
        assert (centre_away * offset)[turning].max() <= 1.05 * reach**2
