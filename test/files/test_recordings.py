# SPDX-License-Identifier: Apache-2.0
"""Noisy recordings give the twists and loads that truly were: arcs, clocks, bias, weights."""

from dataclasses import replace

import numpy as np
import pytest

from limit_surface_ros.errors import DataError
from limit_surface_ros.files.recordings.arcs import Span, fit_curves
from limit_surface_ros.files.recordings.motion import local_slopes, motion_of
from limit_surface_ros.files.recordings.pushes import (
    Corrections,
    Recording,
    Selection,
    find_pushes,
)
from limit_surface_ros.files.recordings.simulation import RecordingPlan, simulate_recording
from limit_surface_ros.surface.kinds.point_contacts import PointContacts
from limit_surface_ros.surface.scaling import Scaling

RHO = 0.05
TRIANGLE = PointContacts(
    np.array([[-0.04, -0.04], [-0.04, 0.08], [0.08, -0.04]]),
    np.full(3, 4.1 / 3),
    Scaling(RHO, 4.1),
)
FINE = {"pose_noise": 5e-5, "yaw_noise": 5e-4}


def angles(first, second, unit):
    """Return the angles between rows in scaled variables [deg]."""
    a, b = first / unit, second / unit
    cross = np.linalg.norm(np.cross(a, b), axis=1)
    return np.degrees(np.arctan2(cross, np.sum(a * b, axis=1)))


def together(pairs):
    """Return the mean angle between recovered loads and those that the recovered twists need."""
    needed = TRIANGLE.wrench_of_twist(pairs.twists)
    return angles(needed, pairs.wrenches, TRIANGLE.scaling.wrench_unit).mean()


def simulated_with(seed=0, pushes=16, **plan):
    return simulate_recording(TRIANGLE, RecordingPlan(pushes=pushes, **plan), seed)


def pushes_of(seed=0, corrections=None, **plan):
    simulated = simulated_with(seed, **plan)
    return simulated, find_pushes(simulated.recording, Selection(), corrections)


def on_an_arc(twist, times):
    """Return poses under a constant body twist, in closed form."""
    vx, vy, omega = twist
    yaw = 0.3 + omega * times
    x = (vx * (np.sin(yaw) - np.sin(0.3)) + vy * (np.cos(yaw) - np.cos(0.3))) / omega
    y = (-vx * (np.cos(yaw) - np.cos(0.3)) + vy * (np.sin(yaw) - np.sin(0.3))) / omega
    return np.column_stack([x, y, yaw])


@pytest.mark.parametrize("omega", [0.01, -0.5, 3.0])
def test_a_constant_twist_is_an_exact_arc(omega):
    twist, times = np.array([0.02, -0.03, omega]), np.linspace(0.0, 0.5, 51)
    motion = motion_of(times, on_an_arc(twist, times), True)
    (curve,) = fit_curves(motion, [Span(0.0, 0.5, 0.0, 0.5)], RHO)
    found, covariance = curve.mean(0.1, 0.4)
    np.testing.assert_allclose(found, twist, atol=1e-10)
    assert np.linalg.eigvalsh(covariance).min() > 0.0


def test_slopes_are_those_of_straight_lines_at_uneven_times():
    times = np.cumsum(np.random.default_rng(0).uniform(0.5, 1.5, 40)) + 1.7e9
    values = np.column_stack([3.0 * (times - times[0]) + 1.0, -(times - times[0])])
    np.testing.assert_allclose(local_slopes(times, values, 3.0), [[3.0, -1.0]] * 40, atol=1e-6)
    assert not local_slopes(times, values, 0.1).any()


@pytest.mark.parametrize(
    ("plan", "most"),
    [
        ({}, 0.8),
        (FINE, 1.5),
        ({"pose_noise": 2e-4, "yaw_noise": 2e-3}, 2.1),
        ({"pose_noise": 1e-3, "yaw_noise": 1e-2}, 3.0),
        ({"pose_noise": 1e-3, "yaw_noise": 1e-2, "rounded": True}, 2.5),
        ({"pose_noise": 2e-4, "yaw_noise": 2e-3, "jitter": 0.05}, 2.6),
        ({"pose_noise": 2e-4, "yaw_noise": 2e-3, "pose_rate": 31.0, "lost": 0.1}, 2.2),
    ],
)
def test_twists_and_loads_belong_together_whatever_the_noise_of_the_poses(plan, most):
    simulated, found = pushes_of(**plan)
    assert len(found.pairs) >= 45
    assert together(found.pairs) <= most
    twists, _ = simulated.means(found.windows)
    errors = angles(found.pairs.twists, twists, TRIANGLE.scaling.twist_unit)
    # What is said of the pairs' deviations is true of them, not far on either side.
    said = np.degrees(found.deviations)
    assert np.sqrt(np.mean(errors**2)) < 3.0 * np.sqrt(np.mean(said**2)) + 0.1


