# SPDX-License-Identifier: Apache-2.0
"""Shapes have their area and centre, pressures their centre, patches the loads known for them."""

import tracemalloc

import numpy as np
import pytest
from scipy import integrate

from limit_surface_ros.errors import GeometryError, RangeError, ShapeError
from limit_surface_ros.surface import sampling
from limit_surface_ros.surface.contact import pressure, shapes
from limit_surface_ros.surface.contact.patch import ContactPatch, natural_scaling

L_SHAPE = [[0, 0], [2, 0], [2, 1], [1, 1], [1, 2], [0, 2]]


@pytest.mark.parametrize(
    ("cells", "size", "centroid"),
    [
        (shapes.disc(0.3), np.pi * 0.09, [0, 0]),
        (shapes.ring(0.1, 0.3), np.pi * 0.08, [0, 0]),
        (shapes.ring(0.3, 0.3), 0.6 * np.pi, [0, 0]),
        (shapes.ellipse([0.3, 0.1]), np.pi * 0.03, [0, 0]),
        (shapes.rectangle([0.3, 0.1]), 0.03, [0, 0]),
        (shapes.line([0, 0], [3, 4]), 5.0, [1.5, 2.0]),
        (shapes.polygon(L_SHAPE), 3.0, [5 / 6, 5 / 6]),
        (shapes.polygon(L_SHAPE[::-1], count=7), 3.0, [5 / 6, 5 / 6]),
        (
            shapes.polygon([[0, 0], [4, 0], [4, 4], [0, 4]], [[[1, 1], [3, 1], [3, 3], [1, 3]]]),
            12.0,
            [2, 2],
        ),
        (shapes.rectangle([1, 1]).placed([3, 2], 0.4), 1.0, [3, 2]),
    ],
)
def test_areas_and_centroids_are_exact_whatever_the_cells(cells, size, centroid):
    assert cells.sizes.sum() == pytest.approx(size, rel=1e-12)
    np.testing.assert_allclose(cells.centroid, centroid, atol=1e-12)


def test_a_turned_shape_turns_with_its_angle():
    line = shapes.line([0, 0], [1, 0], count=2).placed([1, 1], np.pi / 2)
    np.testing.assert_allclose(line.points, [[1, 1.25], [1, 1.75]])


def test_a_bitmap_reads_like_a_picture():
    cells, values = shapes.bitmap([[0, 3], [1, 0]], cell=0.1)
    np.testing.assert_allclose(cells.points, [[0.05, 0.05], [-0.05, -0.05]])
    np.testing.assert_array_equal(values, [3, 1])


def test_a_disc_resists_a_pure_turn_with_two_thirds_of_mu_n_r():
    surface = ContactPatch.of_shape(shapes.disc(0.3)).surface(0.5, 10.0)
    np.testing.assert_allclose(surface.wrench_of_twist([0, 0, 1]), [0, 0, 1.0], atol=1e-3)


def test_a_square_of_side_two_has_the_extremes_of_its_integrals():
    surface = ContactPatch.of_shape(shapes.rectangle([2, 2], count=400)).surface(0.5, 2.0)
    mean_arm = (np.sqrt(2) + np.arcsinh(1)) / 3
    np.testing.assert_allclose(surface.wrench_of_twist([1, 0, 0]), [1, 0, 0], atol=1e-12)
    np.testing.assert_allclose(surface.wrench_of_twist([0, 0, 1]), [0, 0, mean_arm], atol=1e-3)
    assert surface.scaling.characteristic_length == pytest.approx(mean_arm, rel=1e-3)
    assert surface.scaling.friction_force == pytest.approx(1.0)


def mean_arm_of_a_rectangle(width, height):
    """Mean distance of a rectangle's points from its centre, in closed form."""
    a, b = 0.5 * width, 0.5 * height
    diagonal = np.hypot(a, b)
    one = b * np.arcsinh(a / b) * b + a * diagonal
    other = a * np.arcsinh(b / a) * a + b * diagonal
    return (one * b + other * a) / (6.0 * a * b)


