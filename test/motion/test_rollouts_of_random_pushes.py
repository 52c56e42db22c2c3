# SPDX-License-Identifier: Apache-2.0
"""Pushes along paths: as accurate as they say, alike in any frame, alone or many, cut or whole."""

import numpy as np
import pytest

from limit_surface_ros.errors import (
    GeometryError,
    NotFiniteError,
    RangeError,
    ShapeError,
)
from limit_surface_ros.motion.outcomes import ContactMode
from limit_surface_ros.motion.outline import Polygon
from limit_surface_ros.motion.rollout import simulate_push, simulate_pushes
from limit_surface_ros.motion.round_outlines import Ellipse, SmoothCurve
from push_helpers import (
    BUTTERFLY,
    RECTANGLE,
    TIP,
    ellipsoid,
    metric,
    random_runs,
    surfaces,
    turned,
)

SURFACES = surfaces()


@pytest.mark.parametrize("kind", SURFACES)
def test_end_poses_are_as_accurate_as_they_were_asked_for(kind):
    poses, paths = random_runs(RECTANGLE, 200, np.random.default_rng(1))
    arguments = SURFACES[kind], RECTANGLE, TIP, 0.25, poses, paths
    exact = simulate_pushes(*arguments, accuracy=1e-8).end_poses
    for accuracy in (1e-3, 1e-4, 1e-6):
        found = simulate_pushes(*arguments, accuracy=accuracy)
        errors = metric(found.end_poses, exact, RECTANGLE)
        assert np.quantile(errors, 0.97) < accuracy
        assert errors.mean() < 0.2 * accuracy
    # The estimates of a fine run are of the size of its errors, and mostly above.
    assert (errors <= found.errors).mean() > 0.9
    assert found.errors.mean() < 50 * errors.mean()


@pytest.mark.parametrize("kind", SURFACES)
def test_a_run_alone_is_as_one_of_many_and_holds_its_way(kind):
    poses, paths = random_runs(RECTANGLE, 6, np.random.default_rng(2), gap=0.003)
    arguments = SURFACES[kind], RECTANGLE, TIP, 0.25
    many = simulate_pushes(*arguments, poses, paths, accuracy=1e-6)
    for row in range(6):
        run = simulate_push(*arguments, poses[row], paths[row], accuracy=1e-6)
        np.testing.assert_allclose(run.end_pose, many.end_poses[row], atol=1e-12)
        assert run.evaluations == many.evaluations[row]
        assert run.touched_at == pytest.approx(many.touched_at[row], abs=1e-12)
        assert len(run.poses) == len(run.modes) == len(run.wrenches) == len(run.contacts)
        assert run.path_lengths[0] == 0.0
        assert run.path_lengths[-1] == pytest.approx(0.044, abs=1e-12)
        np.testing.assert_allclose(run.poses_at(run.path_lengths), run.poses, atol=1e-12)
        pushing = np.array([mode is not ContactMode.SEPARATE for mode in run.modes])
        gap = np.hypot(*(run.tips - run.contacts)[pushing].T) - TIP
        assert np.abs(gap).max() < 1e-6
        powers = (run.twists * run.wrenches).sum(axis=1)
        assert (powers[pushing] > 0.0).all()
        assert not run.wrenches[~pushing].any()
        assert SURFACES[kind].load_factor(run.wrenches[pushing]) == pytest.approx(1.0, rel=1e-9)
        # Between the steps the way is smooth: a finer run lies on it.
        fine = simulate_push(*arguments, poses[row], paths[row], accuracy=1e-8)
        away = metric(run.poses_at(fine.path_lengths), fine.poses, RECTANGLE)
        assert away.max() < 1e-4


def test_the_whole_scene_may_be_moved():
    rng = np.random.default_rng(3)
    poses, paths = random_runs(RECTANGLE, 50, rng)
    arguments = SURFACES["norms"], RECTANGLE, TIP, 0.25
    here = simulate_pushes(*arguments, poses, paths, accuracy=1e-6).end_poses
    a, shift = 2.1, np.array([0.3, -0.2])
    turn = np.array([[np.cos(a), -np.sin(a)], [np.sin(a), np.cos(a)]])
    moved = np.column_stack([poses[:, :2] @ turn.T + shift, poses[:, 2] + a])
    there = simulate_pushes(*arguments, moved, paths @ turn.T + shift, accuracy=1e-6).end_poses
    np.testing.assert_allclose(there[:, :2], here[:, :2] @ turn.T + shift, atol=1e-10)
    np.testing.assert_allclose(there[:, 2], here[:, 2] + a, atol=1e-9)


