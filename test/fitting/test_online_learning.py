# SPDX-License-Identifier: Apache-2.0
"""A surface that learns while the robot pushes: better with each push, and it can forget."""

import copy

import numpy as np
import pytest

from limit_surface_ros.errors import DataError, NotFiniteError, RangeError, ZeroVectorError
from limit_surface_ros.fitting.few_pushes.calibration import squared_residuals
from limit_surface_ros.fitting.few_pushes.online import OnlineSurface
from limit_surface_ros.fitting.few_pushes.segments import Segments
from limit_surface_ros.fitting.few_pushes.window import Window
from limit_surface_ros.surface.kinds.dissipation import Dissipation
from limit_surface_ros.surface.kinds.dissipation_scatter import (
    UncertainSurface,
    region_quantile,
)
from limit_surface_ros.surface.kinds.point_contacts import PointContacts
from limit_surface_ros.surface.kinds.polynomial import MONOMIALS, Polynomial
from limit_surface_ros.surface.kinds.power_sum import PowerSum
from limit_surface_ros.surface.measures import mean_angle
from limit_surface_ros.surface.pairs import Pairs
from limit_surface_ros.surface.sampling import random_loads
from limit_surface_ros.surface.scaling import Scaling

SCALING = Scaling(0.08, 5.0)
BODY = PointContacts([[-0.04, -0.04], [-0.04, 0.08], [0.08, -0.04]], [2.0, 1.0, 1.5], SCALING)
SPHERE = Dissipation(np.eye(3)[None], SCALING)
TEST = random_loads(BODY, 200, 9)


def pushes(count, seed=0, body=BODY, noise=0.08):
    pairs = random_loads(body, count, seed)
    rng = np.random.default_rng(seed + 50)
    twists = pairs.twists + noise * SCALING.twist_unit * rng.normal(size=(count, 3))
    return Pairs(pairs.wrenches, twists)


def learnt(online, pairs):
    return [online.add(w, t) for w, t in zip(pairs.wrenches, pairs.twists, strict=True)]


def angle(online, test=TEST):
    return np.degrees(mean_angle(online.surface(), test))


def test_predictions_improve_from_a_wrong_prior():
    online = OnlineSurface(SPHERE)
    assert online.surface() is SPHERE
    before = angle(online)
    updates = learnt(online, pushes(25))
    assert all(update.accepted for update in updates)
    assert angle(online) < 0.5 * before
    assert angle(online) < 8.0
    # Each push was predicted before it was learnt, and the later ones better than the prior did.
    late = updates[12:]
    assert np.mean([u.angle_before for u in late]) < np.mean([u.prior_angle for u in late])
    assert len(online.surface().matrices) <= 8 + 8 + 1


def test_a_right_prior_is_not_left():
    online = OnlineSurface(BODY)
    learnt(online, pushes(15))
    assert angle(online) < 4.0


@pytest.mark.parametrize(
    "prior",
    [
        PowerSum(np.eye(3)[None], [0.5], SCALING),
        PowerSum(np.stack([np.eye(3), np.diag([1.0, 2.0, 1.0])]) / 4.0, [0.5, 0.5], SCALING),
        Polynomial(np.where((MONOMIALS == 4).any(axis=1), 1.0, 0.0), SCALING),
        PointContacts(np.random.default_rng(0).normal(size=(200, 2)) * 0.05, np.ones(200) / 40),
    ],
)
def test_every_kind_can_be_a_prior(prior):
    online = OnlineSurface(prior)
    learnt(online, pushes(12))
    assert np.isfinite(online.surface().load_factor(TEST.wrenches)).all()
    assert angle(online) < 15.0


def test_the_window_moves_on_to_another_body():
    shifted = PointContacts(BODY.points + np.array([0.03, 0.0]), BODY.friction_limits, SCALING)
    test = random_loads(shifted, 200, 3)
    kept = OnlineSurface(SPHERE)
    blended = OnlineSurface(SPHERE, forgetting="blend")
    short = OnlineSurface(SPHERE, window=12)
    for online in (kept, blended, short):
        learnt(online, pushes(14, 1))
        learnt(online, pushes(12, 2, shifted))
    assert angle(blended, test) < angle(kept, test)
    assert angle(short, test) < angle(kept, test)


