# SPDX-License-Identifier: Apache-2.0
"""Fits of fourth-order polynomials: plain least squares, or with convexity as a constraint.

    J = sum_k (P(f_k) - 1)^2 + w |(I - v_k v_k') grad P(f_k)|^2

is quadratic in the coefficients: w = 0 is the thesis's peer (section 3.5), w > 0 with the
constraint that P be sum-of-squares convex is that of Zhou, Paolini, Bagnell and Mason, ICRA 2016,
doi:10.1109/ICRA.2016.7487155.
"""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

import numpy as np

from limit_surface_ros.checks import as_number
from limit_surface_ros.errors import MissingExtraError, RangeError, SolverError
from limit_surface_ros.fitting.pairs import check_support, scale_pairs
from limit_surface_ros.fitting.result import FitResult, errors_on
from limit_surface_ros.fitting.symmetric import with_mirror_images
from limit_surface_ros.surface.kinds.polynomial import MONOMIALS, Polynomial

if TYPE_CHECKING:
    from collections.abc import Sequence

    from limit_surface_ros.checks import Floats
    from limit_surface_ros.fitting.pairs import ScaledPairs
    from limit_surface_ros.surface.pairs import Pairs
    from limit_surface_ros.surface.scaling import Scaling


def fit_polynomial(
    pairs: Pairs,
    *,
    velocity_weight: float = 0.0,
    convex: bool = False,
    scaling: Scaling | None = None,
    symmetry: Sequence[str] = (),
) -> FitResult:
    """Fit P(f) = 1, P homogeneous of degree four.

    Args:
        pairs: Loads on the surface and the motions they cause, 15 at least.
        velocity_weight: w.
        convex: Whether P must be convex; solved as a semidefinite program by cvxpy.
        scaling: Characteristic length and friction force; chosen from the pairs if not given.
        symmetry: Axes "x", "y" about which the surface is to be its own mirror image: the pairs'
            mirror images are fitted, too.

    Raises:
        RangeError: The weight is negative, or an axis is not known.
        DataError: The pairs cannot determine a polynomial.
        MatrixError: The polynomial of least squares is not positive, its surface not closed.
        SolverError: The semidefinite program has no solution.
        MissingExtraError: `convex` is asked for and cvxpy is not installed.
    """
    weight = as_number("velocity_weight", velocity_weight)
    if weight < 0.0:
        raise RangeError(f"velocity_weight must not be negative, got {weight}")
    begin = time.perf_counter()
    scaled = scale_pairs(pairs, scaling)
    check_support(scaled, len(MONOMIALS))
    scaled = with_mirror_images(scaled, symmetry)
    rows, targets = _least_squares(scaled, weight)
    coefficients = _convex_solution(rows, targets) if convex else _solution(rows, targets)
    residual = rows @ coefficients - targets
    surface = Polynomial(coefficients, scaled.scaling)
    kind = "convex" if convex else "least squares"
    return FitResult(
        surface=surface,
        objective=f"fourth-order polynomial, {kind}, velocity weight {weight:g}",
        cost=float(residual @ residual),
        start_costs=(float(residual @ residual),),
        iterations=1,
        gradient_norm=float(np.abs(2.0 * rows.T @ residual).max()),
        converged=True,
        wall_time=time.perf_counter() - begin,
        training=errors_on(surface, pairs),
    )


def _least_squares(pairs: ScaledPairs, weight: float) -> tuple[Floats, Floats]:
    """Return rows (m, 15) and targets (m,) whose residuals' squares make up the cost."""
    loads, directions = pairs.wrenches, pairs.directions
    rows, targets = [_monomials(loads, MONOMIALS)], [np.ones(len(loads))]
    if weight > 0.0:
        gradients = np.stack([_derivative(loads, axis) for axis in range(3)], axis=1)
        along = np.einsum("nc,ncp->np", directions, gradients)
        across = gradients - directions[:, :, None] * along[:, None]
        rows.append(np.sqrt(weight) * across.reshape(-1, len(MONOMIALS)))
        targets.append(np.zeros(3 * len(loads)))
    return np.concatenate(rows), np.concatenate(targets)


def _monomials(loads: Floats, powers: Floats) -> Floats:
    """Return the monomials of these powers, shape (n, len(powers))."""
    return np.asarray(np.prod(loads[:, None, :] ** np.maximum(powers, 0), axis=2))


def _derivative(loads: Floats, axis: int) -> Floats:
    """Return the derivatives of the monomials along one axis, shape (n, 15)."""
    lowered = MONOMIALS.copy()
    lowered[:, axis] -= 1
    return np.asarray(_monomials(loads, lowered) * MONOMIALS[:, axis])


def _solution(rows: Floats, targets: Floats) -> Floats:
    return np.asarray(np.linalg.lstsq(rows, targets, rcond=None)[0], dtype=np.float64)


def _convex_solution(rows: Floats, targets: Floats) -> Floats:
    """Minimise |rows a - targets|^2 over sum-of-squares convex polynomials.

    P is sos-convex if z' hess P(f) z = y' Q y with Q positive semidefinite and y = z (x) f.
    """
    try:
        import cvxpy
    except ImportError:
        raise MissingExtraError("cvxpy", "peers") from None
    coefficients = cvxpy.Variable(len(MONOMIALS))
    gram = cvxpy.Variable((9, 9), PSD=True)
    # Coefficients of z_i z_j f^q on both sides, as linear maps of `coefficients` and `gram`.
    left, right = _hessian_maps()
    root = np.asarray(np.linalg.qr(np.column_stack([rows, targets]), mode="r"))
    problem = cvxpy.Problem(
        cvxpy.Minimize(cvxpy.sum_squares(root[:, :-1] @ coefficients - root[:, -1])),
        [left @ coefficients == right @ cvxpy.vec(gram, order="C")],
    )
    try:
        problem.solve(solver=cvxpy.CLARABEL)
    except cvxpy.SolverError as error:
        raise SolverError(f"the convex polynomial could not be found: {error}") from None
    if coefficients.value is None:
        raise SolverError(f"the convex polynomial could not be found: {problem.status}")
    return np.asarray(coefficients.value, dtype=np.float64)


def _hessian_maps() -> tuple[Floats, Floats]:
    """Return matrices that give the coefficients of z' hess P z and of y' Q y, shape (36, ...)."""
    places: dict[tuple[tuple[int, ...], tuple[int, ...]], int] = {}

    def place(i: int, j: int, powers: tuple[int, ...]) -> int:
        key = (tuple(sorted((i, j))), powers)
        return places.setdefault(key, len(places))

    left, right = np.zeros((36, len(MONOMIALS))), np.zeros((36, 81))
    for i, k, j, m in np.ndindex(3, 3, 3, 3):
        powers = np.bincount([k, m], minlength=3)
        right[place(i, j, tuple(powers.tolist())), 27 * i + 9 * k + 3 * j + m] += 1.0
    for column, whole in enumerate(MONOMIALS):
        for i, j in np.ndindex(3, 3):
            powers = whole.copy()
            factor = powers[i]
            powers[i] -= 1
            factor *= powers[j]
            powers[j] -= 1
            if factor:
                left[place(i, j, tuple(powers.tolist())), column] += factor
    return left, right