# Largest moment in parts of mu N and a length, by integrals that have a closed form.
CLOSED_FORMS = {
    "disc, uniform": (lambda n: shapes.disc(1.0, n), pressure.uniform, 2 / 3),
    "disc, centre-heavy": (lambda n: shapes.disc(1.0, n), pressure.centre_heavy(), 8 / 15),
    "disc, centre-heavy, conical": (
        lambda n: shapes.disc(1.0, n),
        pressure.centre_heavy(1.0),
        1 / 2,
    ),
    "disc, rim": (lambda n: shapes.disc(1.0, n), pressure.rim(), 6 / 7),
    "disc, linear": (lambda n: shapes.disc(1.0, n), pressure.linear([0.2, 0.1]), 2 / 3),
    "ring, uniform": (lambda n: shapes.ring(0.5, 1.0, n), pressure.uniform, 7 / 9),
    "ring, centre-heavy": (
        lambda n: shapes.ring(0.5, 1.0, n),
        pressure.centre_heavy(),
        (7 / 24 - 31 / 160) / (3 / 8 - 15 / 64),
    ),
    "ring, rim": (
        lambda n: shapes.ring(0.5, 1.0, n),
        pressure.rim(),
        (127 / 128 / 7) / (63 / 64 / 6),
    ),
    "ring, linear": (lambda n: shapes.ring(0.5, 1.0, n), pressure.linear([0.1, 0.0]), 7 / 9),
    "rectangle, uniform": (
        lambda n: shapes.rectangle([0.12, 0.07], n),
        pressure.uniform,
        mean_arm_of_a_rectangle(0.12, 0.07),
    ),
    "rectangle, linear": (
        lambda n: shapes.rectangle([0.12, 0.07], n),
        pressure.linear([0.01, 0.005]),
        mean_arm_of_a_rectangle(0.12, 0.07),
    ),
    "moved, turned rectangle": (
        lambda n: shapes.rectangle([0.12, 0.07], n).placed([3.0, -2.0], 0.7),
        pressure.uniform,
        mean_arm_of_a_rectangle(0.12, 0.07),
    ),
}


@pytest.mark.parametrize(("count", "tolerance"), [(1000, 4e-5), (10_000, 1e-6)])
@pytest.mark.parametrize("case", CLOSED_FORMS)
def test_moments_of_a_pure_turn_have_their_closed_forms(case, count, tolerance):
    shape, distribution, moment = CLOSED_FORMS[case]
    surface = ContactPatch.of_shape(shape(count), distribution).surface(1.0, 1.0)
    assert surface.wrench_of_twist([0, 0, 1])[2] == pytest.approx(moment, rel=tolerance)


@pytest.mark.parametrize(
    ("distribution", "relative"),
    [(pressure.centre_heavy(), lambda d: 1.0 - d**2), (pressure.rim(), lambda d: d**4)],
)
def test_moments_of_a_rectangle_are_those_of_an_independent_integral(distribution, relative):
    size = np.array([0.12, 0.07])

    def integral(of):
        return integrate.dblquad(lambda y, x: of(np.hypot(x, y)), 0.0, 0.06, 0.0, 0.035)[0]

    reach = 0.5 * np.hypot(*size)
    force = integral(lambda r: relative(r / reach))
    moment = integral(lambda r: relative(r / reach) * r)
    for count, tolerance in ((1000, 2e-5), (10_000, 1e-6)):
        patch = ContactPatch.of_shape(shapes.rectangle(size, count), distribution)
        found = patch.surface(1.0, 1.0).wrench_of_twist([0, 0, 1])[2]
        assert found == pytest.approx(moment / force, rel=tolerance)


def test_a_centre_heavy_pressure_vanishes_at_the_rim_and_not_at_a_cell():
    for count in (12, 100, 1000):
        cells = shapes.disc(0.5, count)
        pressures = pressure.centre_heavy()(cells)
        radii = np.linalg.norm(cells.points, axis=1)
        np.testing.assert_allclose(pressures, 1.0 - (radii / 0.5) ** 2, atol=1e-12)
        assert pressures.min() > 0.0


@pytest.mark.parametrize(
    "shape",
    [
        shapes.disc(0.3).placed([0.1, 0.2]),
        shapes.rectangle([0.12, 0.07]),
        shapes.polygon(np.array(L_SHAPE) - 5 / 6),
    ],
)
def test_centroids_leave_no_residue_of_zero(shape):
    residues = np.abs(shape.centroid)
    assert ((residues == 0.0) | (residues > 1e-9)).all()


@pytest.mark.parametrize(
    "build",
    [
        lambda: shapes.rectangle([0.1, 1e23]),
        lambda: shapes.rectangle([1e-150, 0.2]),
        lambda: shapes.disc(1e-150),
        lambda: shapes.ellipse([1e12, 1.0]),
        lambda: shapes.line([0, 0], [0, 1e10]),
        lambda: shapes.polygon([[0, 0], [1e10, 0], [0, 1e10]]),
    ],
)
def test_sizes_that_no_body_has_are_refused(build):
    with pytest.raises(RangeError, match="must be from 1e-09 to 1e\\+09 m"):
        build()


@pytest.mark.parametrize(
    "shape",
    [
        shapes.rectangle([1e-9, 1e9]),
        shapes.ring(0.1, 0.1 + 1e-12),
        shapes.polygon([[0, 0], [1, 1], [1, 1 + 1e-7], [0, 1e-7]]),
    ],
)
def test_slivers_take_about_as_many_cells_as_others(shape):
    assert 500 < len(shape.sizes) <= 2000


