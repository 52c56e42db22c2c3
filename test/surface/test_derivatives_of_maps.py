# SPDX-License-Identifier: Apache-2.0
"""The promise of Jacobians: what differences tend to, and the identities of conjugate gauges."""

import pickle

import numpy as np
import pytest

from export_models import MODELS, SCALING, TRIANGLE, vectors
from limit_surface_ros.surface import Dissipation, PointContacts, PowerSum, Scaling

W, V = SCALING.wrench_unit, SCALING.twist_unit
RHO = SCALING.characteristic_length
SMOOTH = ["ellipsoid", "thesis_2", "thesis_3_convex", "norms_4", "dissipation_4", "polynomial"]


def scaled(jacobians, out, into):
    """Return Jacobians in scaled variables."""
    return jacobians / np.multiply.outer(out, 1.0 / into)


def differences(one, vectors_of, unit, step=1e-5):
    """Return derivatives (m, 3, 3) by central differences of fourth order."""
    found = np.empty((len(vectors_of), 3, 3))
    for axis in range(3):
        move = np.zeros(3)
        move[axis] = step * unit[axis]
        size = np.linalg.norm(vectors_of / unit, axis=1, keepdims=True)
        h = size * move
        near = one(vectors_of + h) - one(vectors_of - h)
        far = one(vectors_of + 2.0 * h) - one(vectors_of - 2.0 * h)
        found[:, :, axis] = (8.0 * near - far) / (12.0 * h.sum(axis=1, keepdims=True))
    return found


@pytest.mark.parametrize("name", SMOOTH)
def test_jacobians_are_what_differences_tend_to(name):
    surface = MODELS[name]
    asked = vectors(name, 300)[:-2]
    wrenches, twists = asked * [1.0, 1.0, RHO], asked / [1.0, 1.0, RHO]

    def twist_of(rows):
        return np.array([surface.twist_of_wrench(row) for row in rows])

    def wrench_of(rows):
        return np.array([surface.wrench_of_twist(row) for row in rows])

    for given, method, one, out, into in (
        (wrenches, surface.twist_jacobian, twist_of, V, W),
        (twists, surface.wrench_jacobian, wrench_of, W, V),
    ):
        values, jacobians = method(given)
        assert np.allclose(values, one(given), rtol=1e-9, atol=1e-12)
        right = scaled(differences(one, given, into), out, into)
        error = np.abs(scaled(jacobians, out, into) - right).max(axis=(1, 2))
        error /= np.abs(right).max(axis=(1, 2))
        assert np.median(error) < 1e-8
        assert error.max() < 1e-5


@pytest.mark.parametrize("prepared", [False, True])
@pytest.mark.parametrize("name", SMOOTH)
def test_conjugate_gauges_have_inverse_curvatures(name, prepared):
    # A copy, which shares no tables.
    surface = pickle.loads(pickle.dumps(MODELS[name]))
    if prepared:
        # Points that are read from a table are made as exact as others.
        surface.prepare()
    wrenches = vectors(name, 2000)[:-2] * [1.0, 1.0, RHO]
    kappa, k = surface.quadratic_twist(wrenches)
    # K w = kappa, and kappa is g times its gradient.
    again = np.einsum("mij,mj->mi", k, wrenches)
    assert np.abs((again - kappa) / V).max() < 1e-9 * np.abs(kappa / V).max()
    gradient = surface.load_factor_gradient(wrenches)
    factors = surface.load_factor(wrenches)
    assert np.allclose(kappa, gradient * factors[:, np.newaxis], rtol=1e-9, atol=1e-14)
    assert np.allclose((gradient * wrenches).sum(axis=1), factors, rtol=1e-12)
    # M = grad D grad D' + D Hess D at kappa is the inverse of K.
    load, second = surface.wrench_jacobian(kappa)
    dissipation = (load * kappa).sum(axis=1)
    m = load[:, :, np.newaxis] * load[:, np.newaxis]
    m += dissipation[:, np.newaxis, np.newaxis] * second
    one = scaled(k @ m, V, V) - np.eye(3)
    assert np.abs(one).max() < 1e-12


