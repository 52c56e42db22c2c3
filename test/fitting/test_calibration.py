# SPDX-License-Identifier: Apache-2.0
"""The scatter of a fit is calibrated: regions hold what they promise of pushes not seen."""

import numpy as np
import pytest

from limit_surface_ros.fitting.few_pushes.automatic import fit_automatically
from limit_surface_ros.fitting.few_pushes.calibration import (
    calibrate,
    inside_regions,
    squared_residuals,
)
from limit_surface_ros.surface.kinds.dissipation import Dissipation
from limit_surface_ros.surface.kinds.dissipation_scatter import (
    region_probability,
    region_quantile,
    scatter_of,
)
from limit_surface_ros.surface.kinds.point_contacts import PointContacts
from limit_surface_ros.surface.pairs import Pairs
from limit_surface_ros.surface.sampling import random_directions, random_loads
from limit_surface_ros.surface.scaling import Scaling

FEET = np.array([[-0.04, -0.04], [-0.04, 0.08], [0.08, -0.04]])


def scattered_pushes(count, seed, spread=0.2):
    """Pushes under which every foot's friction varies from push to push."""
    rng = np.random.default_rng(seed)
    loads, twists = [], []
    for limits in 1.5 * np.exp(spread * rng.normal(size=(count, 3))):
        body = PointContacts(FEET, limits, Scaling(0.08, 4.5))
        pair = random_loads(body, 1, rng)
        loads.append(pair.wrenches[0])
        noisy = pair.twists[0] / body.scaling.twist_unit + 0.05 * rng.normal(size=3)
        twists.append(noisy * body.scaling.twist_unit)
    return Pairs(np.array(loads), np.array(twists))


@pytest.mark.nightly
def test_regions_hold_the_pushes_that_were_not_seen():
    inside = []
    for seed in range(4):
        result = fit_automatically(scattered_pushes(25, seed))
        scatter = scatter_of(result.details["uncertainty"], result.surface)
        squares = squared_residuals(scatter, result.surface, scattered_pushes(200, 100 + seed))
        inside.append([np.mean(squares <= region_quantile(p)) for p in (0.5, 0.9)])
    half, most = np.mean(inside, axis=0)
    assert 0.35 < half < 0.75
    assert 0.8 < most < 0.98


def test_the_scale_follows_the_residuals_of_the_folds():
    matrices = np.eye(3)[None] * 4.0
    surface = Dissipation(matrices, Scaling(0.1, 1.0))

    def scale_of(angle):
        units = random_directions(200, 5)
        loads = surface.wrench_of_twist(units * surface.scaling.twist_unit)
        noisy = units + angle * np.random.default_rng(2).normal(size=units.shape)
        held_out = Pairs(loads, noisy * surface.scaling.twist_unit)
        return calibrate(surface, [surface] * 2, [held_out] * 2).scatter.log_scale

    # One sphere has no curvature that differs by direction: e^g a^2 I is all there is.
    narrow, wide = scale_of(0.02), scale_of(0.2)
    assert narrow < 0.0 < wide
    assert wide - narrow == pytest.approx(2.0 * np.log(10.0), abs=0.3)


def test_a_turned_body_has_turned_covariances():
    pushes = scattered_pushes(25, 3)
    angle = 0.7
    turn = np.array(
        [[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]]
    )
    turned = Pairs(pushes.wrenches @ turn.T, pushes.twists @ turn.T)
    results = [fit_automatically(each, scaling=Scaling(0.08, 4.0)) for each in (pushes, turned)]
    units = random_directions(20, 0)
    scales = [
        scatter_of(result.details["uncertainty"], result.surface).scale(each)
        for result, each in zip(results, (units, units @ turn.T), strict=True)
    ]
    expected = turn @ scales[0] @ turn.T
    # Starts of a fit are not turned: it is the same but for how far descents went.
    spread = np.sqrt(np.trace(expected, axis1=1, axis2=2))
    found = np.sqrt(np.trace(scales[1], axis1=1, axis2=2))
    assert np.median(np.abs(found / spread - 1.0)) < 0.1


def test_a_push_lies_inside_of_the_regions_above_its_level():
    regions = np.array([0.1, 0.5, 0.9, 0.99])
    levels = region_probability(np.array([region_quantile(each) for each in regions]))
    np.testing.assert_allclose(levels, regions)
    told = inside_regions(np.array([0.02, 0.48, 0.52, 0.97]))
    assert told["pushes"] == 4
    shares = dict(zip(told["regions"], told["inside"], strict=True))
    assert (shares[0.05], shares[0.5], shares[0.55], shares[0.95]) == (0.25, 0.5, 0.75, 0.75)