def test_outliers_are_borne_and_reversed_pushes_turned_away():
    clean, dirty = OnlineSurface(SPHERE), OnlineSurface(SPHERE)
    pairs = pushes(20, 4)
    learnt(clean, pairs)
    twists = np.array(pairs.twists)
    twists[::10] *= -1.0
    updates = learnt(dirty, Pairs(pairs.wrenches, twists))
    assert [update.accepted for update in updates].count(False) == 2
    assert dirty.refused == {"its power is not positive": 2}
    assert angle(dirty) < angle(clean) + 1.5


@pytest.mark.parametrize("forgetting", [1.0, "blend"])
def test_what_is_learnt_says_how_sure_it_is(forgetting):
    online = OnlineSurface(SPHERE, forgetting=forgetting)
    learnt(online, pushes(5))
    assert online.surface_and_scatter()[1] is None
    sizes, unseen = [], pushes(400, 7)
    for seed in (1, 2):
        learnt(online, pushes(12, seed))
        surface, scatter = online.surface_and_scatter()
        np.testing.assert_array_equal(surface.matrices, online.surface().matrices)
        axes = UncertainSurface(surface, scatter).twist_with_covariance(unseen.wrenches).half_axes
        sizes.append(np.median(axes))
    assert sizes[1] < sizes[0]
    inside = squared_residuals(scatter, surface, unseen) <= region_quantile(0.9)
    assert 0.8 < inside.mean() < 0.98


def test_folds_are_near_what_was_learnt_without_their_pushes():
    window, pairs = Window(SPHERE, 50, 1.0), pushes(28)
    loads, motions = pairs.wrenches / SCALING.wrench_unit, pairs.twists / SCALING.twist_unit
    motions = motions / np.linalg.norm(motions, axis=1, keepdims=True)
    for count, (load, motion) in enumerate(zip(loads, motions, strict=True), start=1):
        if count == 26:
            without = copy.deepcopy(window)
        window.learn(load, motion, count)
    (fold,) = window.folds(8, [np.arange(-3, 0)])
    whole, expected, found = (
        each.twist_of_wrench(TEST.wrenches) / SCALING.twist_unit
        for each in (window.surface(8), without.surface(8), fold)
    )
    expected, found = (expected - whole).ravel(), (found - whole).ravel()
    size = np.linalg.norm(found) / np.linalg.norm(expected)
    assert 0.5 < size < 1.5
    assert expected @ found > 0.7 * size * (expected @ expected)


def test_a_state_is_restored():
    online = OnlineSurface(SPHERE)
    learnt(online, pushes(12))
    again = OnlineSurface.restored(online.state(), SPHERE)
    assert again.count == 12
    np.testing.assert_allclose(
        again.surface().twist_of_wrench(TEST.wrenches),
        online.surface().twist_of_wrench(TEST.wrenches),
        atol=1e-5 * SCALING.twist_unit.max(),
    )
    np.testing.assert_allclose(online.pairs().wrenches, pushes(12).wrenches)
    with pytest.raises(DataError, match="nothing has been learnt"):
        OnlineSurface(SPHERE).pairs()
    for state in ({}, {"version": 2, "pushes": []}, {"version": 1, "pushes": [[1.0]]}):
        with pytest.raises(DataError):
            OnlineSurface.restored(state, SPHERE)


def test_what_cannot_be_learnt_is_refused():
    online = OnlineSurface(SPHERE)
    with pytest.raises(ZeroVectorError):
        online.add([0, 0, 0], [1, 0, 0])
    with pytest.raises(NotFiniteError):
        online.add([1, np.nan, 0], [1, 0, 0])
    assert online.count == 0
    for arguments in ({"window": 1}, {"forgetting": 0.0}, {"forgetting": 1.5}):
        with pytest.raises(RangeError):
            OnlineSurface(SPHERE, **arguments)