@pytest.mark.parametrize("name", MODELS)
def test_no_jacobian_is_nan_and_each_takes_its_vector_to_zero(name):
    surface = MODELS[name]
    asked = vectors(name, 400)
    wrenches, twists = asked * [1.0, 1.0, RHO], asked / [1.0, 1.0, RHO]
    _, by_wrench = surface.twist_jacobian(wrenches)
    _, by_twist = surface.wrench_jacobian(twists)
    assert np.isfinite(by_wrench).all()
    assert np.isfinite(by_twist).all()
    assert surface.is_smooth_at(wrenches).shape == (400,)
    for jacobians, given, out, into in ((by_wrench, wrenches, V, W), (by_twist, twists, W, V)):
        plain = scaled(jacobians, out, into)[:-2]
        kept = np.abs(np.einsum("mij,mj->mi", plain, (given / into)[:-2])).max(axis=1)
        size = np.abs(plain).max(axis=(1, 2)) * np.linalg.norm((given / into)[:-2], axis=1)
        assert np.quantile(kept / (size + 1e-30), 0.95) < 1e-8
    symmetric = scaled(by_twist, W, V)[:-2]
    size = np.abs(symmetric).max(axis=(1, 2), keepdims=True) + 1e-30
    assert np.quantile(np.abs(symmetric - np.swapaxes(symmetric, 1, 2)) / size, 0.99) < 1e-9


def test_a_sphere_and_an_ellipsoid_have_their_closed_forms():
    sphere = PowerSum(np.eye(3)[np.newaxis], [1.0])
    wrench = np.array([2.0, -1.0, 2.0])
    unit = wrench / 3.0
    right = (np.eye(3) - np.outer(unit, unit)) / 3.0
    assert np.abs(sphere.twist_jacobian(wrench)[1] - right).max() < 1e-15
    matrix = np.array([[2.0, 0.3, 0.1], [0.3, 1.0, -0.2], [0.1, -0.2, 1.5]])
    surface = PowerSum(matrix[np.newaxis], [1.0], Scaling(0.05, 2.0))
    L = matrix / np.multiply.outer(surface.scaling.wrench_unit, surface.scaling.wrench_unit)
    kappa, k = surface.quadratic_twist(wrench)
    assert np.allclose(kappa, L @ wrench, rtol=1e-12)
    assert np.allclose(k, L, rtol=1e-10)


def test_two_points_have_the_load_and_the_slope_that_one_writes_down():
    # Limits m at (+-a, 0): a motion along y loads both by m, and x and turning resist with 2 m.
    a, m = 0.1, 3.0
    surface = PointContacts([[a, 0.0], [-a, 0.0]], [m, m], Scaling(0.1, 6.0))
    wrench, jacobian = surface.wrench_jacobian([1.0, 0.0, 0.0])
    assert np.allclose(wrench, [2.0 * m, 0.0, 0.0])
    assert np.allclose(jacobian, np.diag([0.0, 2.0 * m, 2.0 * m * a * a]), atol=1e-12)


def test_within_a_facet_the_motion_does_not_change():
    x, y = TRIANGLE.points[0]
    rest = TRIANGLE.wrench_of_twist([y, -x, 1.0])
    forces = 0.3 * np.array([[1.0, 0.0], [0.0, 1.0], [-0.6, 0.5]])
    loads = rest + np.column_stack([forces, x * forces[:, 1] - y * forces[:, 0]])
    twists, jacobians = TRIANGLE.twist_jacobian(loads)
    assert not jacobians.any()
    assert np.allclose(twists[0], twists[1])
    assert (TRIANGLE.load_factor_gradient(loads) * loads).sum(axis=1) == pytest.approx(1.0)