@pytest.mark.parametrize(("count", "median", "most"), [(1000, 1e-4, 2e-3), (10000, 1e-6, 3e-4)])
def test_cells_are_as_good_as_their_number_says(count, median, most):
    def loads(cells):
        surface = ContactPatch.of_shape(shapes.disc(1.0, cells)).surface(1.0, 1.0)
        return surface.wrench_of_twist(sampling.random_directions(100, 1) * [1, 1, 1.5])

    errors = np.linalg.norm(loads(count) - loads(40000), axis=1)
    assert np.median(errors) < median
    assert errors.max() < most


def test_linear_pressure_has_the_centre_asked_for():
    cells = shapes.rectangle([0.2, 0.1])
    patch = ContactPatch.of_shape(cells, pressure.linear([0.01, -0.005]))
    np.testing.assert_allclose(patch.centre_of_pressure, [0.01, -0.005], atol=1e-12)
    np.testing.assert_allclose(patch.centroid, [0, 0], atol=1e-12)


def test_a_centre_of_pressure_that_would_lift_the_body_is_refused():
    cells = shapes.rectangle([0.2, 0.1])
    with pytest.raises(GeometryError, match="would lift"):
        ContactPatch.of_shape(cells, pressure.linear([0.09, 0.0]))
    bar = shapes.line([-1, 0], [1, 0])
    assert ContactPatch.of_shape(bar, pressure.linear([0.2, 0.0])).centre_of_pressure[0] == (
        pytest.approx(0.2)
    )
    with pytest.raises(GeometryError, match="would lift"):
        ContactPatch.of_shape(bar, pressure.linear([0.2, 0.1]))


def test_any_function_may_be_a_pressure():
    patch = ContactPatch.of_shape(shapes.disc(1.0), lambda cells: cells.points[:, 0] > 0)
    assert patch.centre_of_pressure[0] == pytest.approx(4 / (3 * np.pi), rel=0.02)


def test_another_weight_is_a_scale():
    patch = ContactPatch.of_shape(shapes.disc(0.1, 100))
    light, heavy = patch.surface(0.5, 2.0), patch.surface(0.5, 6.0)
    np.testing.assert_allclose(
        light.with_friction_force(3.0).wrench_of_twist([1, 2, 3]), heavy.wrench_of_twist([1, 2, 3])
    )


def test_loads_about_another_reference_point_keep_their_power():
    patch = ContactPatch.of_shape(shapes.rectangle([0.2, 0.1], 50))
    shift = np.array([0.05, 0.02])
    about_centre, about_shift = patch.surface(1, 1), patch.surface(1, 1, reference_point=shift)
    twist = np.array([0.3, -0.2, 2.0])
    moved = twist + np.array([-2.0 * shift[1], 2.0 * shift[0], 0.0])
    power = about_centre.wrench_of_twist(twist) @ twist
    assert about_shift.wrench_of_twist(moved) @ moved == pytest.approx(power)


def test_natural_scales_make_largest_force_and_moment_one():
    scaling = natural_scaling([[0.1, 0.0], [-0.3, 0.0]], [1.0, 1.0])
    assert (scaling.characteristic_length, scaling.friction_force) == (pytest.approx(0.2), 2.0)
    assert natural_scaling([[0.0, 0.0]], [1.0]).characteristic_length == 1.0


@pytest.mark.parametrize(
    ("build", "error", "message"),
    [
        (lambda: shapes.disc(-1.0), RangeError, "above 0, got -1"),
        (lambda: shapes.ring(2.0, 1.0), RangeError, "from 0 to 1"),
        (lambda: shapes.rectangle([1, 2, 3]), ShapeError, "two numbers"),
        (lambda: shapes.line([1, 1], [1, 1]), GeometryError, "twice"),
        (lambda: shapes.polygon([[0, 0], [1, 1], [1, 0], [0, 1]]), GeometryError, "not simple"),
        (lambda: shapes.polygon([[0, 0], [1, 1]]), ShapeError, "n >= 3"),
        (lambda: shapes.bitmap([[0, 0]], 0.1), GeometryError, "no cell"),
        (lambda: shapes.bitmap([[-1, 0]], 0.1), RangeError, "negative"),
        (
            lambda: ContactPatch.of_shape(shapes.disc(1), lambda c: 0 * c.sizes),
            GeometryError,
            "no load",
        ),
        (lambda: ContactPatch.of_shape(shapes.disc(1), lambda _: [1.0]), ShapeError, "one number"),
        (lambda: ContactPatch.of_shape(shapes.disc(1)).surface(0, 1), RangeError, "friction_coef"),
    ],
)
def test_what_is_no_patch_is_refused(build, error, message):
    with pytest.raises(error, match=message):
        build()


def test_a_batch_for_many_cells_takes_the_memory_of_a_block():
    surface = ContactPatch.of_shape(shapes.rectangle([0.1, 0.1], 10_000)).surface(0.3, 10.0)
    twists = sampling.random_directions(2000, 1)
    # What is worked out once does not count.
    surface.wrench_of_twist(twists[:1000])
    tracemalloc.start()
    wrenches = surface.wrench_of_twist(twists)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 3e6 + 10 * wrenches.nbytes
