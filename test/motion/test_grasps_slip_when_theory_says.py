# SPDX-License-Identifier: Apache-2.0
"""How much normal force holds a load, and when a grasp slips whose normal force relaxes."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from limit_surface_ros.decay.exponential_sum import ExponentialSum
from limit_surface_ros.errors import (
    DataError,
    NoOnsetError,
    NotFiniteError,
    RangeError,
    ShapeError,
    SolverError,
    UnstableError,
)
from limit_surface_ros.motion.crossings import first_above
from limit_surface_ros.motion.slip import (
    load_factors,
    predict_slip,
    required_normal_force,
    required_share,
)
from limit_surface_ros.surface.kinds.dissipation import Dissipation
from limit_surface_ros.surface.kinds.point_contacts import PointContacts
from limit_surface_ros.surface.kinds.power_sum import PowerSum
from limit_surface_ros.surface.scaling import Scaling

seeds = st.integers(min_value=0, max_value=2**32 - 1)
HERTZ = 1.0 / 3.0


def ellipsoid(force, torque):
    """Return the ellipsoid with these largest forces and moment."""
    return PowerSum([np.eye(3)], [1.0], Scaling(torque / force, force))


@given(seeds)
def test_an_ellipsoid_with_hertz_contact_asks_for_the_root_of_its_quartic(seed):
    """By y = nu^(2/3): y^4 = A y + B, A = (F / mu N0)^2, B = (tau / tau0)^2."""
    rng = np.random.default_rng(seed)
    force, torque = rng.uniform(0.5, 20.0), rng.uniform(1e-3, 0.5)
    wrench = rng.normal(size=3) * [force, force, torque] * 10.0 ** rng.uniform(-3.0, 2.0)
    share = required_share(ellipsoid(force, torque), wrench, HERTZ).share
    a, b = (wrench[0] ** 2 + wrench[1] ** 2) / force**2, (wrench[2] / torque) ** 2
    roots = np.roots([1.0, 0.0, 0.0, -a, -b])
    y = float(roots[(abs(roots.imag) < 1e-9 * abs(roots)) & (roots.real > 0.0)].real.max())
    y -= (y**4 - a * y - b) / (4.0 * y**3 - a)
    assert share == pytest.approx(y**1.5, rel=1e-12)


def test_the_published_example():
    """Take mu = 0.8, N0 = 10 N, a0 = 6 mm, and a largest moment of 0.6 mu N0 a0."""
    surface = ellipsoid(8.0, 0.6 * 8.0 * 0.006)
    needed = required_normal_force(surface, 10.0, (2.0, 1.0, 0.01), HERTZ)
    assert needed == pytest.approx(5.154302851, abs=1e-9)


@given(seeds, st.floats(min_value=0.0, max_value=0.5), st.floats(min_value=0.5, max_value=4.0))
def test_at_the_force_that_is_asked_for_the_load_factor_is_1(seed, exponent, margin):
    rng = np.random.default_rng(seed)
    factors = rng.normal(size=(3, 3, 3))
    forms = np.einsum("kij,kil->kjl", factors, factors)
    # Symmetric about the contact's centre: a moment never helps.
    forms[:, :2, 2] = forms[:, 2, :2] = 0.0
    for surface in (PowerSum.norms(forms, Scaling(0.02, 5.0)), Dissipation(forms)):
        wrench = rng.normal(size=3) * surface.scaling.wrench_unit
        found = required_share(surface, wrench, exponent, margin)
        (factor,) = load_factors(surface, margin * wrench, [found.share], exponent)
        assert factor == pytest.approx(1.0, abs=1e-12)
        assert found.load_factor == pytest.approx(float(surface.load_factor(wrench)), rel=1e-12)
        first = margin * found.load_factor
        ends = sorted([first, first ** (1.0 / (1.0 + exponent))])
        assert ends[0] * (1.0 - 1e-12) <= found.share <= ends[1] * (1.0 + 1e-12)
        assert -1e-12 <= found.torsional_share <= 1.0 + 1e-12


def test_pure_forces_and_pure_torques_have_closed_forms():
    surface = ellipsoid(4.0, 0.02)
    assert required_share(surface, (3.0, 0.0, 0.0), HERTZ).share == pytest.approx(0.75, rel=1e-14)
    torque = required_share(surface, (0.0, 0.0, -0.03), HERTZ, margin=2.0)
    assert torque.share == pytest.approx(3.0 ** (1.0 / (1.0 + HERTZ)), rel=1e-14)
    assert torque.torsional_share == pytest.approx(1.0)
    assert required_share(surface, (0.0, 0.0, 0.03), 0.0, margin=2.0).share == pytest.approx(3.0)
    assert required_share(surface, (0.0, 0.0, 0.0), HERTZ).share == 0.0


def test_a_disc_of_cells_asks_for_more_the_softer_it_is():
    cells = [(x, y) for x in range(-11, 12) for y in range(-11, 12) if x * x + y * y <= 121]
    points = 0.006 * np.array(cells) / 11.5
    surface = PointContacts(points, np.full(len(points), 8.0 / len(points)), Scaling(0.006, 8.0))
    needed = [
        required_normal_force(surface, 10.0, (2.0, 1.0, 0.01), exponent)
        for exponent in (0.0, 0.2, HERTZ, 0.5)
    ]
    assert needed == sorted(needed)
    # What ignoring the exponent leaves out, 12 to 20 %.
    assert 1.12 < needed[2] / needed[0] < 1.2


@pytest.mark.parametrize("factor", [0.2, 0.7, 0.999])
def test_one_exponential_slips_after_the_logarithm(factor):
    found = predict_slip(
        ellipsoid(4.0, 0.02), ExponentialSum([-0.7], [-3.0]), (4.0 * factor, 0, 0)
    )
    assert found.time == pytest.approx(math.log(1.0 / factor) / 0.7, rel=1e-9)
    assert found.slips
    assert found.share == pytest.approx(factor)
    assert (found.earliest, found.latest) == (found.time, found.time)


def test_a_pad_that_keeps_a_part_slips_only_below_it():
    pad = ExponentialSum([0.0, -2.0], [0.6, 0.4])
    surface = ellipsoid(1.0, 1.0)
    found = predict_slip(surface, pad, (0.7, 0.0, 0.0))
    assert found.time == pytest.approx(math.log(0.4 / 0.1) / 2.0, rel=1e-12)
    for factor in (0.1, 0.599, 0.6):
        never = predict_slip(surface, pad, (factor, 0.0, 0.0))
        assert never.time == never.latest == math.inf
        assert not never.slips


def test_a_load_that_the_onset_cannot_hold_slips_at_once():
    assert (
        predict_slip(ellipsoid(1.0, 1.0), ExponentialSum([-1.0], [1.0]), (1.2, 0, 0)).time == 0.0
    )


def test_errors_of_the_model_bound_the_time():
    x = ExponentialSum([0.0, -2.0], [0.6, 0.4])
    surface = ellipsoid(1.0, 1.0)
    found = predict_slip(surface, x, (0.7, 0.0, 0.0), max_error=0.05)
    times = np.linspace(0.0, 5.0, 100_001)
    for phase in np.linspace(0.0, 6.0, 13):
        response = x(times) + 0.05 * np.cos(9.0 * times + phase)
        slip = times[np.argmax(response < 0.7)]
        assert found.earliest - times[1] <= slip <= found.latest
    assert predict_slip(surface, x, (0.7, 0.0, 0.0), max_error=0.11).latest == math.inf


def random_sum(rng):
    count = int(rng.integers(1, 6))
    pair = rng.random(count) < 0.4
    rates = -np.exp(rng.uniform(-2.0, 3.0, count)) + 1j * np.where(
        pair, rng.uniform(0.3, 20.0, count), 0.0
    )
    coefficients = rng.normal(size=count) + 1j * np.where(pair, rng.normal(size=count), 0.0)
    return ExponentialSum(
        np.append(rates, 0.0), np.append(coefficients, rng.choice([0.0, rng.normal()]))
    )


def check_first_crossings(count, samples, seed):
    """Hold first crossings against many samples; a touch within their spacing is no verdict."""
    rng = np.random.default_rng(seed)
    verdicts = 0
    for _ in range(count):
        x = random_sum(rng)
        live = x.rates[x.rates != 0.0]
        end = 30.0 / float(-live.real.max())
        times = np.linspace(0.0, end, samples)
        values = x(times)
        level = float(rng.uniform(values.min(), values.max()))
        curvature = float((np.abs(x.coefficients) * np.abs(x.rates) ** 2).sum())
        doubt = curvature * times[1] ** 2
        found = first_above(x, level)
        above = np.flatnonzero(values > level + doubt)
        if found is None:
            assert not len(above)
            verdicts += 1
            continue
        assert abs(float(x(found)) - level) <= 1e-9 * x.size or found == 0.0
        before = times < found
        assert (values[before] <= level + doubt).all()
        if len(above):
            assert found <= times[above[0]]
            verdicts += 1
    return verdicts


def test_first_crossings_are_those_of_many_samples():
    assert check_first_crossings(40, 20_001, 0) >= 35


@pytest.mark.nightly
def test_300_first_crossings_are_those_of_a_million_samples():
    assert check_first_crossings(300, 1_000_001, 1) >= 290


def test_a_crossing_is_looked_for_from_a_start_on():
    wave = ExponentialSum([-0.1 + 2.0j], [1.0])
    assert first_above(wave, 0.5) == 0.0
    second = first_above(wave, 0.5, 1.5)
    assert float(wave(second)) == pytest.approx(0.5, abs=1e-12)
    assert 2.0 < second < 3.2
    assert first_above(wave, 0.5, 20.0) is None


@pytest.mark.parametrize(
    ("wrench", "exponent", "margin", "error"),
    [
        ((1.0, 0.0), 0.0, 1.0, ShapeError),
        ([[1.0, 0.0, 0.0]], 0.0, 1.0, ShapeError),
        ((math.nan, 0.0, 0.0), 0.0, 1.0, NotFiniteError),
        ((1.0, 0.0, 0.0), -0.1, 1.0, RangeError),
        ((1.0, 0.0, 0.0), 1.1, 1.0, RangeError),
        ((1.0, 0.0, 0.0), math.nan, 1.0, NotFiniteError),
        ((1.0, 0.0, 0.0), 0.0, 0.0, RangeError),
    ],
)
def test_bad_numbers_are_refused(wrench, exponent, margin, error):
    with pytest.raises(error):
        required_share(ellipsoid(1.0, 1.0), wrench, exponent, margin)


def test_what_no_force_holds_is_refused():
    single = PointContacts(np.array([[0.0, 0.0]]), [1.0])
    with pytest.raises(DataError, match="no normal force"):
        required_share(single, (0.0, 0.0, 1.0))
    with pytest.raises(RangeError, match="normal_force"):
        required_normal_force(ellipsoid(1.0, 1.0), 0.0, (1.0, 0.0, 0.0))


def test_a_moment_that_holds_back_may_leave_no_answer():
    skew = np.array([[1.0, 0.0, -0.99], [0.0, 1.0, 0.0], [-0.99, 0.0, 1.0]])
    with pytest.raises(SolverError, match="does not hold more"):
        required_share(PowerSum([skew], [1.0]), (1.0, 0.0, 0.6), 1.0)


@pytest.mark.parametrize(
    ("rates", "coefficients", "error"),
    [([0.1], [1.0], UnstableError), ([-1.0, -2.0], [1.0, -1.0], NoOnsetError)],
)
def test_normal_forces_that_do_not_relax_are_refused(rates, coefficients, error):
    with pytest.raises(error):
        predict_slip(ellipsoid(1.0, 1.0), ExponentialSum(rates, coefficients), (0.5, 0.0, 0.0))
