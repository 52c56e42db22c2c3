# SPDX-License-Identifier: Apache-2.0
"""Slides agree with other formulations of the same physics, and with themselves at 1e-12."""

import numpy as np
import pytest
from motion_helpers import body_on_points, dissipation_surface, random_inertia, random_twist
from scipy.integrate import LSODA, solve_ivp

from limit_surface_ros.decay.exponential_sum import ExponentialSum
from limit_surface_ros.motion.sliding.body import SlidingBody
from limit_surface_ros.motion.sliding.equations import FreeMotion, State
from limit_surface_ros.motion.sliding.friction import NormFriction
from limit_surface_ros.motion.sliding.inertia import Inertia
from limit_surface_ros.motion.sliding.load import Load
from limit_surface_ros.motion.sliding.slide import slide, slide_stages
from limit_surface_ros.motion.stages import finish
from limit_surface_ros.surface.kinds.dissipation import Dissipation
from limit_surface_ros.surface.kinds.point_contacts import PointContacts
from limit_surface_ros.surface.kinds.power_sum import PowerSum
from limit_surface_ros.surface.scaling import Scaling

AT_REST = (0.0, 0.0, 0.0)
SWINGING = ExponentialSum([-0.7, -0.5 + 6.0j], [0.4, 0.6])


def assert_as_exact(surface, inertia, twist):
    found = slide(surface, inertia, twist)
    exact = slide(surface, inertia, twist, tolerance=1e-12)
    assert found.time == pytest.approx(exact.time, rel=1e-6)
    np.testing.assert_allclose(found.pose[:2], exact.pose[:2], atol=1e-6)
    assert found.pose[2] == pytest.approx(exact.pose[2], abs=2e-6)
    assert found.energy_residual < 1e-7


def check_free_slides(count, seed):
    rng = np.random.default_rng(seed)
    for _ in range(count):
        assert_as_exact(dissipation_surface(rng), random_inertia(rng), random_twist(rng))


def test_free_slides_are_those_of_a_tolerance_of_1e_12():
    check_free_slides(25, 0)


@pytest.mark.nightly
def test_300_free_slides_are_those_of_a_tolerance_of_1e_12():
    check_free_slides(300, 1)


def test_energy_is_kept_to_1e_8_at_a_tolerance_of_1e_9():
    rng = np.random.default_rng(2)
    for _ in range(25):
        found = slide(
            dissipation_surface(rng), random_inertia(rng), random_twist(rng), tolerance=1e-9
        )
        assert found.energy_residual < 1e-8


def test_other_kinds_slide_by_their_own_maps():
    rng = np.random.default_rng(3)
    ellipsoid = np.diag([1.0, 1.3, 2.0])
    inertia = random_inertia(rng)
    scaling = Scaling(0.05, 1.5)
    # The dissipation of an ellipsoid f'A f = 1 is sqrt(v' inv(A) v).
    by_map = slide(PowerSum([ellipsoid], [1.0], scaling), inertia, (0.5, -0.2, 8.0))
    by_form = slide(Dissipation([np.linalg.inv(ellipsoid)], scaling), inertia, (0.5, -0.2, 8.0))
    assert by_map.time == pytest.approx(by_form.time, rel=1e-7)
    np.testing.assert_allclose(by_map.pose, by_form.pose, atol=1e-7)
    np.testing.assert_allclose(by_map.final_direction, by_form.final_direction, atol=1e-6)


def body_frame_stop(surface, inertia, twist, load):
    """Return stop time and pose by the body-frame equations with their gyroscopic terms."""
    matrix = inertia.matrix
    body = SlidingBody(surface, inertia)
    law = body.friction.law(body.root)

    def slope(_, y):
        q, heading, time = y[:3], y[3], y[6]
        fx, fy, torque, rate = law(*q)
        px, py, _ = matrix @ q
        gyroscopic = np.array([q[2] * py, -q[2] * px, q[1] * px - q[0] * py])
        push = np.zeros(3) if load is None else load.fraction(time) * load.in_body(heading)
        rise = np.linalg.solve(matrix, push - [fx, fy, torque] + gyroscopic)
        c, s = np.cos(heading), np.sin(heading)
        moves = [q[2], c * q[0] - s * q[1], s * q[0] + c * q[1], 1.0]
        return np.array([*rise, *moves]) / rate

    def speed(y):
        return body.energy_norm(y[:3])

    y = np.array([*twist, 0.0, 0.0, 0.0, 0.0])
    first = speed(y)
    near_rest = lambda _, y: np.log(speed(y) / first) + np.log(1e6)  # noqa: E731
    near_rest.terminal = True
    found = solve_ivp(
        slope, (0.0, 1e4), y, method="DOP853", rtol=1e-12, atol=1e-14, events=near_rest
    )
    y = found.y[:, -1]
    n = y[:3] / speed(y)
    push = 0.0 if load is None else load.fraction(y[6]) * load.in_body(y[3])
    left = speed(y) / float((surface.wrench_of_twist(n) - push) @ n)
    return y[6] + left, np.array([y[4], y[5], y[3]])


