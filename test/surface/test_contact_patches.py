# SPDX-License-Identifier: Apache-2.0
"""Shapes have their area and centre, pressures their centre, patches the loads known for them."""

import tracemalloc

import numpy as np
import pytest

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


@pytest.mark.parametrize(("count", "median", "most"), [(1000, 5e-4, 4e-3), (10000, 5e-5, 4e-4)])
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


def test_rim_pressure_resists_turning_more_than_central_pressure():
    moments = [
        ContactPatch.of_shape(shapes.disc(1.0), distribution)
        .surface(1.0, 1.0)
        .wrench_of_twist([0, 0, 1])[2]
        for distribution in (pressure.centre_heavy(), pressure.uniform, pressure.rim())
    ]
    np.testing.assert_allclose(moments, [8 / 15, 2 / 3, 6 / 7], rtol=3e-2)


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
