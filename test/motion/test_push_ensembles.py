# SPDX-License-Identifier: Apache-2.0
"""What is uncertain of a surface spreads the end of a push, and is told as it is."""

import numpy as np
import pytest

from limit_surface_ros.errors import DataError, NotFiniteError, RangeError, ShapeError
from limit_surface_ros.motion.outline import Polygon
from limit_surface_ros.motion.rollout import simulate_push
from limit_surface_ros.motion.spread import EndPoses, calibrate_ends, push_spread
from limit_surface_ros.surface.kinds.dissipation import Dissipation
from limit_surface_ros.surface.kinds.dissipation_scatter import (
    FRICTION,
    TwistScatter,
    UncertainSurface,
)
from limit_surface_ros.surface.scaling import Scaling

BOX = Polygon([[-0.05, -0.03], [0.05, -0.03], [0.05, 0.03], [-0.05, 0.03]])
FEET = np.array([[-0.8, -0.5], [0.8, -0.5], [0.8, 0.5], [-0.8, 0.5]])
PUSH = (BOX, 0.005, 0.25, [0, 0, 0], [[-0.07, 0.02], [0.0, 0.02]])


def uncertain(log_scale=0.0):
    """A box on four feet, and how its pushes scatter."""
    x, y = FEET.T
    one, none = np.ones(4), np.zeros(4)
    forms = np.array([[one, none, -y], [none, one, x], [-y, x, x * x + y * y + 0.05]])
    matrices = np.moveaxis(forms, -1, 0) / 16.0
    scatter = TwistScatter(matrices, (matrices,) * 5, log_scale)
    return UncertainSurface(Dissipation(matrices, Scaling(0.05, 4.0)), scatter)


def crosses(first, second):
    """Cross products of vectors in the plane."""
    return first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]


def test_members_are_pushed_as_alone_and_the_ellipse_holds_nine_of_ten():
    body = uncertain()
    members = body.members(40)
    ends = push_spread(members, *PUSH)
    for number in (0, 17):
        alone = simulate_push(members[number], *PUSH).end_pose
        np.testing.assert_allclose(ends.poses[number], alone, atol=1e-12)
    border = ends.ellipse(0.9).border()
    inside = [
        crosses(np.roll(border, -1, axis=0) - border, place - border).min() > 0.0
        for place in ends.poses[:, :2]
    ]
    assert np.mean(inside) == pytest.approx(0.9, abs=0.03)
    low, high = ends.pose_quantiles[0], ends.pose_quantiles[2]
    assert (low <= simulate_push(body.surface, *PUSH).end_pose).all()
    assert (simulate_push(body.surface, *PUSH).end_pose <= high).all()


def test_the_friction_of_each_term_scatters_by_itself_and_by_the_scale_of_the_fit():
    def spread_of(log_scale):
        body = uncertain(log_scale)
        logarithms = [
            0.5 * np.log(each.matrices[:, 0, 0] / body.scatter.matrices[:, 0, 0])
            for each in body.members(3000)
        ]
        middle = np.quantile(logarithms, [0.25, 0.75], axis=0)
        assert np.abs(np.corrcoef(np.sign(logarithms).T) - np.eye(4)).max() < 0.1
        return np.diff(middle, axis=0).mean()

    # The quartiles of a t distribution of 3.3 degrees of freedom are at 0.75 of its scale.
    assert spread_of(0.0) == pytest.approx(2.0 * 0.755 * FRICTION, rel=0.06)
    assert spread_of(-1.0) == pytest.approx(np.exp(-0.5) * spread_of(0.0), rel=0.08)


def test_no_spread_is_told_of_one_member_or_no_share():
    with pytest.raises(RangeError, match="at least two members"):
        push_spread(uncertain().members(1), *PUSH)
    with pytest.raises(RangeError, match="probability must be above 0"):
        EndPoses(np.zeros((3, 3))).ellipse(1.0)
    # Members that agree end at one place.
    assert not EndPoses(np.ones((3, 3))).ellipse(0.9).half_axes.any()


def thin_ensembles(count, rng):
    """Ensembles that differ along one direction each, and ends that err by more, in all."""
    ends, recorded = [], np.zeros((count, 3))
    for number in range(count):
        along = np.array([*rng.normal(size=2), 0.0])
        offsets = 1e-3 * rng.normal(size=(12, 1)) * along + 1e-5 * rng.normal(size=(12, 3))
        centre = np.array([*rng.normal(size=2), 0.0])
        ends.append(EndPoses(centre + offsets))
        scatter = 2e-3 * rng.standard_t(4, size=2)
        recorded[number, :2] = centre[:2] + scatter + 1e-3 * rng.normal() * along[:2]
    return ends, recorded


def holds(ellipse, place):
    c, s = np.cos(ellipse.angle), np.sin(ellipse.angle)
    along = np.array([[c, s], [-s, c]]) @ (place - ellipse.centre)
    return float(np.sum((along / ellipse.half_axes) ** 2)) <= 1.0


def test_recorded_ends_make_the_ellipse_hold_what_it_says():
    rng = np.random.default_rng(0)
    ends, recorded = thin_ensembles(900, rng)
    calibrated, bare = [], []
    for begin in range(0, 900, 30):
        known = calibrate_ends(ends[begin : begin + 19], recorded[begin : begin + 19])
        for number in range(begin + 19, begin + 30):
            place = recorded[number, :2]
            calibrated.append(holds(known.ellipse(ends[number], 0.9), place))
            bare.append(holds(ends[number].ellipse(0.9), place))
    assert np.mean(bare) < 0.3
    assert np.mean(calibrated) == pytest.approx(0.9, abs=0.05)


def test_what_members_that_agree_do_not_know_is_the_scatter_of_recorded_ends():
    ends = [EndPoses(np.ones((5, 3)))] * 400
    recorded = 1.0 + 1e-3 * np.random.default_rng(2).normal(size=(400, 3))
    recorded[:20] += 1.0
    known = calibrate_ends(ends, recorded)
    assert known.deviation == pytest.approx(1e-3, rel=0.1)
    # Of a round normal distribution nine of ten lie within this circle, of these 0.95 do.
    within = 1e-3 * np.sqrt(-2.0 * np.log(1.0 - 0.9 / 0.95))
    np.testing.assert_allclose(known.ellipse(ends[0], 0.9).half_axes, within, rtol=0.1)


def test_nine_recorded_ends_are_the_fewest_for_nine_of_ten():
    ends, recorded = thin_ensembles(9, np.random.default_rng(1))
    known = calibrate_ends(ends, recorded)
    places = recorded[:, :2]
    inside = [holds(known.ellipse(each, 0.9), p) for each, p in zip(ends, places, strict=True)]
    assert sum(inside) >= 8
    with pytest.raises(DataError, match="at least 19 recorded pushes, there are 9"):
        known.ellipse(ends[0], 0.95)
    with pytest.raises(RangeError, match="probability"):
        known.ellipse(ends[0], 1.0)
    with pytest.raises(ShapeError, match="9 ensembles need as many poses, there are 8"):
        calibrate_ends(ends, recorded[:8])
    with pytest.raises(NotFiniteError):
        calibrate_ends(ends, np.full((9, 3), np.nan))
    with pytest.raises(DataError, match="no recorded pushes"):
        calibrate_ends([], np.empty((0, 3)))