def feed(segments, wrenches, twists, start=0.0, step=0.01):
    closed = [
        segments.feed(start + step * k, w, t)
        for k, (w, t) in enumerate(zip(wrenches, twists, strict=True))
    ]
    return [pair for pair in closed if pair is not None]


def test_a_steady_push_is_one_segment_and_a_turning_one_several():
    steady = np.tile([3.0, 0.0, 0.0], (100, 1)), np.tile([0.02, 0.0, 0.0], (100, 1))
    segments = Segments(SCALING)
    assert feed(segments, *steady) == []
    wrench, twist = segments.close()
    np.testing.assert_allclose(wrench, [3.0, 0.0, 0.0])
    np.testing.assert_allclose(twist, [1.0, 0.0, 0.0])
    angles = np.radians(np.linspace(0.0, 40.0, 200))
    turning = 0.02 * np.stack([np.cos(angles), np.sin(angles), 0.0 * angles], axis=1)
    closed = feed(segments, 150.0 * turning, turning, 5.0)
    assert 3 <= len(closed) <= 5


@pytest.mark.parametrize(
    ("stop", "count"), [("gap", 2), ("rest", 2), ("contact", 2), ("backwards", 2), ("short", 0)]
)
def test_gaps_rests_and_lost_contact_end_a_segment(stop, count):
    segments = Segments(SCALING)
    samples = 3 if stop == "short" else 20
    wrenches = np.tile([3.0, 0.0, 0.0], (samples, 1))
    twists = np.tile([0.02, 0.0, 0.0], (samples, 1))
    closed = feed(segments, wrenches, twists)
    if stop == "rest":
        closed += feed(segments, wrenches[:1], 0.0 * twists[:1], 0.2)
    if stop == "contact":
        closed += feed(segments, 0.001 * wrenches[:1], twists[:1], 0.2)
    begin = {"gap": 5.0, "short": 5.0, "backwards": -3.0}.get(stop, 0.21)
    closed += feed(segments, wrenches, twists, begin)
    closed += [pair for pair in [segments.close()] if pair is not None]
    assert len(closed) == count


@pytest.mark.parametrize("stamps", ["equal", "ten of a time", "swapped", "one late"])
def test_segments_take_samples_whose_stamps_do_not_rise(stamps):
    times = 0.001 * np.arange(100)
    if stamps == "equal":
        times[:] = 7.0
    elif stamps == "ten of a time":
        times = np.repeat(times[::10], 10)
    elif stamps == "swapped":
        times = times.reshape(-1, 2)[:, ::-1].ravel()
    else:
        times[50] -= 0.04
    segments = Segments(SCALING)
    closed = [segments.feed(each, [3.0, 0.0, 0.0], [0.02, 0.0, 0.0]) for each in times]
    assert closed == [None] * 100
    wrench, twist = segments.close()
    np.testing.assert_allclose([*wrench, *twist], [3.0, 0.0, 0.0, 1.0, 0.0, 0.0])


def test_segments_refuse_what_is_no_number():
    with pytest.raises(RangeError, match="turn_deg must be a finite number above 0"):
        Segments(SCALING, turn_deg=0.0)
    with pytest.raises(NotFiniteError):
        Segments(SCALING).feed(0.0, [np.inf, 0, 0], [1, 0, 0])


def test_a_stream_of_samples_teaches_as_well_as_its_pushes():
    rng = np.random.default_rng(3)
    online, segments = OnlineSurface(SPHERE), Segments(SCALING)
    stamp = 0.0
    for wrench, twist in zip(pushes(12, 8).wrenches, pushes(12, 8).twists, strict=True):
        motion = 0.02 * twist / np.linalg.norm(twist / SCALING.twist_unit)
        for _ in range(15):
            stamp += 0.01
            noisy = motion + 0.0005 * SCALING.twist_unit * rng.normal(size=3)
            closed = segments.feed(stamp, wrench * (1.0 + 0.01 * rng.normal()), noisy)
            if closed is not None:
                online.add(*closed)
        closed = segments.feed(stamp + 0.01, np.zeros(3), np.zeros(3))
        if closed is not None:
            online.add(*closed)
        stamp += 1.0
    assert 12 <= online.count <= 24
    assert angle(online) < 10.0