@pytest.mark.parametrize("frame", ["none", "body", "world"])
def test_frames_agree(frame):
    """Velocities in the world's axes against momenta in the body's with gyroscopic terms."""
    rng = np.random.default_rng(8)
    for _ in range(3):
        surface, inertia = dissipation_surface(rng), random_inertia(rng, 0.5, 2.0)
        wrench = 0.7 * rng.normal(size=3) * [1.0, 1.0, 0.05]
        load = None
        if frame != "none":
            load = Load(wrench, ExponentialSum([-3.0], [1.0]), in_world=frame == "world")
        twist = (0.8, 0.3, 18.0)
        found = slide(surface, inertia, twist, load, tolerance=1e-12)
        time, pose = body_frame_stop(surface, inertia, twist, load)
        assert found.time == pytest.approx(time, rel=1e-8)
        np.testing.assert_allclose(found.pose, pose, atol=1e-9)


def test_moreau_time_stepping_agrees_on_a_straight_push():
    step, mass, speed, place = 1e-4, 0.5, 0.0, 0.0
    times = (np.arange(20_000) + 0.5) * step
    for force in 3.0 * SWINGING(times):
        free = speed + step * force / mass
        speed = np.sign(free) * max(0.0, abs(free) - step / mass)
        place += step * speed
    surface = Dissipation(np.eye(3)[np.newaxis], Scaling(0.05, 1.0))
    found = slide(surface, Inertia(mass, 1e-3), AT_REST, Load([3.0, 0.0, 0.0], SWINGING))
    assert place == pytest.approx(found.pose[0], abs=1e-4)


def regularised_pose(surface, inertia, load, smoothing, end):
    """Return the pose under friction whose norms are rounded at a speed, in plain time."""
    body = SlidingBody(surface, inertia)
    cx, cy = inertia.centre

    def slope(_, y):
        vx, vy, turn, heading = y[:4]
        c, s = np.cos(heading), np.sin(heading)
        q = np.array([c * vx + s * vy + turn * cy, c * vy - s * vx - turn * cx, turn])
        images = body.friction.roots @ q
        sizes = np.sqrt((images**2).sum(axis=1) + smoothing**2)
        net = load.fraction(_) * load.in_body(heading)
        net = net - np.einsum("kij,ki->j", body.friction.roots, images / sizes[:, np.newaxis])
        return [
            (c * net[0] - s * net[1]) / inertia.mass,
            (s * net[0] + c * net[1]) / inertia.mass,
            (net[2] - cx * net[1] + cy * net[0]) / inertia.moment,
            turn,
            vx,
            vy,
        ]

    start = [0.0, 0.0, 0.0, 0.0, cx, cy]
    y = solve_ivp(slope, (0.0, end), start, method="LSODA", rtol=1e-10, atol=1e-12).y[:, -1]
    c, s = np.cos(y[3]), np.sin(y[3])
    return np.array([y[4] - c * cx + s * cy, y[5] - s * cx - c * cy, y[3]])


@pytest.mark.nightly
@pytest.mark.parametrize("in_world", [False, True])
def test_regularised_friction_comes_nearer_the_less_it_is_regularised(in_world):
    rng = np.random.default_rng(10)
    for _ in range(4):
        surface, inertia = dissipation_surface(rng), random_inertia(rng, 0.5, 2.0, 0.02)
        wrench = rng.normal(size=3) * [1.0, 1.0, 0.05]
        wrench *= 2.5 / surface.load_factor(wrench)
        load = Load(wrench, SWINGING, in_world=in_world)
        found = slide(surface, inertia, AT_REST, load)
        poses = found.path.at([1.2])[0][0]
        rough, fine = (
            np.abs(regularised_pose(surface, inertia, load, d, 1.2) - poses).max()
            for d in (1e-5, 1e-6)
        )
        assert fine < 0.35 * rough
        assert fine < 1e-3


def rounded_stop(surface, inertia, twist, rounding):
    """Return stop time and pose where the creases are rounded: a term of M in each norm."""
    body = SlidingBody(surface, inertia)
    shares = np.square(body.friction.roots @ np.linalg.inv(body.root)).sum(axis=(1, 2)) / 3.0
    # Roots are stacked: in the squared form, the rounding would vanish.
    roots = [
        np.linalg.qr(np.vstack([root, rounding * np.sqrt(share) * body.root]), mode="r")
        for root, share in zip(body.friction.roots, shares, strict=True)
    ]
    friction = NormFriction(np.array(roots))
    motion = FreeMotion(friction, inertia, None)
    first = body.energy_norm(twist)
    scale = np.array(motion.scale(first, first / body.largest))
    start = motion.begin(State(0.0, AT_REST, tuple(twist)))
    solver = LSODA(
        lambda _, y: motion.slope(y.tolist()), 0.0, start, 1e300, rtol=1e-11, atol=1e-10 * scale
    )
    for _ in range(50_000):
        solver.step()
        state = motion.read(solver.y.tolist())
        speed = body.energy_norm(state.twist)
        if speed < 1e-6 * first:
            break
    else:
        return None
    n = np.array(state.twist) / speed
    return np.array([state.time + speed / float(friction.wrenches(n[None])[0] @ n), *state.pose])


