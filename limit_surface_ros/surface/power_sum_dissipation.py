"""The load of maximum dissipation on a sum of powers of quadratic forms."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from limit_surface_ros.surface.power_sum_scale import log_scales
from limit_surface_ros.surface.sphere import even_directions

if TYPE_CHECKING:
    from limit_surface_ros.checks import Floats

_MAX_STEPS = 400


def loads_of_twists(roots: Floats, exponents: Floats, twists: Floats) -> Floats:
    """Return the loads f on H(f) = 1 with the most power f.v.

    Each q^p is concave in q, so that its tangent at the present load bounds H from above by a
    quadratic form; the ellipsoid of that form lies inside the surface, and its load of most power
    is the next one. The power only grows.

    Args:
        roots: R_i with A_i = R_i' R_i, shape (k, 3, 3).
        exponents: p_i, shape (k,).
        twists: v, shape (3, m).

    Returns:
        Shape (3, m).
    """
    matrices = np.swapaxes(roots, 1, 2) @ roots
    loads = _on_surface(roots, exponents, _starts(roots, exponents, twists))
    todo = np.arange(twists.shape[1])
    for _ in range(_MAX_STEPS):
        f = loads[:, todo]
        forms = _forms(roots, f)
        weights = exponents[:, np.newaxis] * np.maximum(forms, 1e-30) ** (
            exponents[:, np.newaxis] - 1.0
        )
        bound = np.einsum("km,kij->mij", weights, matrices)
        f_new = np.linalg.solve(bound, twists[:, todo].T[..., np.newaxis])[..., 0].T
        f_new = _on_surface(roots, exponents, f_new)
        loads[:, todo] = f_new
        todo = todo[np.abs(f_new - f).max(axis=0) > 1e-13 * np.abs(f_new).max(axis=0)]
        if len(todo) == 0:
            break
    return loads


def _starts(roots: Floats, exponents: Floats, twists: Floats) -> Floats:
    """Return for each twist the direction of most power among a fixed set."""
    candidates = _on_surface(roots, exponents, even_directions(512).T)
    return candidates[:, np.argmax(candidates.T @ twists, axis=0)]


def _forms(roots: Floats, loads: Floats) -> Floats:
    images = np.tensordot(roots, loads, axes=1)
    return np.asarray(np.einsum("kcm,kcm->km", images, images))


def _on_surface(roots: Floats, exponents: Floats, loads: Floats) -> Floats:
    return loads * np.exp(log_scales(_forms(roots, loads), exponents))
