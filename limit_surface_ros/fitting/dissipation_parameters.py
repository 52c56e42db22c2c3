# SPDX-License-Identifier: Apache-2.0
"""The parameters of dissipation models: Cholesky factors, with a floor under every term.

    B = L L' + r trace(L L') I

A floor r > 0 keeps D smooth: each term is a small contact area instead of a point, so that a
load's motion depends smoothly on the parameters.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from limit_surface_ros.fitting.cholesky import (
    factors_of,
    factors_of_matrices,
    matrices_of,
    parameter_gradient,
    parameters_of,
)

if TYPE_CHECKING:
    from limit_surface_ros.checks import Floats

# Share of a term that every direction of it has to begin with.
_SLIVER = 1e-7


def floored_matrices(parameters: Floats, floor: float) -> tuple[Floats, Floats]:
    """Return the matrices B, shape (k, 3, 3), and the factors L behind them."""
    factors = factors_of(parameters)
    matrices = matrices_of(factors)
    if floor > 0.0:
        matrices += floor * _traces(matrices) * np.eye(3)
    return matrices, factors


def floored_parameters(matrices: Floats, floor: float) -> Floats:
    """Return the parameters of the nearest model to `matrices`, shape (k, 3, 3), with the floor.

    Where a matrix is flatter than the floor allows, its smallest part is that of the floor.
    """
    below = floor / (1.0 + 3.0 * floor) * _traces(matrices) * np.eye(3)
    # A factor of zero would stay zero: its matrix does not change with it to first order.
    sliver = _SLIVER * _traces(matrices) * np.eye(3)
    values, axes = np.linalg.eigh(matrices - below)
    positive = (axes * np.maximum(values, 0.0)[:, None]) @ axes.transpose(0, 2, 1)
    return parameters_of(factors_of_matrices(positive + sliver))


def floored_gradient(matrix_gradient: Floats, factors: Floats, floor: float) -> Floats:
    """Chain a gradient with respect to B, shape (k, 3, 3), to the parameters."""
    if floor > 0.0:
        matrix_gradient = matrix_gradient + floor * _traces(matrix_gradient) * np.eye(3)
    return parameter_gradient(matrix_gradient, factors)


def random_factors(loads: Floats, terms: int, rng: np.random.Generator) -> Floats:
    """Return parameters of random terms that together resist loads of the given size.

    The second moment of loads on an ellipsoid is a third of the one term that has it as its
    surface; k terms of a k-th of the force each make up one.

    Args:
        loads: Scaled loads, shape (3, n).
        terms: k.
        rng: Generator.

    Returns:
        Shape (6 k,).
    """
    moment = 3.0 * loads @ loads.T / loads.shape[1]
    moment += 1e-9 * np.trace(moment) * np.eye(3)
    whole = np.linalg.cholesky(moment)
    parts = whole @ matrices_of(np.tril(rng.normal(size=(terms, 3, 3)))) @ whole.T
    parts *= np.trace(moment) / _traces(parts) / terms**2
    return parameters_of(np.linalg.cholesky(parts + 1e-9 * _traces(parts) * np.eye(3)))


def _traces(matrices: Floats) -> Floats:
    return np.asarray(np.trace(matrices, axis1=1, axis2=2)[:, None, None])