def check_bodies_on_points(count, seed):
    """Hold slides on support points against rounded corners, extrapolated; return those that do.

    Extrapolations from two pairs of roundings that differ are no reference.
    """
    rng = np.random.default_rng(seed)
    compared = turning = 0
    for _ in range(count):
        surface, inertia = body_on_points(rng)
        twist = random_twist(rng)
        found = slide(surface, inertia, twist)
        body = SlidingBody(surface, inertia)
        share = [
            body.friction.sizes(found.final_direction)[term]
            / (size * body.energy_norm(found.final_direction))
            for term, size in body.creases
        ]
        turning += min(share) < 1e-9
        assert found.energy_residual < 1e-7
        rough, middle, fine = (
            rounded_stop(surface, inertia, twist, e) for e in (1e-4, 1e-5, 1e-6)
        )
        if rough is None or middle is None or fine is None:
            continue
        first, second = middle + (middle - rough) / 9.0, fine + (fine - middle) / 9.0
        if abs(first[0] / second[0] - 1.0) > 1e-6:
            continue
        compared += 1
        assert found.time == pytest.approx(second[0], rel=1e-6)
        np.testing.assert_allclose(found.pose[:2], second[1:3], atol=1e-6)
    return compared, turning


def test_bodies_on_points_slide_as_with_rounded_corners():
    compared, turning = check_bodies_on_points(2, 0)
    assert compared
    assert turning


@pytest.mark.nightly
def test_120_bodies_on_points_slide_as_with_rounded_corners():
    compared, turning = check_bodies_on_points(120, 1)
    assert compared >= 90
    assert turning >= 60


def test_a_point_under_a_load_rests_and_lets_go():
    """A strong point holds while the load is weak: the resting force passes its limit later."""
    points = np.array([[0.05, 0.0], [-0.05, 0.03], [-0.05, -0.03]])
    surface = PointContacts(points, [0.9, 0.3, 0.3], Scaling(0.05, 1.5))
    inertia = Inertia(0.3, 0.3 * 0.05**2)
    x = ExponentialSum([-1.0, -0.8], [1.0, -0.6])
    for angle in np.linspace(0.0, 2.0 * np.pi, 7):
        wrench = [1.6 * np.cos(angle), 1.6 * np.sin(angle), 0.02]
        load = Load(wrench, x)
        found = slide(surface, inertia, AT_REST, load)
        exact = slide(surface, inertia, AT_REST, load, tolerance=1e-11)
        assert found.time == pytest.approx(exact.time, rel=1e-6, abs=1e-9)
        np.testing.assert_allclose(found.pose, exact.pose, atol=2e-6)
        assert found.energy_residual < 1e-7


def test_points_in_one_place_are_one_point():
    points = np.array([[0.05, 0.0], [0.05, 0.0], [-0.05, 0.03]])
    limits = np.array([0.5, 0.4, 0.3])
    inertia = Inertia(0.3, 0.3 * 0.05**2)
    apart = PointContacts(points, limits, Scaling(0.05, 1.2))
    merged = PointContacts(points[1:], [0.9, 0.3], Scaling(0.05, 1.2))
    twist = (0.2, 0.1, 6.0)
    one, other = slide(apart, inertia, twist), slide(merged, inertia, twist)
    assert one.time == pytest.approx(other.time, rel=1e-9)
    np.testing.assert_allclose(one.pose, other.pose, atol=1e-9)


def test_a_body_that_starts_turning_about_a_support_point_goes_on_so():
    """Its friction is then constant: w(t) falls in a straight line."""
    points = np.array([[0.06, 0.0], [-0.03, 0.02], [-0.03, -0.02]])
    surface = PointContacts(points, [2.0, 0.2, 0.2], Scaling(0.05, 2.4))
    inertia = Inertia(0.3, 0.3 * 0.04**2)
    found = slide(surface, inertia, (0.0, -0.06 * 5.0, 5.0))
    levers = np.hypot(*(points[1:] - points[0]).T)
    about_point = inertia.moment + inertia.mass * 0.06**2
    assert found.time == pytest.approx(5.0 * about_point / (0.2 * levers.sum()), rel=1e-8)
    assert found.pose[2] == pytest.approx(2.5 * found.time, rel=1e-8)
    c, s = np.cos(found.pose[2]), np.sin(found.pose[2])
    np.testing.assert_allclose(found.pose[:2] + 0.06 * np.array([c, s]), [0.06, 0.0], atol=1e-9)


def test_the_path_between_steps_is_that_of_fine_steps():
    rng = np.random.default_rng(12)
    for _ in range(5):
        body = SlidingBody(dissipation_surface(rng), random_inertia(rng))
        twist = random_twist(rng)
        rough, fine = (
            finish(slide_stages(body, twist)),
            finish(slide_stages(body, twist, tolerance=1e-13)),
        )
        times = np.linspace(0.0, rough.time, 101)
        for one, other, size in zip(
            rough.path.at(times), fine.path.at(times), (1e-4, 1e-2), strict=True
        ):
            np.testing.assert_allclose(one, other, atol=size * np.abs(other).max())
