# SPDX-License-Identifier: Apache-2.0
"""Certificates that a quartic is positive, or convex: it, or its Hessian, is a sum of squares.

A form q is a sum of squares if q = z'Gz with a positive semidefinite matrix G, z the monomials of
half its degree. For quartics in three variables this is no loss: each that is not negative is a
sum of squares (Hilbert, 1888, doi:10.1007/BF01443605), and each that is convex is so by a Hessian
that is one (Ahmadi and Parrilo, SIAM J. Optim. 23, 2013, doi:10.1137/110856010).
"""

from __future__ import annotations

from functools import cache
from itertools import combinations_with_replacement
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from limit_surface_ros.checks import Floats
    from limit_surface_ros.surface.gauges.quartic import Quartic

# Products of two of three variables: x^2, x y, x m, y^2, y m, m^2.
_PAIRS = list(combinations_with_replacement(range(3), 2))
_NEWTON_STEPS = 80
# The gap to the optimum at which the search for G ends, and the growth of the barrier's weight.
_GAP = 1e-12
_GROWTH = 4.0
# Least eigenvalue of G, in parts of its size, that rounding may take from a convex quartic.
_ROUNDING = 1e-10


def proves_positive(quartic: Quartic, margin: float) -> bool:
    """Tell whether P(f) >= margin |f|^4 is certain."""
    # In z = (x^2, sqrt(2) x y, ...), with |z|^2 = |f|^4.
    weights = np.array([1.0 if i == j else np.sqrt(2.0) for i, j in _PAIRS])
    rows, columns = np.transpose(_PAIRS)
    gram = quartic.tensor[rows, columns][:, rows, columns] * np.outer(weights, weights)
    return _least_eigenvalue(gram, _ambiguities_of_square(), margin) >= margin


def proves_convex(quartic: Quartic) -> bool:
    """Tell whether no Hessian of P has a negative eigenvalue, but for rounding."""
    # v' (Hessian of P at f) v = 12 T_ijkl v_i v_j f_k f_l, in z = v f' as nine numbers.
    gram = quartic.tensor.transpose(0, 2, 1, 3).reshape(9, 9)
    least = -_ROUNDING * 9.0 * float(np.abs(gram).max())
    return _least_eigenvalue(gram, _ambiguities_of_hessian(), 0.0) >= least


def lowest_curvature(quartic: Quartic, loads: Floats) -> tuple[float, Floats, Floats]:
    """Return the lowest v' H(f) v of unit loads f and directions v that descents lead to.

    H(f) is the Hessian of P. Because f and v change places in v' H(f) v, the best of one for the
    other is an eigenvector, and taking turns only lowers it.

    Args:
        quartic: P.
        loads: Where to start, shape (3, m).

    Returns:
        The lowest value, with its f (3,) and v (3,).
    """
    first = loads
    second = first
    for _ in range(_NEWTON_STEPS):
        first, second = second, _softest(quartic, first)
    values, vectors = np.linalg.eigh(np.moveaxis(quartic.hessian(first), -1, 0))
    lowest = int(values[:, 0].argmin())
    return float(values[lowest, 0]), first[:, lowest], vectors[lowest, :, 0]


def _softest(quartic: Quartic, loads: Floats) -> Floats:
    """Return the eigenvectors (3, m) of the lowest eigenvalues of the Hessians at loads."""
    vectors = np.linalg.eigh(np.moveaxis(quartic.hessian(loads), -1, 0))[1]
    return np.ascontiguousarray(vectors[:, :, 0].T)


def _least_eigenvalue(gram: Floats, ambiguities: Floats, enough: float) -> float:
    """Return the largest least eigenvalue of G + sum_i y_i D_i, or one that is enough.

    The largest t for which G + sum_i y_i D_i - t is positive definite, by a barrier method.
    """
    size = len(gram)
    scale = size * float(np.abs(gram).max()) or 1.0
    directions = np.concatenate([ambiguities, -np.eye(size)[np.newaxis]])
    least = float(np.linalg.eigvalsh(gram)[0])
    best = least
    unknowns: Floats = np.zeros(len(directions))
    unknowns[-1] = least - scale
    weight = size / scale
    for _ in range(_NEWTON_STEPS):
        if best > enough or size / weight < _GAP * scale:
            break
        slack = gram + np.tensordot(unknowns, directions, 1)
        solved = np.linalg.solve(slack, directions)
        gradient = -np.trace(solved, axis1=1, axis2=2)
        gradient[-1] -= weight
        hessian = np.einsum("iab,jba->ij", solved, solved)
        step = -np.linalg.solve(hessian, gradient)
        square = float(-gradient @ step)
        if not square > 0.0:
            break  # no more than rounding is left
        decrement = np.sqrt(square)
        unknowns += step / (1.0 + decrement)
        moved = gram + np.tensordot(unknowns[:-1], ambiguities, 1)
        best = max(best, float(np.linalg.eigvalsh(moved)[0]))
        if decrement < 0.5:
            weight *= _GROWTH
    return best


@cache
def _ambiguities_of_square() -> Floats:
    """Return the changes of G (6, 6, 6) that do not change z'Gz for z of `proves_positive`."""
    monomials = [(*pair,) for pair in _PAIRS]
    weights = [1.0 if i == j else np.sqrt(2.0) for i, j in _PAIRS]
    return _ambiguities([tuple(sorted(each)) for each in monomials], weights, parts=1)


@cache
def _ambiguities_of_hessian() -> Floats:
    """Return the changes of G (9, 9, 9) that do not change z'Gz for z of `proves_convex`."""
    return _ambiguities([(i, k) for i in range(3) for k in range(3)], [1.0] * 9, parts=2)


def _ambiguities(monomials: list[tuple[int, ...]], weights: list[float], parts: int) -> Floats:
    """Return matrices D with z'Dz = 0: two ways to make one product of monomials.

    Args:
        monomials: The variables of each.
        weights: Factors of each in z.
        parts: Groups of variables that do not mix: those at each place of a monomial, or all.
    """
    ways: dict[tuple[tuple[int, ...], ...], list[Floats]] = {}
    for a, first in enumerate(monomials):
        for b, second in enumerate(monomials[a:], a):
            if parts == 1:
                product: tuple[tuple[int, ...], ...] = (tuple(sorted(first + second)),)
            else:
                product = tuple(tuple(sorted(pair)) for pair in zip(first, second, strict=True))
            way: Floats = np.zeros((len(monomials), len(monomials)))
            way[a, b] = way[b, a] = 1.0 / (weights[a] * weights[b] * (1.0 if a == b else 2.0))
            ways.setdefault(product, []).append(way)
    return np.array([way - same[0] for same in ways.values() for way in same[1:]])
