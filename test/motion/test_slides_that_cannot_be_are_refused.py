# SPDX-License-Identifier: Apache-2.0
"""A slide that has no answer is refused with the error that says why."""

import math

import numpy as np
import pytest

from limit_surface_ros.decay.exponential_sum import ExponentialSum
from limit_surface_ros.errors import (
    DataError,
    NoOnsetError,
    NotFiniteError,
    RangeError,
    ShapeError,
    SolverError,
    UnstableError,
)
from limit_surface_ros.motion.sliding.body import SlidingBody
from limit_surface_ros.motion.sliding.inertia import Inertia
from limit_surface_ros.motion.sliding.load import Load
from limit_surface_ros.motion.sliding.slide import slide, stop_bracket
from limit_surface_ros.surface.kinds.dissipation import Dissipation
from limit_surface_ros.surface.kinds.point_contacts import PointContacts
from limit_surface_ros.surface.scaling import Scaling

ROUND = Dissipation(np.eye(3)[np.newaxis], Scaling(0.05, 1.0))
INERTIA = Inertia(0.5, 1e-3)
FADING = ExponentialSum([-1.0], [1.0])
AT_REST = (0.0, 0.0, 0.0)


@pytest.mark.parametrize(
    ("mass", "moment", "centre", "error"),
    [
        (0.0, 1.0, (0.0, 0.0), RangeError),
        (-1.0, 1.0, (0.0, 0.0), RangeError),
        (math.inf, 1.0, (0.0, 0.0), RangeError),
        (1.0, 0.0, (0.0, 0.0), RangeError),
        (1.0, math.nan, (0.0, 0.0), RangeError),
        (1.0, 1.0, (0.0, math.nan), NotFiniteError),
        (1.0, 1.0, (0.0, 0.0, 0.0), ShapeError),
    ],
)
def test_an_inertia_that_no_body_has(mass, moment, centre, error):
    with pytest.raises(error):
        Inertia(mass, moment, centre)


@pytest.mark.parametrize(
    ("arguments", "options", "error"),
    [
        (((1.0, 0.0),), {}, ShapeError),
        (([[1.0, 0.0, 0.0]],), {}, ShapeError),
        (((math.nan, 0.0, 0.0),), {}, NotFiniteError),
        (((1.0, 0.0, 0.0), None, (0.0, math.inf, 0.0)), {}, NotFiniteError),
        (((1.0, 0.0, 0.0),), {"horizon": 0.0}, RangeError),
        (((1.0, 0.0, 0.0),), {"horizon": math.nan}, RangeError),
        (((1.0, 0.0, 0.0),), {"tolerance": 0.0}, RangeError),
    ],
)
def test_bad_numbers(arguments, options, error):
    with pytest.raises(error):
        slide(ROUND, INERTIA, *arguments, **options)


@pytest.mark.parametrize("load", [None, Load([3.0, 0.0, 0.0], FADING)])
def test_a_horizon_before_the_rest(load):
    twist = (1.0, 0.0, 0.0)
    time = slide(ROUND, INERTIA, twist, load).time
    assert slide(ROUND, INERTIA, twist, load, horizon=1.001 * time).time == time
    with pytest.raises(SolverError, match="horizon"):
        slide(ROUND, INERTIA, twist, load, horizon=0.999 * time)


def test_more_steps_than_are_allowed():
    with pytest.raises(SolverError, match="too many steps"):
        slide(ROUND, INERTIA, (1.0, 0.3, 5.0), most_steps=5)


@pytest.mark.parametrize(
    ("rates", "coefficients", "error", "message"),
    [
        ([0.3], [1.0], UnstableError, "0.3"),
        ([0.1 + 2.0j], [1.0], UnstableError, "decay"),
        ([-1.0, -2.0], [1.0, -1.0], NoOnsetError, "starts at"),
    ],
)
def test_a_load_that_does_not_die_away(rates, coefficients, error, message):
    with pytest.raises(error, match=message):
        Load([1.0, 0.0, 0.0], ExponentialSum(rates, coefficients))


@pytest.mark.parametrize("in_world", [False, True])
def test_a_load_that_stays_beyond_friction(in_world):
    staying = ExponentialSum([0.0, -1.0], [0.5, 0.5])
    with pytest.raises(UnstableError, match="never rests"):
        slide(ROUND, INERTIA, AT_REST, Load([2.1, 0.0, 0.0], staying, in_world=in_world))
    assert slide(ROUND, INERTIA, AT_REST, Load([1.9, 0.0, 0.0], staying)).time > 1.0


def test_a_motion_that_nothing_resists():
    single = PointContacts(np.array([[0.02, 0.0]]), [1.0], Scaling(0.05, 1.0))
    with pytest.raises(DataError, match="nothing resists"):
        SlidingBody(single, INERTIA)


def test_the_bracket_holds_what_errors_within_the_bound_can_do():
    body = SlidingBody(ROUND, INERTIA)
    x = ExponentialSum([-5.0], [2.0])
    load = Load([3.0, 0.0, 0.0], x)
    time = slide(ROUND, INERTIA, AT_REST, load).time
    error = 0.04
    earliest, latest = stop_bracket(body, AT_REST, load, error)
    assert earliest < time < latest
    rng = np.random.default_rng(0)
    for _ in range(10):
        # A cosine of the size of the error, as a pair of rates that hardly decays.
        wave = ExponentialSum(
            [-5.0, -1e-6 + 1j * rng.uniform(1.0, 30.0)],
            [2.0, 0.99 * error * np.exp(2j * np.pi * rng.random())],
        )
        share = wave.start / x.start
        waved = slide(ROUND, INERTIA, AT_REST, Load([3.0 * share, 0.0, 0.0], wave))
        assert earliest <= waved.time <= latest
    assert stop_bracket(body, AT_REST, load, 0.0) == (time, time)


def test_an_error_as_large_as_what_friction_holds_leaves_the_end_open():
    body = SlidingBody(ROUND, INERTIA)
    assert stop_bracket(body, AT_REST, Load([3.0, 0.0, 0.0], FADING), 0.34)[1] == math.inf
    with pytest.raises(RangeError, match="max_error"):
        stop_bracket(body, AT_REST, Load([3.0, 0.0, 0.0], FADING), -1.0)


def test_a_load_is_above_friction_along_itself_or_against():
    load = Load([1.0, 0.0, 0.0], ExponentialSum([-0.1 + 2.0j], [-3.0]))
    along, against = load.next_above(0.5, math.inf, 1.0), load.next_above(math.inf, 0.5, 0.0)
    assert load.fraction(along) == pytest.approx(0.5, abs=1e-12)
    assert load.fraction(against) == pytest.approx(-0.5, abs=1e-12)
    assert load.next_above(0.5, 0.5, 0.6) == against
    assert load.next_above(math.inf, math.inf, 0.0) is None


def test_an_inertia_that_is_none_is_named():
    with pytest.raises(TypeError, match=r"must be an Inertia\(mass, moment\), got NoneType"):
        slide(ROUND, None, (1.0, 0.0, 0.0))
