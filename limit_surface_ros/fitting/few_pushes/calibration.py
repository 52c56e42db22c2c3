# SPDX-License-Identifier: Apache-2.0
"""How wide the scatter of a model's twists is: one number, from the pushes that folds held out.

g is the mode of its posterior: residuals of held-out pushes follow the t distribution of
`dissipation_scatter` about the twists of the model that did not see them, and g itself a normal
distribution about 0. A t bounds what an outlier weighs.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from limit_surface_ros.surface.kinds.dissipation_scatter import (
    FREEDOM,
    TwistScatter,
    log_map,
    tangent_basis,
)

if TYPE_CHECKING:
    from collections.abc import Sequence

    from limit_surface_ros.checks import Floats
    from limit_surface_ros.surface.kinds.dissipation import Dissipation
    from limit_surface_ros.surface.pairs import Pairs

# Standard deviation of g among the sets that its distribution was fitted to.
_SPREAD = 0.35
_ITERATIONS = 50


def calibrated_scatter(
    surface: Dissipation, folds: Sequence[Dissipation], held_out: Sequence[Pairs]
) -> TwistScatter:
    """Return the scatter of a model's twists.

    Args:
        surface: The model of all pushes.
        folds: The models that did not see the pushes of a fold, at least two.
        held_out: The pushes of each fold.

    Raises:
        DataError: There are fewer than two folds.
    """
    matrices = tuple(fold.matrices for fold in folds)
    squares = [
        squared_residuals(TwistScatter(fold.matrices, matrices), fold, pairs)
        for fold, pairs in zip(folds, held_out, strict=True)
    ]
    return TwistScatter(surface.matrices, matrices, _log_scale(np.concatenate(squares)))


def squared_residuals(scatter: TwistScatter, surface: Dissipation, pairs: Pairs) -> Floats:
    """Return r' inv(S) r of pushes: how far their twists lie from the model's, shape (n,)."""
    unit = surface.scaling.twist_unit
    units = surface.twist_of_wrench(pairs.wrenches) / unit
    measured = pairs.twists / unit
    measured = measured / np.linalg.norm(measured, axis=1, keepdims=True)
    plane = tangent_basis(units)
    residuals = log_map(units, measured, plane)
    inverse = np.linalg.inv(scatter.plane_scale(units, plane))
    return np.asarray(np.einsum("ni,nij,nj->n", residuals, inverse, residuals))


def _log_scale(squares: Floats) -> float:
    """Return g by Newton's method; its log posterior is concave where it matters."""
    scaled, g = squares / FREEDOM, 0.0
    half = 0.5 * FREEDOM + 1.0
    for _ in range(_ITERATIONS):
        part = np.exp(-g) * scaled
        part /= 1.0 + part
        slope = float(np.sum(1.0 - half * part)) + g / _SPREAD**2
        curvature = half * float(np.sum(part * (1.0 - part))) + 1.0 / _SPREAD**2
        step = slope / curvature
        g -= max(-1.0, min(1.0, step))
        if abs(step) < 1e-10:
            break
    return g
