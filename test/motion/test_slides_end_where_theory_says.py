# SPDX-License-Identifier: Apache-2.0
"""Slides with mass end when, where and how closed forms and published ratios say."""

import subprocess
import sys

import numpy as np
import pytest
from motion_helpers import GRAVITY, Disc, body_on_points, dissipation_surface, random_inertia

from limit_surface_ros.decay.exponential_sum import ExponentialSum
from limit_surface_ros.motion.sliding.body import SlidingBody
from limit_surface_ros.motion.sliding.inertia import Inertia
from limit_surface_ros.motion.sliding.load import Load
from limit_surface_ros.motion.sliding.rest import acceleration
from limit_surface_ros.motion.sliding.slide import slide
from limit_surface_ros.surface.kinds.dissipation import Dissipation
from limit_surface_ros.surface.kinds.point_contacts import PointContacts
from limit_surface_ros.surface.kinds.power_sum import PowerSum
from limit_surface_ros.surface.scaling import Scaling

RADIUS, MASS, MU = 0.05, 1.0, 0.3
# One norm: friction of 1 N and 0.05 N m whatever else moves.
ROUND = Dissipation(np.eye(3)[np.newaxis], Scaling(0.05, 1.0))
FADING = ExponentialSum([-1.0], [1.0])
AT_REST = (0.0, 0.0, 0.0)


@pytest.mark.parametrize(
    "surface",
    [
        Disc(RADIUS, MU * MASS * GRAVITY),
        Dissipation(np.eye(3)[np.newaxis], Scaling(RADIUS, MU * MASS * GRAVITY)),
        PowerSum.norms([np.eye(3)], Scaling(RADIUS, MU * MASS * GRAVITY)),
    ],
    ids=["disc", "dissipation", "norms"],
)
def test_a_straight_slide_takes_v_over_mu_g(surface):
    found = slide(surface, Inertia(MASS, 1e-3), (0.6, 0.8, 0.0))
    assert found.time == pytest.approx(1.0 / (MU * GRAVITY), rel=1e-9)
    distance = 1.0 / (2.0 * MU * GRAVITY)
    np.testing.assert_allclose(
        found.pose, [0.6 * distance, 0.8 * distance, 0.0], atol=1e-8 * distance
    )
    np.testing.assert_allclose(found.final_direction, [0.6, 0.8, 0.0], atol=1e-9)


def test_a_pure_spin_takes_its_momentum_over_the_largest_moment():
    moment = 1.3e-3
    found = slide(Disc(RADIUS, 2.0), Inertia(MASS, moment), (0.0, 0.0, -20.0))
    largest = 2.0 / 3.0 * 2.0 * RADIUS
    assert found.time == pytest.approx(20.0 * moment / largest, rel=1e-9)
    assert found.pose[2] == pytest.approx(-(20.0**2) * moment / (2.0 * largest), rel=1e-8)
    np.testing.assert_allclose(found.pose[:2], 0.0, atol=1e-12)


@pytest.mark.parametrize(
    ("hole", "start", "time", "distance", "angle"),
    [
        (0.0, (1.0, 4.0), 0.349335115, 0.171607833, 0.911332),
        (0.0, (0.3, 30.0), 0.402762738, 0.067247262, 5.962490),
        (0.0, (1.0, 60.0), 0.867616866, 0.467345441, 25.460695),
        (0.5, (1.0, 4.0), 0.351383620, 0.172036371, 0.913158),
        (0.5, (0.3, 30.0), 0.436737904, 0.081309630, 6.343287),
        (0.9, (0.3, 30.0), 0.511570796, 0.098301190, 7.439081),
    ],
)
def test_discs_and_annuli_slide_as_integrated_by_others(hole, start, time, distance, angle):
    inertia = Inertia(MASS, MASS * RADIUS**2 * (1.0 + hole**2) / 2.0)
    found = slide(Disc(RADIUS, MU * MASS * GRAVITY, hole), inertia, (start[0], 0.0, start[1]))
    assert found.time == pytest.approx(time, rel=1e-7)
    assert found.pose[0] == pytest.approx(distance, abs=1e-7 * distance + 5e-10)
    assert found.pose[1] == pytest.approx(0.0, abs=1e-12)
    assert found.pose[2] == pytest.approx(angle, abs=1e-6)
    assert found.energy_residual < 1e-8


def final_ratio(found):
    x, y, turn = found.final_direction
    return np.hypot(x, y) / (RADIUS * abs(turn))