ONES = np.eye(3)
FLAT, THIN = np.diag([1.0, 2.0, 0.0]), np.diag([1.0, 0.0, 0.0])
# Forms that do not see a load or a motion, with exponents of every range.
KINKS = {
    "blind, 1": (PowerSum([ONES, FLAT], [1.0, 1.0]), [0.0, 0.0, 1.0], True),
    "blind, 1/2": (PowerSum([ONES, FLAT], [1.0, 0.5]), [0.0, 0.0, 1.0], False),
    "blind, 2/3": (PowerSum([ONES, FLAT, ONES], [1.0, 2 / 3, 0.5]), [0.0, 0.0, 1.0], False),
    "blind, 1/4": (PowerSum([ONES, ONES, FLAT], [1.0, 0.5, 0.25]), [0.0, 0.0, 1.0], False),
    "norms": (PowerSum([ONES, FLAT], [0.5, 0.5]), [0.0, 0.0, 1.0], False),
    "ridge of norms": (PowerSum([ONES, THIN], [0.5, 0.5]), [0.0, 0.5, 1.0], False),
    "polynomial": (MODELS["polynomial"], [0.0, 0.0, 1.0], True),
}


@pytest.mark.parametrize("name", KINKS)
def test_what_a_term_does_not_see_is_told_and_what_is_left_is_the_derivative(name):
    surface, load, smooth = KINKS[name]
    assert surface.is_smooth_at(load) == smooth
    twist, jacobian = surface.twist_jacobian(load)
    many = surface.twist_jacobian([load, load])[1]
    assert np.allclose(many, jacobian, rtol=1e-12, atol=1e-14)
    if smooth:
        right = differences(surface.twist_of_wrench, np.array([load]), np.ones(3))[0]
        assert np.allclose(jacobian, right, atol=1e-8)
        return
    # The same without the term, whose weight beside the others' is all that it changes.
    others = [p for p in surface.exponents if p in (1.0, 0.5)]
    rest = PowerSum([ONES] * len(others), others)
    assert np.allclose(jacobian, rest.twist_jacobian(load)[1], atol=1e-12)
    # A wrench that does not leave its corner or ridge does so with no motion nearby.
    nearby = np.add(twist, [1e-3, 0.0, 0.0])
    fixed = surface.wrench_jacobian(nearby)[1]
    if name != "blind, 2/3":
        assert np.abs(fixed[0]).max() < 1e-11
    assert np.isfinite(fixed).all()


def test_the_motion_stays_in_the_plane_of_a_term_of_rank_one():
    # |v| + |omega|: a moment of less than the second norm does not turn the body.
    surface = Dissipation([ONES, np.diag([0.0, 0.0, 1.0])])
    load = [1.0, 0.5, 0.2]
    twist, jacobian = surface.twist_jacobian(load)
    plane = np.array([1.0, 0.5]) / np.hypot(1.0, 0.5)
    assert np.allclose(twist, [*plane, 0.0], atol=1e-12)
    across = (np.eye(2) - np.outer(plane, plane)) / np.hypot(1.0, 0.5)
    assert np.allclose(jacobian[:2, :2], across, atol=1e-12)
    assert np.abs(jacobian[2]).max() < 1e-11
    assert surface.is_smooth_at(load)
    assert not surface.wrench_is_smooth_at([1.0, 0.5, 0.0])
    assert surface.wrench_is_smooth_at([1.0, 0.5, 0.1])


def test_a_support_that_turns_freely_has_finite_derivatives():
    surface = PointContacts([[0.1, 0.05]], [3.0], Scaling(0.1, 3.0))
    for load, smooth in (([1.0, 0.0, 0.3], True), ([1.0, 0.0, -0.05], False)):
        twist, jacobian = surface.twist_jacobian(load)
        kappa, k = surface.quadratic_twist(load)
        everything = (twist, jacobian, kappa, k, surface.load_factor_gradient(load))
        assert all(np.isfinite(each).all() for each in everything)
        assert surface.is_smooth_at(load) == smooth
    assert not surface.wrench_is_smooth_at([0.05, -0.1, 1.0])
    assert not surface.wrench_jacobian([0.05, -0.1, 1.0])[1].any()


