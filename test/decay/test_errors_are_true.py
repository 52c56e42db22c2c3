# SPDX-License-Identifier: Apache-2.0
"""The stated largest error is the true one, steep starts included, and proven where it can be."""

import numpy as np
import pytest
from scipy.special import erfcx

from limit_surface_ros.decay import fit as fits
from limit_surface_ros.decay.certify import certified_error
from limit_surface_ros.decay.examples import EXAMPLES
from limit_surface_ros.decay.exponential_sum import ExponentialSum
from limit_surface_ros.decay.fit import fit_decay
from limit_surface_ros.decay.targets import Analytic, Record
from limit_surface_ros.errors import RangeError

END = 20.0
STEEP = {
    "erfcx(sqrt t)": lambda t: erfcx(np.sqrt(t)),
    "exp(-t^0.3)": lambda t: np.exp(-(t**0.3)),
    "exp(-sqrt t)": lambda t: np.exp(-np.sqrt(t)),
}


def graded(end=END):
    """Return 120 000 points that miss no start."""
    even, early = np.linspace(0.0, end, 20_000), np.geomspace(1e-18, end, 100_000)
    return np.unique(np.concatenate([even, early]))


def true_error(fit, function, end=END):
    times = graded(end)
    return float(np.abs(fit.fit.sum(times) - function(times)).max())


@pytest.mark.parametrize(
    ("name", "terms", "most"),
    [
        ("erfcx(sqrt t)", 9, 3.0e-4),
        ("exp(-t^0.3)", 5, 9e-3),
        ("exp(-sqrt t)", 5, 2.9e-3),
        pytest.param("erfcx(sqrt t)", 15, 3e-5, marks=pytest.mark.nightly),
        pytest.param("exp(-t^0.3)", 9, 1.3e-3, marks=pytest.mark.nightly),
        pytest.param("exp(-t^0.3)", 15, 1.4e-4, marks=pytest.mark.nightly),
        pytest.param("exp(-sqrt t)", 9, 2.5e-4, marks=pytest.mark.nightly),
        pytest.param("exp(-sqrt t)", 15, 2.2e-5, marks=pytest.mark.nightly),
    ],
)
def test_steep_starts_are_met_with_true_and_proven_errors(name, terms, most):
    function = STEEP[name]
    fit = fit_decay(Analytic(function, shape="convex"), terms, END)
    true = true_error(fit, function)
    assert true <= most
    assert fit.fit.max_error == pytest.approx(true, rel=0.02)
    assert true <= fit.largest.proven <= 1.02 * true


def test_a_fast_term_that_a_uniform_grid_misses_is_found():
    def function(t):
        return 0.9 * np.exp(-t) + 0.1 * np.exp(-5000.0 * t)

    fit = fit_decay(Analytic(function), 5, END)
    assert true_error(fit, function) <= 1e-12
    fit = fit_decay(Analytic(function), 1, END, "esprit")
    assert fit.fit.max_error == pytest.approx(true_error(fit, function), rel=0.02)


@pytest.mark.parametrize("name", ["f1", "f2", "tail", "gaussian", "power_law"])
def test_the_examples_errors_are_proven(name):
    target = EXAMPLES[name]()
    fit = fit_decay(target, 3, 6.0, "esprit")
    true = true_error(fit, target, 6.0)
    assert true * (1.0 - 1e-12) <= fit.largest.proven <= 1.02 * true
    assert fit.fit.max_error == pytest.approx(true, rel=1e-3)


@pytest.mark.parametrize("shape", ["monotone", "convex"])
def test_no_error_hides_between_the_points_of_a_proof(shape):
    random = np.random.default_rng(4)
    for _ in range(20):
        speeds, sizes = 10.0 ** random.uniform(-1.0, 3.0, 3), random.uniform(0.1, 1.0, 3)
        rates = -speeds * random.uniform(0.8, 1.2, 3)
        x = ExponentialSum(np.append(rates, -1.0 + 20.0j), np.append(sizes, 0.02 + 0.01j))

        def function(t, speeds=speeds, sizes=sizes):
            return np.exp(np.multiply.outer(t, -speeds)) @ sizes

        largest = certified_error(x, Analytic(function, shape=shape), 3.0)
        times = graded(3.0)
        true = float(np.abs(x(times) - function(times)).max())
        assert true <= largest.proven * (1.0 + 1e-12)
        assert largest.proven <= 1.02 * true
        assert largest.found <= largest.proven


@pytest.mark.parametrize("gap", [1e-3, 2e-5])
def test_small_errors_of_monotone_responses_are_proven_too(gap):
    x = ExponentialSum([-1.0, -3.0], [0.5, 0.5])

    def function(t):
        return x(t) + gap * np.exp(-2.0 * t) * (1.0 - t)

    largest = certified_error(x, Analytic(function, shape="monotone"), 6.0)
    assert gap * (1.0 - 1e-9) <= largest.found <= largest.proven <= 1.02 * gap


def test_nothing_is_proven_of_what_is_not_known():
    x = ExponentialSum([-1.0], [1.0])
    assert certified_error(x, Analytic(lambda t: np.exp(-t) * np.cos(t)), 1.0).proven == np.inf
    assert (
        certified_error(x, Record(np.arange(5.0), np.exp(-np.arange(5.0))), 4.0).proven == np.inf
    )
    with pytest.raises(RangeError, match="monotone, convex"):
        Analytic(lambda t: np.exp(-t), shape="round")


def test_auto_takes_more_terms_than_a_response_that_is_known_anywhere_has_knots(monkeypatch):
    monkeypatch.setattr(fits, "MOST_AUTO", 3)
    found = fit_decay(EXAMPLES["f1"](), "auto", 6.0)
    assert found.fit.sum.terms == 3
    assert found.fit.max_error < 0.03