@pytest.mark.parametrize(
    ("hole", "ratio"),
    [
        (0.0, 0.653001789),
        (0.1, 0.659487271),
        (0.25, 0.690094314),
        (0.5, 0.774468870),
        (0.75, 0.880471295),
        (0.9, 0.950828867),
        (0.99, 0.995008115),
    ],
)
def test_uniform_annuli_end_in_one_ratio_of_speed_to_spin(hole, ratio):
    """Weidman and Malhotra 2007, Regular and Chaotic Dynamics."""
    inertia = Inertia(MASS, MASS * RADIUS**2 * (1.0 + hole**2) / 2.0)
    for start in ((0.5, 0.0, 3.0), (0.0, -0.1, 30.0)):
        assert final_ratio(slide(Disc(RADIUS, 3.0, hole), inertia, start)) == pytest.approx(
            ratio, rel=1e-6
        )


@pytest.mark.parametrize(
    ("gyration", "ratio"),
    [
        (0.505, 3.268029),
        (0.52, 1.696144),
        (0.55, 1.156321),
        (0.6, 0.935465),
        (0.7071067811865476, 0.653001789),
        (0.75, 0.509073),
        (0.8, 0.254030),
        (0.815, 0.076579),
    ],
)
def test_the_ratio_at_the_end_hangs_on_the_radius_of_gyration(gyration, ratio):
    inertia = Inertia(MASS, MASS * (gyration * RADIUS) ** 2)
    found = slide(Disc(RADIUS, 3.0), inertia, (0.5, 0.0, 10.0))
    assert final_ratio(found) == pytest.approx(ratio, abs=1e-6)


def test_a_body_of_small_gyration_ends_sliding_and_one_of_large_spinning():
    sliding = slide(Disc(RADIUS, 3.0), Inertia(MASS, MASS * (0.4 * RADIUS) ** 2), (0.5, 0.0, 10.0))
    spinning = slide(Disc(RADIUS, 3.0), Inertia(MASS, MASS * (0.9 * RADIUS) ** 2), (0.5, 0.0, 9.0))
    assert final_ratio(sliding) > 1e6
    assert final_ratio(spinning) < 1e-6


def test_a_square_on_its_corners_ends_straight():
    """Its radius of gyration is below that of four points on a ring, k^2 < R^2 / 2."""
    half = 0.05
    corners = half * np.array([[1, 1], [1, -1], [-1, 1], [-1, -1]])
    surface = PointContacts(corners, np.full(4, 0.25), Scaling(0.05, 1.0))
    found = slide(surface, Inertia(1.0, 2.0 * half**2 / 3.0), (0.4, 0.1, 2.0))
    assert abs(found.final_direction[2]) * 0.05 < 1e-9


@pytest.mark.parametrize("mass", [0.05, 0.5, 5.0])
@pytest.mark.parametrize(
    ("factor", "time"),
    [(1.01, 0.019933775), (1.5, 0.874217466), (3, 2.821439372), (10, 9.999545794)],
)
def test_a_straight_push_that_fades_ends_where_its_impulse_is_used_up(factor, time, mass):
    """By momentum, s (1 - exp(-T)) = T, whatever the mass."""
    found = slide(ROUND, Inertia(mass, 1e-3), AT_REST, Load([factor, 0.0, 0.0], FADING))
    assert found.time == pytest.approx(time, rel=1e-7)
    stop = found.time
    assert factor * -np.expm1(-stop) == pytest.approx(stop, rel=1e-7)
    distance = (factor * (stop - 1.0 + np.exp(-stop)) - stop**2 / 2.0) / mass
    assert found.pose[0] == pytest.approx(distance, rel=1e-7)
    assert len(found.rests) == 0


def test_a_spin_that_two_exponentials_drive_ends_where_theory_says():
    x = ExponentialSum([-0.5, -4.0], [0.5, 0.5])
    found = slide(ROUND, Inertia(0.5, 1e-3), AT_REST, Load([0.0, 0.0, 3.0 * 0.05], x))
    assert found.time == pytest.approx(2.526992707, rel=1e-8)
    assert 3.0 * float(x.integral(found.time)) == pytest.approx(found.time, rel=1e-8)


