# SPDX-License-Identifier: Apache-2.0
"""Pairs that are known better count more in a fit."""

import numpy as np
import pytest

from limit_surface_ros.errors import RangeError, ShapeError
from limit_surface_ros.fitting.pairs import scale_pairs
from limit_surface_ros.fitting.power_sum import fit_power_sum
from limit_surface_ros.surface.kinds.power_sum import PowerSum
from limit_surface_ros.surface.measures import angle_error
from limit_surface_ros.surface.pairs import Pairs
from limit_surface_ros.surface.sampling import random_motions
from limit_surface_ros.surface.scaling import Scaling


def test_weights_are_checked_taken_along_and_ones_by_default():
    ones = np.ones((3, 3))
    assert (Pairs(ones, ones).weights == 1.0).all()
    pairs = Pairs(ones, ones, np.array([1.0, 2.0, 3.0]))
    np.testing.assert_array_equal(pairs.take([2, 0]).weights, [3.0, 1.0])
    np.testing.assert_array_equal(pairs.take(pairs.weights > 1.5).weights, [2.0, 3.0])
    np.testing.assert_array_equal(scale_pairs(pairs, Scaling(1.0, 1.0)).weights, [1.0, 2.0, 3.0])
    with pytest.raises(ShapeError, match=r"weights must have shape \(3,\)"):
        Pairs(ones, ones, np.ones(2))
    with pytest.raises(RangeError, match="weights must be above 0"):
        Pairs(ones, ones, np.array([1.0, 0.0, 1.0]))


def test_a_fit_follows_the_pairs_that_weigh_more():
    truth = PowerSum.thesis(np.array([np.diag([1.0, 2.0, 1.5])]), Scaling(0.05, 4.0))
    exact = random_motions(truth, 60, 0)
    rng = np.random.default_rng(1)
    noisy = rng.random(60) < 0.5
    wrenches = exact.wrenches * (1.0 + 0.4 * noisy[:, None] * rng.normal(size=(60, 3)))
    weights = np.where(noisy, 1e-4, 1.0)
    errors = []
    for given in (Pairs(wrenches, exact.twists), Pairs(wrenches, exact.twists, weights)):
        fitted = fit_power_sum(given, [1.0], scaling=truth.scaling).surface
        errors.append(angle_error(fitted, random_motions(truth, 500, 2)).mean())
    assert errors[1] < 0.02 * errors[0]
