# SPDX-License-Identifier: Apache-2.0
"""A single vector takes a lean path, which must tell the same and refuse the same as the batch."""

import pickle

import numpy as np
import pytest

from limit_surface_ros.errors import NotFiniteError, ShapeError, ZeroVectorError
from limit_surface_ros.surface import sampling
from limit_surface_ros.surface.kinds.dissipation import Dissipation
from limit_surface_ros.surface.kinds.point_contacts import PointContacts
from limit_surface_ros.surface.kinds.polynomial import Polynomial
from limit_surface_ros.surface.kinds.power_sum import PowerSum
from limit_surface_ros.surface.scaling import Scaling

RNG = np.random.default_rng(11)
SCALING = Scaling(0.1, 5.0)
ROOTS = RNG.standard_normal((3, 3, 3))
MATRICES = np.swapaxes(ROOTS, 1, 2) @ ROOTS
SURFACES = [
    PowerSum.thesis(MATRICES[:1], SCALING),
    PowerSum.thesis(MATRICES, SCALING),
    PowerSum.norms(MATRICES, SCALING),
    Dissipation(MATRICES, SCALING),
    PointContacts(0.1 * RNG.standard_normal((4, 2)), [1, 2, 1, 1], SCALING),
    Polynomial([1, 0, 0, 1 / 3, 0, 1, 0, 0, 0, 0, 2, 0, 1, 0, 3], SCALING),
]
MAPS = ["load_factor", "twist_of_wrench", "wrench_of_twist"]


@pytest.mark.parametrize("surface", SURFACES, ids=lambda surface: surface.kind)
@pytest.mark.parametrize("name", MAPS)
@pytest.mark.parametrize("size", [1e-200, 1e-9, 1.0, 1e9, 1e200])
def test_one_vector_gives_what_it_gives_among_many(surface, name, size):
    function = getattr(surface, name)
    vectors = size * RNG.standard_normal((20, 3))
    many = function(vectors)
    for form in (np.array, list, tuple, lambda v: v[np.newaxis]):
        one = np.array([np.squeeze(function(form(vector))) for vector in vectors])
        np.testing.assert_allclose(one, many, rtol=1e-9, atol=1e-12 * np.abs(many).max())


@pytest.mark.parametrize("surface", SURFACES, ids=lambda surface: surface.kind)
@pytest.mark.parametrize("name", MAPS)
def test_whole_numbers_and_lists_are_vectors_too(surface, name):
    function = getattr(surface, name)
    np.testing.assert_allclose(function([1, 2, 3]), function(np.array([1.0, 2.0, 3.0])))
    np.testing.assert_allclose(function(np.float32([1, 2, 3])), function([1, 2, 3]), rtol=1e-12)


@pytest.mark.parametrize("surface", SURFACES, ids=lambda surface: surface.kind)
@pytest.mark.parametrize("name", MAPS)
def test_one_bad_vector_is_refused_as_many_are(surface, name):
    function = getattr(surface, name)
    for bad, error in [
        ([1.0, np.nan, 0.0], NotFiniteError),
        ([np.inf, 0.0, 0.0], NotFiniteError),
        ([1.0, 2.0], ShapeError),
        (["a", 1.0, 2.0], ShapeError),
        (3.0, ShapeError),
        ([[1.0, 2.0, 3.0], [1.0, 2.0]], ShapeError),
    ]:
        with pytest.raises(error):
            function(bad)
    if name != "load_factor":
        with pytest.raises(ZeroVectorError, match="no direction"):
            function([0.0, 0.0, 0.0])
    else:
        assert function([0.0, 0.0, 0.0]) == 0.0


@pytest.mark.parametrize("surface", SURFACES[3:5], ids=lambda surface: surface.kind)
def test_a_twist_at_a_kink_gives_the_middle_of_its_facet(surface):
    contacts = SURFACES[4]
    x, y = contacts.points[1]
    twist = np.array([y, -x, 1.0])
    np.testing.assert_allclose(
        contacts.wrench_of_twist(twist), contacts.wrench_of_twist([twist])[0], rtol=1e-12
    )


