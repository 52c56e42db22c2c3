# SPDX-License-Identifier: Apache-2.0
"""Homogeneous polynomials of fourth order: maps, derivatives and what is refused."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from limit_surface_ros.errors import MatrixError, ShapeError
from limit_surface_ros.surface import measures, sampling
from limit_surface_ros.surface.kinds.polynomial import MONOMIALS, Polynomial
from limit_surface_ros.surface.kinds.power_sum import PowerSum
from limit_surface_ros.surface.scaling import Scaling

seeds = st.integers(0, 2**32 - 1)
SCALING = Scaling(0.1, 3.0)


def squared_form(matrix):
    """Coefficients of (f' A f)^2, by interpolation."""
    points = sampling.random_directions(60, 0)
    columns = np.prod(points[:, np.newaxis] ** MONOMIALS, axis=2)
    return np.linalg.lstsq(columns, np.einsum("ni,ij,nj->n", points, matrix, points) ** 2)[0]


def random_convex(rng):
    return Polynomial(sum(squared_form(r.T @ r) for r in rng.standard_normal((3, 3, 3))), SCALING)


def test_the_monomials_are_those_of_degree_four():
    assert MONOMIALS.shape == (15, 3)
    assert (MONOMIALS.sum(axis=1) == 4).all()
    assert len(np.unique(MONOMIALS, axis=0)) == 15


@given(seeds)
def test_value_and_gradient_are_those_of_the_monomials(seed):
    rng = np.random.default_rng(seed)
    polynomial = random_convex(rng)
    load = rng.standard_normal(3)
    assert polynomial.value(load) == pytest.approx(
        polynomial.coefficients @ np.prod(load**MONOMIALS, axis=1)
    )
    step = 1e-5 * np.eye(3)
    differences = (polynomial.value(load + step) - polynomial.value(load - step)) / 2e-5
    np.testing.assert_allclose(polynomial.gradient(load), differences, rtol=1e-5, atol=1e-4)


def test_the_square_of_a_form_is_its_ellipsoid():
    root = np.random.default_rng(4).standard_normal((3, 3))
    polynomial = Polynomial(squared_form(root.T @ root), SCALING)
    ellipsoid = PowerSum.thesis([root.T @ root], SCALING)
    loads, twists = sampling.random_directions(50, 1), sampling.random_directions(50, 2)
    np.testing.assert_allclose(polynomial.load_factor(loads), ellipsoid.load_factor(loads))
    np.testing.assert_allclose(polynomial.twist_of_wrench(loads), ellipsoid.twist_of_wrench(loads))
    np.testing.assert_allclose(
        polynomial.wrench_of_twist(twists), ellipsoid.wrench_of_twist(twists), rtol=1e-6, atol=1e-9
    )


@given(seeds)
def test_round_trips_of_convex_polynomials_are_exact(seed):
    rng = np.random.default_rng(seed)
    polynomial = random_convex(rng)
    pairs = sampling.random_motions(polynomial, 30, rng)
    np.testing.assert_allclose(polynomial.load_factor(pairs.wrenches), 1.0, rtol=1e-12)
    assert measures.angle_error(polynomial, pairs).max() < 1e-8


@given(seeds)
def test_the_load_found_has_the_most_power_where_the_surface_is_not_convex(seed):
    rng = np.random.default_rng(seed)
    dented = squared_form(np.diag([1.0, 2.0, 3.0]))
    dented[[3, 5, 12]] *= rng.uniform(-0.8, 4.0, 3)
    polynomial = Polynomial(dented)
    pairs = sampling.random_motions(polynomial, 20, rng)
    probes = sampling.random_directions(3000, rng)
    probes /= polynomial.load_factor(probes)[:, np.newaxis]
    power = (pairs.wrenches * pairs.twists).sum(axis=1)
    assert ((pairs.twists @ probes.T).max(axis=1) <= power * (1.0 + 1e-9)).all()


def test_what_is_no_closed_surface_is_refused():
    with pytest.raises(ShapeError, match=r"\(15,\)"):
        Polynomial(np.ones(14))
    with pytest.raises(MatrixError, match="must be positive"):
        Polynomial(-squared_form(np.eye(3)))
