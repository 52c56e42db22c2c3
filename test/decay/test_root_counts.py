# SPDX-License-Identifier: Apache-2.0
"""Roots of random quasi-polynomials: as many as an independent contour count, or a reason why not.

One to six delays, alone or in clusters, distributed feedback, and roots that are nearly double.
"""

import math
from itertools import pairwise

import numpy as np
import pytest

from limit_surface_ros.decay.delay.pieces import PiecewisePolynomial
from limit_surface_ros.decay.delay.roots import (
    count_roots,
    first_roots,
    right_edge,
    rightmost_roots,
    roots_in_box,
)
from limit_surface_ros.decay.delay.system import DelaySystem
from limit_surface_ros.decay.neutral import neutral_roots, neutral_system
from limit_surface_ros.errors import RangeError, SolverError

KINDS = ("plain", "clustered", "distributed", "double, real", "double, complex")


def clustered(random, count):
    return 1.0 + 1e-3 * random.uniform(size=count)


def nearly_double(random, real):
    """Return delays, strengths and a place where two roots are at a known distance."""
    separation = 10.0 ** random.uniform(-6.0, -1.0)
    count = 2 if real else 4
    while True:
        delays = np.sort(random.uniform(0.2, 1.0, count))
        root = complex(random.uniform(-1.5, 0.5), 0.0 if real else random.uniform(2.0, 12.0))
        waves = np.exp(-root * delays)
        rows, aims = [waves, delays * waves], [root, -1.0]
        matrix = np.array([part for row in rows for part in (row.real, row.imag)])
        aim = np.array([part for z in aims for part in (complex(z).real, complex(z).imag)])
        if real:
            matrix, aim = matrix[::2], aim[::2]
        if np.linalg.cond(matrix) < 1e4:
            strengths = np.linalg.solve(matrix, aim)
            curvature = abs(float(np.abs((strengths * delays**2 * waves).sum())))
            if 0.1 < curvature < 100.0:
                break
    # h = curvature / 2 (z - root)^2 - change: the roots part by `separation`.
    strengths[0] += curvature * separation**2 / 8.0 / abs(waves[0])
    return delays, strengths


def random_system(seed):
    """Return a system of the kind that the seed says, and its h coded apart from ours."""
    random = np.random.default_rng(seed)
    kind = KINDS[seed % len(KINDS)]
    edges, heights = np.zeros(1), np.zeros(0)
    if kind.startswith("double"):
        delays, strengths = nearly_double(random, kind.endswith("real"))
    else:
        count = int(random.integers(1, 7))
        delays = clustered(random, count) if kind == "clustered" else random.uniform(0.1, 1, count)
        strengths = random.normal(size=count) * 10.0 ** random.uniform(-1.0, 1.0)
    pieces = None
    if kind == "distributed":
        edges = np.append(0.0, np.sort(random.uniform(0.05, 1.0, 4)))
        heights = 3.0 * random.normal(size=4)
        pieces = PiecewisePolynomial(edges, heights[:, np.newaxis])

    def h(z):
        value = z - np.exp(-z[:, np.newaxis] * delays) @ strengths
        for left, right, height in zip(edges[:-1], edges[1:], heights, strict=True):
            value = value - height * (np.exp(-z * left) - np.exp(-z * right)) / z
        return value

    return kind, DelaySystem(delays, strengths, pieces), h


def contour_count(h, real, imag):
    """Count zeros, pairs twice, in a box symmetric about the real axis by its upper half."""
    corners = [complex(real[1], 1e-12), complex(real[1], imag), complex(real[0], imag)]
    corners.append(complex(real[0], 1e-12))
    for points in (4_000, 40_000, 400_000):
        legs = [np.linspace(a, b, points) for a, b in pairwise(corners)]
        values = h(np.concatenate(legs))
        turns = np.angle(values[1:] / values[:-1])
        if np.abs(turns).max() < 0.5:
            return round(float(turns.sum()) / np.pi)
    return None


def check(seed):
    """Hold one system against the count; tell whether it was counted and not refused."""
    kind, system, h = random_system(seed)
    box = (-4.0, right_edge(system) + 0.3), 30.0
    expected = contour_count(h, *box)
    if expected is None:
        return None
    try:
        found = roots_in_box(system, box[0], (0.0, box[1]))
    except SolverError:
        # It says what was counted and what was found; `run` allows few of these.
        return False
    assert len(found) + np.count_nonzero(found.imag) == expected, (kind, seed)
    value, slope = system.characteristic_and_derivative(found)
    assert (
        (np.abs(value) < 1e-12 * system.magnitude(found)) | (np.abs(value / slope) < 1e-10)
    ).all()
    return True


