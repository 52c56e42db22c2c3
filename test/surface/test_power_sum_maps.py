# SPDX-License-Identifier: Apache-2.0
"""Sums of powers: their scale, their normals and their loads of maximum dissipation."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from limit_surface_ros.errors import MatrixError, NotFiniteError, RangeError, ShapeError
from limit_surface_ros.surface import measures, sampling
from limit_surface_ros.surface.base import LimitSurface
from limit_surface_ros.surface.kinds.power_sum import PowerSum, thesis_exponents
from limit_surface_ros.surface.scaling import Scaling

seeds = st.integers(0, 2**32 - 1)
SCALING = Scaling(characteristic_length=0.1, friction_force=5.0)


def random_forms(rng, terms, rank=3, spread=0.0):
    roots = rng.standard_normal((terms, rank, 3))
    roots *= 10.0 ** rng.uniform(-spread, 0.0, (terms, rank, 1))
    return np.swapaxes(roots, 1, 2) @ roots


def random_surface(rng, lowest=0.1, terms=None, **forms):
    terms = terms or rng.integers(1, 5)
    exponents = rng.uniform(lowest, 1.0, terms)
    return PowerSum(random_forms(rng, terms, **forms), exponents, SCALING)


def test_power_sums_are_limit_surfaces():
    assert isinstance(PowerSum.thesis([np.eye(3)]), LimitSurface)


@pytest.mark.parametrize(
    ("terms", "exponents"),
    [(1, [1]), (2, [1, 1 / 2]), (3, [1, 2 / 3, 1 / 3]), (4, [1, 3 / 4, 2 / 4, 1 / 4])],
)
def test_presets_have_the_exponents_of_the_thesis(terms, exponents):
    np.testing.assert_allclose(thesis_exponents(terms), exponents)
    surface = PowerSum.thesis(random_forms(np.random.default_rng(0), terms))
    np.testing.assert_allclose(surface.exponents, exponents)


@given(seeds)
def test_loads_divided_by_their_factor_are_on_the_surface(seed):
    rng = np.random.default_rng(seed)
    surface = random_surface(rng, spread=3.0)
    loads = rng.standard_normal((30, 3)) * 10.0 ** rng.uniform(-9, 9, (30, 1))
    on_surface = loads / surface.load_factor(loads)[:, np.newaxis]
    np.testing.assert_allclose(surface.value(on_surface / SCALING.wrench_unit), 1.0, rtol=1e-12)


def test_the_value_of_a_load_keeps_its_digits_where_forms_are_small():
    rng = np.random.default_rng(5)
    for _ in range(20):
        surface = random_surface(rng, 0.05, terms=3, spread=4.0)
        loads = rng.standard_normal((2000, 3))
        on_surface = loads / surface.load_factor(loads)[:, np.newaxis] / SCALING.wrench_unit
        np.testing.assert_allclose(surface.value(on_surface), 1.0, rtol=1e-12)


@given(seeds)
def test_scale_and_normals_are_homogeneous_and_symmetric(seed):
    rng = np.random.default_rng(seed)
    surface = random_surface(rng)
    loads = rng.standard_normal((10, 3))
    factor, twist = surface.load_factor(loads), surface.twist_of_wrench(loads)
    for size in (1e-9, 1e9):
        np.testing.assert_allclose(surface.load_factor(size * loads), size * factor, rtol=1e-12)
        np.testing.assert_allclose(surface.twist_of_wrench(size * loads), twist, rtol=1e-8)
    np.testing.assert_array_equal(surface.load_factor(-loads), factor)
    np.testing.assert_array_equal(surface.twist_of_wrench(-loads), -twist)
    np.testing.assert_allclose(np.linalg.norm(twist / SCALING.twist_unit, axis=1), 1.0)


@given(seeds)
def test_gradient_agrees_with_finite_differences(seed):
    rng = np.random.default_rng(seed)
    surface = random_surface(rng)
    load = rng.standard_normal(3)
    step = 1e-5 * np.eye(3)
    differences = (surface.value(load + step) - surface.value(load - step)) / 2e-5
    np.testing.assert_allclose(surface.gradient(load), differences, rtol=1e-4, atol=1e-6)


@given(seeds)
def test_twists_are_normals_of_the_surface(seed):
    rng = np.random.default_rng(seed)
    surface = random_surface(rng)
    load = rng.standard_normal(3)
    load /= surface.load_factor(load)
    normal = surface.gradient(load / SCALING.wrench_unit)
    twist = surface.twist_of_wrench(load) / SCALING.twist_unit
    np.testing.assert_allclose(twist, normal / np.linalg.norm(normal), atol=1e-9)


@given(seeds)
def test_round_trips_of_smooth_convex_surfaces_are_exact(seed):
    rng = np.random.default_rng(seed)
    surface = random_surface(rng, lowest=0.55)
    pairs = sampling.random_motions(surface, 50, rng)
    np.testing.assert_allclose(surface.load_factor(pairs.wrenches), 1.0, rtol=1e-12)
    assert measures.angle_error(surface, pairs).max() < 1e-8


@given(seeds, st.integers(1, 3), st.booleans())
def test_no_load_on_the_surface_has_more_power_than_the_one_found(seed, rank, convex):
    rng = np.random.default_rng(seed)
    surface = random_surface(rng, 0.5 if convex else 0.15, terms=4, rank=rank, spread=1.0)
    pairs = sampling.random_motions(surface, 10, rng)
    power = (pairs.wrenches * pairs.twists).sum(axis=1)
    probes = sampling.random_directions(3000, rng) * SCALING.wrench_unit
    probes /= surface.load_factor(probes)[:, np.newaxis]
    assert ((pairs.twists @ probes.T).max(axis=1) <= power * (1.0 + 1e-9)).all()


def test_a_near_kink_beside_the_way_does_not_stop_the_climb():
    roots = np.array(
        [
            [[0.01987, -0.00706, -0.0047], [0.0, 0.01944, 0.02869]],
            [[0.28763, 0.17764, -0.5661], [0.0, 0.09627, -0.07476]],
            [[1.13444, 0.54292, -0.11681], [0.0, -0.19973, 0.13726]],
        ]
    )
    surface = PowerSum(np.swapaxes(roots, 1, 2) @ roots, [0.72783, 0.57382, 0.51007])
    twist = np.array([0.09845, 0.32652, 0.94005])
    back = surface.twist_of_wrench(surface.wrench_of_twist(twist))
    np.testing.assert_allclose(back, twist / np.linalg.norm(twist), atol=1e-7)


@pytest.mark.parametrize("exponent", [0.5, 0.25])
def test_a_load_that_one_term_does_not_see_is_a_corner_with_a_cone_of_twists(exponent):
    surface = PowerSum([np.eye(3), np.diag([1.0, 1.0, 0.0])], [1.0, exponent])
    corner = np.array([0.0, 0.0, 1.0])
    np.testing.assert_allclose(surface.twist_of_wrench(corner), corner, atol=1e-15)
    twists = np.array([[0.3, 0.1, 1.0], [-0.2, 0.3, 1.0], [0.0, 0.0, 1.0]])
    np.testing.assert_allclose(surface.wrench_of_twist(twists), [corner] * 3, atol=1e-12)
    np.testing.assert_allclose(surface.wrench_of_twist(-twists), [-corner] * 3, atol=1e-12)


def test_norms_with_corners_are_inverted_as_support_points_are():
    forms = random_forms(np.random.default_rng(5), 3, rank=2)
    surface = PowerSum.norms(forms)
    twists = sampling.random_directions(200, 6)
    loads = surface.wrench_of_twist(twists)
    probes = sampling.random_directions(20000, 7)
    probes /= surface.load_factor(probes)[:, np.newaxis]
    power = (loads * twists).sum(axis=1)
    assert ((twists @ probes.T).max(axis=1) <= power * (1.0 + 1e-12)).all()
    np.testing.assert_allclose(surface.load_factor(loads), 1.0, rtol=1e-12)


def test_a_load_that_nothing_limits_never_moves_the_body():
    surface = PowerSum([np.diag([1.0, 1.0, 0.0])], [1.0])
    assert surface.load_factor([0.0, 0.0, 7.0]) == 0.0
    with pytest.raises(RangeError, match="no limit"):
        surface.twist_of_wrench([[1.0, 0.0, 0.0], [0.0, 0.0, 7.0]])
    with pytest.raises(RangeError, match="no limit"):
        surface.twist_of_wrench([0.0, 0.0, 7.0])
    with pytest.raises(RangeError, match="infinite"):
        surface.wrench_of_twist([1.0, 0.0, 0.1])
    np.testing.assert_allclose(surface.wrench_of_twist([2.0, 0.0, 0.0]), [1.0, 0.0, 0.0])


def test_one_load_gives_what_it_gives_among_many():
    rng = np.random.default_rng(2)
    for surface in (random_surface(rng, terms=3), PowerSum.norms(random_forms(rng, 3))):
        loads = rng.standard_normal((2, 5, 3))
        assert surface.load_factor(loads).shape == (2, 5)
        many = surface.twist_of_wrench(loads)
        one = surface.twist_of_wrench(loads[1, 2])
        np.testing.assert_allclose(one, many[1, 2], rtol=1e-13)
        assert np.ndim(surface.load_factor(loads[1, 2])) == 0
        assert surface.twist_of_wrench(np.empty((0, 3))).shape == (0, 3)


@pytest.mark.parametrize(
    ("matrices", "exponents", "error", "message"),
    [
        (np.eye(3), [1.0], ShapeError, r"\(k, 3, 3\)"),
        (np.empty((0, 3, 3)), [], ShapeError, "k >= 1"),
        ([np.eye(3)], [1.0, 0.5], ShapeError, r"\(1,\)"),
        ([np.eye(3)], [0.0], RangeError, r"\(0, 1\]"),
        ([np.eye(3)], [1.1], RangeError, r"\(0, 1\]"),
        ([np.eye(3)] * 3, [1e-3] * 3, RangeError, "are too small: .* 4e[+]238 times smaller"),
        ([np.eye(3)] * 3, [1e-5] * 3, RangeError, "are too small"),
        ([np.diag([1.0, 1.0, -1.0])], [1.0], MatrixError, "lowest eigenvalue is -1"),
        ([[[1, 1, 0], [0, 1, 0], [0, 0, 1]]], [1.0], MatrixError, "symmetric"),
        ([np.zeros((3, 3))], [1.0], MatrixError, "is zero"),
        ([np.full((3, 3), np.nan)], [1.0], NotFiniteError, "finite"),
    ],
)
def test_what_is_no_power_sum_is_refused(matrices, exponents, error, message):
    with pytest.raises(error, match=message):
        PowerSum(matrices, exponents)
