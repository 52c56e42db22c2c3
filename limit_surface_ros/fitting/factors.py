# SPDX-License-Identifier: Apache-2.0
"""Positive semidefinite matrices as free parameters: lower-triangular Cholesky factors.

A = L L' is positive semidefinite for every L, so that an unconstrained optimiser can never leave
the family. Each matrix takes six parameters: L's lower triangle, row by row.

A smooth dissipation model has a floor r > 0 under every term,

    B = L L' + r trace(L L') I,

which makes each term a small contact area instead of a point, so that a load's motion depends
smoothly on the parameters.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from limit_surface_ros.checks import Floats

PARAMETERS_PER_MATRIX = 6

# Puts six parameters in their places among the nine entries of L.
_PLACES = np.zeros((PARAMETERS_PER_MATRIX, 9))
_PLACES[np.arange(PARAMETERS_PER_MATRIX), np.flatnonzero(np.tril(np.ones((3, 3))))] = 1.0
# Share of a term that every direction of it has to begin with.
_SLIVER = 1e-7


def factors_of(parameters: Floats) -> Floats:
    """Return the factors L, shape (m, 3, 3), of flat `parameters`, shape (6 m)."""
    entries: Floats = parameters.reshape(-1, PARAMETERS_PER_MATRIX) @ _PLACES
    return entries.reshape(-1, 3, 3)


def parameters_of(factors: Floats) -> Floats:
    """Return the flat parameters, shape (6 m), of lower-triangular `factors`, shape (m, 3, 3)."""
    parameters: Floats = factors.reshape(-1, 9) @ _PLACES.T
    return parameters.ravel()


def matrices_of(factors: Floats) -> Floats:
    """Return the matrices A = L L', shape (m, 3, 3), exactly symmetric."""
    matrices = factors @ factors.transpose(0, 2, 1)
    return np.asarray(0.5 * (matrices + matrices.transpose(0, 2, 1)))


def parameter_gradient(matrix_gradient: Floats, factors: Floats) -> Floats:
    """Chain a gradient with respect to A to the parameters of L: dJ/dL = (G + G') L.

    Args:
        matrix_gradient: Shape (m, 3, 3), G with dJ = sum_ij G_ij dA_ij, symmetric or not.
        factors: Shape (m, 3, 3), lower triangular.

    Returns:
        Shape (6 m).
    """
    symmetric = matrix_gradient + matrix_gradient.transpose(0, 2, 1)
    return parameters_of(symmetric @ factors)


def factors_of_matrices(matrices: Floats) -> Floats:
    """Return lower-triangular factors of positive semidefinite `matrices`, rank-deficient too.

    A = E diag(w) E' has the factor R' of the QR decomposition of diag(sqrt(w)) E'.
    """
    values, vectors = np.linalg.eigh(matrices)
    roots = np.sqrt(np.maximum(values, 0.0))[..., None] * vectors.transpose(0, 2, 1)
    upper = np.stack([np.linalg.qr(root, mode="r") for root in roots])
    return np.asarray(upper.transpose(0, 2, 1))


def one_redrawn(parameters: Floats, fresh: Floats, rng: np.random.Generator) -> Floats:
    """Return `parameters`, shape (6 m), with one matrix, chosen at random, taken from `fresh`."""
    mixed: Floats = parameters.reshape(-1, PARAMETERS_PER_MATRIX).copy()
    term = rng.integers(len(mixed))
    mixed[term] = fresh.reshape(-1, PARAMETERS_PER_MATRIX)[term]
    return mixed.ravel()


def two_exchanged(parameters: Floats, rng: np.random.Generator) -> Floats:
    """Return `parameters`, shape (6 m) with m > 1, with two random matrices exchanged."""
    mixed: Floats = parameters.reshape(-1, PARAMETERS_PER_MATRIX).copy()
    two = rng.choice(len(mixed), 2, replace=False)
    mixed[two] = mixed[two[::-1]]
    return mixed.ravel()


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