def test_another_reference_point_is_the_same_body():
    rng = np.random.default_rng(4)
    poses, paths = random_runs(RECTANGLE, 30, rng)
    surface, shift = SURFACES["ellipsoid"], np.array([0.02, -0.01])
    here = simulate_pushes(surface, RECTANGLE, TIP, 0.25, poses, paths, accuracy=1e-7).end_poses
    # The body's frame sits elsewhere: the outline and the surface's point are shifted in it.
    outline = Polygon(RECTANGLE.vertices + shift)
    moved = poses.copy()
    moved[:, :2] -= shift
    there = simulate_pushes(
        surface, outline, TIP, 0.25, moved, paths, accuracy=1e-7, reference_point=shift
    ).end_poses
    c, s = np.cos(there[:, 2]), np.sin(there[:, 2])
    back = there[:, :2] + np.stack(
        [c * shift[0] - s * shift[1], s * shift[0] + c * shift[1]], axis=1
    )
    np.testing.assert_allclose(back, here[:, :2], atol=1e-6)
    np.testing.assert_allclose(there[:, 2], here[:, 2], atol=1e-5)


def test_a_path_cut_in_two_halves_leads_to_the_same_end():
    poses, paths = random_runs(RECTANGLE, 100, np.random.default_rng(5), gap=-0.001)
    arguments = SURFACES["norms"], RECTANGLE, TIP, 0.25
    middle = paths.mean(axis=1, keepdims=True)
    whole = simulate_pushes(*arguments, poses, paths, accuracy=2e-7).end_poses
    first = np.concatenate([paths[:, :1], middle], axis=1)
    second = np.concatenate([middle, paths[:, 1:]], axis=1)
    half = simulate_pushes(*arguments, poses, first, accuracy=2e-7).end_poses
    both = simulate_pushes(*arguments, half, second, accuracy=2e-7).end_poses
    bent = np.concatenate([paths[:, :1], middle, paths[:, 1:]], axis=1)
    at_once = simulate_pushes(*arguments, poses, bent, accuracy=2e-7).end_poses
    assert metric(both, whole, RECTANGLE).max() < 2e-6
    assert metric(at_once, whole, RECTANGLE).max() < 2e-6


def test_nothing_pulls_a_body_back():
    poses, paths = random_runs(RECTANGLE, 60, np.random.default_rng(6))
    arguments = SURFACES["norms"], RECTANGLE, TIP, 0.25
    there = simulate_pushes(*arguments, poses, paths).end_poses
    back = simulate_pushes(*arguments, poses, np.concatenate([paths, paths[:, :1]], axis=1))
    assert metric(back.end_poses, there, RECTANGLE).mean() < 1e-4
    assert np.median(metric(back.end_poses, there, RECTANGLE)) < 1e-12


def test_a_tip_that_passes_by_touches_nothing_and_one_that_comes_later_is_timed():
    surface = SURFACES["ellipsoid"]
    missed = simulate_push(surface, RECTANGLE, TIP, 0.3, [0, 0, 0], [[-0.1, 0.08], [0.1, 0.08]])
    assert missed.touched_at is None
    assert missed.left_at is None
    assert not missed.end_pose.any()
    assert set(missed.modes) == {ContactMode.SEPARATE}
    hit = simulate_push(surface, RECTANGLE, TIP, 0.3, [0, 0, 0], [[-0.1, 0.0], [0.0, 0.0]])
    assert hit.touched_at == pytest.approx(0.1 - 0.045 - TIP, abs=1e-12)
    still = simulate_push(surface, RECTANGLE, TIP, 0.3, [1, 2, 3], [[0.1, 0], [0.1, 0]])
    np.testing.assert_array_equal(still.end_pose, [1, 2, 3])