def test_a_swinging_load_lets_a_body_rest_and_moves_it_again():
    x = ExponentialSum([-0.7, -0.5 + 6.0j], [0.4, 0.6])
    found = slide(ROUND, Inertia(0.5, 1e-3), AT_REST, Load([3.0, 0.0, 0.0], x))
    assert found.rests[0, 0] == pytest.approx(0.5536257996, rel=1e-8)
    assert found.time == pytest.approx(1.4631932, abs=1e-7)
    assert found.pose[0] == pytest.approx(0.3365352, abs=1e-7)
    assert found.final_direction[0] == pytest.approx(1.0)
    at_rest, twists = found.path.at(found.rests.mean(axis=1))
    np.testing.assert_allclose(twists, 0.0, atol=1e-9)
    np.testing.assert_allclose(at_rest[0], found.path.at(found.rests[0, :1])[0][0], atol=1e-9)


def test_the_first_acceleration_is_that_of_least_constraint():
    """M a + f(a) = w outside the surface, and a = 0 inside."""
    rng = np.random.default_rng(5)
    for _ in range(30):
        surface, inertia = dissipation_surface(rng), random_inertia(rng)
        wrench = rng.normal(size=3) * [1.0, 1.0, 0.05]
        wrench /= surface.load_factor(wrench)
        load = wrench * rng.uniform(1.01, 50.0)
        body = SlidingBody(surface, inertia)
        a = acceleration(body.friction, inertia.matrix, load, surface.twist_of_wrench(load))
        gap = (inertia.matrix @ a + surface.wrench_of_twist(a) - load) / [1.0, 1.0, 0.05]
        assert np.linalg.norm(gap) < 1e-12 * np.linalg.norm(load / [1.0, 1.0, 0.05])
        still = slide(surface, inertia, AT_REST, Load(0.999 * wrench, FADING))
        assert still.time == 0.0
        assert not still.pose.any()
        assert not still.final_direction.any()


def test_a_load_sets_bodies_on_points_off_where_some_turn_about_one_of_them():
    """What is left of the load lies within the surface, and in a motion as much as friction."""
    rng = np.random.default_rng(9)
    for _ in range(150):
        surface, inertia = body_on_points(rng)
        wrench = rng.normal(size=3) * [1.0, 1.0, 0.05]
        wrench *= rng.uniform(1.01, 2.5) / surface.load_factor(wrench)
        friction = SlidingBody(surface, inertia).friction
        a = acceleration(friction, inertia.matrix, wrench, surface.twist_of_wrench(wrench))
        left = wrench - inertia.matrix @ a
        assert surface.load_factor(left) < 1.0 + 1e-9
        assert left @ a == pytest.approx(friction.sizes(a).sum(), rel=1e-9)


def test_a_body_that_rests_without_load_stays():
    found = slide(ROUND, Inertia(1.0, 1.0), AT_REST, pose=(1.0, 2.0, 3.0))
    assert found.time == 0.0
    assert found.pose.tolist() == [1.0, 2.0, 3.0]
    poses, twists = found.path.at([0.0, 1.0])
    assert poses.tolist() == [[1.0, 2.0, 3.0]] * 2
    assert not twists.any()


def test_a_load_that_grows_past_friction_sets_a_body_off_later():
    x = ExponentialSum([-1.0, -4.0], [3.0, -2.0])
    found = slide(ROUND, Inertia(0.5, 1e-3), AT_REST, Load([0.9, 0.0, 0.0], x))
    ((begin, end),) = found.rests
    assert begin == 0.0
    assert float(x(end)) == pytest.approx(1.0 / 0.9, abs=1e-12)
    moved = found.time - end
    assert 0.9 * float(x.integral(found.time) - x.integral(end)) == pytest.approx(moved, abs=1e-8)


def test_a_free_slide_imports_no_scipy():
    code = (
        "import sys, numpy as np\n"
        "from limit_surface_ros.decay.exponential_sum import ExponentialSum\n"
        "from limit_surface_ros.motion.sliding.inertia import Inertia\n"
        "from limit_surface_ros.motion.sliding.load import Load\n"
        "from limit_surface_ros.motion.sliding.slide import slide\n"
        "from limit_surface_ros.surface.kinds.dissipation import Dissipation\n"
        "forms = [np.diag([1.0, 1.0, 0.4]), np.diag([0.5, 0.2, 1.0])]\n"
        "surface, inertia = Dissipation(forms), Inertia(1.0, 0.4, (0.1, 0.0))\n"
        "slide(surface, inertia, (1.0, 0.5, 2.0))\n"
        "load = Load([4.0, 1.0, 1.0], ExponentialSum([-1.0], [1.0]))\n"
        "slide(surface, inertia, (0.0, 0.0, 0.0), load)\n"
        "loaded = [name for name in sys.modules if name.startswith('scipy')]\n"
        "assert not loaded, loaded\n"
    )
    subprocess.run([sys.executable, "-c", code], check=True)
