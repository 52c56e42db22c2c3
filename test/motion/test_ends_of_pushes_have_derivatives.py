# SPDX-License-Identifier: Apache-2.0
"""Derivatives of end poses by start and path are what differences of whole pushes tend to."""

import numpy as np
import pytest

from limit_surface_ros.errors import ShapeError
from limit_surface_ros.motion.outline import Polygon
from limit_surface_ros.motion.rollout import simulate_pushes
from limit_surface_ros.motion.rollout_derivatives import simulate_push_derivatives
from limit_surface_ros.motion.round_outlines import Ellipse
from push_helpers import BUTTERFLY, RECTANGLE, TIP, ellipsoid, random_runs, surfaces, turned

pytestmark = pytest.mark.filterwarnings("error::RuntimeWarning")
BODIES = surfaces()
# Metres for a radian, so that all derivatives are numbers of like size.
ARM = 0.05


def with_derivatives(body, outline, radius, friction, poses, paths, accuracy=1e-7):
    """Return what is found, and errors (n,) of its derivatives against differences."""
    found = simulate_push_derivatives(
        body, outline, radius, friction, poses, paths, accuracy=accuracy
    )
    count, points = paths.shape[:2]
    starts, ways, step = [], [], 1e-4
    for column in range(3 + 2 * points):
        for k in (1.0, -1.0, 2.0, -2.0):
            pose, path = poses.copy(), paths.copy()
            if column < 3:
                pose[:, column] += k * step / (ARM if column == 2 else 1.0)
            else:
                path[:, (column - 3) // 2, (column - 3) % 2] += k * step
            starts.append(pose)
            ways.append(path)
    ends = simulate_pushes(
        body,
        outline,
        radius,
        friction,
        np.concatenate(starts),
        np.concatenate(ways),
        accuracy=1e-9,
    ).end_poses.reshape(-1, 4, count, 3) * [1.0, 1.0, ARM]
    right = (8.0 * (ends[:, 0] - ends[:, 1]) - (ends[:, 2] - ends[:, 3])) / (12.0 * step)
    mine = np.concatenate([found.by_pose, found.by_path.reshape(count, 3, -1)], axis=2)
    mine[:, 2] *= ARM
    mine[:, :, 2] /= ARM
    return found, np.abs(mine - np.moveaxis(right, 0, 2)).max(axis=(1, 2))


@pytest.mark.parametrize("name", BODIES)
def test_derivatives_are_what_differences_tend_to(name):
    rng = np.random.default_rng(1)
    poses, paths = random_runs(RECTANGLE, 12, rng, gap=0.003)
    # Bodies that lie anywhere, and tips that go around a bend.
    angles = rng.uniform(-3.0, 3.0, 12)
    middle = paths.mean(axis=1) + 0.004 * rng.normal(size=(12, 2))
    paths = np.stack([paths[:, 0], middle, paths[:, 1]], axis=1)
    paths = np.array([turned(path, a) for path, a in zip(paths, angles, strict=True)]) + 0.1
    poses = np.column_stack([np.full((12, 2), 0.1), angles])
    for friction in (0.3,) if name == "dissipation" else (0.0, 0.3, np.inf):
        found, errors = with_derivatives(BODIES[name], RECTANGLE, TIP, friction, poses, paths)
        # A tip that cannot slip lets go all at once.
        assert found.smooth.sum() >= (11 if friction == np.inf else 12)
        assert np.median(errors) < 2e-5
        assert errors[found.smooth].max() < 1e-3


def test_pushes_of_round_bodies_and_with_overlaps_have_them_too():
    rng = np.random.default_rng(4)
    around = rng.uniform(0.0, 2.0 * np.pi, 12)
    start = 0.08 * np.stack([np.cos(around), np.sin(around)], axis=1)
    end = -0.3 * start + 0.01 * rng.normal(size=(12, 2))
    paths = np.stack([start, end], axis=1)
    outline = Ellipse([0.05, 0.03], [0.002, 0.001], 0.3)
    found, errors = with_derivatives(BODIES["norms"], outline, TIP, 0.3, np.zeros((12, 3)), paths)
    assert found.smooth.all()
    assert np.median(errors) < 2e-5
    assert errors.max() < 1e-3
    poses, paths = random_runs(RECTANGLE, 12, rng, gap=-0.001)
    found, errors = with_derivatives(BODIES["norms"], RECTANGLE, TIP, 0.3, poses, paths)
    assert found.smooth.all()
    assert errors.max() < 1e-3


def test_what_has_no_derivative_is_told():
    # A point that slips off the end of a face, and a tip in an inward corner.
    paths = np.array([[[-0.05, 0.04], [-0.03, 0.08]], [[-0.05, 0.01], [-0.04, 0.01]]])
    found, errors = with_derivatives(
        ellipsoid(0.03), RECTANGLE, 0.0, 0.05, np.zeros((2, 3)), paths
    )
    assert found.smooth.tolist() == [False, True]
    assert errors[1] < 1e-4
    assert np.isfinite(found.by_path).all()
    into = np.array([[[0.001, -0.05], [0.0, 0.0]]])
    found = simulate_push_derivatives(BODIES["norms"], BUTTERFLY, TIP, 0.3, np.zeros((1, 3)), into)
    assert not found.smooth.any()
    assert np.isfinite(found.by_pose).all()


def test_a_tip_that_misses_moves_nothing_and_a_whole_scene_moves_as_one():
    square = Polygon([[-1, -1], [1, -1], [1, 1], [-1, 1]])
    body = ellipsoid(0.6)
    miss = simulate_push_derivatives(
        body, square, 0.1, 0.3, [[0.0, 0.0, 0.2]], [[[-2.0, 3.0], [2.0, 3.0]]]
    )
    np.testing.assert_array_equal(miss.by_pose[0], np.eye(3))
    assert not miss.by_path.any()
    path = np.array([[-1.5, 0.3], [-0.8, 0.35], [-0.5, 0.2]])
    found = simulate_push_derivatives(
        body, square, 0.1, 0.3, [[0.1, 0.0, 0.2]], [path], accuracy=1e-9
    )
    end = found.end_poses[0]
    moved = found.by_pose[0, :, :2] + found.by_path[0].sum(axis=1)
    np.testing.assert_allclose(moved, [[1.0, 0.0], [0.0, 1.0], [0.0, 0.0]], atol=1e-8)
    # All turned about the frame's origin.
    across = np.stack([-path[:, 1], path[:, 0]], axis=1)
    turn = found.by_pose[0] @ [0.0, 0.1, 1.0] + (found.by_path[0] * across).sum(axis=(1, 2))
    np.testing.assert_allclose(turn, [-end[1], end[0], 1.0], atol=1e-6)


def test_what_are_no_pushes_is_refused():
    with pytest.raises(ShapeError, match="paths"):
        simulate_push_derivatives(
            ellipsoid(0.03), RECTANGLE, TIP, 0.3, [[0.0, 0.0, 0.0]], np.zeros((2, 2, 2))
        )