def test_a_path_around_a_corner_pushes_twice():
    surface = SURFACES["ellipsoid"]
    path = [[-0.1, 0.0], [-0.04, 0.0], [-0.1, 0.0], [-0.1, -0.2], [0.0, -0.2], [0.0, -0.03]]
    run = simulate_push(surface, RECTANGLE, TIP, 0.3, [0, 0, 0], path)
    pushing = [mode is not ContactMode.SEPARATE for mode in run.modes]
    assert np.abs(np.diff(pushing)).sum() >= 3
    assert run.end_pose[1] > 0.02


@pytest.mark.parametrize("angle", [0.0, 0.7])
@pytest.mark.parametrize("inward", [[1.0, 0.0], [0.0, -1.0]])
@pytest.mark.parametrize("overlap", ["keep", "push_out"])
def test_an_overlap_at_the_start_is_kept_or_pushed_out(overlap, inward, angle):
    depth, inward = 0.002, np.array(inward)
    face = 0.005 * inward[::-1] - RECTANGLE.drawn().max(axis=0) * inward
    start = face - (TIP - depth) * inward
    run = simulate_push(
        SURFACES["ellipsoid"],
        RECTANGLE,
        TIP,
        0.3,
        [0, 0, angle],
        turned([start, start + 0.02 * inward], angle),
        overlap=overlap,
    )
    (expected,) = turned([(0.0 if overlap == "keep" else depth) * inward], angle)
    assert run.poses[0, :2] == pytest.approx(expected, abs=1e-12)
    gap = np.hypot(*(run.tips - run.contacts).T) - TIP
    assert gap == pytest.approx(-depth if overlap == "keep" else 0.0, abs=1e-6)


@pytest.mark.parametrize("start", [[0.004, 0.003], [0.002, 0.004]])
def test_an_overlap_with_both_sides_of_an_inward_corner_is_pushed_out_of_both(start):
    sides = Polygon([[-0.05, -0.05], [0.05, -0.05], [0.05, 0], [0, 0], [0, 0.05], [-0.05, 0.05]])
    body, still = SURFACES["ellipsoid"], [start, np.add(start, 1e-6)]
    run = simulate_push(body, sides, TIP, 0.3, [0, 0, 0], still, overlap="push_out")
    np.testing.assert_allclose(run.poses[0], [start[0] - TIP, start[1] - TIP, 0.0], atol=1e-12)


@pytest.mark.parametrize("kind", SURFACES)
def test_a_tip_in_an_inward_corner_holds_the_body_and_never_enters_it(kind):
    rng = np.random.default_rng(7)
    surface = SURFACES[kind]
    for _ in range(4):
        start = np.array([rng.uniform(-0.02, 0.02), 0.03 + TIP])
        way = [start, start + np.array([rng.uniform(-0.01, 0.01), -0.05])]
        run = simulate_push(surface, BUTTERFLY, TIP, 0.3, [0, 0, 0], way, accuracy=1e-4)
        fine = simulate_push(surface, BUTTERFLY, TIP, 0.3, [0, 0, 0], way, accuracy=1e-5)
        assert metric(run.end_pose, fine.end_pose, BUTTERFLY) < 2e-4
        c, s = np.cos(run.poses[:, 2]), np.sin(run.poses[:, 2])
        x, y = (run.tips - run.poses[:, :2]).T
        seen = np.stack([c * x + s * y, c * y - s * x], axis=1)
        assert (BUTTERFLY.nearest(seen).distances - TIP).min() > -1e-4
        assert run.touched_at is not None


def test_a_tip_stuck_in_an_inward_corner_carries_the_body_along():
    # Both sides of the notch hold a tip that is pushed straight into it.
    path = [[0.0, 0.03], [0.0, -0.02]]
    run = simulate_push(ellipsoid(0.035), BUTTERFLY, TIP, 0.3, [0, 0, 0], path, accuracy=1e-6)
    reach = 0.01 + TIP * np.hypot(0.05, 0.03) / 0.05
    assert run.touched_at == pytest.approx(0.03 - reach, abs=1e-9)
    assert metric(run.end_pose, [0.0, -0.02 - reach, 0.0], BUTTERFLY) < 1e-6
    # In the corner it pushes straight, with both contacts.
    assert run.modes[-1] is ContactMode.STICK
    np.testing.assert_allclose(run.wrenches[-1], [0.0, -1.0, 0.0], atol=1e-4)