@pytest.mark.parametrize("seed", range(12))
def test_the_lean_path_finds_the_same_most_power_on_any_power_sum(seed):
    rng = np.random.default_rng(seed)
    terms = rng.integers(1, 5)
    roots = rng.standard_normal((terms, 3, 3)) * 10.0 ** rng.uniform(-1, 0, (terms, 3, 1))
    surface = PowerSum(np.swapaxes(roots, 1, 2) @ roots, rng.uniform(0.15, 1, terms), SCALING)
    twists = rng.standard_normal((30, 3)) * SCALING.twist_unit
    loads = np.array([surface.wrench_of_twist(twist) for twist in twists])
    np.testing.assert_allclose(surface.load_factor(loads), 1.0, rtol=1e-12)
    many = surface.wrench_of_twist(twists)
    np.testing.assert_allclose(
        (loads * twists).sum(axis=1), (many * twists).sum(axis=1), rtol=1e-12
    )


@pytest.mark.parametrize("seed", range(8))
def test_the_lean_path_finds_the_same_motion_for_any_sum_of_norms(seed):
    rng = np.random.default_rng(seed)
    roots = rng.standard_normal((1 + seed % 5, 1 + seed % 3, 3))
    points = 0.1 * rng.standard_normal((2 + seed % 4, 2))
    contacts = PointContacts(points, rng.uniform(0.1, 1.0, len(points)), SCALING)
    facets = sampling.facet_loads(contacts, 3, rng).wrenches
    sum_of_norms = Dissipation(np.swapaxes(roots, 1, 2) @ roots, SCALING)
    for surface, some in (
        (contacts, facets),
        (contacts.dissipation(), facets),
        (sum_of_norms, []),
    ):
        any_loads = rng.standard_normal((20, 3)) * SCALING.wrench_unit
        loads = [*any_loads, *sampling.random_motions(surface, 12, rng).wrenches, *some]
        factors = np.array([surface.load_factor(load) for load in loads])
        np.testing.assert_allclose(factors, surface.load_factor(loads), rtol=1e-11)
        limited = np.isfinite(factors)
        loads, factors = np.array(loads)[limited], factors[limited]
        twists = np.array([surface.twist_of_wrench(load) for load in loads])
        power = (loads * twists).sum(axis=1) / factors
        most = (surface.wrench_of_twist(twists) * twists).sum(axis=1)
        np.testing.assert_allclose(power, most, rtol=1e-11)


@pytest.mark.parametrize("surface", SURFACES, ids=lambda surface: surface.kind)
@pytest.mark.parametrize("shape", [(3,), (1, 3), (4, 5, 3)])
def test_motion_and_load_factor_together_are_what_they_are_alone(surface, shape):
    wrenches = 1e3 * RNG.standard_normal(shape)
    twists, factors = surface.twist_and_load_factor(wrenches)
    assert twists.shape == shape
    assert factors.shape == shape[:-1]
    np.testing.assert_allclose(twists, surface.twist_of_wrench(wrenches), atol=1e-12)
    np.testing.assert_allclose(factors, surface.load_factor(wrenches), rtol=1e-12)


@pytest.mark.parametrize("surface", SURFACES, ids=lambda surface: surface.kind)
def test_a_surface_is_sent_to_another_process_without_what_it_has_worked_out(surface):
    before = len(pickle.dumps(surface))
    vectors = RNG.standard_normal((30_000, 3))
    wrenches = surface.wrench_of_twist(vectors)
    surface.twist_of_wrench(vectors)
    sent = pickle.dumps(surface)
    assert len(sent) == before
    np.testing.assert_allclose(
        pickle.loads(sent).load_factor(wrenches), surface.load_factor(wrenches), rtol=1e-12
    )


@pytest.mark.parametrize("exponents", [[0.5], [1.0], [0.5, 0.5], [1.0, 0.5]])
@pytest.mark.parametrize("seed", range(3))
def test_a_load_that_nothing_limits_has_the_factor_zero_alone_too(exponents, seed):
    free = np.random.default_rng(seed).standard_normal(3)
    free /= np.linalg.norm(free)
    limited = np.eye(3) - np.outer(free, free)
    surface = PowerSum(np.array([limited] * len(exponents)), exponents)
    assert surface.load_factor([free, 2.0 * free]).tolist() == [0.0, 0.0]
    assert surface.load_factor(free) == 0.0
