# SPDX-License-Identifier: Apache-2.0
"""BFGS reaches minima, and goes on from a known curvature."""

import numpy as np
import pytest
from scipy.optimize import rosen, rosen_der

from limit_surface_ros.fitting.bfgs import minimise


@pytest.mark.parametrize("seed", range(5))
def test_rosenbrocks_valley_is_followed_to_its_end(seed):
    start = np.random.default_rng(seed).uniform(-2.0, 2.0, size=6)
    found = minimise(lambda x: (rosen(x) + 1.0, rosen_der(x)), start, 1e-15, 1000)
    assert found.converged
    # The valley has a second, shallower minimum near (-1, 1, ..., 1).
    assert found.cost - 1.0 < 1e-9 or found.cost == pytest.approx(4.97, abs=0.01)
    assert np.abs(found.gradient).max() < 1e-3


def test_a_known_curvature_saves_steps():
    rng = np.random.default_rng(0)
    factor = rng.normal(size=(12, 12)) * np.geomspace(0.01, 1.0, 12)
    hessian = factor @ factor.T + 1e-6 * np.eye(12)

    def quadratic(x):
        return 1.0 + 0.5 * x @ hessian @ x, hessian @ x

    cold = minimise(quadratic, np.ones(12), 1e-12, 500)
    warm = minimise(quadratic, np.ones(12), 1e-12, 500, np.linalg.inv(hessian))
    assert warm.evaluations < cold.evaluations / 4
    assert warm.cost == pytest.approx(1.0, rel=1e-9)


def test_too_few_steps_are_said_not_to_have_converged():
    found = minimise(lambda x: (rosen(x) + 1.0, rosen_der(x)), np.full(6, -1.5), 1e-15, 3)
    assert not found.converged
    assert found.iterations == 3