def test_weights_are_larger_where_pairs_are_better_known():
    _, found = pushes_of(pose_noise=1e-3, yaw_noise=1e-2)
    order = np.argsort(found.deviations)
    assert (np.diff(found.pairs.weights[order]) <= 1e-12).all()
    assert found.pairs.weights.mean() == pytest.approx(1.0)
    needed = TRIANGLE.wrench_of_twist(found.pairs.twists)
    errors = angles(needed, found.pairs.wrenches, TRIANGLE.scaling.wrench_unit)
    assert np.average(errors, weights=found.pairs.weights) < errors.mean()


@pytest.mark.parametrize("delay", [-0.3, 0.05, 0.1])
def test_a_delay_is_found_and_taken_away(delay):
    _, found = pushes_of(delay=delay, **FINE)
    assert found.clock_offset.applied
    assert found.clock_offset.delay == pytest.approx(delay, abs=0.01)
    assert found.clock_offset.low <= delay <= found.clock_offset.high
    assert together(found.pairs) < 1.5


@pytest.mark.parametrize("plan", [FINE, {"wander": 0.0, "delay": 0.05, **FINE}])
def test_a_delay_that_is_not_certain_is_left(plan):
    _, found = pushes_of(**plan)
    assert not found.clock_offset.applied
    assert found.clock_offset.low <= 0.0 <= found.clock_offset.high
    assert together(found.pairs) < 1.5


def test_a_delay_that_is_told_is_taken():
    simulated = simulated_with(delay=2.0, **FINE)
    found = find_pushes(simulated.recording, None, Corrections(clock_offset=2.0))
    assert together(found.pairs) < 1.5


BIAS = (0.4, -0.3, 0.01)


@pytest.mark.parametrize("plan", [{}, {"leaning": 1.0}, {"leaning": 1.0, "delay": 0.3}])
def test_a_bias_is_found_at_rests_also_where_the_pusher_leans(plan):
    _, found = pushes_of(bias=BIAS, **FINE, **plan)
    np.testing.assert_allclose(found.tare.mean[[0, 1]], BIAS[:2], atol=0.01)
    assert found.tare.mean[5] == pytest.approx(BIAS[2], abs=5e-4)
    assert found.tare.mean[2] == pytest.approx(9.0, abs=0.01)
    assert together(found.pairs) < 1.5


def test_a_bias_is_left_if_that_is_asked_for():
    _, left = pushes_of(0, Corrections(tare=False), bias=BIAS, **FINE)
    assert left.tare is None
    assert together(left.pairs) > 3.0


def test_a_bias_that_drifts_is_followed():
    _, found = pushes_of(bias=BIAS, drift=(0.3, 0.3, 0.0), **FINE)
    np.testing.assert_allclose(found.tare.drift[:2], 0.3, atol=0.06)
    assert together(found.pairs) < 1.5


def test_without_rests_no_bias_is_made_up():
    _, found = pushes_of(bias=BIAS, pushes=2, resting=0.5, leaning=2.0, **FINE)
    assert found.tare is None


@pytest.mark.parametrize("seed", [0, 1])
def test_loads_that_come_and_go_between_pushes_are_no_bias(seed):
    """Between these pushes the load is at zero for a twentieth of a second alone."""
    _, found = pushes_of(seed, pushes=8, resting=0.3, moving=6.0, **FINE)
    assert found.tare is None
    assert together(found.pairs) < 1.0


def test_measured_twists_are_averaged_over_windows():
    simulated = simulated_with(1)
    recording = simulated.recording
    rng = np.random.default_rng(0)
    twists = np.column_stack(
        [np.interp(recording.motion_times, simulated.times, c) for c in simulated.twists.T]
    ) + rng.normal(size=recording.motions.shape) * [2e-4, 2e-4, 4e-3]
    found = find_pushes(replace(recording, motions=twists, are_poses=False))
    assert len(found.pairs) >= 45
    assert together(found.pairs) < 1.5


def test_a_long_run_without_rests_is_read_in_pieces():
    times = np.arange(0.0, 20.0, 0.01)
    motions = on_an_arc([0.02, 0.01, 0.3], times)
    wrenches = np.tile([1.0, 0.5, 9.0, 0.0, 0.0, 0.02], (len(times), 1))
    found = find_pushes(Recording(times, wrenches, times, motions, True))
    assert len(found.pairs) == 40
    np.testing.assert_allclose(found.pairs.twists, [[0.02, 0.01, 0.3]] * 40, atol=1e-7)


def test_recordings_that_hold_no_push_say_why():
    times = np.arange(0.0, 3.0, 0.01)
    still = np.zeros((len(times), 3))
    wrenches = np.ones((len(times), 6))
    with pytest.raises(DataError, match="no part is a quasi-static push; of 300 wrenches 300 too"):
        find_pushes(Recording(times, wrenches, times, still, True))
    with pytest.raises(DataError, match="holds 1 motion samples"):
        find_pushes(Recording(times, wrenches, times[:1], still[:1], True))
    for bad in (np.nan, 9e307):
        with pytest.raises(DataError, match="hardly a finite number"):
            find_pushes(Recording(times, wrenches * bad, times, still, True))
