# SPDX-License-Identifier: Apache-2.0
"""Another weight is another unit, no other shape: cheap, exact, and without a trace in memory."""

import gc
import pickle
import tracemalloc

import numpy as np
import pytest

from limit_surface_ros.errors import RangeError
from limit_surface_ros.surface import measures, sampling
from limit_surface_ros.surface.kinds.dissipation import Dissipation
from limit_surface_ros.surface.kinds.point_contacts import PointContacts
from limit_surface_ros.surface.kinds.polynomial import Polynomial
from limit_surface_ros.surface.kinds.power_sum import PowerSum
from limit_surface_ros.surface.scaling import Scaling

RNG = np.random.default_rng(3)
ROOTS = RNG.standard_normal((3, 3, 3))
MATRICES = np.swapaxes(ROOTS, 1, 2) @ ROOTS
POINTS = 0.1 * RNG.standard_normal((4, 2))
LIMITS = np.array([1.0, 2.0, 1.0, 0.5])
QUARTIC = [1, 0, 0, 1 / 3, 0, 1, 0, 0, 0, 0, 2, 0, 1, 0, 3]
FACTOR = 3.7
KINDS = {
    "thesis": lambda f: PowerSum.thesis(MATRICES, Scaling(0.1, 5.0 * f)),
    "norms": lambda f: PowerSum.norms(MATRICES, Scaling(0.1, 5.0 * f)),
    "dissipation": lambda f: Dissipation(MATRICES, Scaling(0.1, 5.0 * f)),
    "points": lambda f: PointContacts(POINTS, LIMITS * f, Scaling(0.1, 5.0 * f)),
    "polynomial": lambda f: Polynomial(QUARTIC, Scaling(0.1, 5.0 * f)),
}
MAPS = ["load_factor", "twist_of_wrench", "wrench_of_twist"]


@pytest.fixture(params=KINDS)
def kind(request):
    return KINDS[request.param]


@pytest.mark.parametrize("name", MAPS)
@pytest.mark.parametrize("shape", [(3,), (5, 3), (300, 3)])
def test_a_rescaled_surface_is_the_one_made_for_that_weight(kind, name, shape):
    vectors = np.random.default_rng(0).standard_normal(shape)
    made = getattr(kind(FACTOR), name)(vectors)
    for rescaled in (kind(1.0).scaled(FACTOR), kind(1.0).with_friction_force(5.0 * FACTOR)):
        found = getattr(rescaled, name)(vectors)
        np.testing.assert_allclose(found, made, rtol=1e-9, atol=1e-12 * np.abs(made).max())


def test_limits_and_numbers_of_the_rescaled_are_those_of_the_other_weight(kind):
    made, rescaled = kind(FACTOR), kind(1.0).scaled(FACTOR)
    assert rescaled.scaling == made.scaling
    for array in made.arrays:
        np.testing.assert_allclose(getattr(rescaled, array.key), getattr(made, array.key))


def test_the_shape_and_its_table_are_shared_both_ways(kind):
    surface = kind(1.0)
    rescaled = surface.scaled(FACTOR).scaled(0.5)
    assert rescaled.shape is surface.shape
    rescaled.prepare()
    tables = [each for each in gc.get_objects() if type(each).__name__ == "SupportTable"]
    surface.prepare()
    again = [each for each in gc.get_objects() if type(each).__name__ == "SupportTable"]
    assert len(again) == len(tables)


def test_a_rescaled_surface_travels_without_its_shape(kind):
    rescaled = kind(1.0).scaled(FACTOR)
    back = pickle.loads(pickle.dumps(rescaled))
    assert "shape" not in back.__dict__
    np.testing.assert_allclose(back.load_factor([1, 2, 3]), rescaled.load_factor([1, 2, 3]))


def test_rescaling_again_and_again_keeps_no_memory(kind):
    surface = kind(1.0)
    surface.load_factor([1.0, 2.0, 3.0])

    def rescale_many():
        for index in range(100):
            surface.scaled(1.0 + 1e-3 * index).twist_of_wrench([1.0, 2.0, 3.0])
        gc.collect()

    rescale_many()
    tracemalloc.start()
    rescale_many()
    before = tracemalloc.get_traced_memory()[0]
    rescale_many()
    after = tracemalloc.get_traced_memory()[0]
    tracemalloc.stop()
    assert after - before < 2_000


@pytest.mark.parametrize("factor", [0.0, -1.0, np.nan, np.inf, "heavy"])
def test_what_is_no_factor_is_refused(kind, factor):
    with pytest.raises(RangeError, match="factor must be"):
        kind(1.0).scaled(factor)
    with pytest.raises(RangeError, match="friction_force must be"):
        kind(1.0).with_friction_force(factor)


def test_a_weight_out_of_the_range_of_numbers_is_refused(kind):
    with pytest.raises(RangeError, match="friction_force must be a finite number"):
        kind(1.0).scaled(1e308).scaled(1e308)


def test_errors_of_load_are_in_parts_of_the_friction_force_scale(kind):
    surface = kind(1.0)
    pairs = sampling.random_motions(surface, 40, 0)
    heavier = surface.scaled(1.1)
    # Every load is 10 % too large, in parts of the model's own scale or of the one that is named.
    exact = np.linalg.norm(pairs.wrenches / surface.scaling.wrench_unit, axis=1)
    own, named = (measures.load_error(heavier, pairs, s) for s in (None, surface.scaling))
    np.testing.assert_allclose(named, 0.1 * exact, rtol=1e-6)
    np.testing.assert_allclose(own, 0.1 * exact / 1.1, rtol=1e-6)