@pytest.mark.parametrize("friction", [0.0, 0.3])
def test_a_tip_that_does_not_fit_into_a_hollow_touches_both_of_its_sides(friction):
    around = np.linspace(0.0, 2.0 * np.pi, 60, endpoint=False)
    radius = 0.05 * (1.0 + 0.45 * np.cos(4.0 * around))
    hollow = SmoothCurve(np.stack([radius * np.cos(around), radius * np.sin(around)], axis=1))
    start = np.array([0.06, 0.06])
    way = [start, start - np.array([0.05, 0.045])]
    tip = 0.012
    arguments = SURFACES["norms"], hollow, tip, friction, [0, 0, 0], way
    run = simulate_push(*arguments, accuracy=1e-4)
    fine = simulate_push(*arguments, accuracy=1e-5)
    assert metric(run.end_pose, fine.end_pose, hollow) < 1e-4
    c, s = np.cos(run.poses[:, 2]), np.sin(run.poses[:, 2])
    x, y = (run.tips - run.poses[:, :2]).T
    seen = np.stack([c * x + s * y, c * y - s * x], axis=1)
    distances = hollow.nearest(seen).distances - tip
    assert distances.min() > -1e-4
    counts = hollow.touch_counts(seen, np.full(len(seen), tip), 1e-4)
    assert counts.max() == 2


def test_round_outlines_agree_with_polygons_of_many_edges():
    around = np.linspace(0, 2 * np.pi, 600, endpoint=False)
    dots = np.stack([0.0525 * np.cos(around), 0.0785 * np.sin(around)], axis=1)
    starts = 0.1 * np.stack([np.cos(around[::40]), np.sin(around[::40])], axis=1)
    paths = np.stack([starts, 0.2 * starts + [0.0, 0.01]], axis=1)
    poses = np.zeros((len(paths), 3))
    arguments = SURFACES["norms"], TIP, 0.25
    ends = [
        simulate_pushes(
            arguments[0], outline, *arguments[1:], poses, paths, accuracy=1e-5
        ).end_poses
        for outline in (Ellipse([0.0525, 0.0785]), SmoothCurve(dots[::10]), Polygon(dots))
    ]
    assert metric(ends[1], ends[0], RECTANGLE).max() < 2e-5
    assert np.median(metric(ends[2], ends[0], RECTANGLE)) < 1e-4


@pytest.mark.parametrize(
    ("changes", "error", "message"),
    [
        ({"tip_radius": -0.1}, RangeError, "tip_radius"),
        ({"tip_radius": float("nan")}, NotFiniteError, "tip_radius"),
        ({"friction": -0.1}, RangeError, "friction"),
        ({"pose": [0, 0]}, ShapeError, "pose"),
        ({"path": [[0, 0]]}, ShapeError, "path"),
        ({"path": [[0, 0, 0], [1, 0, 0]]}, ShapeError, "path"),
        ({"path": [[-1, 0], [float("inf"), 0]]}, NotFiniteError, "path"),
        ({"path": [[0, 0], [1, 0]]}, GeometryError, "within"),
        ({"accuracy": 0.0}, RangeError, "accuracy"),
        ({"accuracy": 1e-15}, RangeError, "accuracy"),
        ({"overlap": "ignore"}, RangeError, "overlap"),
        ({"reference_point": [0]}, ShapeError, "reference_point"),
    ],
)
def test_what_is_no_push_along_a_path_is_refused(changes, error, message):
    arguments = {
        "surface": SURFACES["ellipsoid"],
        "outline": RECTANGLE,
        "tip_radius": TIP,
        "friction": 0.3,
        "pose": [0, 0, 0],
        "path": [[-0.1, 0], [0.1, 0]],
    }
    with pytest.raises(error, match=message):
        simulate_push(**{**arguments, **changes})


def test_no_pushes_end_nowhere():
    none = simulate_pushes(
        SURFACES["norms"], RECTANGLE, TIP, 0.3, np.zeros((0, 3)), np.zeros((0, 2, 2))
    )
    assert none.end_poses.shape == (0, 3)