@pytest.mark.parametrize("name", MODELS)
def test_one_vector_has_the_derivatives_of_many(name):
    surface = MODELS[name]
    asked = vectors(name, 60)
    for given, method in (
        (asked * [1.0, 1.0, RHO], surface.twist_jacobian),
        (asked / [1.0, 1.0, RHO], surface.wrench_jacobian),
    ):
        values, jacobians = method(given)
        each = [method(row) for row in given]
        size = np.abs(jacobians).max(axis=(1, 2), keepdims=True)
        assert np.allclose([value for value, _ in each], values, rtol=1e-9, atol=1e-12)
        alone = np.array([jacobian for _, jacobian in each])
        assert (np.abs(alone - jacobians) <= 1e-7 * size).all()


def test_at_the_rim_of_a_facet_the_inside_is_returned_and_told():
    # Two points pulled across their line turn about either: any motion between will do.
    surface = PointContacts([[0.1, 0.0], [-0.1, 0.0]], [3.0, 3.0], Scaling(0.1, 6.0))
    across, along = [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]
    assert not surface.is_smooth_at(across)
    assert not surface.twist_jacobian(across)[1].any()
    assert surface.is_smooth_at(along)
    x, y = TRIANGLE.points[0]
    rest = TRIANGLE.wrench_of_twist([y, -x, 1.0])
    limit = TRIANGLE.friction_limits[0]
    for part, smooth in ((0.9, True), (1.0, False), (1.1, True)):
        fx, fy = part * limit * np.array([0.6, -0.8])
        load = np.add(rest, [fx, fy, x * fy - y * fx])
        assert TRIANGLE.is_smooth_at(load) == smooth
        assert TRIANGLE.twist_jacobian(load)[1].any() == (part > 1.0)
    # And of the cone of motions for which a load stays at its corner.
    norms = PowerSum([ONES, np.diag([1.0, 1.0, 0.0])], [0.5, 0.5])
    assert norms.wrench_is_smooth_at([0.5, 0.0, 1.0])
    assert not norms.wrench_is_smooth_at([1.0, 0.0, 1.0])


@pytest.mark.parametrize("force", [1e-100, 1e100])
@pytest.mark.parametrize("kind", [PowerSum.norms, Dissipation, PowerSum.thesis])
def test_derivatives_are_numbers_in_any_unit(kind, force):
    forms = MODELS["norms_4"].matrices[:2]
    usual, scaled_up = (
        kind(forms, scaling=Scaling(0.1, 1.0)),
        kind(forms, scaling=Scaling(0.1, force)),
    )
    loads, twists = vectors("norms_4", 20)[:-2], vectors("norms_4", 20)[:-2]
    for method, given, factor in (
        ("twist_jacobian", loads, 1.0 / force),
        ("quadratic_twist", loads, force**-2),
        ("wrench_jacobian", twists, force),
    ):
        right = getattr(usual, method)(given)[1]
        unit = 1.0 if method == "wrench_jacobian" else force
        found = getattr(scaled_up, method)(given * unit)[1]
        assert np.allclose(found / factor, right, rtol=1e-9, atol=1e-12 * np.abs(right).max())


@pytest.mark.parametrize("seed", [1, 3])
def test_beside_creases_and_at_corners_the_load_turns_as_differences_say(seed):
    # Terms of rank one make creases, along which nearly every load of maximum dissipation lies;
    # those of rank two, of unlike sizes, corners at which it stays.
    rng = np.random.default_rng([29, seed])
    roots = [
        rng.normal(size=(rank, 3)) * 10.0 ** rng.uniform(-3.0, 0.0, size=3)
        for rank in (1, 1, 2, 2, 2)
    ]
    surface = PowerSum.norms([root.T @ root for root in roots])
    twists = rng.normal(size=(5, 3))
    loads, many = surface.wrench_jacobian(twists)
    step = 1e-6
    for twist, load, jacobian in zip(twists, loads, many, strict=True):
        one = surface.wrench_jacobian(twist)[1]
        size = np.abs(one).max()
        assert np.abs(one - jacobian).max() <= 1e-9 * size + 1e-12 * np.abs(load).max()
        columns = [
            (surface.wrench_of_twist(twist + way) - surface.wrench_of_twist(twist - way))
            / (2.0 * step)
            for way in step * np.eye(3)
        ]
        assert np.abs(np.array(columns).T - jacobian).max() <= 1e-5 * size + 1e-7
