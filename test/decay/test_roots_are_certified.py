# SPDX-License-Identifier: Apache-2.0
"""All roots in a box are found, none twice, and the argument principle vouches for it."""

import warnings

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.special import lambertw

from limit_surface_ros.decay import examples
from limit_surface_ros.decay.delay import roots
from limit_surface_ros.decay.delay.construction import delay_system
from limit_surface_ros.decay.delay.pieces import PiecewisePolynomial
from limit_surface_ros.decay.delay.roots import (
    count_roots,
    first_roots,
    rightmost_roots,
    roots_in_box,
)
from limit_surface_ros.decay.delay.stability import (
    count_growing_modes,
    count_unstable_roots,
    require_minimum_phase,
    require_stable,
)
from limit_surface_ros.decay.delay.system import DelaySystem
from limit_surface_ros.errors import DataError, RangeError, SolverError, UnstableError

THESIS_BOX = ((-6.0, 3.0), (0.0, 68.0))


def test_sixty_two_roots_of_the_simple_system_are_lambert_w():
    found = first_roots(examples.simple_system(), 62)
    np.testing.assert_allclose(found, lambertw(-0.6, np.arange(62)) / 6.0, rtol=0, atol=1e-12)


@pytest.mark.parametrize(
    ("system", "count"),
    [(examples.thesis_system(), 65), (delay_system(examples.hockey_stick(), 6.0), 64)],
)
def test_the_thesis_box_holds_the_known_number_of_roots(system, count):
    found = roots_in_box(system, *THESIS_BOX)
    assert len(found) == count
    value, slope = system.characteristic_and_derivative(found)
    assert np.abs(value / slope).max() < 1e-13
    symmetric = len(found) + np.count_nonzero(found.imag)
    assert count_roots(system, *THESIS_BOX) == symmetric


def test_the_first_roots_of_the_printed_equation_are_those_measured_before():
    found = first_roots(examples.thesis_system(), 5)
    known = [-0.7815, -0.642 + 0.908j, -0.580 + 2.023j, -0.634 + 3.137j, -0.750 + 4.224j]
    np.testing.assert_allclose(found, known, atol=6e-4)


def test_rightmost_roots_are_all_of_those_to_the_right():
    system = delay_system(examples.hockey_stick(), 6.0)
    found = rightmost_roots(system, 12)
    assert (np.diff(found.real) <= 0.0).all()
    others = roots_in_box(system, (-2.6, 3.0), (0.0, 60.0))
    np.testing.assert_allclose(np.sort(found.real), np.sort(others.real)[-12:], rtol=0, atol=1e-10)


@given(st.integers(min_value=0, max_value=2**32 - 1))
@settings(max_examples=15, deadline=None)
def test_roots_of_random_systems_are_roots_and_complete(seed):
    rng = np.random.default_rng(seed)
    pieces = PiecewisePolynomial([0.0, 0.7, 1.6], rng.normal(size=(2, 4)))
    system = DelaySystem([0.0, 0.4], rng.normal(size=2), pieces)
    found = roots_in_box(system, (-4.0, 5.0), (0.0, 30.0))
    value, slope = system.characteristic_and_derivative(found)
    assert np.abs(value / slope).max() < 1e-11
    assert len(np.unique(np.round(found, 6))) == len(found)
    # An independent count: the phase of h on a dense path, without refinement.
    path = np.concatenate(
        [
            5.0 + 1j * np.linspace(0.0, 30.0, 40001),
            np.linspace(5.0, -4.0, 40001) + 30.0j,
            -4.0 + 1j * np.linspace(30.0, 0.0, 40001),
        ]
    )
    phase = np.unwrap(np.angle(system.characteristic(path)))
    expected = round((phase[-1] - phase[0]) / np.pi)
    assert len(found) + np.count_nonzero(found.imag) == expected


def test_a_root_on_the_edge_of_the_box_is_included():
    root = first_roots(examples.simple_system(), 5)[4]
    found = roots_in_box(examples.simple_system(), (root.real, 1.0), (0.0, root.imag))
    assert np.abs(found - root).min() < 1e-10


def test_a_double_root_is_not_passed_off_as_a_simple_one():
    # xdot(t) = -x(t - 1) / e has the double root -1.
    system = DelaySystem([1.0], [-np.exp(-1.0)])
    with pytest.raises(SolverError, match="counts 2 roots"):
        roots_in_box(system, (-1.5, 0.5), (0.0, 3.0))


def test_a_missed_root_is_an_error_and_not_a_gap(monkeypatch):
    monkeypatch.setattr(roots, "_seeds", lambda *_: np.array([-0.1 + 0.1j]))
    with pytest.raises(SolverError, match="the argument principle counts"):
        roots_in_box(examples.simple_system(), (-2.0, 1.0), (0.0, 20.0))


def test_qpmr_agrees_on_a_system_of_its_own_literature_list():
    qpmr = pytest.importorskip("qpmr")
    # s + exp(-s), from Vyhlidal and Zitek 2009 as qpmr's own documentation has it.
    equation = np.array([[0.0, 1.0], [1.0, 0.0]]), np.array([0.0, 1.0])
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # The peer casts complex numbers on its way.
        peer, _ = qpmr.qpmr(*equation, region=(-10.0, 2.0, 0.0, 30.0))
    ours = roots_in_box(DelaySystem([1.0], [-1.0]), (-10.0, 2.0), (0.0, 30.0))
    assert len(peer) == len(ours) > 3
    np.testing.assert_allclose(np.sort_complex(ours), np.sort_complex(peer), rtol=0, atol=1e-6)


def test_stability_is_certified_by_a_count():
    assert count_unstable_roots(examples.thesis_system()) == 0
    require_stable(examples.simple_system())
    # xdot = -c x(t - 1) loses stability at c = pi / 2.
    assert count_unstable_roots(DelaySystem([1.0], [-1.5])) == 0
    assert count_unstable_roots(DelaySystem([1.0], [-1.7])) == 2
    with pytest.raises(UnstableError, match="2 of its roots"):
        require_stable(DelaySystem([1.0], [-1.7]))
    with pytest.raises(UnstableError, match="border"):
        require_stable(DelaySystem([1.0, 2.0], [-1.0, 1.0]))


@pytest.mark.parametrize(
    ("name", "modes"), [("f1", 0), ("f2", 0), ("f3", 0), ("f4", 1), ("tail", 0), ("power_law", 0)]
)
def test_a_response_that_would_give_an_unstable_system_is_known_before(name, modes):
    assert count_growing_modes(examples.example(name), 40.0) == modes


def test_growing_modes_are_the_unstable_roots_of_the_system_built():
    response = examples.undershoot()
    with pytest.raises(UnstableError, match="not minimum-phase"):
        require_minimum_phase(response, 6.0)
    system = delay_system(response, 6.0)
    assert count_unstable_roots(system) > 0


def test_a_response_that_has_not_decayed_is_refused():
    with pytest.raises(DataError, match="has not decayed"):
        count_growing_modes(examples.power_law(), 0.2)


@pytest.mark.parametrize(
    ("call", "error"),
    [
        (lambda s: roots_in_box(s, (1.0, -1.0), (0.0, 1.0)), RangeError),
        (lambda s: roots_in_box(s, (-1.0, 1.0), (-1.0, 1.0)), RangeError),
        (lambda s: first_roots(s, 0), RangeError),
        (lambda s: rightmost_roots(s, 0), RangeError),
        (lambda s: first_roots(DelaySystem([0.0], [-1.0]), 3), RangeError),
    ],
)
def test_bad_questions_are_refused(call, error):
    with pytest.raises(error):
        call(examples.simple_system())