def run(seeds):
    results = [check(seed) for seed in seeds]
    assert results.count(None) <= len(results) // 20
    assert results.count(False) <= len(results) // 20


def test_counts_agree_with_an_independent_contour():
    run(range(100))


@pytest.mark.nightly
def test_counts_of_300_agree_with_an_independent_contour():
    run(range(300))


@pytest.mark.parametrize("excess", [1e-1, 1e-3, 1e-6, 1e-10, -1e-3, -1e-6, -1e-10])
def test_roots_about_to_meet_are_told_apart(excess):
    # x' = -(1 + excess) / e x(t - 1) has a double root at -1 without the excess.
    found = first_roots(DelaySystem([1.0], [-(1.0 + excess) / math.e]), 2)
    # (z + 1)^2 / 2 = -excess (1 + (z + 1) / 3 + ...) near -1.
    distance = math.sqrt(2.0 * abs(excess))
    if excess > 0.0:
        assert found[0].imag == pytest.approx(distance, rel=0.1 * distance + 1e-3)
        assert found[0].real == pytest.approx(-1.0 + 2.0 * excess / 3.0, abs=excess)
    else:
        assert (found.imag == 0.0).all()
        assert abs(found[1] - found[0]) == pytest.approx(2.0 * distance, rel=0.1 * distance + 1e-3)


def test_the_known_root_near_a_double_one():
    found = first_roots(DelaySystem([1.0], [-1.001 / math.e]), 1)
    assert found[0] == pytest.approx(-0.99933365 + 0.0447077j, abs=1e-7)


def test_the_rightmost_roots_of_a_strong_feedback_are_found():
    found = rightmost_roots(DelaySystem([1.0], [-1e6]), 3)
    assert found[0] == pytest.approx(11.35446778 + 2.89217915j, abs=1e-7)
    assert (np.diff(found.real) < 0.0).all()
    np.testing.assert_allclose(found, -1e6 * np.exp(-found), rtol=1e-9)


@pytest.mark.parametrize("scale", [1e-9, 1e-3, 1e6, 1e12])
def test_roots_know_no_time_scale(scale):
    pieces = PiecewisePolynomial([0.0, 0.5, 1.0], [[0.3, -0.2], [0.1, 0.4]])
    here = DelaySystem([0.3, 1.0], [-1.0, 0.4], pieces)
    there = here.in_unit_of(1.0 / scale)
    np.testing.assert_allclose(first_roots(there, 4) * scale, first_roots(here, 4), rtol=1e-10)
    np.testing.assert_allclose(
        rightmost_roots(there, 3) * scale, rightmost_roots(here, 3), rtol=1e-10
    )
    assert right_edge(there) * scale == pytest.approx(right_edge(here), rel=1e-2)


def test_a_delay_without_strength_does_not_act():
    assert DelaySystem([1.0, 6.0], [-1.0, 0.0]).max_delay == 1.0
    pieces = PiecewisePolynomial([0.0, 1.0, 4.0], [[1.0], [0.0]])
    assert DelaySystem([], [], pieces).max_delay == 1.0


def test_a_neutral_system_has_the_roots_of_the_closed_form():
    for terms in (6, 7):
        system = neutral_system(terms, 0.8, 1.3)
        closed = neutral_roots(terms, 0.8, 1.3)
        high = float(closed.imag.max()) + 1.0
        found = roots_in_box(system, (-2.0, -0.1), (0.0, high))
        np.testing.assert_allclose(found, closed, atol=1e-11)
        # The equation is that of the derivative: a constant solves it too.
        assert count_roots(system, (-0.1, 0.1), (0.0, 0.1)) == 1


def test_the_rightmost_roots_of_a_neutral_system_are_right_or_refused():
    system = DelaySystem([1.0], [-1.0], None, [1.5], [0.2])
    found = rightmost_roots(system, 1)
    value, slope = system.characteristic_and_derivative(found)
    assert np.abs(value / slope).max() < 1e-12
    assert count_roots(system, (found[0].real + 1e-6, 3.0), (0.0, 30.0)) == 0
    with pytest.raises(SolverError, match="goes up without end"):
        rightmost_roots(DelaySystem([], [], None, [1.0], [0.5]), 5)


def test_a_derivative_cannot_feed_on_itself():
    with pytest.raises(RangeError, match="neutral_delays must be above 0"):
        DelaySystem([1.0], [-1.0], None, [0.0], [0.5])
