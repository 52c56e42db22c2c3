# SPDX-License-Identifier: Apache-2.0
"""Surfaces of every kind and with every trait that an export has to stand, and vectors to ask."""

from __future__ import annotations

import numpy as np

from limit_surface_ros.surface import Dissipation, PointContacts, Polynomial, PowerSum, Scaling

SCALING = Scaling(0.05, 3.0)


def _forms(seed: int, ranks: list[int], rest: float = 0.0) -> np.ndarray:
    rng = np.random.default_rng(seed)
    roots = [rng.normal(size=(rank, 3)) for rank in ranks]
    return np.array([r.T @ r + rest * np.square(r).sum() * np.eye(3) for r in roots])


def _polynomial() -> Polynomial:
    # (x^2 + y^2 + m^2)^2 and a little of other monomials.
    coefficients = np.zeros(15)
    coefficients[[0, 3, 5, 10, 12, 14]] = [1.0, 2.2, 2.0, 1.1, 2.0, 0.8]
    coefficients[[4, 7]] = [0.1, -0.05]
    return Polynomial(coefficients, SCALING)


# Support points of a triangle.
TRIANGLE = PointContacts([[-0.04, -0.04], [-0.04, 0.08], [0.08, -0.04]], [0.5] * 3, SCALING)
MODELS = {
    "ellipsoid": PowerSum(_forms(1, [3]), [1.0], SCALING),
    "thesis_2": PowerSum(_forms(2, [3, 3]), [1.0, 0.5], SCALING),
    "thesis_3_convex": PowerSum(_forms(3, [3, 3, 3]), [1.0, 2 / 3, 0.5], SCALING),
    "norms_4": PowerSum(_forms(4, [3] * 4), [0.5] * 4, SCALING),
    "norms_with_corners": PowerSum(_forms(5, [2] * 3), [0.5] * 3, SCALING),
    "dissipation_4": Dissipation(_forms(6, [3] * 4), SCALING),
    "dissipation_with_facets": Dissipation(_forms(7, [2] * 3), SCALING),
    "dissipation_nearly_with_facets": Dissipation(_forms(8, [2] * 3, 1e-13), SCALING),
    "triangle": TRIANGLE,
    "polynomial": _polynomial(),
    # Of 0.1 m, and 2.2 m from the reference point: the products in a power cancel.
    "points_far_off": PointContacts(
        [[0.973, 2.046], [0.969, 1.993], [0.941, 1.984], [0.953, 1.962]],
        [0.8, 0.42, 0.59, 0.98],
        SCALING,
    ),
}


def vectors(name: str, count: int) -> np.ndarray:
    """Return vectors (count, 3): all directions, some all but flat, and of extreme sizes."""
    rng = np.random.default_rng(sum(map(ord, name)))
    found = rng.normal(size=(count, 3))
    found[: count // 8, 2] *= 0.01
    found[-2:] *= [[1e-100], [1e100]]
    return found


def scaled_error(found: np.ndarray, right: np.ndarray, unit: np.ndarray) -> np.ndarray:
    """Return the largest error of each row, in parts of its own size, in scaled variables."""
    return np.abs((found - right) / unit).max(axis=1) / np.abs(right / unit).max(axis=1)
