# SPDX-License-Identifier: Apache-2.0
"""A batch of slides is what its rows are alone."""

import numpy as np
import pytest
from motion_helpers import body_on_points, dissipation_surface, random_inertia, random_twist

from limit_surface_ros.decay.exponential_sum import ExponentialSum
from limit_surface_ros.errors import NotFiniteError, ShapeError
from limit_surface_ros.motion.sliding.batch import slides
from limit_surface_ros.motion.sliding.inertia import Inertia
from limit_surface_ros.motion.sliding.load import Load
from limit_surface_ros.motion.sliding.slide import slide
from limit_surface_ros.surface.kinds.dissipation import Dissipation
from limit_surface_ros.surface.kinds.power_sum import PowerSum
from limit_surface_ros.surface.scaling import Scaling

ROUND = Dissipation(np.eye(3)[np.newaxis], Scaling(0.05, 1.0))


def assert_rows(found, surfaces, inertias, twists, poses, rows):
    for row in rows:
        one = slide(surfaces[row], inertias[row], twists[row], pose=poses[row])
        assert found.times[row] == pytest.approx(one.time, rel=1e-6)
        np.testing.assert_allclose(found.poses[row], one.pose, atol=1e-6)


def test_rows_of_one_body_are_as_alone():
    rng = np.random.default_rng(0)
    surface, inertia = dissipation_surface(rng), random_inertia(rng, 0.5, 2.0)
    twists = np.array([random_twist(rng) for _ in range(60)])
    twists[7] = 0.0
    poses = rng.normal(size=(60, 3))
    found = slides(surface, inertia, twists, poses=poses)
    assert found.times[7] == 0.0
    assert not found.last_directions[7].any()
    assert found.alone.sum() < 20
    assert_rows(found, [surface] * 60, [inertia] * 60, twists, poses, range(0, 60, 7))
    lengths = np.linalg.norm(found.last_directions / surface.scaling.twist_unit, axis=1)
    np.testing.assert_allclose(np.delete(lengths, 7), 1.0)


def test_each_row_may_have_its_own_surface_and_inertia():
    rng = np.random.default_rng(1)
    count = 30
    terms = rng.integers(2, 5, count)
    surfaces = [dissipation_surface(rng, int(each)) for each in terms]
    inertias = [random_inertia(rng) for _ in range(count)]
    twists = np.array([random_twist(rng) for _ in range(count)])
    found = slides(surfaces, inertias, twists)
    poses = np.zeros((count, 3))
    assert_rows(found, surfaces, inertias, twists, poses, range(0, count, 5))


def test_other_kinds_and_bodies_on_points_are_as_alone():
    rng = np.random.default_rng(2)
    ellipsoid = PowerSum([np.diag([1.0, 1.3, 2.0])], [1.0], Scaling(0.05, 1.5))
    points, inertia = body_on_points(rng)
    twists = np.array([random_twist(rng) for _ in range(8)])
    surfaces = [ellipsoid, points] * 4
    found = slides(surfaces, inertia, twists)
    assert_rows(found, surfaces, [inertia] * 8, twists, np.zeros((8, 3)), range(8))


def test_under_a_load_rows_are_as_alone():
    load = Load([3.0, 0.5, 0.02], ExponentialSum([-1.0], [1.0]))
    inertia = Inertia(0.5, 1e-3)
    found = slides(ROUND, inertia, [[0.0, 0.0, 0.0], [0.3, 0.0, 2.0]], load)
    assert found.alone.all()
    assert found.times[1] == slide(ROUND, inertia, (0.3, 0.0, 2.0), load).time


def test_no_rows_are_an_empty_batch():
    found = slides(ROUND, Inertia(1.0, 1.0), np.zeros((0, 3)))
    assert found.times.shape == (0,)
    assert found.poses.shape == (0, 3)


@pytest.mark.parametrize(
    ("surface", "twists", "poses", "error"),
    [
        (ROUND, [1.0, 0.0, 0.0], (0.0, 0.0, 0.0), ShapeError),
        (ROUND, [[1.0, 0.0]], (0.0, 0.0, 0.0), ShapeError),
        (ROUND, [[1.0, 0.0, np.nan]], (0.0, 0.0, 0.0), NotFiniteError),
        (ROUND, [[1.0, 0.0, 0.0]] * 2, np.zeros((3, 3)), ShapeError),
        ([ROUND] * 3, [[1.0, 0.0, 0.0]] * 2, (0.0, 0.0, 0.0), ShapeError),
    ],
)
def test_lengths_that_do_not_fit_are_refused(surface, twists, poses, error):
    with pytest.raises(error):
        slides(surface, Inertia(1.0, 1.0), twists, poses=poses)
