# SPDX-License-Identifier: Apache-2.0
"""Predicted twists say how far real ones scatter: closed forms, symmetries, one load and many."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from limit_surface_ros.errors import DataError, RangeError, ZeroVectorError
from limit_surface_ros.surface.kinds.dissipation import Dissipation
from limit_surface_ros.surface.kinds.dissipation_scatter import (
    FREEDOM,
    FRICTION,
    OWN,
    TwistScatter,
    UncertainSurface,
    log_map,
    region_quantile,
    scatter_of,
    tangent_basis,
)
from limit_surface_ros.surface.kinds.power_sum import PowerSum
from limit_surface_ros.surface.scaling import Scaling

SCALING = Scaling(0.1, 3.0)


def model(seed=0, terms=4, folds=5):
    """A smooth dissipation model, and models of folds that are near it."""
    rng = np.random.default_rng(seed)
    factors = rng.normal(size=(terms, 3, 3))
    matrices = factors @ factors.transpose(0, 2, 1)
    near = tuple(matrices * (1.0 + 0.1 * rng.normal(size=(terms, 1, 1))) for _ in range(folds))
    surface = Dissipation(matrices, SCALING)
    return UncertainSurface(surface, TwistScatter(matrices, near, 0.2))


def loads(count, seed=1):
    return np.random.default_rng(seed).normal(size=(count, 3)) * SCALING.wrench_unit


@pytest.mark.parametrize(
    ("probability", "quantile"), [(0.5, 1.722921), (0.9, 10.022156), (0.95, 16.977617)]
)
def test_regions_hold_their_share_of_the_t_distribution(probability, quantile):
    assert region_quantile(probability) == pytest.approx(quantile, rel=1e-6)
    rng = np.random.default_rng(0)
    normal, chi = rng.normal(size=(400_000, 2)), rng.chisquare(FREEDOM, 400_000)
    squares = np.sum(normal**2, axis=1) * FREEDOM / chi
    assert np.mean(squares <= quantile) == pytest.approx(probability, abs=2e-3)


def test_one_term_that_pulls_along_the_load_scatters_by_its_own_noise_alone():
    sphere = np.eye(3)[None]
    scale = TwistScatter(sphere, (sphere,) * 5).scale(np.array([[1.0, 0.0, 0.0]]))[0]
    np.testing.assert_allclose(scale, OWN**2 * np.diag([0.0, 1.0, 1.0]), atol=1e-15)


def test_scatter_of_friction_is_that_of_terms_that_vary_by_themselves():
    uncertain = model()
    matrices = uncertain.scatter.matrices
    units = uncertain.surface.twist_of_wrench(loads(5)) / SCALING.twist_unit
    plane = tangent_basis(units)
    equal = TwistScatter(matrices, (matrices,) * 5)
    found = equal.plane_scale(units, plane)
    # Differences: each term's friction larger by a little, the load as it is.
    products = np.einsum("kij,nj->kni", matrices, units)
    parts = products / np.sqrt(np.einsum("kni,ni->kn", products, units))[:, :, None]
    whole = parts.sum(axis=0)
    step, shifts = 1e-6, []
    for part in parts:
        twists = [
            uncertain.surface.twist_of_wrench((whole + sign * step * part) * SCALING.wrench_unit)
            for sign in (1, -1)
        ]
        shifts.append((twists[0] - twists[1]) / SCALING.twist_unit / (2.0 * step))
    flat = np.einsum("nij,knj->nki", plane, np.array(shifts))
    friction = flat.transpose(0, 2, 1) @ flat
    saturated = np.linalg.solve(np.eye(2) + friction / 2.1**2, friction)
    np.testing.assert_allclose(found, OWN**2 * np.eye(2) + FRICTION**2 * saturated, rtol=1e-4)


@given(seed=st.integers(0, 1000))
@settings(max_examples=25, deadline=None)
def test_covariances_do_not_depend_on_the_size_or_the_sense_of_a_load(seed):
    uncertain, some = model(seed % 5), loads(4, seed)
    answer = uncertain.twist_with_covariance(some)
    for factor in (-1.0, 7.0):
        other = uncertain.twist_with_covariance(factor * some)
        np.testing.assert_allclose(other.covariance, answer.covariance, rtol=1e-6, atol=1e-12)
    # Power has no scatter to first order: the size of the unit twist is fixed.
    dual = answer.twist / SCALING.twist_unit**2
    assert np.abs(np.einsum("nij,nj->ni", answer.covariance, dual)).max() < 1e-9
    values = np.linalg.eigvalsh(answer.covariance / np.outer(*[SCALING.twist_unit] * 2))
    axes = np.sqrt(values[:, :0:-1] * (FREEDOM - 2) / FREEDOM * region_quantile(0.9))
    np.testing.assert_allclose(answer.half_axes, axes, rtol=1e-6)


@pytest.mark.parametrize("probability", [0.5, 0.9])
def test_the_border_of_a_region_is_as_far_as_its_half_axes(probability):
    uncertain, load = model(2), loads(1)[0]
    answer = uncertain.twist_with_covariance(load[None], probability)
    twists = uncertain.border(load, probability, 360)
    units, centre = twists / SCALING.twist_unit, answer.twist[0] / SCALING.twist_unit
    np.testing.assert_allclose(np.linalg.norm(units, axis=1), 1.0)
    angles = np.arccos(units @ centre)
    farthest = np.array([angles.max(), angles.min()])
    np.testing.assert_allclose(farthest, answer.half_axes[0], rtol=1e-3)
    # A residual on the border is at the quantile.
    plane = tangent_basis(np.tile(centre, (360, 1)))
    residuals = log_map(np.tile(centre, (360, 1)), units, plane)
    inverse = np.linalg.inv(uncertain.scatter.plane_scale(centre[None], plane[:1])[0])
    squares = np.einsum("ni,ij,nj->n", residuals, inverse, residuals)
    np.testing.assert_allclose(squares, region_quantile(probability), rtol=1e-6)


def test_one_load_is_looked_up_close_to_what_many_are_worked_out_as():
    uncertain, some = model(3), loads(300)
    many = uncertain.twist_with_covariance(some, probability=0.5)
    ones = [uncertain.twist_with_covariance(load, probability=0.5) for load in some]
    spread = np.sqrt(np.trace(many.covariance, axis1=1, axis2=2))
    found = np.array([np.sqrt(np.trace(one.covariance)) for one in ones])
    errors = np.abs(found / spread - 1.0)
    assert np.median(errors) < 0.01
    assert np.quantile(errors, 0.95) < 0.05
    np.testing.assert_allclose([one.twist for one in ones], many.twist, rtol=1e-9)
    for one in ones[:20]:
        assert one.covariance.shape == (3, 3)
        assert np.abs(one.covariance @ (one.twist / SCALING.twist_unit**2)).max() < 1e-12
        assert np.linalg.eigvalsh(one.covariance).min() > -1e-12


def test_pushes_that_say_little_widen_the_scatter_and_agreeing_folds_do_not():
    uncertain = model()
    matrices = uncertain.scatter.matrices
    sure = UncertainSurface(uncertain.surface, TwistScatter(matrices, (matrices,) * 5, 0.2))
    some = loads(50)
    wide, narrow = (
        np.trace(each.twist_with_covariance(some).covariance, axis1=1, axis2=2)
        for each in (uncertain, sure)
    )
    assert (wide >= narrow).all()
    assert wide.mean() > 1.05 * narrow.mean()


def test_what_is_stored_is_read_back():
    uncertain, some = model(), loads(20)
    stored = uncertain.scatter.stored()
    again = UncertainSurface(uncertain.surface, scatter_of(stored, uncertain.surface))
    np.testing.assert_allclose(
        again.twist_with_covariance(some).covariance,
        uncertain.twist_with_covariance(some).covariance,
        rtol=1e-3,
    )


@pytest.mark.parametrize(
    "change",
    [
        {"version": 2},
        {"fold_matrices": [[1.0]]},
        {"fold_matrices": "none"},
        {"fold_matrices": []},
        {"log_scale": "wide"},
    ],
)
def test_what_is_no_stored_scatter_is_refused(change):
    uncertain = model()
    with pytest.raises(DataError):
        scatter_of(uncertain.scatter.stored() | change, uncertain.surface)
    with pytest.raises(DataError, match="dissipation models"):
        scatter_of(uncertain.scatter.stored(), PowerSum(np.eye(3)[None], [0.5]))


def test_what_cannot_be_asked_is_refused():
    uncertain = model()
    with pytest.raises(RangeError, match="probability must be above 0 and below 1"):
        uncertain.twist_with_covariance([1.0, 0.0, 0.0], probability=1.0)
    with pytest.raises(ZeroVectorError):
        uncertain.twist_with_covariance([0.0, 0.0, 0.0])
    with pytest.raises(DataError, match="at least two folds"):
        TwistScatter(np.eye(3)[None], (np.eye(3)[None],))


def test_the_log_map_keeps_angles_up_to_the_antipode():
    units = np.array([[0.0, 0.0, 1.0]] * 4)
    measured = np.array([[0, 0, 1], [1, 0, 0], [0, np.sin(3.0), np.cos(3.0)], [0, 0, -1.0]])
    vectors = log_map(units, measured, tangent_basis(units))
    np.testing.assert_allclose(
        np.linalg.norm(vectors, axis=1), [0.0, np.pi / 2, 3.0, np.pi], atol=1e-12
    )
